#version 300 es
// VPT, the artistic tone mapper: the mean as the canvas shows it.
precision highp float;
precision highp sampler2D;
uniform sampler2D mean;
uniform float low;
uniform float mid;
uniform float high;
uniform float saturation;
uniform float gamma;
in vec2 place;
out vec4 color;

const vec3 GRAY = vec3(0.57735026919);

void main() {
    vec3 light = (texture(mean, place).rgb - low) / (high - low);
    vec3 mixed = mix(dot(light, GRAY) * GRAY, light, saturation);
    float middle = (mid - low) / (high - low);
    float exponent = -log(middle) / log(2.0);
    color = vec4(pow(max(mixed, 0.0), vec3(exponent / gamma)), 1.0);
}
