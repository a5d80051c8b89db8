// A frame as WebGPU left it: rows of the copy are aligned to 256 bytes, bgra is sorted, half floats unpacked.

import { checkDrawn, checkSize, drawnBy, pageOf } from "./volref-page.js";
import { refuse } from "./volref-refusal.js";

/**
 * @typedef {object} WebGPUOptions
 * @property {() => void} [draw]       draws the frame and submits it; called here
 * @property {number} [width]          that the image must have: of the scene
 * @property {number} [height]
 * @property {"premultiplied"|"straight"|"opaque"|null} [alpha]
 *   what its colours are; for a canvas as it was configured, unless said
 * @property {string} [renderer]       what draws: GPUAdapter.info as a text
 * @property {boolean} [allowEmpty]    an image of nothing but zeros is meant
 */

// Format: bytes of a pixel, array of its numbers, whether blue comes first, its name, what encodes.
const FORMATS = {
  rgba8unorm: [4, Uint8Array, false, "unorm8", "none"],
  "rgba8unorm-srgb": [4, Uint8Array, false, "unorm8", "srgb"],
  bgra8unorm: [4, Uint8Array, true, "unorm8", "none"],
  "bgra8unorm-srgb": [4, Uint8Array, true, "unorm8", "srgb"],
  rgba16float: [8, Uint16Array, false, "half", "none"],
  rgba32float: [16, Float32Array, false, "float", "none"],
};

const ROW_ALIGNMENT = 256;
const TEXTURE_COPY_SRC = 1;
const BUFFER_MAP_READ = 1;
const BUFFER_COPY_DST = 8;

/**
 * Return what a texture, or the canvas of a context, holds.
 *
 * The texture of a canvas lives until the task ends: pass `draw`, or call this right after the submit that
 * draws, before any `await`.  Its usage must include GPUTextureUsage.COPY_SRC, which a canvas gets by
 * `context.configure({usage: GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC, ...})`.
 *
 * @param {GPUDevice} device
 * @param {GPUTexture|GPUCanvasContext} source
 * @param {WebGPUOptions} [options]
 * @returns {Promise<import("./volref-capture.js").Capture>}
 */
export async function captureWebGPU(device, source, options = {}) {
  drawnBy(options.draw);
  const canvas = "getCurrentTexture" in source ? source.canvas : null;
  const texture = canvas ? source.getCurrentTexture() : source;
  const { width, height, format } = texture;
  checkSize(width, height, options);
  checkTexture(texture);
  const [bytes, kind, blueFirst, name, encoding] = FORMATS[format];
  const stride = Math.ceil((width * bytes) / ROW_ALIGNMENT) * ROW_ALIGNMENT;
  const buffer = device.createBuffer({ size: stride * height, usage: BUFFER_COPY_DST | BUFFER_MAP_READ });
  const encoder = device.createCommandEncoder();
  encoder.copyTextureToBuffer({ texture }, { buffer, bytesPerRow: stride }, [width, height]);
  device.queue.submit([encoder.finish()]);
  const notes = [];
  const configured = canvas ? source.getConfiguration?.() : undefined;
  const page = pageOf(canvas, canvas !== null, notes);

  await buffer.mapAsync(1); // GPUMapMode.READ
  const data = unpacked(new Uint8Array(buffer.getMappedRange()), width * bytes, stride, kind, blueFirst);
  buffer.unmap();
  buffer.destroy();
  if (canvas && !options.allowEmpty) checkDrawn(data, false);
  const mode = configured?.alphaMode ?? null;
  const alpha = options.alpha !== undefined ? options.alpha : mode;
  const metadata = {
    kind: "volref capture",
    source: `webgpu ${canvas ? "canvas" : "texture"}`,
    width,
    height,
    row_0: "top",
    alpha,
    number_format: name,
    target_encoding: encoding,
    color_space: configured?.colorSpace ?? null,
    renderer: options.renderer ?? "",
    texture_format: format,
    ...page,
    notes,
  };
  return { width, height, data, alpha, metadata };
}

function checkTexture({ format, sampleCount, usage, dimension }) {
  if (!(format in FORMATS))
    refuse(
      `the texture's format must be one of ${Object.keys(FORMATS).join(", ")}`,
      format,
      "draw to rgba8unorm or rgba32float",
    );
  if (dimension !== "2d") refuse("the texture must be of dimension 2d", dimension, "capture what is drawn");
  if (sampleCount > 1)
    refuse("the texture must have one sample a pixel", sampleCount, "draw without multisampling");
  if (!(usage & TEXTURE_COPY_SRC))
    refuse(
      "the texture's usage must include GPUTextureUsage.COPY_SRC",
      "one without",
      "add it where the texture or the canvas is configured",
    );
}

/** RGBA of rows that start at multiples of `stride` bytes and hold `length`. */
function unpacked(copied, length, stride, kind, blueFirst) {
  const rows = copied.length / stride;
  const packed = new Uint8Array(length * rows);
  for (let y = 0; y < rows; y += 1) packed.set(copied.subarray(y * stride, y * stride + length), y * length);
  const data = new kind(packed.buffer);
  if (blueFirst) for (let i = 0; i < data.length; i += 4) [data[i], data[i + 2]] = [data[i + 2], data[i]];
  return kind === Uint16Array ? Float32Array.from(data, float) : data;
}

/** The number that 16 bits stand for (IEEE 754 binary16). */
function float(bits) {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = bits & 1023;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return sign * (exponent ? (1 + fraction / 1024) * 2 ** (exponent - 15) : fraction * 2 ** -24);
}
