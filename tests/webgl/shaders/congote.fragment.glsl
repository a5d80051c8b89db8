// Seed 001: Congote and others, "Volume Ray Casting in WebGL", 2012.  PRINTED is the chapter to the letter.
// STEPS and OPAQUE_AT are defined by the page.
//
// CLAMPED     coordinates are held half a texel inside their tile
// CENTERS     slice i lies at (i + 1/2) / S
// LAST_AGAIN  the slice after the last is the last
//
// Faults, each by a definition of its strength; some are the chapter's own:
// FAULT_A1_ROW_DIVISOR        tiles across are taken to be as many as tiles down
// FAULT_A1_PRINTED_ROW        rows by equations 8 and 10
// FAULT_A1_SECOND_COLUMN      the second slice's column by equation 9
// FAULT_A2_SLICE_OFF_BY_ONE   slices are read so many tiles further on
// FAULT_A2_LAST_TILE          the last slice is never reached
// FAULT_A3_HALF_SLICE         slices lie so many slices further back
// FAULT_A3_SLICE_COUNT        z runs over one slice less
// FAULT_A3_NO_INTERPOLATION   the slice before a place is all that is read
// FAULT_A3_BLEEDING           CLAMPED is forgotten
// FAULT_A3_MIX_BY_X           slices are mixed by x
// FAULT_L3_PER_SLICE          slices are classified, then mixed
// FAULT_O2_ADD_ALPHA          alpha is added without what is in front
// FAULT_O3_FACTOR_PER_SAMPLE  opacity times this at each sample
// FAULT_T3_LOOP_CAP           the loop ends after this share of the steps
// FAULT_M1_AVERAGE            samples are averaged
precision highp float;
precision highp sampler2D;

#ifdef PRINTED
#define FAULT_A1_PRINTED_ROW 1.0
#define FAULT_A1_SECOND_COLUMN 1.0
#define FAULT_O2_ADD_ALPHA 1.0 // equation 4
#define FAULT_A3_MIX_BY_X 1.0  // equation 17
#endif
#ifdef FAULT_A3_BLEEDING
#undef CLAMPED
#endif

varying highp vec4 clip;
uniform sampler2D front_coordinates;
uniform sampler2D back_coordinates;
uniform sampler2D atlas;
uniform sampler2D table;
uniform vec3 tiles;          // M_x, M_y, and the number S of slices
uniform vec2 tile_size;      // in texels
uniform float opacity_factor; // O_f
uniform float light_factor;   // L_f

// Equations 5 to 16: the value of a slice.
float in_slice(float slice, vec2 place, bool is_second) {
#ifdef FAULT_A2_SLICE_OFF_BY_ONE
  slice += FAULT_A2_SLICE_OFF_BY_ONE;
#endif
#ifdef FAULT_A2_LAST_TILE
  slice = min(slice, tiles.z - 2.0);
#endif
#ifdef CLAMPED
  place = clamp(place, 0.5 / tile_size, 1.0 - 0.5 / tile_size);
#endif
  float column = fract(slice / tiles.x);
  float row = floor(slice / tiles.x) / tiles.y;
#ifdef FAULT_A1_ROW_DIVISOR
  row = floor(slice / tiles.y) / tiles.y;
#endif
#ifdef FAULT_A1_SECOND_COLUMN
  if (is_second) column = floor(slice / tiles.x);
#endif
#ifdef FAULT_A1_PRINTED_ROW
  row = fract(slice / tiles.y) / tiles.y;
#endif
  return texture2D(atlas, vec2(column + place.x / tiles.x, row + place.y / tiles.y)).r;
}

vec4 classified(float value) {
  return texture2D(table, vec2(value, 0.5));
}

// Straight colour and opacity, and the value.
vec4 found_at(vec3 place, out float value) {
  float along = place.z * tiles.z;
#ifdef CENTERS
  along = max(along - 0.5, 0.0);
#endif
#ifdef FAULT_A3_SLICE_COUNT
  along = place.z * (tiles.z - 1.0);
#endif
#ifdef FAULT_A3_HALF_SLICE
  along = max(along - FAULT_A3_HALF_SLICE, 0.0);
#endif
  float s1 = floor(along);
  float v1 = in_slice(s1, place.xy, false);
  float s2 = s1 + 1.0;
#ifdef LAST_AGAIN
  s2 = min(s2, tiles.z - 1.0);
#endif
  float v2 = in_slice(s2, place.xy, true);
  float share = along - s1;
#ifdef FAULT_A3_MIX_BY_X
  share = place.x * tiles.z - s1;
#endif
#ifdef FAULT_A3_NO_INTERPOLATION
  share = 0.0;
#endif
  value = mix(v1, v2, share);
#ifdef FAULT_L3_PER_SLICE
  return mix(classified(v1), classified(v2), share);
#else
  return classified(value);
#endif
}

void main() {
  vec2 here = clip.xy / clip.w * 0.5 + 0.5;
  vec3 front = texture2D(front_coordinates, here).xyz;
  vec3 back = texture2D(back_coordinates, here).xyz;
  vec3 delta = (back - front) / float(STEPS);
  vec3 place = front;
  vec3 color = vec3(0.0);
  float alpha = 0.0;
  for (int i = 0; i < STEPS; i++) {
#ifdef FAULT_T3_LOOP_CAP
    if (float(i) >= FAULT_T3_LOOP_CAP * float(STEPS)) break;
#endif
    float value;
    vec4 found = found_at(place, value);
    // Equations 1 to 4.
#ifdef PRINTED
    float opacity = value * opacity_factor * (1.0 / float(STEPS));
#else
    float opacity = found.a * opacity_factor * (1.0 / float(STEPS));
#endif
#ifdef FAULT_O3_FACTOR_PER_SAMPLE
    opacity *= FAULT_O3_FACTOR_PER_SAMPLE;
#endif
#ifdef FAULT_M1_AVERAGE
    color += found.rgb * found.a / float(STEPS);
    alpha += found.a / float(STEPS);
#else
    color += (1.0 - alpha) * found.rgb * opacity * light_factor;
#ifdef FAULT_O2_ADD_ALPHA
    alpha += opacity;
#else
    alpha += (1.0 - alpha) * opacity;
#endif
#endif
    place += delta;
    if (alpha >= OPAQUE_AT) break;
  }
#ifdef PRINTED
  alpha = 1.0; // "which is set to 1 at the end of the render process"
#endif
  gl_FragColor = vec4(color, alpha);
}
