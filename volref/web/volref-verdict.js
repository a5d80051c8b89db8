// Whether an image lies inside the acceptance intervals of a bundle: the verdict of Python's `volref.check`,
// the same numbers and the same sentence (volref/oracle/verdict.py).

import { canvasAlpha, deliveryOf } from "./volref-delivery.js";
import { judged } from "./volref-judging.js";
import { general, percent, rounded } from "./volref-numbers.js";
import { recognised } from "./volref-readings.js";
import { refuse } from "./volref-refusal.js";

/**
 * @typedef {object} Image  a capture, or an image of one's own
 * @property {number} width
 * @property {number} height
 * @property {Uint8Array|Uint8ClampedArray|Float32Array|Float64Array} data  RGBA or RGB, row 0 at the top
 * @property {string|null} [alpha]  "opaque": a canvas without alpha, which is not looked at
 */

/**
 * @typedef {object} CheckOptions
 * @property {"premultiplied"|"straight"|"ignored"} [alpha]
 *   how the image holds its colours; as on the canvas unless said, which is right for captures
 * @property {"none"|"srgb"|"gamma2.2"} [encoding]
 *   what the colours were encoded by after they were on the canvas
 * @property {ArrayLike<number>} [mask]  (height, width): pixels that are not 0 are left out
 * @property {string} [cause]            what to say of the likely cause, after the verdict
 */

/**
 * @typedef {object} Verdict
 * @property {"inside"|"inside only with low-quality filtering"|"outside"|"not comparable"} status
 * @property {boolean} passed
 * @property {string} message         the verdict in words
 * @property {number} width
 * @property {number} height
 * @property {number} judged          pixels that were looked at: all that either image draws on
 * @property {number} outside         pixels outside
 * @property {number} left_out        pixels of the mask
 * @property {number} share_ambiguous
 * @property {string} recognised      what the image seems to be, if it would be inside when read otherwise
 * @property {import("./volref-judging.js").Worst|null} worst
 * @property {Float64Array} excess    (height, width), in parts of 1; 0 inside, Infinity where it is no number
 */

const INSIDE = "inside";
const LOW_QUALITY = "inside only with low-quality filtering";
const OUTSIDE = "outside";
const NOT_COMPARABLE = "not comparable";
const FILTERS =
  "linear filters of 4 bits, which are too coarse for this but allowed, would account for all of them";

/**
 * Return whether an image lies inside the acceptance intervals of every pixel of a bundle.
 *
 * @param {Image} image
 * @param {import("./volref-bundle.js").Bundle} bundle
 * @param {CheckOptions} [options]
 * @returns {Verdict}
 * @throws {Error} one sentence: the image is of another size, or is none
 */
export function check(image, bundle, options = {}) {
  const candidate = candidateOf(image);
  checkSize(candidate, bundle);
  const leftOut = maskOf(options.mask, bundle);
  const asked = deliveryOf(candidate, bundle.manifest.pipeline, options.alpha, options.encoding);
  const found = judged(candidate, bundle, bundle, asked, leftOut);
  const status = statusOf(candidate, bundle, asked, leftOut, found);
  const hint = status === OUTSIDE ? recognised(candidate, bundle, asked, leftOut, found.count) : "";
  const hidden = leftOut.reduce((sum, one) => sum + one, 0);
  const drawn = bundle.drawn.reduce(
    (sum, one, i) => sum + ((one || found.excess[i] > 0) && !leftOut[i] ? 1 : 0),
    0,
  );
  const ambiguous = shareAmbiguous(bundle);
  const sentences = [
    head(status, found, drawn, hidden, leftOut.length, bundle.ambiguous.includes(1) ? ambiguous : null),
    status === LOW_QUALITY ? FILTERS : "",
    hint,
    status === NOT_COMPARABLE ? bundle.manifest.acceptance.advice : "",
    options.cause ?? "",
  ];
  return {
    status,
    passed: status === INSIDE || status === LOW_QUALITY,
    message: paragraph(sentences),
    width: bundle.width,
    height: bundle.height,
    judged: drawn,
    outside: found.count,
    left_out: hidden,
    share_ambiguous: ambiguous,
    recognised: hint,
    worst: found.worst,
    excess: found.excess,
  };
}

/**
 * Return what the page makes of a capture that the program did not mean; "" if it is what it seems.
 *
 * @param {import("./volref-capture.js").Capture} capture
 * @param {import("./volref-bundle.js").Bundle} bundle
 */
export function pageWarning(capture, bundle) {
  const own = canvasAlpha(bundle.manifest.pipeline);
  if (![null, undefined, "opaque", own].includes(capture.alpha)) {
    const taken = `the page takes its canvas for ${capture.alpha}`;
    return `the program writes ${own} colours, and ${taken}: what is seen differs`;
  }
  return "";
}

