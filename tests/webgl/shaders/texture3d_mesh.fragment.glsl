#version 300 es
// The distance at which rays meet a mesh, or its colour (COLOR).
//
// Faults, each by a definition of its strength:
// FAULT_D1_VIEW_DEPTH    distances are measured along the view
// FAULT_D1_WINDOW_DEPTH  the depth of window coordinates is taken for a share of the way from near to far
// FAULT_D1_RANGE         distances are those of so many times the range
precision highp float;
in highp vec3 view;
in highp vec3 own;
uniform float near;
uniform float far;
out vec4 result;

void main() {
#ifdef COLOR
  result = vec4(own, 1.0);
#elif defined(PARALLEL)
  result = vec4(-view.z - near, 0.0, 0.0, 1.0);
#elif defined(FAULT_D1_VIEW_DEPTH)
  result = vec4(-view.z, 0.0, 0.0, 1.0);
#elif defined(FAULT_D1_WINDOW_DEPTH)
  result = vec4(mix(near, far, gl_FragCoord.z), 0.0, 0.0, 1.0);
#elif defined(FAULT_D1_RANGE)
  result = vec4(length(view) * FAULT_D1_RANGE, 0.0, 0.0, 1.0);
#else
  result = vec4(length(view), 0.0, 0.0, 1.0);
#endif
}
