#version 300 es
// Cej, the mean on the canvas.
precision highp float;
precision highp sampler2D;
uniform sampler2D mean;
in vec2 place;
out vec4 color;

void main() {
    color = texture(mean, place);
}
