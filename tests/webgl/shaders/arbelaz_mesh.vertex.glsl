// Seed 000, pass 2 and the meshes of pass 5: their own colours, unlit.  ONE_COLOR: not of the vertices.
attribute vec3 position;
uniform mat4 clip_from_model;
#ifndef ONE_COLOR
attribute vec3 color;
varying highp vec3 shown;
#endif

void main() {
#ifndef ONE_COLOR
  shown = color;
#endif
  gl_Position = clip_from_model * vec4(position, 1.0);
}
