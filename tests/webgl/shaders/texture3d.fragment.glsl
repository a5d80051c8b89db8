#version 300 es
// The baseline: a slab test, a 3-D texture, steps of one world length with the sample in the middle.
//
// PARALLEL: rays without an eye.  MESHES: targets of the nearest mesh are read.
//
// Faults, each by a definition of its strength:
// FAULT_G1_HALF_VOXEL             the volume is read so many voxels further along all axes
// FAULT_G2_NODE_CENTRED           the outer voxels lie on the faces
// FAULT_G3_STEP_IN_TEXTURE_SPACE  lengths along the ray are those of texture space times the longest side
// FAULT_G5_VANISHES_INSIDE        nothing is drawn with the eye in the box
// FAULT_G6_BRICK_SEAMS            bricks of so many voxels know nothing of their neighbours
// FAULT_O1_UNCORRECTED            the table's opacity is a sample's
// FAULT_O1_STALE                  opacity is for a step so many times as long
// FAULT_O2_ADD_ALPHA              alpha is added without what is in front
// FAULT_O3_FACTOR_PER_SAMPLE      opacity times this at each sample
// FAULT_O4_RAY_LENGTH             opacity is for rays that are all as long as the box's mean side
// FAULT_O5_STRAIGHT_OUTPUT        alpha is divided out before the canvas blends
// FAULT_O5_STRAIGHT_AS_PREMULTIPLIED  colours of the table are added as if multiplied by their opacity
// FAULT_T1_NOT_RENORMALISED       a ray ends at this alpha and counts as opaque
// FAULT_T2_...                    the first step, the last step: see the loop
// FAULT_T3_LOOP_CAP               the loop ends after this share of the steps across the box
// FAULT_T3_ONE_SIDED_EXIT         faces at 0 do not end a ray
// FAULT_T4_STEP                   steps are so many times as long, their opacity is not
// FAULT_L1_HALF_TEXEL             the table is read so many entries further
// FAULT_L1_ENDS_FOR_CENTERS       the table is read as if its outer entries were for 0 and 1
// FAULT_C1_SRGB_TWICE             colours are encoded once more
// FAULT_C1_SRGB_NEVER             colours are decoded, and not encoded again
// FAULT_L3_PRE_CLASSIFIED         the volume holds colours and opacities
// FAULT_M1_AVERAGE                samples are averaged
// FAULT_M1_MAXIMUM                the most opaque sample is all that is seen
precision highp float;
precision highp sampler2D;
precision highp sampler3D;
#if defined(FAULT_M1_AVERAGE) || defined(FAULT_M1_MAXIMUM)
#define GATHERED
#endif

in highp vec2 ndc;
uniform sampler3D volume;
uniform sampler2D table;
uniform mat4 texture_from_view;
uniform mat3 world_from_texture; // without the translation
uniform vec2 half_size;          // of the image at view distance 1; of parallel rays, in the world
uniform float near;              // where parallel rays start
uniform float step_length;       // in the world
uniform float offset;            // of the sample in its step
uniform float unit_distance;     // for which the table's opacity is meant
uniform float opaque_at;
#ifdef MESHES
uniform sampler2D mesh_distance;
uniform sampler2D mesh_color;
#endif
out vec4 result;

// Where the volume is read for a place.
vec3 read_at(vec3 place) {
  vec3 size = vec3(textureSize(volume, 0));
#ifdef FAULT_G1_HALF_VOXEL
  place += FAULT_G1_HALF_VOXEL / size;
#endif
#ifdef FAULT_G2_NODE_CENTRED
  place = (place * (size - 1.0) + 0.5) / size;
#endif
#ifdef FAULT_G6_BRICK_SEAMS
  vec3 first = floor(place * size / FAULT_G6_BRICK_SEAMS) * FAULT_G6_BRICK_SEAMS;
  vec3 last = min(first + FAULT_G6_BRICK_SEAMS, size);
  place = clamp(place * size, first + 0.5, last - 0.5) / size;
#endif
  return place;
}

// Straight colour and opacity of a unit distance.
vec4 classified(vec3 place) {
#ifdef FAULT_L3_PRE_CLASSIFIED
  return texture(volume, read_at(place));
#else
  float value = texture(volume, read_at(place)).r;
  float entries = float(textureSize(table, 0).x);
#ifdef FAULT_L1_HALF_TEXEL
  value += FAULT_L1_HALF_TEXEL / entries;
#endif
#ifdef FAULT_L1_ENDS_FOR_CENTERS
  value = (value * (entries - 1.0) + 0.5) / entries;
#endif
  return texture(table, vec2(value, 0.5));
#endif
}

vec3 sides_of_box() {
  return vec3(length(world_from_texture[0]), length(world_from_texture[1]), length(world_from_texture[2]));
}

// Opacity of a share of a step.
float opacity_of(float alpha, float share, float ray_length) {
  float lengths = share * step_length / unit_distance;
#ifdef FAULT_O1_STALE
  lengths *= FAULT_O1_STALE;
#endif
#ifdef FAULT_O4_RAY_LENGTH
  vec3 sides = sides_of_box();
  lengths *= (sides.x + sides.y + sides.z) / 3.0 / ray_length;
#endif
  float opacity = 1.0 - pow(1.0 - alpha, lengths);
#ifdef FAULT_O1_UNCORRECTED
  opacity = alpha;
#endif
#ifdef FAULT_O3_FACTOR_PER_SAMPLE
  opacity *= FAULT_O3_FACTOR_PER_SAMPLE;
#endif
  return opacity;
}

