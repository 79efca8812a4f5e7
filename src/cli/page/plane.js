// Boards to draw on, and axes in the plane.

/** All boards of the page. */
const BOARDS = [];

/** A figure of the stage: a canvas as sharp as the screen, under a legend. */
class Board {
  constructor(kind, label) {
    this.figure = document.createElement("figure");
    this.figure.className = `board ${kind}`;
    this.legend = document.createElement("figcaption");
    this.entries = [];
    BOARDS.push(this);
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", label);
    this.figure.append(this.legend, this.canvas);
    document.getElementById("stage").append(this.figure);
    this.g = this.canvas.getContext("2d", { willReadFrequently: true });
  }

  /** Takes on its size on the screen and begins anew: the width and the height in pixels of the page. */
  begin() {
    const { clientWidth: w, clientHeight: h } = this.canvas, sharp = window.devicePixelRatio || 1;
    const [wide, high] = [Math.round(w * sharp), Math.round(h * sharp)];
    if (this.canvas.width !== wide || this.canvas.height !== high) {
      this.canvas.width = wide;
      this.canvas.height = high;
    }
    this.g.setTransform(sharp, 0, 0, sharp, 0, 0);
    this.g.clearRect(0, 0, w, h);
    this.g.font = '12px system-ui, "DejaVu Sans", sans-serif';
    this.g.lineJoin = this.g.lineCap = "round";
    return [w, h];
  }

  /** Adds an entry to the legend: a line of this style, or a mark with these corners. */
  key(name, { colour, dash = [], width = 2, corners = null }) {
    const entry = document.createElement("span");
    entry.className = "key";
    const mark = corners
      ? `<polygon points="${corners.map(([x, y]) => [13 + 0.8 * x, 6 + 0.8 * y]).join(" ")}" fill="${colour}"/>`
      : `<path d="M1 6H25" stroke="${colour}" stroke-width="${width}" stroke-dasharray="${dash.join(" ")}"/>`;
    entry.innerHTML = `<svg width="26" height="12" aria-hidden="true">${mark}</svg>`;
    entry.append(name);
    this.legend.append(entry);
    this.entries.push({ name, colour });
  }
}

/** Round values between two, some `count` of them and at least two, and their text. */
function ticks([low, high], count) {
  const rough = (high - low) / Math.max(count, 1);
  if (!(rough > 0 && rough < Infinity)) return [];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((k) => k * power >= rough * 0.999);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const largest = Math.max(Math.abs(low), Math.abs(high));
  const text = (x) => {
    if (x === 0) return "0";
    const plain = largest < 1e5 && digits <= 4;
    return (plain ? x.toFixed(digits) : x.toExponential(Math.max(0, Math.ceil(Math.log10(largest / step))))).replace("-", "−");
  };
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push([k * step, text(k * step)]);
  // A single one tells no scale.
  return found.length > 1 ? found : ticks([low, high], 2 * Math.max(count, 1));
}

/** What is subtracted from the ticks of a range that is small beside its values, and the words that say so. */
function base([low, high]) {
  if (high - low > 1e-4 * Math.max(Math.abs(low), Math.abs(high))) return [0, ""];
  const digits = 1 - Math.floor(Math.log10(high - low)), text = ((low + high) / 2).toFixed(Math.min(15, digits));
  return [Number(text), `, less ${text.replace("-", "−")}`];
}

/** A little more than a range, so that nothing lies on its border. */
function wider([low, high], part = 0.05) {
  const by = high > low ? part * (high - low) : 0.5 * Math.abs(low) || 0.5;
  return [low - by, high + by];
}

/** Axes on a board. */
class Axes {
  constructor(board, { x, y, xLabel, yLabel, equal = false }) {
    Object.assign(this, { board, x, y, xLabel, yLabel, equal });
  }

  /** Draws the frame; afterwards `px` and `py` tell where a point is. */
  begin() {
    const [w, h] = this.board.begin(), g = this.g = this.board.g;
    let [left, top, wide, high] = [64, 10, w - 64 - 14, h - 10 - 42];
    let [x, y] = [this.x, this.y];
    if (this.equal) {
      const scale = Math.min(wide / (x[1] - x[0]), high / (y[1] - y[0]));
      const grown = ([a, b], pixels) => [(a + b) / 2 - pixels / scale / 2, (a + b) / 2 + pixels / scale / 2];
      [x, y] = [grown(x, wide), grown(y, high)];
    }
    this.px = (v) => left + ((v - x[0]) / (x[1] - x[0])) * wide;
    this.py = (v) => top + high - ((v - y[0]) / (y[1] - y[0])) * high;
    this.box = [left, top, wide, high];
    g.lineWidth = 1;
    g.fillStyle = INK;
    g.textAlign = "center";
    g.textBaseline = "top";
    const [[x0, xLess], [y0, yLess]] = [base(x), base(y)];
    for (const [v, text] of ticks(x.map((v) => v - x0), wide / 75)) {
      this.rule(this.px(v + x0), top, this.px(v + x0), top + high);
      g.fillText(text, Math.min(this.px(v + x0), w - 3 - g.measureText(text).width / 2), top + high + 6);
    }
    g.textAlign = "right";
    g.textBaseline = "middle";
    for (const [v, text] of ticks(y.map((v) => v - y0), high / 45)) {
      this.rule(left, this.py(v + y0), left + wide, this.py(v + y0));
      g.fillText(text, left - 6, this.py(v + y0));
    }
    g.strokeStyle = FAINT;
    g.strokeRect(left, top, wide, high);
    g.textAlign = "center";
    g.textBaseline = "bottom";
    g.fillText(this.xLabel + xLess, left + wide / 2, h - 3);
    g.save();
    g.translate(4, top + high / 2);
    g.rotate(-Math.PI / 2);
    g.textBaseline = "top";
    g.fillText(this.yLabel + yLess, 0, 0);
    g.restore();
    g.save();
    g.beginPath();
    g.rect(left, top, wide, high);
    g.clip();
    return g;
  }

