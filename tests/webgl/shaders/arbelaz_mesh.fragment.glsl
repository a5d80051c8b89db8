// Seed 000, pass 2 and the meshes of pass 5.
precision highp float;
#ifdef ONE_COLOR
uniform vec3 shown;
#else
varying highp vec3 shown;
#endif

void main() {
  gl_FragColor = vec4(shown, 1.0);
}
