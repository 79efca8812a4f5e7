// Space: a camera that is turned, faces drawn by a depth buffer, and lines and dots hidden by the faces before them.

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const along = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const plus = (a, k, b) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]];
const unit = (a) => plus([0, 0, 0], 1 / (Math.hypot(...a) || 1), a);

/** A vector turned by the unit quaternion (x, y, z, w). */
function turned([x, y, z, w], v) {
  const t = cross([x, y, z], v), twice = [2 * t[0], 2 * t[1], 2 * t[2]];
  return plus(plus(v, w, twice), 1, cross([x, y, z], twice));
}

/** A board that shows a box of space: `low` and `high` in units of the axes, which `scale` makes lengths of a picture. */
class Space {
  constructor(board, { low, high, labels, scale = [1, 1, 1], azimuth = -60, elevation = 22 }) {
    Object.assign(this, { board, low, high, labels, scale, azimuth, elevation, zoom: 1 });
    this.centre = low.map((a, i) => (a + high[i]) / 2);
    this.radius = 0.5 * Math.hypot(...low.map((a, i) => (high[i] - a) * scale[i])) || 1;
    const canvas = board.canvas;
    canvas.classList.add("turns");
    // One finger turns the box, two pinch it.
    const fingers = new Map();
    const apart = () => {
      const [a, b] = fingers.values();
      return Math.hypot(a[0] - b[0], a[1] - b[1]);
    };
    canvas.addEventListener("pointerdown", (e) => {
      fingers.set(e.pointerId, [e.clientX, e.clientY]);
      try { canvas.setPointerCapture(e.pointerId); } catch { /* The pointer is gone. */ }
    });
    canvas.addEventListener("pointermove", (e) => {
      const was = fingers.get(e.pointerId), before = fingers.size === 2 && apart();
      if (!was) return;
      fingers.set(e.pointerId, [e.clientX, e.clientY]);
      if (fingers.size === 1) this.turn(-0.5 * (e.clientX - was[0]), 0.5 * (e.clientY - was[1]));
      if (before > 0) this.near(apart() / before);
    });
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (e) => fingers.delete(e.pointerId));
    canvas.addEventListener("wheel", (e) => {
      if (!e.ctrlKey) return;
      e.preventDefault();
      this.near(Math.exp(-0.002 * e.deltaY));
    }, { passive: false });
    this.changed = () => {};
  }

  turn(by, up) {
    this.azimuth += by;
    this.elevation = Math.min(90, Math.max(-90, this.elevation + up));
    this.soon();
  }

  near(by) {
    this.zoom = Math.min(20, Math.max(0.3, this.zoom * by));
    this.soon();
  }

  /** Draws with the next picture of the screen, however often it is turned until then. */
  soon() {
    if (this.waits) return;
    this.waits = true;
    requestAnimationFrame(() => {
      this.waits = false;
      this.changed();
    });
  }

  /** Begins a picture; `place` then tells where a point is on the screen, and how near. */
  begin() {
    const [w, h] = this.board.begin();
    const [a, e] = [this.azimuth, this.elevation].map((x) => (x * Math.PI) / 180);
    this.right = [-Math.sin(a), Math.cos(a), 0];
    this.up = [-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)];
    this.sight = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    this.size = (this.zoom * Math.min(w, h) * 0.47) / this.radius;
    this.middle = [w / 2, h / 2 - 6];
    this.things = [];
    this.faces = [];
    this.depths = null;
    this.g = this.board.g;
  }

  place(p) {
    const d = p.map((x, i) => (x - this.centre[i]) * this.scale[i]);
    return [this.middle[0] + this.size * along(d, this.right), this.middle[1] - this.size * along(d, this.up), along(d, this.sight)];
  }

  /** A face, darker where it is seen from the side; the colour of its front and of its back. */
  face(points, front, back = front, { alpha = 1 } = {}) {
    const at = points.map((p) => this.place(p));
    const normal = unit(cross(...[1, 2].map((k) => points[k].map((x, i) => (x - points[0][i]) * this.scale[i]))));
    const facing = along(normal, this.sight);
    this.faces.push({ at, colour: shaded(facing >= 0 ? front : back, 0.45 + 0.55 * Math.abs(facing)), alpha });
  }

  /** A line through points, in pieces that are hidden one by one; `lift` draws it before faces that it lies on. */
  line(points, { colour, width = 1.5, alpha = 1, dash = [] }, lift = 0) {
    const at = points.map((p) => this.place(p));
    // Dashes go on from piece to piece.
    let run = 0;
    for (let i = 1; i < at.length; i++) {
      const [a, b] = [at[i - 1], at[i]];
      if (a[0] + b[0] !== a[0] + b[0]) continue;
      const near = lift * this.radius;
      this.things.push({ depth: (a[2] + b[2]) / 2 + near, at: [a, b], near, colour, width, alpha, dash, run });
      run += Math.hypot(b[0] - a[0], b[1] - a[1]);
    }
  }

  /** A rod as a strip along its director d1, whose sides are told apart; with directors if they are wanted. */
  strip(points, across, half, directors) {
    [points, across] = [smooth(points), smooth(across)];
    const side = (j, w) => plus(points[j], w * half, across[j]);
    for (let k = 1; k < points.length; k++) {
      this.face([side(k - 1, 1), side(k, 1), side(k, -1), side(k - 1, -1)], FRONT, BACK);
    }
    this.line(points, { colour: SPINE, width: 1.2 }, 0.006);
    if (!directors) return;
    for (let k = 0; k < points.length; k += Math.ceil(points.length / 12)) {
      const tangent = unit(plus(points[Math.min(k + 1, points.length - 1)], -1, points[Math.max(k - 1, 0)]));
      const frame = [across[k], cross(tangent, across[k]), tangent];
      [ORANGE, GREEN, BLUE].forEach((colour, j) => this.line([points[k], plus(points[k], 4 * half, frame[j])], { colour, width: 2 }, 0.02));
    }
  }

  dot(p, colour, radius, lift = 0) {
    const at = this.place(p), near = lift * this.radius;
    this.things.push({ depth: at[2] + near, at: [at], near, colour, radius });
  }

  /** Draws everything: faces by their depth, then lines and dots from far to near where no face hides them. */
  paint() {
    this.fill();
    this.things.sort((a, b) => a.depth - b.depth);
    for (const one of this.things) {
      if (!one.radius) this.stroke(one);
      else if (this.sees(...one.at[0], one.near)) dot(this.g, one.at[0][0], one.at[0][1], one.colour, one.radius);
    }
    Object.assign(this.g, { globalAlpha: 1, lineCap: "round" });
    this.g.setLineDash([]);
    this.g.lineDashOffset = 0;
    this.things = [];
  }

  /** Fills the faces into a picture with a depth in every pixel: opaque ones, then translucent ones from far to near. */
  fill() {
    if (!this.faces.length) return;
    const canvas = this.board.canvas, sharp = canvas.width / canvas.clientWidth;
    // On a coarse screen four pixels make one, so that borders are smooth.
    const fine = sharp < 1.5 ? 2 : 1, scale = sharp * fine;
    const [wide, high] = [canvas.width * fine, canvas.height * fine];
    const g = (this.buffer ??= document.createElement("canvas")).getContext("2d");
    if (this.buffer.width !== wide || this.buffer.height !== high) [this.buffer.width, this.buffer.height] = [wide, high];
    const picture = g.createImageData(wide, high), depths = new Float32Array(wide * high).fill(-Infinity);
    this.depths = { wide, high, scale, depths };
    const far = (face) => face.at.reduce((sum, p) => sum + p[2], 0) / face.at.length;
    const glassy = this.faces.filter((face) => face.alpha < 1).sort((a, b) => far(a) - far(b));
    for (const face of [...this.faces.filter((face) => face.alpha === 1), ...glassy]) {
      const at = face.at.map(([x, y, z]) => [x * scale, y * scale, z]);
      for (let k = 2; k < at.length; k++) triangle(picture.data, depths, wide, high, [at[0], at[k - 1], at[k]], face);
    }
    g.putImageData(picture, 0, 0);
    this.g.drawImage(this.buffer, 0, 0, canvas.clientWidth, canvas.clientHeight);
    this.faces = [];
  }

  /** True if no opaque face lies before a point of the screen. */
  sees(x, y, depth, near) {
    if (!this.depths) return true;
    const { wide, high, scale, depths } = this.depths, [column, row] = [Math.floor(x * scale), Math.floor(y * scale)];
    if (!(column >= 0 && row >= 0 && column < wide && row < high)) return true;
    return depths[row * wide + column] <= depth + near + 1e-3 * this.radius;
  }

  /** Draws the parts of a piece of a line that no face hides. */
  stroke({ at: [a, b], near, colour, width, alpha, dash, run }) {
    const g = this.g, long = Math.hypot(b[0] - a[0], b[1] - a[1]), parts = Math.max(1, Math.min(200, Math.ceil(long / 3)));
    const between = (part) => a.map((x, i) => x + part * (b[i] - x));
    // Round ends of pieces would show as beads on a pale line.
    Object.assign(g, { globalAlpha: alpha, lineWidth: width, strokeStyle: colour, lineCap: alpha < 1 ? "butt" : "round" });
    g.setLineDash(dash);
    for (let k = 0; k < parts; ) {
      const first = k;
      while (k < parts && this.sees(...between((k + 0.5) / parts), near)) k++;
      if (k > first) {
        g.lineDashOffset = run + (first / parts) * long;
        g.beginPath();
        g.moveTo(...between(first / parts).slice(0, 2));
        g.lineTo(...between(k / parts).slice(0, 2));
        g.stroke();
      } else k++;
    }
  }

  /** The edges of the box that lie behind, and ticks along three of its outer edges. */
  box() {
    const g = this.g, corner = (k) => [0, 1, 2].map((i) => ((k >> i) & 1 ? this.high[i] : this.low[i]));
    const at = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => this.place(corner(k)));
    const near = at.reduce((best, p, k) => (p[2] > at[best][2] ? k : best), 0);
    g.lineWidth = 1;
    g.strokeStyle = EDGE;
    g.beginPath();
    for (let k = 0; k < 8; k++) {
      for (const bit of [1, 2, 4]) {
        if (k & bit || k === near || (k | bit) === near) continue;
        g.moveTo(at[k][0], at[k][1]);
        g.lineTo(at[k | bit][0], at[k | bit][1]);
      }
    }
    g.stroke();
    g.fillStyle = INK;
    // Boxes of words: no two overlap.
    this.words = [];
    for (const axis of [0, 1, 2]) this.ticks(axis, at, corner);
  }

  /** Ticks of an axis along the edge that is lowest, of the vertical axis along the one farthest to the left. */
  ticks(axis, at, corner) {
    const g = this.g, bit = 1 << axis;
    const edges = [0, 1, 2, 3, 4, 5, 6, 7].filter((k) => !(k & bit));
    const worth = (k) => (axis === 2 ? -at[k][0] - at[k | bit][0] : at[k][1] + at[k | bit][1]);
    const edge = edges.reduce((best, k) => (worth(k) > worth(best) ? k : best));
    const [from, to] = [at[edge], at[edge | bit]];
    const long = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (long < 30) return;
    // Words stand away from the middle of the picture.
    let away = [from[1] - to[1], to[0] - from[0]].map((x) => x / long);
    const out = [(from[0] + to[0]) / 2 - this.middle[0], (from[1] + to[1]) / 2 - this.middle[1]];
    if (away[0] * out[0] + away[1] * out[1] < 0) away = away.map((x) => -x);
    g.textBaseline = "middle";
    g.textAlign = away[0] < -0.35 ? "right" : away[0] > 0.35 ? "left" : "center";
    const many = ticks([this.low[axis], this.high[axis]], long / 55);
    let widest = 0;
    for (const [v, text] of many) {
      const p = corner(edge);
      p[axis] = v;
      const [x, y] = this.place(p);
      g.strokeStyle = FAINT;
      g.beginPath();
      g.moveTo(x, y);
      g.lineTo(x + 4 * away[0], y + 4 * away[1]);
      g.stroke();
      this.write(text, x + 9 * away[0], y + 10 * away[1]);
      widest = Math.max(widest, g.measureText(text).width);
    }
    if (axis === 2) {
      const top = from[1] < to[1] ? from : to;
      g.textAlign = "center";
      this.label(axis, top[0], top[1] - 12);
      return;
    }
    const far = 20 + widest * Math.abs(away[0]) + 6 * Math.abs(away[1]);
    this.label(axis, (from[0] + to[0]) / 2 + far * away[0], (from[1] + to[1]) / 2 + far * away[1]);
  }

  /** Writes words where no others stand, as the alignment of text says; true if there was room. */
  write(text, x, y) {
    const g = this.g, wide = g.measureText(text).width, left = x - { left: 0, center: 0.5, right: 1 }[g.textAlign] * wide;
    const box = [left - 3, y - 7, left + wide + 3, y + 7];
    if (this.words.some(([a, b, c, d]) => box[0] < c && a < box[2] && box[1] < d && b < box[3])) return false;
    this.words.push(box);
    g.fillText(text, x, y);
    return true;
  }

  /** The label of an axis, within the board and beside the ticks. */
  label(axis, x, y) {
    const text = this.labels[axis], wide = this.g.measureText(text).width;
    const left = x - { left: 0, center: 0.5, right: 1 }[this.g.textAlign] * wide, right = this.board.canvas.clientWidth - wide - 2;
    this.g.textAlign = "left";
    for (const down of [0, 8, -8, 16, -16, 24, 32]) if (this.write(text, Math.max(2, Math.min(left, right)), y + down)) return;
  }
}

