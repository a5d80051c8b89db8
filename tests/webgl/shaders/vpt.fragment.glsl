#version 300 es
// VPT, emission-absorption: one frame.
//
// ALPHA   what is written as alpha: 1.0, or sum.a for what is accumulated
precision highp float;
precision highp sampler2D;
precision highp sampler3D;
uniform sampler3D volume;
uniform sampler2D colors;
uniform float step_size;
uniform float offset;
uniform float extinction;
in vec3 near;
in vec3 far;
out vec4 color;

vec2 cube(vec3 origin, vec3 direction) {
    vec3 to_low = (vec3(0.0) - origin) / direction;
    vec3 to_high = (vec3(1.0) - origin) / direction;
    vec3 first = min(to_low, to_high);
    vec3 last = max(to_low, to_high);
    float enter = max(max(first.x, first.y), first.z);
    float leave = min(min(last.x, last.y), last.z);
    return vec2(enter, leave);
}

void main() {
    vec2 bounds = max(cube(near, far - near), 0.0);
    if (bounds.x >= bounds.y) {
        color = vec4(0.0, 0.0, 0.0, 1.0);
        return;
    }
    vec3 entry = mix(near, far, bounds.x);
    vec3 exit = mix(near, far, bounds.y);
    float step_length = distance(entry, exit) * step_size;
    vec4 sum = vec4(0.0);
    float t = step_size * offset;
    while (t < 1.0 && sum.a < 0.99) {
        float value = texture(volume, mix(entry, exit, t)).r;
        vec4 found = texture(colors, vec2(value, 0.0));
        found.a *= step_length * extinction;
        found.rgb *= found.a;
        sum += (1.0 - sum.a) * found;
        t += step_size;
    }
    if (sum.a > 1.0) {
        sum.rgb /= sum.a;
    }
    color = vec4(sum.rgb, ALPHA);
}
