// x3dom's VolumeData: a corner of the box, and its place in texture space.
uniform mat4 clip_from_texture;
attribute vec3 corner;
varying vec3 place;

void main() {
    place = corner;
    gl_Position = clip_from_texture * vec4(corner, 1.0);
}
