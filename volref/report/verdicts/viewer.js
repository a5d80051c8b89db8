// One case's viewer: settings, stage, readout.

const FLICKER_MILLISECONDS = 500;
const GLASS = 11;
const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const NAMES = ["red", "green", "blue", "alpha"];

const calm = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

function shownNumber(level, parts) {
  if (!Number.isFinite(level)) return Number.isNaN(level) ? "NaN" : level < 0 ? "-inf" : "inf";
  return parts === 1 ? String(level) : String(+level.toFixed(2));
}

function excessWords(excess, parts) {
  if (Number.isNaN(excess)) return "NaN";
  if (excess === 0) return "inside";
  return `${excess < 0 ? "−" : "+"}${shownNumber(Math.abs(excess), parts)}`;
}

class Viewer {
  constructor(root, numbers) {
    this.root = root;
    this.numbers = numbers;
    this.find = (what) => root.querySelector(what);
    this.all = (what) => [...root.querySelectorAll(what)];
    this.stage = this.find(".stage");
    this.panes = this.all(".pane");
    this.pixel = root.dataset.worst.split(" ").map(Number);
    this.share = 0.5;
    this.swapped = false;
    this.timer = null;
    this.settings = { against: "nominal", top: Number(this.find('[data-view="width"]').dataset.top) };
    for (const set of this.all(".choice")) this.settings[set.dataset.setting] = set.querySelector("input:checked").value;
    this.chooseScale();
    this.listen();
    new ResizeObserver(() => this.fit()).observe(this.find(".bench"));
    this.draw();
    this.move(0, 0);
  }

  /** The shortest scale on which no difference is cut off. */
  chooseScale() {
    let largest = 0;
    for (let i = 0; i < this.numbers.count; i++)
      largest = Math.max(largest, Math.abs(differenceAt(this.numbers, i, this.settings)));
    const scale = [...PALETTE.scales].reverse().find((end) => largest <= end) ?? PALETTE.scales[0];
    this.settings.scale = String(scale);
    this.find(`[data-setting="scale"] input[value="${scale}"]`).checked = true;
  }

  listen() {
    for (const set of this.all(".choice"))
      set.addEventListener("change", (event) => this.set(set.dataset.setting, event.target.value));
    this.find(".swap").addEventListener("click", () => this.swap());
    this.find(".play").addEventListener("click", () => (this.timer ? this.stop() : this.play()));
    this.find(".border").addEventListener("input", (event) => {
      this.share = event.target.value / 100;
      this.draw();
    });
    this.find(".worst").addEventListener("click", () => this.toWorst());
    this.find(".next").addEventListener("click", () => this.toNext());
    this.stage.addEventListener("keydown", (event) => this.key(event));
    for (const canvas of this.all("canvas"))
      for (const kind of ["pointermove", "pointerdown"])
        canvas.addEventListener(kind, (event) => this.point(canvas, event));
  }

  set(name, value) {
    this.settings[name] = value;
    if (name === "against") this.chooseScale();
    if (name === "view") {
      this.stop();
      this.swapped = false;
      if (value === "flicker" && !calm()) this.play();
    }
    this.draw();
    this.tell();
  }

  swap() {
    this.swapped = !this.swapped;
    this.draw();
  }

  play() {
    this.timer = setInterval(() => this.root.isConnected && this.swap(), FLICKER_MILLISECONDS);
    this.find(".play").setAttribute("aria-pressed", "true");
  }

  stop() {
    clearInterval(this.timer);
    this.timer = null;
    this.find(".play").setAttribute("aria-pressed", "false");
  }

  draw() {
    const { view, against, channel } = this.settings, [first, second] = this.panes;
    this.root.dataset.view = view;
    for (const extra of this.all(".extra")) extra.hidden = extra.dataset.view !== view;
    second.hidden = view !== "side";
    const canvas = first.querySelector("canvas"), edge = first.querySelector(".edge");
    edge.hidden = view !== "wipe";
    const only = channel === "all" ? "" : `, ${NAMES[Number(channel)]}`;
    const title = (pane, words) => (pane.querySelector(".name").textContent = words + only);
    if (view === "side") {
      this.picture(first, "candidate", title);
      this.picture(second, against, title);
    } else if (view === "flicker") {
      this.picture(first, this.swapped ? against : "candidate", title);
    } else if (view === "wipe") {
      edge.style.left = `${100 * paintWipe(canvas, this.numbers, this.share, this.settings)}%`;
      title(first, `candidate left, ${against} right`);
    } else {
      paint(canvas, this.numbers, view, this.settings);
      title(first, { difference: `candidate less ${against}`, interval: "outside the interval" }[view] ?? view);
    }
    this.enable();
    this.ramp();
    this.fit();
    this.magnify();
  }

  picture(pane, name, title) {
    paint(pane.querySelector("canvas"), this.numbers, name, this.settings);
    title(pane, name);
  }

  /** Only what changes the view can be set. */
  enable() {
    const { view, channel } = this.settings, pictures = ["side", "flicker", "wipe"].includes(view);
    const used = {
      against: pictures || view === "difference",
      channel: !["width", "ambiguous"].includes(view),
      backdrop: pictures && channel === "all",
      sign: view === "difference",
      scale: view === "difference",
    };
    for (const set of this.all(".settings .choice")) set.hidden = !used[set.dataset.setting];
  }

