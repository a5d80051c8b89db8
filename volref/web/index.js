// volref in a browser: capture a frame right, and judge it against a golden bundle.

export { loadBundle } from "./volref-bundle.js";
export { captureCanvas, captureTarget } from "./volref-capture.js";
export { readNpy, writeNpy } from "./volref-npy.js";
export { writePng } from "./volref-png.js";
export { saveMetadata, saveNpy, savePng } from "./volref-save.js";
export { check, pageWarning } from "./volref-verdict.js";
export { captureWebGPU } from "./volref-webgpu.js";
