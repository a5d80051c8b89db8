// Seed 002, first pass: where the box is left, as a colour.
precision highp float;
varying vec3 place;

void main() {
    gl_FragColor = vec4(place, 1.0);
}
