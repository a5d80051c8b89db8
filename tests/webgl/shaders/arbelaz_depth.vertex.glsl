// Seed 000, passes 1 and 3: meshes and the box's back, for their depth.
attribute vec3 position;
uniform mat4 clip_from_model;
#ifndef WINDOW_OVER_W
uniform mat4 view_from_model;
varying highp float ahead;
#endif

void main() {
#ifndef WINDOW_OVER_W
  ahead = -(view_from_model * vec4(position, 1.0)).z;
#endif
  gl_Position = clip_from_model * vec4(position, 1.0);
}
