#version 300 es
// Seed 003 and its base: one triangle over the whole target.
in vec2 position;

void main() {
    gl_Position = vec4(position, 0.0, 1.0);
}