  /** Lets go of the frame, within which all was drawn. */
  end() {
    this.g.restore();
  }

  rule(x0, y0, x1, y1) {
    const g = this.g;
    g.strokeStyle = RULE;
    g.beginPath();
    g.moveTo(x0, y0);
    g.lineTo(x1, y1);
    g.stroke();
  }

  /**
   * A line through points from `from` to before `to`. The line breaks where there is no point; a point that is not
   * `joined` to the one before it is a dot.
   */
  line(xs, ys, { colour, width = 1.5, dash = [], alpha = 1 }, from = 0, to = xs.length, joined = () => true) {
    const g = this.g;
    g.strokeStyle = colour;
    g.lineWidth = width;
    g.globalAlpha = alpha;
    g.setLineDash(dash);
    g.beginPath();
    let on = false;
    for (let i = from; i < to; i++) {
      const known = xs[i] === xs[i] && ys[i] === ys[i];
      const [x, y] = [this.px(xs[i]), this.py(ys[i])];
      // Round ends make a dot of a line that goes nowhere.
      if (known && on && joined(i)) g.lineTo(x, y);
      else if (known) g.moveTo(x, y), on && g.lineTo(x, y);
      on = known;
    }
    g.stroke();
    g.setLineDash([]);
    g.globalAlpha = 1;
  }

  /** A dot with a light rim. */
  dot(x, y, colour, radius = 4.5) {
    dot(this.g, this.px(x), this.py(y), colour, radius);
  }
}

function dot(g, x, y, colour, radius) {
  g.beginPath();
  g.arc(x, y, radius, 0, 2 * Math.PI);
  g.fillStyle = colour;
  g.fill();
  g.strokeStyle = PAGE;
  g.lineWidth = 1.2;
  g.stroke();
}

/** The keys in words. */
function keys(list) {
  const words = document.createElement("p");
  words.className = "keys";
  words.innerHTML = "Keys: " + list.map(([key, what]) => `${key.split(" ").map((k) => `<kbd>${k}</kbd>`).join(" ")} ${what}`).join("; ") + ".";
  document.getElementById("stage").append(words);
}

/** All boards as one picture, twice as fine as the page, under a line of words, with the names of their curves. */
function pictureOf(words) {
  const boxes = BOARDS.map((board) => board.canvas.getBoundingClientRect()), room = 34, fine = 2;
  const [left, top] = [Math.min(...boxes.map((b) => b.left)), Math.min(...boxes.map((b) => b.top))];
  const [right, low] = [Math.max(...boxes.map((b) => b.right)), Math.max(...boxes.map((b) => b.bottom))];
  const sheet = document.createElement("canvas"), g = sheet.getContext("2d");
  [sheet.width, sheet.height] = [fine * (right - left + 20), fine * (low - top + room + 28)];
  g.scale(fine, fine);
  g.fillStyle = PAGE;
  g.fillRect(0, 0, sheet.width, sheet.height);
  g.font = '13px system-ui, "DejaVu Sans", sans-serif';
  g.fillStyle = INK;
  g.fillText(`${document.title} · ${words}`, 10, 16);
  BOARDS.forEach((board, k) => {
    const [x, y] = [boxes[k].left - left + 10, boxes[k].top - top + room];
    g.drawImage(board.canvas, x, y, boxes[k].width, boxes[k].height);
    let at = x + 4;
    for (const { name, colour } of board.entries) {
      const wide = g.measureText(name).width + 28;
      if (at + wide > x + boxes[k].width) break;
      g.fillStyle = colour;
      g.fillRect(at, y - 9, 14, 4);
      g.fillStyle = INK;
      g.fillText(name, at + 18, y - 3);
      at += wide;
    }
  });
  return sheet;
}

/** Buttons of every page: the picture as a file, and the address of what is shown. */
function keepingButtons(bar, words, number) {
  const button = (text, title, act) => {
    const one = document.createElement("button");
    Object.assign(one, { type: "button", textContent: text, title });
    one.addEventListener("click", act);
    bar.insertBefore(one, bar.querySelector(".status"));
    return one;
  };
  button("save picture", "save what is shown as a PNG file", () => {
    const link = document.createElement("a");
    link.download = `${document.title.split(" ")[0]}-${number()}.png`;
    link.href = pictureOf(words()).toDataURL("image/png");
    link.click();
  });
  const copy = button("link", "copy the address that opens what is shown", () => {
    follow(number());
    const told = (text) => {
      copy.textContent = text;
      setTimeout(() => (copy.textContent = "link"), 2000);
    };
    // A page from a disk may not copy; its address bar has the link.
    const copied = navigator.clipboard?.writeText(location.href) ?? Promise.reject();
    copied.then(() => told("copied"), () => told("see the address"));
  });
}

/** The address follows what is shown. */
function follow(number) {
  try { history.replaceState(null, "", `#${number}`); } catch { location.hash = number; }
}
