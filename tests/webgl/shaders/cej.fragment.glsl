#version 300 es
// Cej: one frame.
//
// ZERO_HALF            gradients are bytes of (g + 1) / 2, else of 128 + 127 g
// SKIP_FLAT            samples without a gradient are left out, else they have no normal
// BY_GRADIENT          what |g| times the opacity is multiplied by, if it is
// LIGHTS               how many lights there are, if any
// LAMBERT PHONG BLINN  the material, one of them
// TWO_SIDED            cosines count from both sides
//
// Faults, each by a definition of its strength; the published code's own are ZERO_HALF and SKIP_FLAT:
// FAULT_N1_SIGN              normals look into the surface
// FAULT_N1_SPACE             normals stay those of texture space, lights in the world
// FAULT_N1_UNGUARDED         gradients of 0 are divided by their length
// FAULT_T1_ABOVE_ONE         what has more than alpha 1 stays as it is
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler3D;
uniform sampler3D volume;
uniform sampler2D colors;
uniform sampler2D jitter;
uniform sampler2D environment;
uniform float step_size;
uniform float extinction;
in vec3 near;
in vec3 far;
out vec4 color;

vec3 unpacked(vec3 bytes) {
#ifdef ZERO_HALF
    return bytes * 2.0 - 1.0;
#else
    return (bytes * 255.0 - 128.0) / 127.0;
#endif
}

#ifdef LIGHTS
// From texture space to the space of the lights, for points and for gradients.
uniform mat4 lit_from_texture;
uniform mat3 normal_from_gradient;
uniform int kinds[LIGHTS];  // 0 ambient, 1 point, 2 directional
uniform vec3 lights[LIGHTS];
uniform vec3 vectors[LIGHTS];  // where a point light is, the way to a directional one
uniform float falloffs[LIGHTS];
uniform float ambient;
uniform float diffuse;
uniform float specular;
uniform float shininess;

float cosine(vec3 a, vec3 b) {
#ifdef TWO_SIDED
    return abs(dot(a, b));
#else
    return max(dot(a, b), 0.0);
#endif
}

float answer(vec3 normal, vec3 towards, vec3 along, bool flat_) {
    if (flat_) return ambient;
    float sum = ambient + diffuse * cosine(normal, towards);
#ifdef PHONG
    sum += specular * pow(cosine(reflect(-towards, normal), -along), shininess);
#endif
#ifdef BLINN
    sum += specular * pow(cosine(normal, normalize(towards - along)), 4.0 * shininess);
#endif
    return sum;
}

vec3 illumination(vec3 place, vec3 gradient, vec3 along) {
    vec3 point = (lit_from_texture * vec4(place, 1.0)).xyz;
    bool flat_ = false;
#if !defined(SKIP_FLAT) && !defined(FAULT_N1_UNGUARDED)
    flat_ = length(gradient) < 0.001;
#endif
    vec3 normal = normalize(normal_from_gradient * gradient);
#ifdef FAULT_N1_SPACE
    normal = normalize(gradient);
#endif
#ifdef FAULT_N1_SIGN
    normal = -normal;
#endif
    vec3 sum = vec3(0.0);
    for (int i = 0; i < LIGHTS; i++) {
        vec3 light = lights[i];
        if (kinds[i] == 1) {
            vec3 way = vectors[i] - point;
            light /= 1.0 + falloffs[i] * dot(way, way);
            light *= answer(normal, normalize(way), along, flat_);
        }
        if (kinds[i] == 2) {
            light *= answer(normal, vectors[i], along, flat_);
        }
        sum += light;
    }
    return sum;
}
#endif

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
    vec4 behind = texture(environment, vec2(0.5));
    vec2 bounds = max(cube(near, far - near), 0.0);
    if (bounds.x >= bounds.y) {
        color = behind;
        return;
    }
    vec3 entry = mix(near, far, bounds.x);
    vec3 exit = mix(near, far, bounds.y);
    float step_length = distance(entry, exit) * step_size;
#ifdef LIGHTS
    vec3 along = normalize(mat3(lit_from_texture) * (far - near));
#endif
    vec4 sum = vec4(0.0);
    float t = step_size * texelFetch(jitter, ivec2(gl_FragCoord.xy), 0).r;
    while (t < 1.0 && sum.a < 0.999) {
        vec3 place = mix(entry, exit, t);
        vec4 texel = texture(volume, place);
        vec3 gradient = unpacked(texel.gba);
        float magnitude = length(gradient);
#ifdef SKIP_FLAT
        if (magnitude > 0.0)
#endif
        {
            vec4 found = texture(colors, vec2(texel.r, magnitude));
            found.a *= step_length * extinction;
#ifdef BY_GRADIENT
            found.a *= magnitude * BY_GRADIENT;
#endif
            found.rgb *= found.a;
#ifdef LIGHTS
            found.rgb *= illumination(place, gradient, along);
#endif
            sum += (1.0 - sum.a) * found;
        }
        t += step_size;
    }
    if (sum.a > 1.0) {
#ifndef FAULT_T1_ABOVE_ONE
        sum.rgb /= sum.a;
#endif
    } else if (sum.a < 1.0) {
        sum += (1.0 - sum.a) * behind;
    }
    color = vec4(sum.rgb, 1.0);
}
