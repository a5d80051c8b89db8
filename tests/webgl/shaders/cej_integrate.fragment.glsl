#version 300 es
// Cej, the mean of the frames up to this one; share is 1 / n for frame n.
precision highp float;
precision highp sampler2D;
uniform sampler2D mean;
uniform sampler2D frame;
uniform float share;
in vec2 place;
out vec4 color;

void main() {
    vec4 latest = texture(frame, place);
    vec4 before = texture(mean, place);
    color = share == 1.0 ? latest : before + (latest - before) * share;
}
