// How far a candidate lies outside the acceptance intervals: volref/oracle/judging.py.

import { delivered } from "./volref-delivery.js";

const CHANNELS = ["red", "green", "blue", "alpha"];

/**
 * @typedef {object} Worst  the number that lies farthest outside
 * @property {number} x       row 0 is the top
 * @property {number} y
 * @property {string} channel
 * @property {number} value   what the candidate holds, and its interval, in parts of 1
 * @property {number} lo
 * @property {number} hi
 * @property {number} excess  how far outside it is; infinite where it is no number
 */

/**
 * @typedef {object} Judgement
 * @property {number} count           pixels outside in any channel
 * @property {Float64Array} excess    (height, width), the worst channel's; 0 inside
 * @property {Worst|null} worst
 */

/**
 * Hold a candidate against the intervals, as if it were delivered so.
 *
 * @param {import("./volref-delivery.js").Candidate} candidate
 * @param {import("./volref-bundle.js").Bundle} bundle
 * @param {import("./volref-bundle.js").Interval} interval
 * @param {import("./volref-delivery.js").Delivery} delivery
 * @param {Uint8Array} leftOut  (height, width)
 * @param {number} [most]       pixels outside at which to stop: the rest is of no interest
 * @returns {Judgement}
 */
export function judged(candidate, bundle, interval, delivery, leftOut, most = Infinity) {
  const { width, data, channels, levels } = candidate;
  const [writeInterval, judgedChannels] = delivered(bundle, interval, candidate, delivery);
  const [lo, hi] = [new Float64Array(4), new Float64Array(4)];
  const scale = 1 / (levels ?? 1);
  const excess = new Float64Array(leftOut.length);
  let [count, worst] = [0, null];
  for (let pixel = 0; pixel < leftOut.length && count < most; pixel += 1) {
    if (leftOut[pixel]) continue;
    writeInterval(pixel, lo, hi);
    for (let channel = 0; channel < judgedChannels; channel += 1) {
      const number = data[channels * pixel + channel];
      const beyond = beyondOf(number, lo[channel], hi[channel]) / (levels ?? 1);
      if (beyond > excess[pixel]) excess[pixel] = beyond;
      if (beyond > (worst?.excess ?? 0)) {
        const place = { x: pixel % width, y: Math.floor(pixel / width), channel: CHANNELS[channel] };
        const ends = { lo: lo[channel] * scale, hi: hi[channel] * scale };
        worst = { ...place, value: number * scale, ...ends, excess: beyond };
      }
    }
    if (excess[pixel] > 0) count += 1;
  }
  return { count, excess, worst };
}

function beyondOf(number, lo, hi) {
  if (!Number.isFinite(number)) return Infinity;
  // An alpha that is no number leaves its colours without an interval; it is found by its own channel.
  return Math.max(lo - number, number - hi, 0) || 0;
}
