// Texture coordinates as colours.
precision highp float;
varying highp vec3 place;

void main() {
  gl_FragColor = vec4(place, 1.0);
}
