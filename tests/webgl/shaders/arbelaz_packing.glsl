// Seed 000: a number in four bytes and back.  PACKING_PRINTED is section 3.3 with the smallest edit that compiles,
// res.xxyz for res.xyz.  FLOAT_DEPTH: a target of floats needs neither.
precision highp float;
precision highp sampler2D;

vec4 pack_float(float value) {
#ifdef FLOAT_DEPTH
  return vec4(value);
#else
  const vec4 bit_sh = vec4(256.0 * 256.0 * 256.0, 256.0 * 256.0, 256.0, 1.0);
  const vec4 bit_msk = vec4(0.0, 1.0 / 256.0, 1.0 / 256.0, 1.0 / 256.0);
  vec4 res = fract(value * bit_sh);
  res -= res.xxyz * bit_msk;
#ifndef PACKING_PRINTED
  res *= 256.0 / 255.0;
#endif
  return res;
#endif
}

float unpack_float(vec4 value) {
#ifdef FLOAT_DEPTH
  return value.r;
#else
  const vec4 bit_sh = vec4(1.0 / (256.0 * 256.0 * 256.0), 1.0 / (256.0 * 256.0), 1.0 / 256.0, 1.0);
#ifndef PACKING_PRINTED
  value *= 255.0 / 256.0;
#endif
  return dot(value, bit_sh);
#endif
}

// What is stored: 1 - depth (FAULT_D1_WINDOW_DEPTH: of the window), so that a target cleared to 0 is as deep as can be.
#ifdef WINDOW_OVER_W
float nearness() {
  return gl_FragCoord.z * gl_FragCoord.w;
}
#else
varying highp float ahead;  // distance along the view
uniform vec2 planes;        // near and far
float nearness() {
#ifdef FAULT_D1_WINDOW_DEPTH
  return 1.0 - gl_FragCoord.z;
#endif
  return (planes.y - ahead) / (planes.y - planes.x);
}
#endif
