// The numbers of a case, as volref/report/verdicts/pixels.py packs them.

const NAN_CODE = -(2 ** 31), MOST = 2 ** 30;
const OUTSIDE = 1, AMBIGUOUS = 2, DRAWN = 4, LEFT_OUT = 8;
const WIDTH_STEPS = 8000, WIDTH_DECADES = 4;

async function inflated(text) {
  const bytes = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Numbers of a viewer: `fields` by name, each (4, N) whole numbers of 1/(255 parts), a channel at a time. */
async function numbersOf(viewer) {
  const about = viewer.dataset;
  const width = Number(about.width), height = Number(about.height), factor = Number(about.factor);
  const parts = Number(about.parts), count = width * height, length = 4 * count;
  const bytes = await inflated(viewer.querySelector(".numbers").textContent);
  let at = 0;
  const take = (size) => bytes.subarray(at, (at += size));
  const whole = parts === 1 ? 1 : 4;
  const field = () => {
    const planes = take(whole * length), read = new Int32Array(length);
    for (let i = 0; i < length; i++)
      for (let k = 0; k < whole; k++) read[i] |= planes[k * length + i] << (8 * k);
    return read;
  };
  const wrap = whole === 1 ? (code) => code & 255 : (code) => code | 0;
  const fields = {};
  for (const name of about.fields.split(" ")) {
    const read = field();
    if (name === "nominal")
      for (let i = 0; i < length; i++) read[i] = wrap(read[i] + (i % count ? read[i - 1] : 0));
    else for (let i = 0; i < length; i++) read[i] = wrap(read[i] + fields.nominal[i]);
    fields[name] = read;
  }
  const marks = take(count), low = take(count), high = take(count);
  const widths = Uint16Array.from(low, (byte, i) => byte | (high[i] << 8));
  const rows = factor > 1 ? take(count) : null, columns = factor > 1 ? take(count) : null;
  const place = (i) => {
    const row = Math.floor(i / width), column = i % width;
    return factor > 1 ? [column * factor + columns[i], row * factor + rows[i]] : [column, row];
  };
  return { width, height, count, parts, fields, marks, widths, place };
}

/** A stored number in 1/255. */
function levelOf(numbers, code) {
  if (code === NAN_CODE) return NaN;
  return Math.abs(code) >= MOST ? Math.sign(code) * Infinity : code / numbers.parts;
}

/**
 * How far a number is outside its interval, in 1/255: negative below, positive above, NaN for no number.
 * The verdict has the last word: it knows how the image was rounded on its way.
 */
function excessAt(numbers, index) {
  if (!(numbers.marks[index % numbers.count] & OUTSIDE)) return 0;
  const { candidate, lo, hi } = numbers.fields;
  const value = levelOf(numbers, candidate[index]);
  if (Number.isNaN(value)) return NaN;
  return Math.min(value - levelOf(numbers, lo[index]), 0) + Math.max(value - levelOf(numbers, hi[index]), 0);
}

/** Width of a pixel's interval in 1/255. */
function widthAt(numbers, i) {
  return numbers.widths[i] ? 10 ** (numbers.widths[i] / WIDTH_STEPS - WIDTH_DECADES) : 0;
}
