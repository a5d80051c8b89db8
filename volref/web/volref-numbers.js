// Numbers as Python writes them: ties go to the even digit, where JavaScript's go up.

/** Python's round(x, digits). */
export function rounded(x, digits) {
  return Number(fixed(x, digits));
}

/** Python's f"{x:.1%}". */
export function percent(x) {
  return `${fixed(x * 100, 1)}%`;
}

/** Python's f"{x:g}": six digits, zeros at the end left out. */
export function general(x) {
  if (x === 0) return Object.is(x, -0) ? "-0" : "0";
  if (!Number.isFinite(x)) return Number.isNaN(x) ? "nan" : x > 0 ? "inf" : "-inf";
  const sign = x < 0 ? "-" : "";
  const [digits, power] = even(Math.abs(x).toExponential(5), Math.abs(x).toExponential(60), 5).split("e");
  const exponent = Number(power);
  if (exponent < -4 || exponent >= 6) {
    const tail = `${Math.abs(exponent)}`.padStart(2, "0");
    return `${sign}${Number(digits)}e${exponent < 0 ? "-" : "+"}${tail}`;
  }
  return `${sign}${Number(`${digits}e${power}`)}`;
}

function fixed(x, digits) {
  if (!Number.isFinite(x)) return `${x}`;
  const sign = x < 0 || Object.is(x, -0) ? "-" : "";
  return sign + even(Math.abs(x).toFixed(digits), Math.abs(x).toFixed(60), digits);
}

/** `short`, or its predecessor where `long` is half-way between two and that one is even. */
function even(short, long, digits) {
  const [mantissa, power] = long.split("e");
  const end = mantissa.indexOf(".") + 1 + digits;
  const below = mantissa.slice(0, end);
  const tie = /^50*$/.test(mantissa.slice(end));
  return tie && Number(below.at(-1)) % 2 === 0 ? below + (power === undefined ? "" : `e${power}`) : short;
}
