// A frame as WebGL left it: numbers as they are, row 0 at the top, and beside them what they depend on.
//
// readPixels gives what the program wrote: neither scaled by the page, nor converted to the screen's colour
// space, nor taken apart by alpha, as screenshots and canvas.toBlob are.

import { checkDrawn, checkSize, drawnBy, pageOf } from "./volref-page.js";
import { refuse } from "./volref-refusal.js";

/**
 * @typedef {object} Capture
 * @property {number} width
 * @property {number} height
 * @property {Uint8Array|Float32Array} data  RGBA, row 0 at the top; bytes are codes of 0..1
 * @property {"premultiplied"|"straight"|"opaque"|null} alpha
 *   as what the page takes the canvas; null: unknown, as of a framebuffer whose alpha was not said
 * @property {Metadata} metadata
 */

/**
 * @typedef {object} Metadata  what the capture depends on, for a JSON file beside it
 * @property {"volref capture"} kind
 * @property {string} source               "webgl2 canvas", "webgl framebuffer", "webgpu texture" ...
 * @property {number} width
 * @property {number} height
 * @property {"top"} row_0
 * @property {string|null} alpha
 * @property {string} number_format        "unorm8", "half" or "float"
 * @property {"none"|"srgb"} target_encoding  "srgb": the target encodes what shaders write
 * @property {string|null} color_space     in which the page shows the canvas
 * @property {string} renderer             what draws, UNMASKED_RENDERER where the browser tells
 * @property {number|null} device_pixel_ratio
 * @property {number|null} css_width       of the canvas on the page
 * @property {number|null} css_height
 * @property {string} user_agent
 * @property {string} time                 ISO 8601
 * @property {string[]} notes              one sentence for whatever a reader should know
 */

/**
 * @typedef {object} CanvasOptions
 * @property {() => void} [draw]             draws the frame; called here, so that the browser cannot clear it
 * @property {number} [width]                that the canvas must have: of the scene
 * @property {number} [height]
 * @property {boolean} [allowAntialias]      note antialiasing rather than refuse it
 * @property {boolean} [allowEmpty]          an image of nothing but zeros is meant
 */

/**
 * @typedef {object} TargetOptions
 * @property {number} width                  of the attachment
 * @property {number} height
 * @property {number} [attachment]           number of the colour attachment, 0 unless said
 * @property {"premultiplied"|"straight"|null} [alpha]  what its colours are
 */

const COMPONENT_TYPE = 0x8211;
const COLOR_ENCODING = 0x8210;
const UNSIGNED_NORMALIZED = 0x8c17;
const SRGB = 0x8c40;
const SAMPLES = 0x80a9;
const RGBA16F = 0x881a;

/**
 * Return what is on the canvas of a WebGL context.
 *
 * Unless the context was made with preserveDrawingBuffer, the browser clears the canvas when the task that
 * drew on it ends: pass `draw`, or call this right after drawing, before any `await`.
 *
 * @param {WebGLRenderingContext|WebGL2RenderingContext} gl
 * @param {CanvasOptions} [options]
 * @returns {Capture}
 * @throws {Error} one sentence: of another size, antialiased, empty, or the context is lost
 */
export function captureCanvas(gl, options = {}) {
  drawnBy(options.draw);
  const notes = [];
  const attributes = attributesOf(gl);
  const { drawingBufferWidth: width, drawingBufferHeight: height, canvas } = gl;
  if (width !== canvas.width || height !== canvas.height) {
    refuse(
      `the canvas must be drawn at its own ${canvas.width} x ${canvas.height} pixels`,
      `a buffer of ${width} x ${height}`,
      "make it smaller",
    );
  }
  checkSize(width, height, options);
  if (attributes.antialias) {
    const got = "antialias: true, which blurs silhouettes by a rule of each GPU";
    if (!options.allowAntialias) {
      refuse(
        "the canvas must be drawn without antialiasing",
        got,
        "make the context with {antialias: false}",
      );
    }
    notes.push(`the canvas was drawn with ${got}`);
  }
  const floats = gl.drawingBufferFormat === RGBA16F;
  const data = reading(gl, null, undefined, notes, () => pixels(gl, width, height, floats));
  if (!options.allowEmpty) checkDrawn(data, attributes.preserveDrawingBuffer);
  const alpha = attributes.alpha ? (attributes.premultipliedAlpha ? "premultiplied" : "straight") : "opaque";
  const colorSpace = gl.drawingBufferColorSpace ?? "srgb";
  const metadata = {
    ...described(gl, "canvas", width, height, alpha, notes),
    number_format: floats ? "half" : "unorm8",
    target_encoding: "none",
    color_space: colorSpace,
    context_attributes: attributes,
  };
  return { width, height, data, alpha, metadata };
}

