#version 300 es
// VPT and Cej, frame: a triangle over the whole target; its corners on the near and the far plane, in texture space.
precision highp float;
uniform mat4 texture_from_clip;
in vec2 position;
out vec3 near;
out vec3 far;

void main() {
    vec4 before = texture_from_clip * vec4(position, -1.0, 1.0);
    vec4 behind = texture_from_clip * vec4(position, 1.0, 1.0);
    near = before.xyz / before.w;
    far = behind.xyz / behind.w;
    gl_Position = vec4(position, 0.0, 1.0);
}