/** Fills a triangle of the screen, each corner with its depth, where it lies before what is there. */
function triangle(pixels, depths, wide, high, [a, b, c], { colour, alpha }) {
  const area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  if (!(Math.abs(area) > 1e-9)) return;
  const [low, top] = [0, 1].map((i) => Math.max(0, Math.floor(Math.min(a[i], b[i], c[i]))));
  const right = Math.min(wide - 1, Math.ceil(Math.max(a[0], b[0], c[0]))), end = Math.min(high - 1, Math.ceil(Math.max(a[1], b[1], c[1])));
  for (let y = top; y <= end; y++) {
    for (let x = low; x <= right; x++) {
      const u = ((b[0] - x - 0.5) * (c[1] - y - 0.5) - (b[1] - y - 0.5) * (c[0] - x - 0.5)) / area;
      const v = ((c[0] - x - 0.5) * (a[1] - y - 0.5) - (c[1] - y - 0.5) * (a[0] - x - 0.5)) / area;
      const w = 1 - u - v;
      if (u < -1e-9 || v < -1e-9 || w < -1e-9) continue;
      const k = y * wide + x, depth = u * a[2] + v * b[2] + w * c[2];
      if (depth <= depths[k]) continue;
      if (alpha === 1) depths[k] = depth;
      const held = pixels[4 * k + 3] / 255, sum = alpha + held * (1 - alpha);
      for (const i of [0, 1, 2]) pixels[4 * k + i] = (alpha * colour[i] + held * (1 - alpha) * pixels[4 * k + i]) / sum;
      pixels[4 * k + 3] = 255 * sum;
    }
  }
}

