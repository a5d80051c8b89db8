// Seed 000: Arbelaz, Moreno and Kabongo 2016, section 3.3: the ray from the front face to the back, through the
// atlas of seed 001, until it meets a mesh.  Each way in which the printed form differs has a name:
//
// ONE_STEP_EARLY   the ray ends a step before the surface
// OBJECT_PRINTED   colour and alpha of the object are put behind a straight colour
// OUTSIDE_ABOVE    the ray ends after a sample beyond 1
//
// STEPS and OPAQUE_AT are defined by the page.
//
// Faults, each by a definition of its strength; the paper's own are those above:
// FAULT_D1_WINDOW_DEPTH  the depth of window coordinates takes the place of one that is linear along the view
// FAULT_D1_RANGE         surfaces lie at so many times their depth: another far plane
varying highp vec4 clip;
varying highp vec3 front;
uniform sampler2D mesh_depth;
uniform sampler2D mesh_color;
uniform sampler2D back_depth;
uniform sampler2D back_coordinates;
uniform sampler2D atlas;
uniform sampler2D table;
uniform vec3 tiles;  // across, down, and the number of slices
uniform float opacity_factor;

vec2 in_atlas(vec2 place, float slice) {
  float column = fract(slice / tiles.x);
  float row = floor(slice / tiles.x) / tiles.y;
  return vec2(column + place.x / tiles.x, row + place.y / tiles.y);
}

float value_at(vec3 place) {
  float s1 = floor(place.z * tiles.z);
  float s2 = s1 + 1.0;
  float v1 = texture2D(atlas, in_atlas(place.xy, s1)).r;
  float v2 = texture2D(atlas, in_atlas(place.xy, s2)).r;
  return mix(v1, v2, place.z * tiles.z - s1);
}

bool met(float ray_depth, float surf_depth, float depth_step) {
#ifdef ONE_STEP_EARLY
  return ray_depth - surf_depth > -depth_step;
#else
  return ray_depth >= surf_depth;
#endif
}

vec4 with_object(vec4 accum, vec3 object) {
#ifdef OBJECT_PRINTED
  vec3 rgb = accum.a * accum.rgb + (1.0 - accum.a) * object;
  return vec4(rgb, accum.a * accum.a + (1.0 - accum.a));
#else
  vec3 rgb = accum.rgb + (1.0 - accum.a) * object;
  return vec4(rgb, 1.0);
#endif
}

void main() {
  vec2 tex_d = clip.xy / clip.w * 0.5 + 0.5;
  vec3 back = texture2D(back_coordinates, tex_d).xyz;
  vec3 object = texture2D(mesh_color, tex_d).rgb;
  vec3 ray_step = (back - front) / float(STEPS);
  float back_at = 1.0 - unpack_float(texture2D(back_depth, tex_d));
  float ray_depth = 1.0 - nearness();
  float surf_depth = 1.0 - unpack_float(texture2D(mesh_depth, tex_d));
#ifdef FAULT_D1_RANGE
  if (surf_depth < 1.0) surf_depth *= FAULT_D1_RANGE;
#endif
  float depth_step = (back_at - ray_depth) / float(STEPS);
  vec3 place = front;
  vec4 accum = vec4(0.0);
  for (int i = 0; i < STEPS; i++) {
    if (met(ray_depth, surf_depth, depth_step)) {
      accum = with_object(accum, object);
      break;
    }
    vec4 found = texture2D(table, vec2(value_at(place), 0.5));
    float opacity = found.a * opacity_factor * (1.0 / float(STEPS));
    accum.rgb += (1.0 - accum.a) * opacity * found.rgb;
    accum.a += (1.0 - accum.a) * opacity;
    if (accum.a >= OPAQUE_AT) break;
#ifdef OUTSIDE_ABOVE
    if (any(greaterThan(place, vec3(1.0)))) break;
#endif
    place += ray_step;
    ray_depth += depth_step;
  }
  gl_FragColor = accum;
}
