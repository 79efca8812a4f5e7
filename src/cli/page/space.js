// Space: a camera that is turned, and a painter that draws what is far before what is near.

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
    canvas.addEventListener("pointerdown", (e) => canvas.setPointerCapture(e.pointerId));
    canvas.addEventListener("pointermove", (e) => {
      if (canvas.hasPointerCapture(e.pointerId)) this.turn(-0.5 * e.movementX, 0.5 * e.movementY);
    });
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
    this.g = this.board.g;
  }

  place(p) {
    const d = p.map((x, i) => (x - this.centre[i]) * this.scale[i]);
    return [this.middle[0] + this.size * along(d, this.right), this.middle[1] - this.size * along(d, this.up), along(d, this.sight)];
  }

  /** A face, darker where it is seen from the side; the colour of its front and of its back. */
  face(points, front, back = front, { alpha = 1, rim = 0.25 } = {}) {
    const at = points.map((p) => this.place(p));
    const normal = unit(cross(...[1, 2].map((k) => points[k].map((x, i) => (x - points[0][i]) * this.scale[i]))));
    const facing = along(normal, this.sight);
    this.things.push({
      depth: at.reduce((sum, p) => sum + p[2], 0) / at.length,
      at,
      colour: shaded(facing >= 0 ? front : back, 0.45 + 0.55 * Math.abs(facing)),
      alpha,
      rim,
    });
  }

  /** A line through points, in pieces that are hidden one by one; `lift` draws it before faces that it lies on. */
  line(points, { colour, width = 1.5, alpha = 1, dash = [] }, lift = 0) {
    const at = points.map((p) => this.place(p));
    // Dashes go on from piece to piece.
    let run = 0;
    for (let i = 1; i < at.length; i++) {
      const [a, b] = [at[i - 1], at[i]];
      if (a[0] + b[0] !== a[0] + b[0]) continue;
      this.things.push({ depth: (a[2] + b[2]) / 2 + lift * this.radius, at: [a, b], colour, width, alpha, dash, run, line: true });
      run += Math.hypot(b[0] - a[0], b[1] - a[1]);
    }
  }

  /** A rod as a strip along its director d1, whose sides are told apart; with directors if they are wanted. */
  strip(points, across, half, directors) {
    [points, across] = [rounded(points), rounded(across)];
    const side = (j, w) => plus(points[j], w * half, across[j]);
    for (let k = 1; k < points.length; k++) {
      this.face([side(k - 1, 1), side(k, 1), side(k, -1), side(k - 1, -1)], "#3d9be0", "#f0b264", { rim: 0.5 });
    }
    this.line(points, { colour: "#0d3b5e", width: 1.2 }, 0.004);
    if (!directors) return;
    for (let k = 0; k < points.length; k += 5) {
      const tangent = unit(plus(points[Math.min(k + 1, points.length - 1)], -1, points[Math.max(k - 1, 0)]));
      const frame = [across[k], cross(tangent, across[k]), tangent];
      [ORANGE, GREEN, BLUE].forEach((colour, j) => this.line([points[k], plus(points[k], 4 * half, frame[j])], { colour, width: 2 }, 0.01));
    }
  }

  dot(p, colour, radius, lift = 0) {
    const at = this.place(p);
    this.things.push({ depth: at[2] + lift * this.radius, at: [at], colour, radius });
  }

  /** Draws everything, from far to near. */
  paint() {
    const g = this.g;
    this.things.sort((a, b) => a.depth - b.depth);
    for (const one of this.things) {
      if (one.radius) {
        dot(g, one.at[0][0], one.at[0][1], one.colour, one.radius);
        continue;
      }
      g.globalAlpha = one.alpha;
      g.beginPath();
      one.at.forEach(([x, y], i) => (i ? g.lineTo(x, y) : g.moveTo(x, y)));
      if (one.line) {
        g.setLineDash(one.dash);
        g.lineDashOffset = one.run;
        g.lineWidth = one.width;
        g.strokeStyle = one.colour;
        g.stroke();
        g.setLineDash([]);
        g.lineDashOffset = 0;
      } else {
        g.closePath();
        g.fillStyle = one.colour;
        g.fill();
        // The rim hides the seam between neighbours.
        g.lineWidth = one.rim * 2;
        g.strokeStyle = one.colour;
        g.stroke();
      }
    }
    g.globalAlpha = 1;
    this.things = [];
  }

  /** The edges of the box that lie behind, and ticks along three of its outer edges. */
  box() {
    const g = this.g, corner = (k) => [0, 1, 2].map((i) => ((k >> i) & 1 ? this.high[i] : this.low[i]));
    const at = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => this.place(corner(k)));
    const near = at.reduce((best, p, k) => (p[2] > at[best][2] ? k : best), 0);
    g.lineWidth = 1;
    g.strokeStyle = "#c4c4c4";
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
      g.fillText(text, x + 9 * away[0], y + 10 * away[1]);
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

  /** The label of an axis, within the board. */
  label(axis, x, y) {
    const text = this.labels[axis], wide = this.g.measureText(text).width;
    const left = x - { left: 0, center: 0.5, right: 1 }[this.g.textAlign] * wide, right = this.board.canvas.clientWidth - wide - 2;
    this.g.textAlign = "left";
    this.g.fillText(text, Math.max(2, Math.min(left, right)), y);
  }
}

/** Three numbers at a time of a list, from the first on. */
function threes(list, from, count) {
  return Array.from({ length: count }, (_, k) => Array.from(list.subarray(3 * (from + k), 3 * (from + k) + 3)));
}

/** A curve of few sections drawn round: between two of them a point of the cubic through four. */
function rounded(points) {
  if (points.length > 24 || points.length < 4) return points;
  const last = points.length - 1, at = (k) => points[k];
  const beyond = (a, b, c) => a.map((x, i) => 3 * x - 3 * b[i] + c[i]);
  const all = [beyond(at(0), at(1), at(2)), ...points, beyond(at(last), at(last - 1), at(last - 2))];
  return points.flatMap((p, k) => (k === last ? [p] : [p, p.map((_, i) => (9 * (all[k + 1][i] + all[k + 2][i]) - all[k][i] - all[k + 3][i]) / 16)]));
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

/** "#rrggbb" with so much of its light. */
function shaded(colour, light) {
  const part = (k) => Math.round(parseInt(colour.slice(k, k + 2), 16) * light);
  return `rgb(${part(1)},${part(3)},${part(5)})`;
}
