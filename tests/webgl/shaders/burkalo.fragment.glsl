#version 300 es
// Seed 003 in one pass: a ray by eq. 1 and 2, the slab test, the loop, tone map and gamma; and its base.
//
// NO_ASPECT          x is not stretched by the aspect (as printed)
// NO_BACKGROUND      the colour is written as it is after gamma, with its own alpha (as printed)
// DEEPEST_IN_FRONT   the base: jitter, each sample over those before it, no tone map, colour times alpha
//
// Faults, each by a definition of its strength:
// FAULT_C1_SRGB_TWICE        gamma is applied twice
// FAULT_C1_SRGB_NEVER        gamma is not applied
// FAULT_C1_WRONG_SPACE       the background joins after gamma
// FAULT_O2_ADD_ALPHA         alpha is added without what is in front
// FAULT_T1_NOT_RENORMALISED  a ray ends at this alpha and counts as opaque
// FAULT_B1_BLENDED_TWICE     colours are multiplied by alpha once more
precision highp float;
precision highp sampler2D;
precision highp sampler3D;
uniform vec2 viewport;
uniform float aspect;
uniform float focal_length;
uniform mat3 texture_from_view;
uniform vec3 eye;
uniform float step_length;
uniform float opaque_at;
uniform float gamma;
uniform vec3 background;
uniform sampler3D volume;
uniform sampler2D table;
#ifdef DEEPEST_IN_FRONT
uniform sampler2D jitter;
#endif
out vec4 fragment;

const float ENTRIES = float(TABLE_SIZE);

// Eq. 1 and 2: where on the image plane the pixel lies, the focal length away; turned, not normalised.
vec3 ray_direction() {
    vec3 along = vec3(2.0 * gl_FragCoord.xy / viewport - 1.0, -focal_length);
#ifndef NO_ASPECT
    along.x *= aspect;
#endif
    return texture_from_view * along;
}

// Where the ray enters and leaves the box 0..1, at t >= 0.
vec2 slab(vec3 along) {
    vec3 inverse_along = 1.0 / along;
    vec3 low = inverse_along * (vec3(0.0) - eye);
    vec3 high = inverse_along * (vec3(1.0) - eye);
    vec3 first = min(low, high);
    vec3 last = max(low, high);
    float enter = max(max(first.x, first.y), first.z);
    float leave = min(min(last.x, last.y), last.z);
    return vec2(max(enter, 0.0), leave);
}

// Straight colour and opacity of a value: the spline, as it was baked.
vec4 classified(float value) {
#ifdef DEEPEST_IN_FRONT
    value = (value * (ENTRIES - 1.0) + 0.5) / ENTRIES;
#endif
    return texture(table, vec2(value, 0.5));
}

// Seed 003: front to back.
vec4 with_sample(vec4 color, vec4 found) {
#ifdef DEEPEST_IN_FRONT
    color.rgb = found.a * found.rgb + (1.0 - found.a) * color.a * color.rgb;
    color.a = found.a + (1.0 - found.a) * color.a;
#else
    color.rgb += (1.0 - color.a) * found.a * found.rgb;
#ifdef FAULT_O2_ADD_ALPHA
    color.a += found.a;
#else
    color.a += (1.0 - color.a) * found.a;
#endif
#endif
    return color;
}

bool is_opaque(float alpha) {
#ifdef DEEPEST_IN_FRONT
    return alpha >= opaque_at;
#else
    return alpha > opaque_at;
#endif
}

vec4 marched(vec3 from, vec3 to) {
    vec3 ray = to - from;
    float left = length(ray);
    vec3 step_vector = step_length * ray / left;
    vec3 at = from;
#ifdef DEEPEST_IN_FRONT
    at += step_vector * texture(jitter, gl_FragCoord.xy / viewport).r;
#endif
    vec4 color = vec4(0.0);
    while (left > 0.0 && !is_opaque(color.a)) {
        float value = texture(volume, at).r;
        color = with_sample(color, classified(value));
#ifdef FAULT_T1_NOT_RENORMALISED
        if (color.a > FAULT_T1_NOT_RENORMALISED) color.a = 1.0;
#endif
        left -= step_length;
        at += step_vector;
    }
    return color;
}

vec3 tone_mapped(vec3 light) {
#ifdef DEEPEST_IN_FRONT
    return light;
#else
    return light / (1.0 + light);
#endif
}

vec3 encoded(vec3 light) {
#ifdef FAULT_C1_SRGB_NEVER
    return light;
#endif
#ifdef FAULT_C1_SRGB_TWICE
    light = pow(light, vec3(1.0 / gamma));
#endif
    return pow(light, vec3(1.0 / gamma));
}

void main() {
    vec3 along = ray_direction();
    vec2 t = slab(along);
    if (!(t.x < t.y)) {
        discard;
    }
    vec4 color = marched(eye + along * t.x, eye + along * t.y);
    color.rgb = tone_mapped(color.rgb);
#ifdef FAULT_B1_BLENDED_TWICE
    color.rgb *= color.a;
#endif
#ifdef NO_BACKGROUND
    fragment = vec4(encoded(color.rgb), color.a);
#else
    vec3 behind = (1.0 - color.a) * pow(background, vec3(gamma));
#ifdef DEEPEST_IN_FRONT
    color.rgb *= color.a;
#endif
    fragment = vec4(encoded(color.rgb + behind), 1.0);
#ifdef FAULT_C1_WRONG_SPACE
    fragment.rgb = encoded(color.rgb) + (1.0 - color.a) * background;
#endif
#endif
}
