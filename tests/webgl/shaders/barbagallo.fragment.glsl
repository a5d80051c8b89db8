// Seed 002, second pass: the ray from the front face to the place that the first pass has left.
//
// LEFT_WITHOUT_EXIT   fragments whose exit has x and y of 0 are transparent black (the page)
// ADDED_ALPHA         A += a (the article); else A += (1 - A) a
// PER_STEP            opacity is divided by the number of steps (the page)
// MAX_STEPS ACROSS DOWN SLICES STEPS
//
// Faults, each by a definition of its strength; the article's own is ADDED_ALPHA:
// FAULT_A2_SLICE_OFF_BY_ONE  slices are read so many tiles further on
// FAULT_A2_LAST_TILE         the last slice is never reached
// FAULT_A3_SLICE_COUNT       z runs over one slice more
// FAULT_L3_POST_CLASSIFIED   values are mixed, then classified
// FAULT_A3_NO_INTERPOLATION  the slice before a place is all that is read
// FAULT_O3_FACTOR_PER_SAMPLE opacity times this at each sample
// FAULT_T2_FIRST_STEP_DROPPED  a ray begins a step behind the face
// FAULT_T3_LOOP_CAP          the loop ends after this share of the steps across the box
precision highp float;
precision highp sampler2D;
uniform sampler2D exits;
uniform sampler2D atlas;
uniform sampler2D colors;
uniform float factor;
varying vec3 place;
varying vec4 clip;

const float ACROSS_TILES = float(ACROSS);
const float DOWN_TILES = float(DOWN);
const float LAST_SLICE = float(SLICES - 1);
const float LAST_TILE = float(ACROSS * DOWN - 1);

// Tiles are counted from the top row down, and v from the bottom up.
vec2 in_atlas(vec2 at, float slice) {
  float column = mod(slice, ACROSS_TILES);
  float row = floor((LAST_TILE - slice) / ACROSS_TILES);
  return vec2(at.x / ACROSS_TILES + column / ACROSS_TILES, at.y / DOWN_TILES + row / DOWN_TILES);
}

// Colour of the value in one slice; the value itself is the alpha.
vec4 in_slice(vec2 at, float slice) {
#ifdef FAULT_A2_SLICE_OFF_BY_ONE
  slice = min(slice + FAULT_A2_SLICE_OFF_BY_ONE, LAST_SLICE);
#endif
#ifdef FAULT_A2_LAST_TILE
  slice = min(slice, LAST_SLICE - 1.0);
#endif
  float value = texture2D(atlas, in_atlas(at, slice)).a;
  return vec4(texture2D(colors, vec2(value, 1.0)).rgb, value);
}

vec4 in_volume(vec3 at) {
  float depth = at.z * LAST_SLICE;
#ifdef FAULT_A3_SLICE_COUNT
  depth = at.z * float(SLICES);
#endif
  float first = floor(depth);
  float second = min(first + 1.0, LAST_SLICE);
  vec4 before = in_slice(at.xy, first);
  vec4 behind = in_slice(at.xy, second);
#ifdef FAULT_A3_NO_INTERPOLATION
  return before;
#endif
#ifdef FAULT_L3_POST_CLASSIFIED
  float value = mix(before.a, behind.a, mod(depth, 1.0));
  return vec4(texture2D(colors, vec2(value, 1.0)).rgb, value);
#endif
  return mix(before, behind, mod(depth, 1.0));
}

void main() {
  vec2 pixel = (clip.xy / clip.w + 1.0) / 2.0;
  vec3 back = texture2D(exits, pixel).xyz;
#ifdef LEFT_WITHOUT_EXIT
  if (back.x == 0.0 && back.y == 0.0) {
    gl_FragColor = vec4(0.0);
    return;
  }
#endif
  vec3 ray = back - place;
  float ray_length = length(ray);
  float delta = 1.0 / float(STEPS);
  vec3 step_vector = normalize(ray) * delta;
  float step_length = length(step_vector);
  vec3 at = place;
  vec4 color = vec4(0.0);
  float alpha = 0.0;
  float walked = 0.0;
#ifdef FAULT_T2_FIRST_STEP_DROPPED
  at += step_vector;
  walked += step_length;
#endif
  for (int i = 0; i < MAX_STEPS; i++) {
#ifdef FAULT_T3_LOOP_CAP
    if (float(i) >= FAULT_T3_LOOP_CAP * sqrt(3.0) * float(STEPS)) break;
#endif
    vec4 found = in_volume(at);
    float opacity = found.a * factor;
#ifdef PER_STEP
    opacity *= delta;
#endif
#ifdef FAULT_O3_FACTOR_PER_SAMPLE
    opacity *= FAULT_O3_FACTOR_PER_SAMPLE;
#endif
    color += (1.0 - alpha) * opacity * found;
#ifdef ADDED_ALPHA
    alpha += opacity;
#else
    alpha += (1.0 - alpha) * opacity;
#endif
    at += step_vector;
    walked += step_length;
    if (walked >= ray_length || alpha >= 1.0) {
      break;
    }
  }
  gl_FragColor = color;
}
