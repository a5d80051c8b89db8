// NumPy's .npy format: one array, little-endian, C order.
//
// Only numbers come in: pickled objects, big-endian numbers and Fortran order are refused.

import { refuse } from "./volref-refusal.js";

/** @typedef {Uint8Array|Int16Array|Uint16Array|Int32Array|Float32Array|Float64Array} Numbers */

/**
 * @typedef {object} NpyArray
 * @property {number[]} shape  the last axis changes fastest
 * @property {Numbers} data    as many numbers as the shape says; truth values are 0 and 1
 * @property {string} [type]   NumPy's name: "|u1", "|b1", "<i2", "<u2", "<i4", "<f4" or "<f8"
 */

const TYPES = {
  "|b1": Uint8Array,
  "|u1": Uint8Array,
  "<i2": Int16Array,
  "<u2": Uint16Array,
  "<i4": Int32Array,
  "<f4": Float32Array,
  "<f8": Float64Array,
};

const MAGIC = [0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59]; // \x93NUMPY

/**
 * Return the array in the bytes of a .npy file.
 *
 * @param {Uint8Array|ArrayBuffer} bytes
 * @param {string} [name]  of the file, for messages
 * @returns {NpyArray}
 */
export function readNpy(bytes, name = "the file") {
  const file = bytes instanceof Uint8Array ? bytes : new Uint8Array(bytes);
  const [header, start] = headerOf(file, name);
  const found = /^\{'descr': '([^']+)', 'fortran_order': (True|False), 'shape': \(([\d, ]*)\),? *\}\s*$/.exec(
    header,
  );
  if (!found)
    refuse(
      `${name} must hold plain numbers`,
      `the header ${header.trim().slice(0, 120)}`,
      "save it with numpy.save",
    );
  const [, type, fortran, axes] = found;
  if (!(type in TYPES))
    refuse(`${name} must have numbers of type ${Object.keys(TYPES).join(" ")}`, type, "convert them first");
  if (fortran === "True")
    refuse(`${name} must be in C order`, "Fortran order", "save numpy.ascontiguousarray of it");
  const shape = axes
    .split(",")
    .filter((part) => part.trim())
    .map(Number);
  const kind = TYPES[type];
  const needed = shape.reduce((product, n) => product * n, kind.BYTES_PER_ELEMENT);
  if (file.length - start !== needed) {
    refuse(
      `${name} must hold ${needed} bytes of numbers (${shape.join(" x ")} ${type})`,
      file.length - start,
      "write it again",
    );
  }
  // A copy starts at an address that suits every type, and outlives the file.
  const data = new kind(file.slice(start).buffer);
  return { shape, data, type };
}

/**
 * Return the bytes of a .npy file with an array, as numpy.save writes them.
 *
 * @param {NpyArray} array  the type follows from `data` unless `type` is "|b1"
 * @returns {Uint8Array<ArrayBuffer>}
 */
export function writeNpy({ shape, data, type }) {
  const name = type ?? Object.keys(TYPES).findLast((key) => data instanceof TYPES[key]);
  if (name === undefined || !(data instanceof TYPES[name])) {
    refuse(
      `data must be a typed array of type ${Object.keys(TYPES).join(" ")}`,
      type ?? data?.constructor?.name,
      "convert it first",
    );
  }
  const count = shape.reduce((product, n) => product * n, 1);
  if (data.length !== count)
    refuse(`data must hold ${count} numbers (${shape.join(" x ")})`, data.length, "give its shape");
  const axes = shape.length === 1 ? `${shape[0]},` : shape.join(", ");
  const text = `{'descr': '${name}', 'fortran_order': False, 'shape': (${axes}), }`;
  // Magic, version and length take 10 bytes; numbers start at a multiple of 64.
  const length = Math.ceil((10 + text.length + 1) / 64) * 64;
  const file = new Uint8Array(length + data.byteLength).fill(0x20, 0, length);
  file.set([...MAGIC, 1, 0, (length - 10) & 255, (length - 10) >> 8]);
  file.set(new TextEncoder().encode(text), 10);
  file[length - 1] = 0x0a;
  file.set(new Uint8Array(data.buffer, data.byteOffset, data.byteLength), length);
  return file;
}

/** @returns {[string, number]} the header's text, and where the numbers start */
function headerOf(file, name) {
  const version = file[6];
  if (file.length < 12 || MAGIC.some((byte, i) => file[i] !== byte) || (version !== 1 && version !== 2)) {
    refuse(
      `${name} must be a .npy file of version 1 or 2`,
      "other bytes at its start",
      "save it with numpy.save",
    );
  }
  const view = new DataView(file.buffer, file.byteOffset, file.byteLength);
  const first = version === 1 ? 10 : 12;
  const length = version === 1 ? view.getUint16(8, true) : view.getUint32(8, true);
  if (first + length > file.length)
    refuse(`${name} must hold its header of ${length} bytes`, file.length - first, "the file is cut short");
  return [new TextDecoder("latin1").decode(file.subarray(first, first + length)), first + length];
}
