// What captures of WebGL and WebGPU share: the frame is drawn, it is there, and how the page shows it.

import { refuse } from "./volref-refusal.js";

/** Call what draws the frame; what draws later draws too late. */
export function drawnBy(draw) {
  const answer = draw?.();
  if (typeof answer?.then === "function") {
    refuse("draw must have drawn when it returns", "a promise", "await what it needs first, then capture");
  }
}

/** Refuse a canvas that has not the size of the scene. */
export function checkSize(width, height, asked) {
  const wanted = [asked.width ?? width, asked.height ?? height];
  if (wanted[0] === width && wanted[1] === height) return;
  const ratio = width / wanted[0];
  const scaled = ratio !== 1 && ratio === height / wanted[1];
  const cure = scaled
    ? `that is a pixel ratio of ${ratio}, so draw with a pixel ratio of 1`
    : "set canvas.width and canvas.height";
  refuse(`the canvas must be ${wanted[0]} x ${wanted[1]} pixels`, `${width} x ${height}`, cure);
}

/** Refuse an image of nothing but zeros or opaque black: what the browser leaves of a canvas it has shown. */
export function checkDrawn(data, preserved) {
  const alpha = data[3];
  const empty =
    (alpha === 0 || alpha === 255 || alpha === 1) &&
    data.every((value, i) => value === (i % 4 === 3 ? alpha : 0));
  if (!empty) return;
  const cure = preserved
    ? "draw first, or pass {allowEmpty: true} if that is the image"
    : "capture in the task that draws: pass {draw}, or make the context with {preserveDrawingBuffer: true}" +
      ", or pass {allowEmpty: true} if that is the image";
  refuse("the canvas must hold an image", alpha === 0 ? "nothing but zeros" : "nothing but black", cure);
}

/** How the page shows the canvas, when and in which browser. */
export function pageOf(canvas, shown, notes) {
  const ratio = globalThis.devicePixelRatio ?? null;
  const box = canvas?.isConnected ? canvas.getBoundingClientRect() : null;
  if (
    shown &&
    box &&
    ratio &&
    (Math.abs(box.width * ratio - canvas.width) > 0.5 || Math.abs(box.height * ratio - canvas.height) > 0.5)
  ) {
    const size = `${box.width} x ${box.height} CSS pixels of ${ratio} device pixels`;
    notes.push(
      `the page shows the ${canvas.width} x ${canvas.height} pixels of the canvas scaled, in ${size}; ` +
        "the capture is not scaled, a screenshot would be",
    );
  }
  return {
    device_pixel_ratio: ratio,
    css_width: box ? box.width : null,
    css_height: box ? box.height : null,
    user_agent: globalThis.navigator?.userAgent ?? "",
    time: new Date().toISOString(),
  };
}