// Length of a ray from face to face.
float length_of(vec3 ray) {
#ifdef FAULT_G3_STEP_IN_TEXTURE_SPACE
  vec3 sides = sides_of_box();
  return length(ray) * max(sides.x, max(sides.y, sides.z));
#else
  return length(world_from_texture * ray);
#endif
}

void main() {
#ifdef PARALLEL
  vec3 view_origin = vec3(ndc * half_size, -near);
  vec3 view_direction = vec3(0.0, 0.0, -1.0);
#else
  vec3 view_origin = vec3(0.0);
  vec3 view_direction = normalize(vec3(ndc * half_size, -1.0));
#endif
  vec3 origin = (texture_from_view * vec4(view_origin, 1.0)).xyz;
  vec3 direction = mat3(texture_from_view) * view_direction;

  vec3 low = (vec3(0.0) - origin) / direction;
  vec3 high = (vec3(1.0) - origin) / direction;
  vec3 first = min(low, high);
  vec3 last = max(low, high);
  float t_near = max(max(first.x, max(first.y, first.z)), 0.0);
  float t_far = min(last.x, min(last.y, last.z));
  vec4 object = vec4(0.0);
#ifdef MESHES
  ivec2 here = ivec2(gl_FragCoord.xy);
  object = texelFetch(mesh_color, here, 0);
  t_far = min(t_far, texelFetch(mesh_distance, here, 0).r);
#endif
  bool missed = !(t_near < t_far);
#ifdef FAULT_G5_VANISHES_INSIDE
  missed = missed || t_near == 0.0;
#endif
  if (missed && object.a == 0.0) discard;

  vec3 color = vec3(0.0);
  float alpha = 0.0;
  if (!missed) {
    vec3 entry = origin + t_near * direction;
    vec3 ray = origin + t_far * direction - entry;
    float ray_length = length_of(ray);
    float walked = step_length;
#ifdef FAULT_T4_STEP
    walked *= FAULT_T4_STEP;
#endif
    vec3 delta = ray / ray_length * walked;
    int begin_at = 0;
#ifdef FAULT_T2_FIRST_STEP_DROPPED
    begin_at = 1;
#endif
#ifdef GATHERED
    vec4 gathered = vec4(0.0);
    float samples = 1.0;
#endif
    for (int i = begin_at; ; i++) {
      float begin = float(i) * walked;
#ifdef FAULT_T3_ONE_SIDED_EXIT
      if (i > 0 && any(greaterThan(entry + delta * (float(i) - offset), vec3(1.0))) || i > 200) break;
      ray_length = begin + walked;
#endif
      if (!(begin < ray_length)) break;
#ifdef FAULT_T3_LOOP_CAP
      if (begin >= FAULT_T3_LOOP_CAP * length(world_from_texture * vec3(1.0))) break;
#endif
      float share = min(ray_length - begin, walked) / walked;
#ifdef FAULT_T2_LAST_STEP_DROPPED
      if (ray_length - begin < walked) break;
#endif
#ifdef FAULT_T2_LAST_STEP_WHOLE
      share = 1.0;
#endif
      vec3 place = entry + delta * (float(i) + offset * share);
#ifdef FAULT_T2_LAST_STEP_DOUBLED
      if (ray_length - begin <= walked) share *= 2.0;
#endif
      vec4 found = classified(place);
      float opacity = opacity_of(found.a, share, ray_length);
      float weight = (1.0 - alpha) * opacity;
#ifdef FAULT_O5_STRAIGHT_AS_PREMULTIPLIED
      color += found.rgb * (1.0 - alpha);
#else
      color += found.rgb * weight;
#endif
#ifdef FAULT_O2_ADD_ALPHA
      alpha += opacity;
#else
      alpha += weight;
#endif
#if defined(FAULT_M1_AVERAGE)
      gathered += vec4(found.rgb, 1.0) * found.a;
      samples = float(i + 1);
#elif defined(FAULT_M1_MAXIMUM)
      if (found.a > gathered.a) gathered = vec4(found.rgb, 1.0) * found.a;
#else
#ifdef FAULT_T1_NOT_RENORMALISED
      if (alpha >= FAULT_T1_NOT_RENORMALISED) alpha = 1.0;
#endif
      if (alpha >= opaque_at) break;
#endif
    }
#ifdef GATHERED
    color = gathered.rgb / samples;
    alpha = gathered.a / samples;
#endif
  }
  color += (1.0 - alpha) * object.rgb;
  alpha = object.a > 0.0 ? 1.0 : alpha;
#ifdef FAULT_O5_STRAIGHT_OUTPUT
  if (alpha > 0.0) color /= alpha;
#endif
#ifdef FAULT_C1_SRGB_TWICE
  color = mix(12.92 * color, 1.055 * pow(color, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, color));
#endif
#ifdef FAULT_C1_SRGB_NEVER
  color = mix(color / 12.92, pow((color + 0.055) / 1.055, vec3(2.4)), step(0.04045, color));
#endif
  result = vec4(color, alpha);
}
