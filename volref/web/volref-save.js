// Captures as files: exact numbers (.npy), bytes for people (.png), and what they depend on (.json).

import { writeNpy } from "./volref-npy.js";
import { writePng } from "./volref-png.js";
import { refuse } from "./volref-refusal.js";

/**
 * @typedef {object} SaveOptions
 * @property {string} [url]  where files are sent by POST, with their names; none: the page downloads them
 */

/**
 * Save the numbers of a capture as NAME.npy, (height, width, 4), bytes or float32, row 0 at the top.
 *
 * @param {import("./volref-capture.js").Capture} capture
 * @param {string} name  of the file, without suffix
 * @param {SaveOptions} [options]
 */
export async function saveNpy({ width, height, data }, name, options) {
  const bytes = writeNpy({
    shape: [height, width, 4],
    data: data instanceof Uint8ClampedArray ? new Uint8Array(data) : data,
  });
  await saveBytes(bytes, `${name}.npy`, "application/octet-stream", options);
}

/** Save the bytes of a capture as NAME.png, nothing converted; of floats see saveNpy. */
export async function savePng(capture, name, options) {
  await saveBytes(await writePng(capture), `${name}.png`, "image/png", options);
}

/** Save what a capture depends on as NAME.json. */
export async function saveMetadata({ metadata }, name, options) {
  await saveBytes(
    new TextEncoder().encode(`${JSON.stringify(metadata, null, 2)}\n`),
    `${name}.json`,
    "application/json",
    options,
  );
}

async function saveBytes(bytes, name, type, { url } = {}) {
  const blob = new Blob([bytes], { type });
  if (url === undefined) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000); // the browser reads it after this task
    return;
  }
  const address = `${url.replace(/\/$/, "")}/${encodeURIComponent(name)}`;
  const answer = await fetch(address, { method: "POST", body: blob }).catch((error) => ({
    ok: false,
    status: error.message,
  }));
  if (!answer.ok) refuse(`${address} must take the file`, answer.status, "start what receives it");
}
