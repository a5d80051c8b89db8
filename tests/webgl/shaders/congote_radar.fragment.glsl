// Seed 001, section 4: the sweeps of a radar in one image, looked up in spherical coordinates at each step.
// PRINTED is the chapter to the letter.  STEPS, OPAQUE_AT and SWEEPS are defined by the page.
precision highp float;
precision highp sampler2D;

varying highp vec4 clip;
uniform sampler2D front_coordinates;
uniform sampler2D back_coordinates;
uniform sampler2D sweeps;
uniform sampler2D table;
uniform float tilts[SWEEPS];  // elevations of the sweeps, rising, in radians
uniform vec2 gates;           // where the first gate begins and how far all reach, the cube's side being 1
uniform float half_gate;      // half a gate as a share of a sweep's rows
uniform float turn;           // share of a turn, clockwise from north, at which the first column begins
uniform float columns;        // radials of a sweep; the image has one more on either side
uniform float opacity_factor; // O_f
uniform float light_factor;   // L_f

const float PI = 3.14159265358979;
const float PER_TURN = 0.15915494309189535;
const vec2 M = vec2(1.0, SWEEPS); // tiles in a row and in a column

// Where in the image azimuth and range of a place in a sweep are: equations 7, 8, 11 and 12, or 9, 10, 13, 14.
float image_at(float dx, float dy, vec2 place) {
  return texture2D(sweeps, vec2(dx + place.x / M.x, dy + place.y / M.y)).r;
}

float value_at(vec3 p) {
  vec3 q = p - 0.5;
  // Equations 18 to 20.
  float r = sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
#ifdef PRINTED
  float phi = atan(p.y, p.x) + PI;
  float theta = acos(p.z / phi);
#else
  float phi = atan(q.y, q.x) + PI;
  float theta = acos(q.z / r);
#endif
  float elevation = PI / 2.0 - theta;
  float range = (r - gates.x) / gates.y;
#ifdef PRINTED
  float azimuth = phi * PER_TURN;
#else
  float azimuth = fract(0.75 - phi * PER_TURN - turn);
#endif
  // The search.
  float s1 = -1.0;
  float share = 0.0;
  for (int i = 0; i < SWEEPS - 1; i++) {
    if (elevation >= tilts[i] && elevation <= tilts[i + 1]) {
      s1 = float(i);
      share = (elevation - tilts[i]) / (tilts[i + 1] - tilts[i]);
    }
  }
  if (s1 < 0.0 || !(range >= 0.0) || !(range <= 1.0)) return 0.0;
  float s2 = s1 + 1.0;
#ifdef PRINTED
  vec2 place = vec2(azimuth, range);
  share = azimuth * M.y - s1;
  float v1 = image_at(fract(s1 / M.x), fract(s1 / M.y) / M.y, place);
  float v2 = image_at(floor(s2 / M.x), fract(s2 / M.y) / M.y, place);
#else
  vec2 place = vec2((azimuth * columns + 1.0) / (columns + 2.0), clamp(range, half_gate, 1.0 - half_gate));
  float v1 = image_at(fract(s1 / M.x), floor(s1 / M.x) / M.y, place);
  float v2 = image_at(fract(s2 / M.x), floor(s2 / M.x) / M.y, place);
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
