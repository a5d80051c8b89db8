// The front faces again; where a fragment lies on the screen is interpolated, not gl_FragCoord: that is mediump.
attribute vec3 corner;
uniform mat4 clip_from_texture;
varying highp vec4 clip;

void main() {
  clip = clip_from_texture * vec4(corner, 1.0);
  gl_Position = clip;
}