/**
 * Return what a colour attachment of a framebuffer holds: bytes, or floats of a half or float target.
 *
 * @param {WebGLRenderingContext|WebGL2RenderingContext} gl
 * @param {WebGLFramebuffer} framebuffer
 * @param {TargetOptions} options
 * @returns {Capture}
 * @throws {Error} one sentence: incomplete, of another size, multisampled, of integers or of more than 8 bits
 */
export function captureTarget(gl, framebuffer, options) {
  attributesOf(gl);
  const notes = [];
  const { width, height, attachment = 0, alpha = null } = options;
  const read = () => {
    const held = attached(gl, attachment);
    checkAttachment(gl, width, height, held.floats);
    return { held, data: pixels(gl, width, height, held.floats) };
  };
  const { held, data } = reading(gl, framebuffer, attachment, notes, read);
  const metadata = {
    ...described(gl, "framebuffer", width, height, alpha, notes),
    number_format: held.format,
    target_encoding: held.encoding,
    color_space: null,
  };
  return { width, height, data, alpha, metadata };
}

/** Call `read` with the framebuffer bound and nothing that shifts what readPixels gives; put all back. */
function reading(gl, framebuffer, attachment, notes, read) {
  const two = isWebGL2(gl);
  const error = gl.getError();
  if (error !== gl.NO_ERROR)
    notes.push(`the program had left GL error 0x${error.toString(16)} before the capture`);
  const target = two ? gl.READ_FRAMEBUFFER : gl.FRAMEBUFFER;
  const bound = gl.getParameter(two ? gl.READ_FRAMEBUFFER_BINDING : gl.FRAMEBUFFER_BINDING);
  const names = ["PACK_ALIGNMENT", ...(two ? ["PACK_ROW_LENGTH", "PACK_SKIP_PIXELS", "PACK_SKIP_ROWS"] : [])];
  const packing = names.map((name) => [gl[name], gl.getParameter(gl[name])]);
  const packed = two && gl.getParameter(gl.PIXEL_PACK_BUFFER_BINDING);
  gl.bindFramebuffer(target, framebuffer);
  const buffer = two && gl.getParameter(gl.READ_BUFFER);
  try {
    for (const [name] of packing) gl.pixelStorei(name, name === gl.PACK_ALIGNMENT ? 1 : 0);
    if (two) {
      gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
      gl.readBuffer(framebuffer === null ? gl.BACK : gl.COLOR_ATTACHMENT0 + attachment);
    } else if (attachment > 0) {
      refuse("attachment must be 0 in WebGL 1", attachment, "draw it to a framebuffer of its own");
    }
    return read();
  } finally {
    if (two) {
      gl.readBuffer(buffer);
      gl.bindBuffer(gl.PIXEL_PACK_BUFFER, packed);
    }
    for (const [name, value] of packing) gl.pixelStorei(name, value);
    gl.bindFramebuffer(target, bound);
  }
}

/** RGBA of the bound framebuffer, row 0 at the top; GL's row 0 is at the bottom. */
function pixels(gl, width, height, floats) {
  const below = new (floats ? Float32Array : Uint8Array)(width * height * 4);
  gl.readPixels(0, 0, width, height, gl.RGBA, floats ? gl.FLOAT : gl.UNSIGNED_BYTE, below);
  const code = gl.getError();
  if (code !== gl.NO_ERROR)
    refuse(
      "readPixels must work",
      `GL error 0x${code.toString(16)}`,
      "capture outside of transform feedback, with a context that is not lost",
    );
  const rows = new below.constructor(below.length);
  for (let y = 0; y < height; y += 1)
    rows.set(below.subarray((height - 1 - y) * width * 4, (height - y) * width * 4), y * width * 4);
  return rows;
}

