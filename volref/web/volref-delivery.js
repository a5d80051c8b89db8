// What becomes of an acceptance interval on the way from the canvas into an image: volref/oracle/delivery.py.
//
// To undo on the image what was done to the canvas would lose what rounding took.  So the interval goes the
// same way instead, and every rounding moves its ends outward:
//
//   canvas [lo, hi] -> divided by alpha -> encoded -> times alpha -> rounded outward = delivered
//
// Alpha itself is never changed, so that the image's own alpha is what it was divided by.

import { decode, encode } from "./volref-light.js";
import { refuse } from "./volref-refusal.js";

/**
 * @typedef {object} Candidate  an image to judge, as it was delivered
 * @property {number} width
 * @property {number} height
 * @property {ArrayLike<number>} data  RGBA or RGB, row 0 at the top: codes 0..`levels`, or parts of 1
 * @property {3|4} channels
 * @property {number|null} levels      255 for bytes, null for floats
 */

/**
 * @typedef {object} Delivery
 * @property {"premultiplied"|"straight"|"ignored"} alpha
 * @property {"none"|"srgb"|"gamma2.2"|"srgb-target"|"decoded"} encoding
 */

export const ALPHAS = ["premultiplied", "straight", "ignored"];
// Curves put over the canvas's numbers as they are, multiplied by alpha or not: mistakes to recognise.
export const DIRECT = ["srgb-target", "decoded"];
const ENCODINGS = ["srgb", "gamma2.2", "none"];

// Colours where alpha is 0 and was divided by: they say nothing.
const FREE = 1e30;

// Why these: volref/oracle/candidate.py and delivery.py.
const ROUNDING = 2 ** -23;
const CONVERSION_ROUNDING = 8 * 2 ** -23;
const OWN_ROUNDING = 2 ** -48;

/** How a candidate was delivered: as told, else as the canvas has it. */
export function deliveryOf(candidate, pipeline, alpha, encoding) {
  const chosen = oneOf("encoding", encoding ?? "none", ENCODINGS);
  if (alpha === undefined) {
    return { alpha: candidate.channels === 4 ? canvasAlpha(pipeline) : "ignored", encoding: chosen };
  }
  const kind = oneOf("alpha", alpha, ALPHAS);
  if (kind !== "ignored" && candidate.channels !== 4) {
    const cure = "leave it out, or save the image with four channels";
    refuse("alpha must be 'ignored' for an image without alpha", `'${kind}'`, cure);
  }
  return { alpha: kind, encoding: chosen };
}

/** What the canvas's colours are: "straight" if they are divided by alpha and never multiplied. */
export function canvasAlpha({ accumulation, output }) {
  const divided = accumulation.normalize === "always" && accumulation.alpha !== "one";
  return divided && output.blend === "none" ? "straight" : "premultiplied";
}

/**
 * Return what writes the interval of a pixel, in the numbers of the candidate, into two arrays of four.
 *
 * @param {import("./volref-bundle.js").Bundle} bundle
 * @param {import("./volref-bundle.js").Interval} interval
 * @param {Candidate} candidate
 * @param {Delivery} delivery
 * @returns {[(pixel: number, lo: Float64Array, hi: Float64Array) => void, 3|4]}  and how many channels it has
 */
export function delivered({ manifest: { pipeline } }, interval, candidate, delivery) {
  const own = canvasAlpha(pipeline);
  const levels = canvasLevels(pipeline);
  const widened = levels !== null && !onLevels(candidate, delivery, own, levels) ? 0.5 / levels : 0;
  const exact = levels !== null && levels === candidate.levels;
  const between = encodedKind(delivery, own);
  const converted = delivery.encoding !== "none" || ![own, "ignored"].includes(delivery.alpha);
  const share = ROUNDING + (converted ? CONVERSION_ROUNDING : 0);
  const ignored = delivery.alpha === "ignored";
  const channels = ignored ? 3 : 4;
  const alphas = new Float64Array(2);

  // One pixel after the other, in arrays that are there: an image has a million numbers.
  const write = (pixel, lo, hi) => {
    for (let channel = 0; channel < channels; channel += 1) {
      lo[channel] = interval.lo[4 * pixel + channel] - widened;
      hi[channel] = interval.hi[4 * pixel + channel] + widened;
    }
    if (!ignored) alphaRange(alphas, lo[3], hi[3], unitOf(candidate, pixel, 3), candidate.levels, exact);
    for (let channel = 0; channel < 3 && converted; channel += 1) {
      if (!ignored) asKind(lo, hi, channel, alphas, own, between);
      encodeEnds(lo, hi, channel, delivery.encoding);
      if (!ignored) asKind(lo, hi, channel, alphas, between, delivery.alpha);
    }
    for (let channel = 0; channel < channels; channel += 1) store(lo, hi, channel, candidate.levels, share);
  };
  return [write, channels];
}