/** Three numbers at a time of a list, from the first on. */
function threes(list, from, count) {
  return Array.from({ length: count }, (_, k) => Array.from(list.subarray(3 * (from + k), 3 * (from + k) + 3)));
}

/** A curve through the points with a continuous tangent: cubics between them, over the lengths of their chords. */
function smooth(points, pieces = Math.ceil(120 / points.length)) {
  const last = points.length - 1;
  if (last < 2 || pieces < 2) return points;
  const chords = points.slice(1).map((p, k) => Math.hypot(...p.map((x, i) => x - points[k][i])) || 1e-300);
  const slope = (k) => points[k].map((x, i) => (points[k + 1][i] - x) / chords[k]);
  // Of the parabola through three points; at an end it is that of the first or the last three.
  const middle = (k) => {
    const [h, l] = [chords[k - 1], chords[k]], [a, b] = [slope(k - 1), slope(k)];
    return a.map((x, i) => (l * x + h * b[i]) / (h + l));
  };
  const end = (k, next) => slope(k).map((x, i) => 2 * x - next[i]);
  const tangents = points.map((_, k) => (k === 0 ? end(0, middle(1)) : k === last ? end(last - 1, middle(last - 1)) : middle(k)));
  return points.flatMap((p, k) => {
    if (k === last) return [p];
    return Array.from({ length: pieces }, (_, j) => {
      const t = j / pieces, s = 1 - t, [m, n] = [tangents[k], tangents[k + 1]];
      return p.map((x, i) => s * s * (1 + 2 * t) * x + t * t * (3 - 2 * t) * points[k + 1][i] + chords[k] * t * s * (s * m[i] - t * n[i]));
    });
  });
}