/** What the bound framebuffer holds; refuses what readPixels could not give as it is. */
function attached(gl, attachment) {
  const two = isWebGL2(gl);
  const target = two ? gl.READ_FRAMEBUFFER : gl.FRAMEBUFFER;
  const status = gl.checkFramebufferStatus(target);
  if (status !== gl.FRAMEBUFFER_COMPLETE)
    refuse(
      "the framebuffer must be complete",
      `status 0x${status.toString(16)}`,
      "attach a texture with storage",
    );
  if (two && samplesOf(gl, target) > 0)
    refuse(
      "the framebuffer must have one sample a pixel",
      "a multisampled one",
      "draw to one without samples",
    );
  const typed =
    two ||
    ["WEBGL_color_buffer_float", "EXT_color_buffer_half_float"]
      .map((name) => gl.getExtension(name))
      .some(Boolean);
  const asked = (name) =>
    gl.getFramebufferAttachmentParameter(target, gl.COLOR_ATTACHMENT0 + attachment, name);
  const type = typed ? asked(COMPONENT_TYPE) : UNSIGNED_NORMALIZED;
  const bits = two ? asked(0x8212) : gl.getParameter(gl.RED_BITS); // FRAMEBUFFER_ATTACHMENT_RED_SIZE
  if (type === gl.FLOAT)
    return {
      floats: true,
      format: bits === 16 ? "half" : bits === 32 ? "float" : `float${bits}`,
      encoding: "none",
    };
  if (type !== UNSIGNED_NORMALIZED || bits > 8) {
    refuse(
      "the attachment must hold floats or 8-bit numbers in 0..1",
      `component type 0x${type.toString(16)} of ${bits} bits`,
      "draw to RGBA8 or RGBA32F",
    );
  }
  const encoding = two && asked(COLOR_ENCODING) === SRGB ? "srgb" : "none";
  return { floats: false, format: `unorm${bits}`, encoding };
}

function samplesOf(gl, target) {
  const drawn = gl.getParameter(gl.DRAW_FRAMEBUFFER_BINDING);
  // SAMPLES is asked of the framebuffer that is drawn to.
  gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, gl.getParameter(gl.READ_FRAMEBUFFER_BINDING));
  const samples = gl.getParameter(SAMPLES);
  gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, drawn);
  return samples;
}

/** Refuse a size that is not the attachment's: readPixels leaves pixels outside of it as they were. */
function checkAttachment(gl, width, height, floats) {
  const holds = (x, y) => {
    const [first, second] = [0, 1].map((before) => {
      const one = new (floats ? Float32Array : Uint8Array)(4).fill(before);
      gl.readPixels(x, y, 1, 1, gl.RGBA, floats ? gl.FLOAT : gl.UNSIGNED_BYTE, one);
      return one;
    });
    return first.every((value, i) => Object.is(value, second[i]));
  };
  const whole = Number.isInteger(width) && Number.isInteger(height) && width > 0 && height > 0;
  if (!whole || !holds(width - 1, height - 1) || holds(width, height - 1) || holds(width - 1, height)) {
    refuse(
      "width and height must be those of the attachment",
      `${width} x ${height}`,
      "give the size of its texture",
    );
  }
}

function attributesOf(gl) {
  const attributes = gl.getContextAttributes();
  if (attributes === null || gl.isContextLost()) {
    refuse("the context must be there", "one that is lost", "draw in smaller parts, or reload the page");
  }
  return attributes;
}

function described(gl, what, width, height, alpha, notes) {
  const named = gl.getExtension("WEBGL_debug_renderer_info");
  const page = pageOf(gl.canvas, what === "canvas", notes);
  return {
    kind: "volref capture",
    source: `${isWebGL2(gl) ? "webgl2" : "webgl"} ${what}`,
    width,
    height,
    row_0: "top",
    alpha,
    renderer: gl.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : gl.RENDERER),
    vendor: gl.getParameter(named ? named.UNMASKED_VENDOR_WEBGL : gl.VENDOR),
    version: gl.getParameter(gl.VERSION),
    ...page,
    notes,
  };
}

function isWebGL2(gl) {
  return typeof WebGL2RenderingContext !== "undefined" && gl instanceof WebGL2RenderingContext;
}
