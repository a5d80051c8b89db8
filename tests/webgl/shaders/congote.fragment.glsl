// Seed 001: Congote and others, "Volume Ray Casting in WebGL", 2012.  PRINTED is the chapter to the letter.
// STEPS and OPAQUE_AT are defined by the page.
precision highp float;
precision highp sampler2D;

varying highp vec4 clip;
uniform sampler2D front_coordinates;
uniform sampler2D back_coordinates;
uniform sampler2D atlas;
uniform sampler2D table;
uniform vec3 tiles;          // M_x, M_y, and the number S of slices
uniform float opacity_factor; // O_f
uniform float light_factor;   // L_f

// Equations 5 to 17.
float value_at(vec3 place) {
  float s1 = floor(place.z * tiles.z);
  float s2 = s1 + 1.0;
  float dx1 = fract(s1 / tiles.x);
#ifdef PRINTED
  float dy1 = fract(s1 / tiles.y) / tiles.y;
  float dx2 = floor(s2 / tiles.x);
  float dy2 = fract(s2 / tiles.y) / tiles.y;
#else
  float dy1 = floor(s1 / tiles.x) / tiles.y;
  float dx2 = fract(s2 / tiles.x);
  float dy2 = floor(s2 / tiles.x) / tiles.y;
#endif
  float tx1 = dx1 + place.x / tiles.x;
  float ty1 = dy1 + place.y / tiles.y;
  float tx2 = dx2 + place.x / tiles.x;
  float ty2 = dy2 + place.y / tiles.y;
  float v1 = texture2D(atlas, vec2(tx1, ty1)).r;
  float v2 = texture2D(atlas, vec2(tx2, ty2)).r;
#ifdef PRINTED
  float share = place.x * tiles.z - s1;
#else
  float share = place.z * tiles.z - s1;
#endif
  return mix(v1, v2, share);
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
    float value = value_at(place);
    vec4 found = texture2D(table, vec2(value, 0.5));
    // Equations 1 to 4.
#ifdef PRINTED
    float opacity = value * opacity_factor * (1.0 / float(STEPS));
#else
    float opacity = found.a * opacity_factor * (1.0 / float(STEPS));
#endif
    color += (1.0 - alpha) * found.rgb * opacity * light_factor;
#ifdef PRINTED
    alpha += opacity;
#else
    alpha += (1.0 - alpha) * opacity;
#endif
    place += delta;
    if (alpha >= OPAQUE_AT) break;
  }
#ifdef PRINTED
  alpha = 1.0; // "which is set to 1 at the end of the render process"
#endif
  gl_FragColor = vec4(color, alpha);
}