function canvasLevels({ output }) {
  return { unorm8: 255, unorm16: 65535 }[output.mean_format ?? output.format] ?? null;
}

function unitOf({ data, channels, levels }, pixel, channel) {
  return data[channels * pixel + channel] / (levels ?? 1);
}

/** Whether the candidate's numbers are codes of the canvas, as exactly as its type can say. */
function onLevels(candidate, delivery, own, levels) {
  if (candidate.levels !== null) return true;
  const slack = levels * (ROUNDING + 2 * CONVERSION_ROUNDING);
  const numbers = new Float64Array(delivery.alpha === "ignored" ? 3 : 4);
  for (let pixel = 0; pixel < candidate.width * candidate.height; pixel += 1) {
    writeCanvas(numbers, candidate, pixel, delivery, own);
    for (const number of numbers) {
      const code = levels * number;
      if (Math.abs(code - Math.round(code)) > slack) return false;
    }
  }
  return true;
}

/** What colours are in the moment when they are encoded. */
function encodedKind({ alpha, encoding }, own) {
  if (encoding === "none") return alpha;
  return DIRECT.includes(encoding) ? own : "straight";
}

/** Write the numbers on the canvas that a pixel comes from, as nearly as it tells them. */
function writeCanvas(numbers, candidate, pixel, { alpha, encoding }, own) {
  const share = numbers.length === 4 ? unitOf(candidate, pixel, 3) : 1;
  const between = encodedKind({ alpha, encoding }, own);
  for (let channel = 0; channel < 3; channel += 1) {
    const color = unitOf(candidate, pixel, channel);
    numbers[channel] =
      alpha === "ignored"
        ? decode(color, encoding)
        : colorAs(decode(colorAs(color, share, alpha, between), encoding), share, between, own);
  }
  if (numbers.length === 4) numbers[3] = share;
}

function colorAs(color, alpha, kind, wanted) {
  if (kind === wanted) return color;
  if (wanted === "premultiplied") return color * alpha;
  return alpha > 0 ? color / alpha : 0;
}

/** Write which alphas of the canvas the candidate's may come from. */
function alphaRange(alphas, lo, hi, alpha, levels, exact) {
  const slack = exact ? 0 : levels === null ? alpha * ROUNDING : 1 / levels;
  alphas[0] = exact ? alpha : Math.max(alpha - slack, 0);
  alphas[1] = alpha + slack;
  // An alpha that no canvas within the intervals has is found by its own channel.
  if (exact || !(alphas[0] <= hi && alphas[1] >= lo)) return;
  alphas[0] = Math.max(alphas[0], lo);
  alphas[1] = Math.min(alphas[1], hi);
}

/** Change ends of a colour to the other kind of alpha; straight ones held to 1 or not: tools do either. */
function asKind(lo, hi, channel, [least, most], kind, wanted) {
  if (kind === wanted) return;
  const [low, high] = [lo[channel], hi[channel]];
  if (wanted === "premultiplied") {
    lo[channel] = Math.min(low * least, low * most);
    hi[channel] = Math.max(high * least, high * most);
  } else {
    lo[channel] = least <= 0 ? 0 : Math.min(low / least, low / most, 1);
    hi[channel] = least <= 0 ? FREE : Math.max(high / least, high / most);
  }
}

/** Encode a colour's ends, held to 1 before or not: tools do either. */
function encodeEnds(lo, hi, channel, encoding) {
  if (encoding === "none") return;
  lo[channel] = encode(Math.min(lo[channel], 1), encoding);
  hi[channel] = encode(hi[channel], encoding);
}

/** Change ends to the candidate's numbers, outward by as much as storing them may round. */
function store(lo, hi, channel, levels, share) {
  if (levels === null) {
    lo[channel] -= share * Math.abs(lo[channel]);
    hi[channel] += share * Math.abs(hi[channel]);
  } else {
    const slack = levels * OWN_ROUNDING;
    lo[channel] = Math.floor(Math.min(Math.max(lo[channel], 0), 1) * levels + slack);
    hi[channel] = Math.ceil(Math.min(Math.max(hi[channel], 0), 1) * levels - slack);
  }
}

function oneOf(name, word, words) {
  if (!words.includes(word))
    refuse(`${name} must be one of ${words.join(", ")}`, `'${word}'`, "use one of these");
  return word;
}
