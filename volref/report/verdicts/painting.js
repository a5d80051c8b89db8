// Pictures of numbers, as volref/report/verdicts/views.py makes them, for any channel and scale.

const PALETTE = JSON.parse(document.getElementById("palette").textContent);
const CHECK = 8;

/** Colour of a fraction 0..1 on a scale of colours at equal distances. */
function between(colors, fraction) {
  const place = Math.min(Math.max(fraction, 0), 1) * (colors.length - 1);
  const k = Math.min(Math.floor(place), colors.length - 2), part = place - k;
  return colors[k].map((from, c) => from + (colors[k + 1][c] - from) * part);
}

const gradient = (colors) => `linear-gradient(to right, ${colors.map((c) => `rgb(${c.join(" ")})`).join(", ")})`;

const channelsOf = (settings) => (settings.channel === "all" ? [0, 1, 2, 3] : [Number(settings.channel)]);

function backdropAt(numbers, i, backdrop) {
  if (backdrop === "black") return 0;
  if (backdrop === "white") return 255;
  const x = i % numbers.width, y = Math.floor(i / numbers.width);
  return (Math.floor(x / CHECK) + Math.floor(y / CHECK)) % 2 ? 190 : 120;
}

function imageColor(numbers, name, i, settings) {
  const field = numbers.fields[name], level = (c) => levelOf(numbers, field[c * numbers.count + i]) || 0;
  if (settings.channel !== "all") return Array(3).fill(level(Number(settings.channel)));
  if (settings.backdrop === "black") return [level(0), level(1), level(2)];
  const behind = (1 - level(3) / 255) * backdropAt(numbers, i, settings.backdrop);
  return [0, 1, 2].map((c) => level(c) + behind);
}

/** The largest difference of the channels that are looked at, with its sign, in 1/255. */
function differenceAt(numbers, i, settings) {
  let largest = 0;
  for (const c of channelsOf(settings)) {
    const at = c * numbers.count + i;
    const apart = levelOf(numbers, numbers.fields.candidate[at]) - levelOf(numbers, numbers.fields[settings.against][at]);
    const seen = Number.isFinite(apart) ? apart : apart < 0 ? -255 : apart > 0 || Number.isNaN(apart) ? 255 : 0;
    if (Math.abs(seen) > Math.abs(largest)) largest = seen;
  }
  return largest;
}

function differenceColor(numbers, i, settings) {
  const part = differenceAt(numbers, i, settings) / Number(settings.scale);
  if (settings.sign === "absolute") return between(PALETTE.viridis, Math.abs(part));
  return between(PALETTE.signed, (part + 1) / 2);
}

function intervalColor(numbers, i, settings) {
  let below = false, above = false, furthest = 0;
  const outside = numbers.marks[i] & OUTSIDE;
  for (const c of outside ? channelsOf(settings) : []) {
    const excess = excessAt(numbers, c * numbers.count + i);
    below ||= !(excess >= 0);
    above ||= !(excess <= 0);
    furthest = Math.max(furthest, Number.isNaN(excess) ? Infinity : Math.abs(excess));
  }
  // Rounding on the way may put outside what is inside on the canvas.
  if (outside && settings.channel === "all" && !below && !above) below = above = true;
  const part = Math.log1p(Math.min(furthest, PALETTE.fullExcess)) / Math.log1p(PALETTE.fullExcess);
  const shade = PALETTE.leastShade + (1 - PALETTE.leastShade) * part;
  const color = below && above ? PALETTE.both : below ? PALETTE.below : PALETTE.above;
  if (below || above) return color.map((level) => Math.round(shade * level));
  const levels = [0, 1, 2].map((c) => levelOf(numbers, numbers.fields.candidate[c * numbers.count + i]) || 0);
  const grey = levels.reduce((sum, level) => sum + Math.min(Math.max(level, 0), 255), 0) / 3;
  return Array(3).fill(grey * PALETTE.insideShare);
}

/** Four decades up to `top` levels, as error_map has them. */
function widthColor(numbers, i, settings) {
  const width = widthAt(numbers, i);
  return width ? between(PALETTE.viridis, 1 + Math.log10(width / settings.top) / 4) : PALETTE.neutral;
}

function ambiguousColor(numbers, i) {
  const mark = numbers.marks[i];
  return mark & AMBIGUOUS ? PALETTE.ambiguous : mark & DRAWN ? PALETTE.plain : PALETTE.nothing;
}

const COLORS = {
  difference: differenceColor,
  interval: intervalColor,
  width: widthColor,
  ambiguous: ambiguousColor,
};

/** Paint a view, or an image by its name, on a canvas. */
function paint(canvas, numbers, view, settings) {
  canvas.width = numbers.width;
  canvas.height = numbers.height;
  const image = new ImageData(numbers.width, numbers.height);
  const color = COLORS[view] ?? ((_, i) => imageColor(numbers, view, i, settings));
  for (let i = 0; i < numbers.count; i++) image.data.set([...color(numbers, i, settings), 255], 4 * i);
  canvas.getContext("2d").putImageData(image, 0, 0);
}

/** Paint the candidate left of a border, a share of the width, and the other image right of it. */
function paintWipe(canvas, numbers, share, settings) {
  paint(canvas, numbers, settings.against, settings);
  const left = document.createElement("canvas");
  paint(left, numbers, "candidate", settings);
  const columns = Math.round(share * numbers.width);
  if (columns) canvas.getContext("2d").drawImage(left, 0, 0, columns, numbers.height, 0, 0, columns, numbers.height);
  return columns / numbers.width;
}