function candidateOf({ width, height, data, alpha }) {
  const bytes = data instanceof Uint8Array || data instanceof Uint8ClampedArray;
  const floats = data instanceof Float32Array || data instanceof Float64Array;
  const channels = data?.length / (width * height);
  if (!(bytes || floats) || ![3, 4].includes(channels)) {
    const got = `${data?.constructor?.name} of ${data?.length} numbers for ${width} x ${height} pixels`;
    refuse("candidate must be an image of 3 or 4 bytes or floats a pixel", got, "capture the canvas again");
  }
  const levels = bytes ? 255 : null;
  if (alpha !== "opaque" || channels === 3) return { width, height, data, channels, levels };
  // The browser's alpha of 1 is not the canvas's: as if the image had none.
  const colors = data.filter((_, i) => i % 4 !== 3);
  return { width, height, data: colors, channels: 3, levels };
}

/** Refuse an image of another size, with what the size tells. */
function checkSize({ width: across, height: down }, { width, height }) {
  if (across === width && down === height) return;
  const ratio = across / width;
  const plain = [ratio, 1 / ratio, 2 * ratio].some(Number.isInteger);
  let cure = "draw the scene at its own size";
  if (across === height && down === width) cure = "its axes are swapped: transpose it";
  if (down === ratio * height && plain) {
    const found = `that is a device pixel ratio of ${general(ratio)}`;
    cure = `${found}: set the canvas's width and height without it, `;
    cure += `or accept the scene at ${across} x ${down}`;
  }
  refuse(`candidate must be ${width} x ${height} pixels as the scene`, `${across} x ${down}`, cure);
}

function maskOf(mask, { width, height }) {
  if (mask === undefined) return new Uint8Array(width * height);
  if (mask.length !== width * height) {
    refuse(
      `mask must be ${width} x ${height} pixels as the image`,
      `${mask.length} numbers`,
      "draw it over the image",
    );
  }
  return Uint8Array.from(mask, (one) => (one ? 1 : 0));
}

function statusOf(candidate, bundle, asked, leftOut, found) {
  if (leftOut.every(Boolean)) return NOT_COMPARABLE;
  if (found.count === 0) return bundle.manifest.acceptance.advice ? NOT_COMPARABLE : INSIDE;
  if (bundle.lowQuality === null) return OUTSIDE;
  return judged(candidate, bundle, bundle.lowQuality, asked, leftOut).count ? OUTSIDE : LOW_QUALITY;
}

function shareAmbiguous({ ambiguous, drawn }) {
  const total = drawn.reduce((sum, one) => sum + one, 0);
  return total ? ambiguous.reduce((sum, one, i) => sum + (one && drawn[i] ? 1 : 0), 0) / total : 0;
}

/** The verdict in one sentence. */
function head(status, { count, worst }, drawn, hidden, pixels, ambiguous) {
  const parts = [counts(count, worst, drawn, hidden === pixels)];
  if (worst !== null) parts.push(worstWords(worst));
  if (ambiguous !== null) {
    parts.push(`${percent(ambiguous)} of what is drawn hangs on a comparison and may differ by a sample`);
  }
  if (hidden) parts.push(`${hidden} ${hidden === 1 ? "pixel is" : "pixels are"} left out by the mask`);
  return `${status}: ${parts.join("; ")}`;
}

function counts(count, worst, drawn, nothing) {
  if (nothing) return "the mask leaves no pixel to judge";
  if (worst !== null) return `${count} of ${drawn} drawn pixels lie outside`;
  return drawn ? `all ${drawn} drawn pixels lie inside` : "nothing is to be drawn, and nothing is";
}

function worstWords({ x, y, channel, value, lo, hi, excess }) {
  const at = `the worst is pixel (${x}, ${y}), ${channel} `;
  if (!Number.isFinite(value)) {
    return `${at}${Number.isNaN(value) ? "nan" : value > 0 ? "inf" : "-inf"}, which is no number`;
  }
  const side = value > hi ? "above" : "below";
  const interval = lo === hi ? level(lo) : `${level(lo)} to ${level(hi)}`;
  return `${at}${level(value)}, ${level(excess)} ${side} what is accepted, ${interval}`;
}

function level(value) {
  return `${general(rounded(255 * value, 3))}/255`;
}

/** Sentences one after the other; the first begins with the status, a word to search for. */
function paragraph(sentences) {
  const [first, ...others] = sentences.filter(Boolean).map((text) => text.replace(/\.+$/, ""));
  return [first, ...others.map((text) => text[0].toUpperCase() + text.slice(1))]
    .map((text) => `${text}.`)
    .join(" ");
}
