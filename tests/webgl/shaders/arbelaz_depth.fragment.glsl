// Seed 000, passes 1 and 3.
void main() {
  gl_FragColor = pack_float(nearness());
}
