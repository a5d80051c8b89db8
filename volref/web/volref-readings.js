// Other ways to read an image that lies outside, upside down or divided by alpha: volref/oracle/readings.py.

import { ALPHAS, DIRECT } from "./volref-delivery.js";
import { judged } from "./volref-judging.js";

// Whether rows are reversed, whether columns are, and what that makes of an image.
const TURNS = [
  [false, false, ""],
  [true, false, "upside down"],
  [false, true, "mirrored left to right"],
  [true, true, "turned by 180 degrees"],
];
const ALPHA_WORDS = {
  premultiplied: "premultiplied",
  straight: "straight, its colours divided by alpha",
  ignored: "without the canvas's alpha",
};
const ENCODING_WORDS = {
  none: "not encoded",
  srgb: "encoded as sRGB",
  "gamma2.2": "encoded with gamma 2.2",
  "srgb-target": "encoded as sRGB after its colours were multiplied by alpha",
  decoded: "decoded from sRGB",
};
const MOST_CHANGES = 2;
const REMAINDER = 1 / 20;

/** What an image seems to be of which so many pixels are `outside`; "" if no reading helps. */
export function recognised(candidate, bundle, asked, leftOut, outside) {
  let [best, least] = [null, Math.trunc(outside * REMAINDER) + 1];
  for (const reading of readings(candidate, asked)) {
    const [turned, mask] = turnedBy(candidate, leftOut, reading);
    const { count } = judged(turned, bundle, bundle, reading.delivery, mask, least);
    if (count < least) [best, least] = [reading, count];
    if (least === 0) break;
  }
  if (best === null) return "";
  const rest = least === 0 ? "every pixel lies" : `all but ${least} pixels lie`;
  const words = best.changes.join(" and ");
  return `the image seems to be ${words}: read so, ${rest} inside${option(best.delivery, asked)}`;
}

/** Readings that differ from the one asked for in one or two ways, fewer first. */
function readings(candidate, asked) {
  const alphas = candidate.channels === 4 ? ALPHAS : ["ignored"];
  const found = [];
  for (const alpha of alphas) {
    for (const encoding of Object.keys(ENCODING_WORDS)) {
      for (const swapped of [false, true]) {
        for (const [rows, columns, turn] of TURNS) {
          const words = [
            turn,
            swapped ? "BGR, not RGB" : "",
            alpha === asked.alpha ? "" : ALPHA_WORDS[alpha],
            encoding === asked.encoding ? "" : ENCODING_WORDS[encoding],
          ];
          const changes = words.filter(Boolean);
          found.push({ rows, columns, swapped, delivery: { alpha, encoding }, changes });
        }
      }
    }
  }
  return found
    .filter(({ changes }) => changes.length >= 1 && changes.length <= MOST_CHANGES)
    .sort((a, b) => a.changes.length - b.changes.length);
}

function turnedBy(candidate, leftOut, { rows, columns, swapped }) {
  const { width, height, data, channels } = candidate;
  const turned = new data.constructor(data.length);
  const mask = new Uint8Array(leftOut.length);
  for (let pixel = 0; pixel < leftOut.length; pixel += 1) {
    const [x, y] = [pixel % width, Math.floor(pixel / width)];
    const from = (rows ? height - 1 - y : y) * width + (columns ? width - 1 - x : x);
    for (let channel = 0; channel < channels; channel += 1) {
      const place = swapped && channel < 3 ? 2 - channel : channel;
      turned[channels * pixel + channel] = data[channels * from + place];
    }
    mask[pixel] = leftOut[from];
  }
  return [{ ...candidate, data: turned }, mask];
}

/** How to have an image judged by that delivery, in the words of Python's `check`. */
function option(delivery, asked) {
  const given = ["alpha", "encoding"]
    .filter((name) => delivery[name] !== asked[name] && !DIRECT.includes(delivery[name]))
    .map((name) => `${name}='${delivery[name]}'`);
  return given.length ? ` (pass ${given.join(", ")} if that is meant)` : "";
}
