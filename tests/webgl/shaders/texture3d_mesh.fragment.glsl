#version 300 es
// The distance at which rays meet a mesh, or its colour (COLOR).
precision highp float;
in highp vec3 view;
in highp vec3 own;
uniform float near;
out vec4 result;

void main() {
#ifdef COLOR
  result = vec4(own, 1.0);
#elif defined(PARALLEL)
  result = vec4(-view.z - near, 0.0, 0.0, 1.0);
#else
  result = vec4(length(view), 0.0, 0.0, 1.0);
#endif
}