  ramp() {
    const { sign, scale } = this.settings, legend = this.find('.extra[data-view="difference"]'), end = Number(scale);
    const signed = sign === "signed", words = signed ? [-end, -end / 2, 0, end / 2, end] : [0, end / 2, end];
    legend.querySelector(".ramp").style.background = gradient(signed ? PALETTE.signed : PALETTE.viridis);
    legend.querySelector(".ticks").replaceChildren(
      ...words.map((word, k) => {
        const tick = document.createElement("span");
        tick.textContent = signed && word > 0 ? `+${word}` : String(word);
        tick.style.left = `${(100 * k) / (words.length - 1)}%`;
        tick.className = k === 0 ? "first" : k === words.length - 1 ? "last" : "middle";
        return tick;
      }),
    );
    legend.querySelector(".key").textContent =
      `1/255; the channel that differs most. Gain ${+(255 / end).toPrecision(3)}.`;
  }

  /** Whole device pixels for each pixel of the image, if there is room for them. */
  fit() {
    const seen = this.panes.filter((pane) => !pane.hidden);
    for (const pane of seen) {
      const sheet = pane.querySelector(".sheet"), { width, height } = this.numbers;
      const most = Math.min(pane.clientWidth, 640, (0.62 * innerHeight * width) / height);
      const times = (most * devicePixelRatio) / width;
      const whole = times >= 1 ? Math.floor(times) : times;
      sheet.style.width = `${(whole * width) / devicePixelRatio}px`;
    }
  }

  key(event) {
    const step = STEPS[event.key], far = event.shiftKey ? 8 : 1, letter = event.key.toLowerCase();
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (step) this.move(far * step[0], far * step[1]);
    else if (letter === "w") this.toWorst();
    else if (letter === "n") this.toNext();
    else if (event.key === " ") {
      if (this.settings.view === "flicker") this.swap();
    } else return;
    event.preventDefault();
  }

  point(canvas, event) {
    const box = canvas.getBoundingClientRect(), { width, height } = this.numbers;
    const x = Math.floor(((event.clientX - box.left) / box.width) * width);
    const y = Math.floor(((event.clientY - box.top) / box.height) * height);
    this.to(x, y);
  }

  move(right, down) {
    this.to(this.pixel[0] + right, this.pixel[1] + down);
  }

  to(x, y) {
    const { width, height } = this.numbers;
    this.pixel = [Math.min(Math.max(x, 0), width - 1), Math.min(Math.max(y, 0), height - 1)];
    this.tell();
  }

  toWorst() {
    this.to(...this.root.dataset.worst.split(" ").map(Number));
  }

  toNext() {
    const { marks, count, width } = this.numbers, from = this.pixel[1] * width + this.pixel[0];
    for (let k = 1; k <= count; k++) {
      const i = (from + k) % count;
      if (marks[i] & OUTSIDE) return this.to(i % width, Math.floor(i / width));
    }
  }

  tell() {
    const { numbers } = this, [column, row] = this.pixel, i = row * numbers.width + column;
    for (const cross of this.all(".cross")) {
      cross.style.left = `${(100 * (column + 0.5)) / numbers.width}%`;
      cross.style.top = `${(100 * (row + 0.5)) / numbers.height}%`;
      cross.style.setProperty("--pixel", `${100 / numbers.width}%`);
    }
    const [x, y] = numbers.place(i), mark = numbers.marks[i];
    const words = [mark & LEFT_OUT ? "left out" : mark & OUTSIDE ? "outside" : "inside"];
    if (mark & AMBIGUOUS) words.push("ambiguous");
    words.push(`width ${+widthAt(numbers, i).toPrecision(3)}/255`);
    this.find(".place").textContent = `x ${x}, y ${y}: ${words.join(", ")}`;
    for (const line of this.all("tr[data-field]"))
      line.querySelectorAll("td").forEach((cell, c) => {
        const code = numbers.fields[line.dataset.field][c * numbers.count + i];
        cell.textContent = shownNumber(levelOf(numbers, code), numbers.parts);
      });
    this.all(".beyond td").forEach((cell, c) => this.tellExcess(cell, c, excessAt(numbers, c * numbers.count + i)));
    this.magnify();
  }

  tellExcess(cell, channel, excess) {
    const ignored = channel === 3 && this.root.dataset.alpha === "ignored";
    cell.textContent = ignored ? "not seen" : excessWords(excess, this.numbers.parts);
    cell.className = excess === 0 ? "in" : "out";
  }

  /** The pixels around, of every image in view. */
  magnify() {
    this.all(".glass").forEach((glass, k) => {
      const pane = this.panes[k], [x, y] = this.pixel, half = (GLASS - 1) / 2;
      glass.hidden = pane.hidden;
      glass.width = glass.height = GLASS;
      const brush = glass.getContext("2d");
      if (!pane.hidden) brush.drawImage(pane.querySelector("canvas"), x - half, y - half, GLASS, GLASS, 0, 0, GLASS, GLASS);
    });
  }
}
