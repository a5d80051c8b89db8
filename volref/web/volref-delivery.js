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
const ROUNDING = 2 ** -24;
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
 * Return what gives the interval of a pixel in the numbers of the candidate, 3 or 4 channels.
 *
 * @param {import("./volref-bundle.js").Bundle} bundle
 * @param {import("./volref-bundle.js").Interval} interval
 * @param {Candidate} candidate
 * @param {Delivery} delivery
 * @returns {(pixel: number) => [number[], number[]]}
 */
export function delivered({ manifest: { pipeline } }, interval, candidate, delivery) {
  const own = canvasAlpha(pipeline);
  const levels = canvasLevels(pipeline);
  const widened = levels !== null && !onLevels(candidate, delivery, own, levels) ? 0.5 / levels : 0;
  const exact = levels !== null && levels === candidate.levels;
  const between = encodedKind(delivery, own);
  const converted = delivery.encoding !== "none" || ![own, "ignored"].includes(delivery.alpha);
  const share = ROUNDING + (converted ? CONVERSION_ROUNDING : 0);

  return (pixel) => {
    const lo = Array.from(interval.lo.subarray(4 * pixel, 4 * pixel + 4), (low) => low - widened);
    const hi = Array.from(interval.hi.subarray(4 * pixel, 4 * pixel + 4), (high) => high + widened);
    let colors = lo.slice(0, 3).map((low, channel) => [low, hi[channel]]);
    if (delivery.alpha === "ignored") {
      colors = colors.map((ends) => encoded(ends, delivery.encoding));
    } else {
      const alphas = alphaRange(lo[3], hi[3], unitOf(candidate, pixel, 3), candidate.levels, exact);
      colors = colors
        .map((ends) => asKind(ends, alphas, own, between))
        .map((ends) => encoded(ends, delivery.encoding))
        .map((ends) => asKind(ends, alphas, between, delivery.alpha));
      colors.push([lo[3], hi[3]]);
    }
    const ends = colors.map((pair) => stored(pair, candidate.levels, share));
    return [ends.map(([low]) => low), ends.map(([, high]) => high)];
  };
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
  for (let pixel = 0; pixel < candidate.width * candidate.height; pixel += 1) {
    for (const number of canvasNumbers(candidate, pixel, delivery, own)) {
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

/** The numbers on the canvas that a pixel comes from, as nearly as it tells them. */
function canvasNumbers(candidate, pixel, delivery, own) {
  const { alpha, encoding } = delivery;
  let colors = [0, 1, 2].map((channel) => unitOf(candidate, pixel, channel));
  if (alpha === "ignored") return colors.map((color) => decode(color, encoding));
  const share = unitOf(candidate, pixel, 3);
  const change = (from, to) => {
    if (from === to) return;
    if (to === "premultiplied") colors = colors.map((color) => color * share);
    else colors = colors.map((color) => (share > 0 ? color / share : 0));
  };
  const between = encodedKind(delivery, own);
  change(alpha, between);
  colors = colors.map((color) => decode(color, encoding));
  change(between, own);
  return [...colors, share];
}

/** Which alphas of the canvas the candidate's may come from. */
function alphaRange(lo, hi, alpha, levels, exact) {
  if (exact) return [alpha, alpha];
  const slack = levels === null ? alpha * ROUNDING : 1 / levels;
  const [least, most] = [Math.max(alpha - slack, 0), alpha + slack];
  // An alpha that no canvas within the intervals has is found by its own channel.
  return least <= hi && most >= lo ? [Math.max(least, lo), Math.min(most, hi)] : [least, most];
}

/** A colour's ends of one kind of alpha as the other; straight ones held to 1 or not: tools do either. */
function asKind([lo, hi], [least, most], kind, wanted) {
  if (kind === wanted) return [lo, hi];
  if (wanted === "premultiplied") {
    return [Math.min(lo * least, lo * most), Math.max(hi * least, hi * most)];
  }
  if (least <= 0) return [0, FREE];
  return [Math.min(lo / least, lo / most, 1), Math.max(hi / least, hi / most)];
}

/** A colour's ends encoded, held to 1 before or not: tools do either. */
function encoded([lo, hi], encoding) {
  return encoding === "none" ? [lo, hi] : [encode(Math.min(lo, 1), encoding), encode(hi, encoding)];
}

/** Ends in the candidate's numbers, outward by as much as storing them may round. */
function stored([lo, hi], levels, share) {
  if (levels === null) return [lo - share * Math.abs(lo), hi + share * Math.abs(hi)];
  const slack = levels * OWN_ROUNDING;
  const [low, high] = [lo, hi].map((end) => Math.min(Math.max(end, 0), 1) * levels);
  return [Math.floor(low + slack), Math.ceil(high - slack)];
}

function oneOf(name, word, words) {
  if (!words.includes(word))
    refuse(`${name} must be one of ${words.join(", ")}`, `'${word}'`, "use one of these");
  return word;
}