/** A box of space that is not flatter than a part of its longest edge. */
function roomy(bounds, part = 0.2) {
  const [low, high] = [0, 1].map((side) => bounds.map((of) => wider(of, 0.04)[side]));
  const longest = Math.max(...low.map((a, k) => high[k] - a));
  low.forEach((a, k) => {
    const short = part * longest - (high[k] - a);
    if (short > 0) [low[k], high[k]] = [a - short / 2, high[k] + short / 2];
  });
  // What lies in a plane is seen from the side.
  const thin = bounds.map(([a, b]) => b - a < 0.02 * longest);
  const camera = thin[1] ? { azimuth: -80, elevation: 10 } : thin[0] ? { azimuth: -10, elevation: 10 } : { azimuth: -60, elevation: 22 };
  return { low, high, longest, camera };
}

/** Keys that turn boxes of space. */
const TURNING = [["A D W S", "rotate the view, or drag it"], ["+ −", "zoom in, out"]];
function turnByKeys(spaces) {
  document.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || e.target.tagName === "SELECT") return;
    const turns = { a: [8, 0], d: [-8, 0], w: [0, 8], s: [0, -8] }[e.key.toLowerCase()];
    if (turns) spaces.forEach((space) => space.turn(...turns));
    if (e.key === "+" || e.key === "-") spaces.forEach((space) => space.near(e.key === "+" ? 1.2 : 1 / 1.2));
  });
}

/** Buttons that zoom, for hands without keys. */
function zoomButtons(board, spaces) {
  const some = document.createElement("span");
  some.className = "zoom";
  for (const [sign, by, name] of [["−", 1 / 1.2, "zoom out"], ["+", 1.2, "zoom in"]]) {
    const button = document.createElement("button");
    Object.assign(button, { type: "button", textContent: sign, title: name });
    button.setAttribute("aria-label", name);
    button.addEventListener("click", () => spaces.forEach((space) => space.near(by)));
    some.append(button);
  }
  board.legend.append(some);
}

/** The parts of "#rrggbb" with so much of their light. */
function shaded(colour, light) {
  return [1, 3, 5].map((k) => Math.round(parseInt(colour.slice(k, k + 2), 16) * light));
}
