// Seed 002, both passes: a corner of the box, its place in texture space, and its clip position once more.
precision highp float;
uniform mat4 clip_from_texture;
attribute vec3 corner;
varying vec3 place;
varying vec4 clip;

void main() {
  place = corner;
  clip = clip_from_texture * vec4(corner, 1.0);
  gl_Position = clip;
}
