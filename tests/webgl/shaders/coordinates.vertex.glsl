// The corners of the unit cube of texture space, and their own places as colours.
attribute vec3 corner;
uniform mat4 clip_from_texture;
varying highp vec3 place;

void main() {
  place = corner;
  gl_Position = clip_from_texture * vec4(corner, 1.0);
}
