#version 300 es
// The baseline: a slab test, a 3-D texture, steps of one world length with the sample in the middle.
//
// PARALLEL: rays without an eye.  MESHES: targets of the nearest mesh are read.
precision highp float;
precision highp sampler2D;
precision highp sampler3D;

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
  if (missed && object.a == 0.0) discard;

  vec3 color = vec3(0.0);
  float alpha = 0.0;
  if (!missed) {
    vec3 entry = origin + t_near * direction;
    vec3 ray = origin + t_far * direction - entry;
    float ray_length = length(world_from_texture * ray);
    vec3 delta = ray / ray_length * step_length;
    for (int i = 0; ; i++) {
      float begin = float(i) * step_length;
      if (!(begin < ray_length)) break;
      float share = min(ray_length - begin, step_length) / step_length;
      vec3 place = entry + delta * (float(i) + offset * share);
      float value = texture(volume, place).r;
      vec4 found = texture(table, vec2(value, 0.5));
      float opacity = 1.0 - pow(1.0 - found.a, share * step_length / unit_distance);
      float weight = (1.0 - alpha) * opacity;
      color += found.rgb * weight;
      alpha += weight;
      if (alpha >= opaque_at) break;
    }
  }
  color += (1.0 - alpha) * object.rgb;
  alpha = object.a > 0.0 ? 1.0 : alpha;
  result = vec4(color, alpha);
}
