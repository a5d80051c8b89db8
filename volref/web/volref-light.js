// Between light and code values, alpha multiplied and divided: as volref/image.py has it.

const GAMMA = 2.2;

/** Code values of light: "srgb", "srgb-target" (IEC 61966-2-1), "gamma2.2", "none"; "decoded" undoes srgb. */
export function encode(light, encoding) {
  if (encoding === "none") return light;
  if (encoding === "decoded") return decodeSrgb(light);
  return encoding === "gamma2.2" ? Math.max(light, 0) ** (1 / GAMMA) : encodeSrgb(light);
}

/** Light of code values; undoes `encode`. */
export function decode(code, encoding) {
  if (encoding === "none") return code;
  if (encoding === "decoded") return encodeSrgb(code);
  return encoding === "gamma2.2" ? Math.max(code, 0) ** GAMMA : decodeSrgb(code);
}

function encodeSrgb(linear) {
  const light = Math.max(linear, 0);
  return light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055;
}

function decodeSrgb(code) {
  const value = Math.max(code, 0);
  return value <= 12.92 * 0.0031308 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}
