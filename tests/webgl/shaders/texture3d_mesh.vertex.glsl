#version 300 es
// A mesh, as seen from the eye.
in vec3 position;
in vec3 color;
uniform mat4 view_from_world;
uniform mat4 clip_from_view;
out highp vec3 view;
out highp vec3 own;

void main() {
  view = (view_from_world * vec4(position, 1.0)).xyz;
  own = color;
  gl_Position = clip_from_view * vec4(view, 1.0);
}
