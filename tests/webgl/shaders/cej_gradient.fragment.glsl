#version 300 es
// Cej, the gradient volume, slice under slice: value and gradient of a voxel, in bytes.
//
// MISPRINT   the weight of kernelZ that the published code has wrong
// ZERO_HALF  bytes of (g + 1) / 2, else of 128 + 127 g
precision highp float;
precision highp int;
precision highp sampler3D;
uniform sampler3D values;
uniform ivec3 size;
out vec4 texel;

int value(ivec3 at) {
    return int(round(texelFetch(values, at, 0).r * 255.0));
}

// 27 g in bytes: f before less f behind, weighted 1 2 1 across.
ivec3 sobel(ivec3 at) {
    ivec3 sum = ivec3(0);
    for (int z = -1; z <= 1; z++) {
        for (int y = -1; y <= 1; y++) {
            for (int x = -1; x <= 1; x++) {
                int here = value(at + ivec3(x, y, z));
                ivec3 smooth_ = 2 - abs(ivec3(x, y, z));
                sum.x -= x * smooth_.y * smooth_.z * here;
                sum.y -= y * smooth_.x * smooth_.z * here;
                int last = smooth_.x * smooth_.y;
#ifdef MISPRINT
                if (ivec3(x, y, z) == ivec3(1)) last = 2;
#endif
                sum.z -= z * last * here;
            }
        }
    }
    return sum;
}

// floor(x / y) of a positive x; round(u) is floor(u + 1/2).
ivec3 bytes(ivec3 g27) {
#ifdef ZERO_HALF
    return (g27 + 54 * 128) / 54;
#else
    return (254 * g27 + 257 * 6885) / (2 * 6885);
#endif
}

void main() {
    int row = int(gl_FragCoord.y);
    ivec3 at = ivec3(int(gl_FragCoord.x), row % size.y, row / size.y);
    bool border = any(equal(at, ivec3(0))) || any(equal(at, size - 1));
    ivec3 g = border ? ivec3(128) : bytes(sobel(at));
    texel = vec4(float(value(at)), vec3(g)) / 255.0;
}
