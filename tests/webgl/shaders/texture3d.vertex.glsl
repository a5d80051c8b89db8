#version 300 es
// One triangle over the whole screen.
in vec2 position;
out highp vec2 ndc;

void main() {
  ndc = position;
  gl_Position = vec4(position, 0.0, 1.0);
}
