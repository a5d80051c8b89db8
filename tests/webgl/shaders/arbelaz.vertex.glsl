// Seed 000, pass 5: the box's front faces.  Where a fragment lies on the screen is interpolated.
attribute vec3 position;
uniform mat4 clip_from_model;
varying highp vec4 clip;
varying highp vec3 front;
#ifndef WINDOW_OVER_W
uniform mat4 view_from_model;
varying highp float ahead;
#endif

void main() {
#ifndef WINDOW_OVER_W
  ahead = -(view_from_model * vec4(position, 1.0)).z;
#endif
  front = position;
  clip = clip_from_model * vec4(position, 1.0);
  gl_Position = clip;
}
