// x3dom's VolumeData with an OpacityMapVolumeStyle, no lights.
//
// STEPS ACROSS DOWN SLICES    with a point: 85.0
// ROW_DIVISOR                 ACROSS, or DOWN in older versions
precision highp float;
precision highp sampler2D;
uniform sampler2D atlas;
uniform sampler2D colors;
uniform vec3 eye;
uniform float opacity_factor;
uniform float light_factor;
uniform float step_length;
varying vec3 place;

vec2 in_atlas(vec2 at, float slice) {
    float column = fract(slice / ACROSS);
    float row = floor(slice / ROW_DIVISOR) / DOWN;
    return vec2(column + at.x / ACROSS, row + at.y / DOWN);
}

float in_volume(vec3 at) {
    float first = floor(at.z * SLICES);
    float second = first + 1.0;
    float before = texture2D(atlas, in_atlas(at.xy, first)).r;
    float behind = texture2D(atlas, in_atlas(at.xy, second)).r;
    return mix(before, behind, at.z * SLICES - first);
}

void main() {
    vec3 direction = normalize(place - eye);
    bool inside = all(lessThan(eye, vec3(1.0))) && all(greaterThan(eye, vec3(0.0)));
    vec3 at = inside ? eye : place;
    vec3 step_vector = direction * step_length;
    vec4 sum = vec4(0.0);
    for (float i = 0.0; i < STEPS; i += 1.0) {
        vec4 found = texture2D(colors, vec2(in_volume(at), 0.5));
        float opacity = found.a * opacity_factor * (1.0 / STEPS);
        vec3 shining = found.rgb * opacity * light_factor;
        sum.rgb += (1.0 - sum.a) * shining;
        sum.a += (1.0 - sum.a) * opacity;
        at += step_vector;
        if (sum.a >= 1.0 || any(lessThan(at, vec3(0.0))) || any(greaterThan(at, vec3(1.0)))) {
            break;
        }
    }
    gl_FragColor = sum;
}
