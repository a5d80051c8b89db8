// PNG of RGBA bytes exactly as they are.
//
// Why not canvas.toBlob: it divides the colours of a premultiplied canvas by alpha and rounds, clips those
// above alpha, and may convert them to another colour space.  Here nothing is converted and no colour
// profile is named; whether colours are premultiplied is said beside the file.

import { refuse } from "./volref-refusal.js";

const SIGNATURE = [0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a];
const RGBA = 6;

/**
 * Return the bytes of a PNG file with 8-bit RGBA.
 *
 * @param {{width: number, height: number, data: Uint8Array|Uint8ClampedArray}} image  row 0 at the top
 * @returns {Promise<Uint8Array<ArrayBuffer>>}
 */
export async function writePng({ width, height, data }) {
  if (!(data instanceof Uint8Array || data instanceof Uint8ClampedArray)) {
    refuse("data must be RGBA bytes", data?.constructor?.name, "save floats with saveNpy");
  }
  if (data.length !== width * height * 4) {
    refuse(`data must hold ${width} x ${height} x 4 bytes`, data.length, "give the image's own size");
  }
  const head = new DataView(new ArrayBuffer(13));
  head.setUint32(0, width);
  head.setUint32(4, height);
  head.setUint8(8, 8); // bits
  head.setUint8(9, RGBA);
  const rows = new Uint8Array(height * (1 + width * 4)); // each starts with its filter: 0, none
  for (let y = 0; y < height; y += 1) {
    rows.set(data.subarray(y * width * 4, (y + 1) * width * 4), y * (1 + width * 4) + 1);
  }
  const zlib = new Blob([rows]).stream().pipeThrough(new CompressionStream("deflate"));
  const packed = new Uint8Array(await new Response(zlib).arrayBuffer());
  const parts = [
    chunk("IHDR", new Uint8Array(head.buffer)),
    chunk("IDAT", packed),
    chunk("IEND", new Uint8Array(0)),
  ];
  return new Uint8Array(await new Blob([new Uint8Array(SIGNATURE), ...parts]).arrayBuffer());
}

function chunk(name, data) {
  const bytes = new Uint8Array(12 + data.length);
  const view = new DataView(bytes.buffer);
  view.setUint32(0, data.length);
  bytes.set(new TextEncoder().encode(name), 4);
  bytes.set(data, 8);
  view.setUint32(8 + data.length, crc(bytes.subarray(4, 8 + data.length)));
  return bytes;
}

const TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let bit = 0; bit < 8; bit += 1) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c;
});

/** CRC-32 of PNG (ISO 3309). */
function crc(bytes) {
  let c = 0xffffffff;
  for (const byte of bytes) c = TABLE[(c ^ byte) & 255] ^ (c >>> 8);
  return (c ^ 0xffffffff) >>> 0;
}
