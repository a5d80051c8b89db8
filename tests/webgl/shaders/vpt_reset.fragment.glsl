#version 300 es
// VPT, the mean before the first frame.
precision highp float;
out vec4 color;

void main() {
    color = vec4(0.0, 0.0, 0.0, 1.0);
}
