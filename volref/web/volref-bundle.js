// A golden bundle from the web: what the verdict needs of it, checked before it is used.

import { readNpy } from "./volref-npy.js";
import { refuse } from "./volref-refusal.js";

/**
 * @typedef {object} Interval
 * @property {Float64Array} lo  (height, width, 4), in the canvas's own numbers
 * @property {Float64Array} hi
 */

/**
 * @typedef {object} Bundle
 * @property {object} manifest           as docs/bundle_format.md has it
 * @property {number} width
 * @property {number} height
 * @property {Float64Array} nominal      (height, width, 4), what volref's emulation draws
 * @property {Float64Array} lo           the least that a correct machine may leave, and the greatest
 * @property {Float64Array} hi
 * @property {Uint8Array} ambiguous      (height, width), 1 where the pixel hangs on a comparison
 * @property {Uint8Array} drawn          (height, width), 1 where something may be drawn
 * @property {Interval|null} lowQuality  lo and hi with linear filters of 4 bits
 * @property {boolean} verified          whether hashes were compared: only where the page is a secure context
 */

const FORMAT = "volref-golden";
const FORMAT_VERSION = 1;
const PLAIN_PATH = /^[A-Za-z0-9_-][A-Za-z0-9._-]*(\/[A-Za-z0-9_-][A-Za-z0-9._-]*)*$/;

/**
 * Return the bundle in the folder at a URL, such as "/goldens/head/".
 *
 * @param {string|URL} url
 * @param {{fetch?: typeof fetch}} [options]  `fetch`: what reads, with credentials or from a disk, say
 * @returns {Promise<Bundle>}
 * @throws {Error} one sentence: not there, of another format, damaged
 */
export async function loadBundle(url, options = {}) {
  const folder = new URL(`${url}`.replace(/\/?$/, "/"), globalThis.location?.href);
  const read = (path) => bytesOf(options.fetch ?? fetch, new URL(path, folder), path);
  const manifest = manifestOf(await read("manifest.json"));
  const { width, height } = manifest.image;
  const verified = globalThis.crypto?.subtle !== undefined;
  const array = async (key, type, channels) => {
    const path = manifest.expected[key];
    const { data, shape, type: got } = readNpy(await checked(manifest, path, read, verified), path);
    const wanted = [height, width, ...channels];
    if (got !== type || `${shape}` !== `${wanted}`) {
      refuse(
        `${path} must hold ${type} of shape ${wanted}`,
        `${got} of shape ${shape}`,
        "make the bundle again",
      );
    }
    if (data.some(Number.isNaN)) refuse(`${path} must hold numbers`, "NaN", "make the bundle again");
    return data;
  };
  const image = (key) => array(key, "<f8", [4]);
  const [nominal, lo, hi, ambiguous, drawn] = await Promise.all([
    ...["nominal", "lo", "hi"].map(image),
    ...["ambiguous", "drawn"].map((key) => array(key, "|b1", [])),
  ]);
  if (lo.some((low, i) => low > hi[i])) {
    refuse(
      `${manifest.expected.lo} must not exceed ${manifest.expected.hi}`,
      "one that does",
      "make the bundle again",
    );
  }
  const coarse = "low_quality_lo" in manifest.expected && "low_quality_hi" in manifest.expected;
  const lowQuality = coarse ? { lo: await image("low_quality_lo"), hi: await image("low_quality_hi") } : null;
  return { manifest, width, height, nominal, lo, hi, ambiguous, drawn, lowQuality, verified };
}

function manifestOf(bytes) {
  let manifest = null;
  try {
    manifest = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes));
  } catch (error) {
    refuse("manifest.json must be a JSON document", error.message, "give the URL of a bundle's folder");
  }
  if (manifest?.format !== FORMAT) {
    refuse(
      `manifest.json: format must be "${FORMAT}"`,
      JSON.stringify(manifest?.format),
      "this is no golden bundle",
    );
  }
  if (manifest.format_version !== FORMAT_VERSION) {
    const cure = "make the bundle again with the version of volref that these modules are of";
    refuse(`manifest.json: format_version must be ${FORMAT_VERSION}`, manifest.format_version, cure);
  }
  const sizes = [manifest.image?.width, manifest.image?.height];
  if (!sizes.every((size) => Number.isInteger(size) && size > 0)) {
    refuse(
      "manifest.json: image must have a width and a height",
      JSON.stringify(manifest.image),
      "make it again",
    );
  }
  return manifest;
}

/** The bytes of a listed file, of the length and with the hash that the manifest states. */
async function checked(manifest, path, read, verified) {
  const listed = manifest.files?.find((file) => file.path === path);
  if (typeof path !== "string" || !PLAIN_PATH.test(path) || !listed) {
    refuse("manifest.json: expected must name files that it lists", path, "make the bundle again");
  }
  const bytes = await read(path);
  if (bytes.length !== listed.bytes) {
    refuse(`${path} must have ${listed.bytes} bytes`, bytes.length, "the file is damaged, so fetch it again");
  }
  if (verified) {
    const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
    const hash = Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
    if (hash !== listed.sha256) {
      refuse(`${path} must have SHA-256 ${listed.sha256}`, hash, "the file is damaged, so fetch it again");
    }
  }
  return bytes;
}

async function bytesOf(fetching, url, name) {
  const failed = (error) => ({ ok: false, status: error.message });
  const answer = await fetching(url).catch(failed);
  if (!answer.ok) refuse(`${name} must be at ${url}`, answer.status, "give the URL of a bundle's folder");
  return new Uint8Array(await answer.arrayBuffer());
}
