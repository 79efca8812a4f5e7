// The sheets: over the places of the end and over the force, the number of stable equilibria, and the rod at a node.

const COLOURS = ["#3d9be0", "#f0b264", "#39b08a", "#d98bb8", "#9a86d8", "#c9c24a", "#5fc4c9", "#c98f6a"];
const views = data.views.map((view) => ({
  ...view,
  patches: view.patches.map((patch) => ({ ...patch, at: patch.at.map(reals) })),
  folds: view.folds.map((curves) => curves.map((curve) => curve.map(reals))),
}));
const nodes = data.nodes.map((sheet) => {
  const parts = Object.entries(sheet).map(([name, value]) => [name, value.q ? reals(value) : value]);
  return Object.fromEntries(parts);
});
const folds = data.folds.map(({ x, y }) => [reals(x), reals(y)]);
const FOLDS = shade("#a3142e", "#ff7d92");
/** "S_1^-" as it is written. */
const written = (name) => name.replace(/_(\d)/, (_, d) => "₀₁₂₃"[d]).replace(/\^(.)/, (_, s) => (s === "+" ? "⁺" : "⁻"));
const shown = data.sheets.map(() => true);
// What is chosen: a sheet, and a node of it.
let chosen = { sheet: 0, node: 0 };

/** The part of a face up to this value of the first axis. */
function cut(points, most) {
  return points.flatMap((p, i) => {
    const q = points[(i + 1) % points.length], part = (most - p[0]) / (q[0] - p[0]);
    const crossing = p[0] <= most === q[0] <= most ? [] : [p.map((x, k) => x + part * (q[k] - x))];
    return p[0] <= most ? [p, ...crossing] : crossing;
  });
}

/** Sheets in a box of space. */
class SheetBox {
  constructor(board, view, labels, place, camera) {
    Object.assign(this, { view, place });
    const [low, high] = [0, 1].map((side) => view.bounds.map((of) => of[side]));
    const scale = view.bounds.map(([a, b]) => 2 / (b - a));
    this.space = new Space(board, { low, high, labels, scale, ...camera });
    this.space.changed = () => this.draw();
    let down = null;
    const canvas = board.canvas;
    canvas.addEventListener("pointerdown", (e) => (down = [e.clientX, e.clientY]));
    canvas.addEventListener("pointermove", (e) => e.buttons || this.pick(e));
    canvas.addEventListener("pointerup", (e) => down && Math.hypot(e.clientX - down[0], e.clientY - down[1]) < 4 && this.pick(e));
  }

  /** Chooses the node next to the pointer; of those at one place the one in front. */
  pick(e) {
    const box = this.space.board.canvas.getBoundingClientRect();
    let best = null, least = 24;
    nodes.forEach((sheet, k) => {
      if (!shown[k]) return;
      for (let i = 0; i < sheet.x.length; i++) {
        const [x, y, depth] = this.space.place(this.place(sheet, i));
        const far = Math.hypot(x - (e.clientX - box.left), y - (e.clientY - box.top)) - 6 * depth;
        if (far < least) [least, best] = [far, { sheet: k, node: i }];
      }
    });
    if (best && (best.sheet !== chosen.sheet || best.node !== chosen.node)) show(best);
  }

  draw() {
    const { space, view } = this;
    space.begin();
    space.box();
    view.patches.forEach(({ rows, columns, at }, k) => {
      if (!shown[k]) return;
      const node = (r, c) => at.map((of) => of[r * columns + c]);
      for (let r = 1; r < rows; r++) {
        for (let c = 1; c < columns; c++) {
          const four = [node(r - 1, c - 1), node(r - 1, c), node(r, c), node(r, c - 1)];
          if (!four.every((p) => p.every((x) => x === x))) continue;
          const face = cut(four, view.bounds[0][1]);
          if (face.length > 2) space.face(face, COLOURS[k]);
        }
      }
    });
    view.folds.forEach((curves, m) => {
      if (!shown.some((on, k) => on && data.sheets[k].mode === view.modes[m])) return;
      for (const [x, y, z] of curves) space.line(Array.from(x, (_, i) => [x[i], y[i], z[i]]), { colour: FOLDS, width: 2 }, 0.02);
    });
    space.dot(this.place(nodes[chosen.sheet], chosen.node), INK, 6, 3);
    space.paint();
  }
}

/** How many stable equilibria have their end at a place. */
class StableView {
  constructor(board) {
    this.axes = new Axes(board, { x: [-1.04, 1.04], y: [-1.04, 1.04], xLabel: "x", yLabel: "y", equal: true });
    const { points, counts } = data.map, values = bytes(counts);
    const image = (this.image = document.createElement("canvas"));
    [image.width, image.height] = [points, points];
    const g = image.getContext("2d"), pixels = g.createImageData(points, points);
    const greys = [[255, 255, 255], [242, 242, 242], [205, 221, 236], [148, 184, 216], [90, 140, 190], [40, 90, 150]];
    for (let row = 0; row < points; row++) {
      for (let column = 0; column < points; column++) {
        // Nodes next to the circle have no count of their own: the next one inside is theirs.
        const inward = (i) => Math.round((points - 1) * (0.5 + 0.96 * (i / (points - 1) - 0.5)));
        const own = values[row * points + column], k = 4 * ((points - 1 - row) * points + column);
        const count = own === 255 ? values[inward(row) * points + inward(column)] : own;
        const [r, g2, b] = count === 255 ? [255, 255, 255] : greys[Math.min(count, greys.length - 1)];
        pixels.data.set([r, g2, b, count === 255 ? 0 : 255], k);
      }
    }
    g.putImageData(pixels, 0, 0);
    this.count = (x, y) => {
      const [column, row] = [x, y].map((v) => Math.round(((v + 1) / 2) * (points - 1)));
      const count = values[row * points + column];
      return count === 255 || count === undefined ? null : count;
    };
    for (const count of [...new Set(values)].filter((c) => c !== 255).sort()) {
      board.key(`${count}`, { colour: `rgb(${greys[Math.min(count, greys.length - 1)].join(",")})`, width: 10 });
    }
    board.legend.prepend("stable equilibria with this end position: ");
    board.key("fold curves", { colour: FOLDS });
  }

  draw() {
    const axes = this.axes, g = axes.begin();
    g.imageSmoothingEnabled = false;
    g.save();
    g.beginPath();
    g.arc(axes.px(0), axes.py(0), axes.px(1) - axes.px(0), 0, 2 * Math.PI);
    g.clip();
    g.drawImage(this.image, axes.px(-1), axes.py(1), axes.px(1) - axes.px(-1), axes.py(-1) - axes.py(1));
    g.restore();
    for (const [x, y] of folds) axes.line(x, y, { colour: FOLDS, width: 1.2 });
    const sheet = nodes[chosen.sheet];
    axes.dot(sheet.x[chosen.node], sheet.y[chosen.node], INK, 6);
    axes.end();
  }
}

/** The rod of the node, its force, and its neighbours along the sheet. */
class RodView {
  constructor(board) {
    this.axes = new Axes(board, { x: [-1.04, 1.04], y: [-1.04, 1.04], xLabel: "x", yLabel: "y", equal: true });
    board.key("rod at the node", { colour: INK, width: 3 });
    board.key("neighbours on its sheet", { colour: GHOSTLY, width: 1.3 });
    board.key("force on the mass", { colour: PINK, width: 2 });
  }

  draw() {
    const axes = this.axes, { sheet: k, node } = chosen, sheet = nodes[k], n = sheet.sections;
    const g = axes.begin();
    const circle = Array.from({ length: 121 }, (_, i) => (i * Math.PI) / 60);
    axes.line(circle.map(Math.cos), circle.map(Math.sin), { colour: FAINT, width: 1 });
    const rod = (i, style) => {
      const part = (j) => sheet.shape.filter((_, m) => m >= 2 * n * i && m < 2 * n * (i + 1) && m % 2 === j);
      axes.line(part(0), part(1), style);
    };
    const row = Math.floor(node / sheet.columns);
    for (let i = row * sheet.columns; i < (row + 1) * sheet.columns; i++) if (i !== node) rod(i, { colour: GHOSTLY, width: 1, alpha: 0.35 });
    rod(node, { colour: INK, width: 3.4 });
    rod(node, { colour: COLOURS[k], width: 2.2 });
    const [x, y, a] = [sheet.x[node], sheet.y[node], sheet.alpha[node]], length = 0.25;
    const [px, py] = [axes.px(x), axes.py(y)], [tx, ty] = [axes.px(x + length * Math.cos(a)), axes.py(y + length * Math.sin(a))];
    g.strokeStyle = PINK;
    g.lineWidth = 2;
    g.beginPath();
    g.moveTo(px, py);
    g.lineTo(tx, ty);
    for (const turn of [2.6, -2.6]) {
      g.moveTo(tx, ty);
      g.lineTo(tx + 8 * Math.cos(-a + turn), ty + 8 * Math.sin(-a + turn));
    }
    g.stroke();
    axes.dot(x, y, BODY, 6);
    axes.end();
  }
}

document.getElementById("about").textContent =
  "The equilibria of the planar elastica, length 1 and bending stiffness 1: clamped at the origin along x, a force and no couple at its end. Point at a node of a sheet.";
const bar = document.createElement("div");
bar.className = "controls";
bar.innerHTML = data.sheets.map(({ name }, k) => `<label style="border-bottom:4px solid ${COLOURS[k]}"><input type="checkbox" checked> ${written(name)}</label>`).join("")
  + '<span class="steps"></span><div class="status" role="status" aria-live="off"></div>';
document.getElementById("stage").append(bar);
bar.querySelectorAll("input").forEach((box, k) => box.addEventListener("change", () => {
  shown[k] = box.checked;
  boxes.forEach((one) => one.draw());
}));
const turnLabel = "θ(1)";
const boxes = [
  new SheetBox(new Board("tall", "sheets over the places of the end"), views[0], ["x", "y", turnLabel], (s, i) => [s.x[i], s.y[i], s.theta[i]], { azimuth: -52, elevation: 20 }),
  new SheetBox(new Board("tall", "sheets over the force"), views[1], ["λ", "α", turnLabel], (s, i) => [s.lambda[i], s.alpha[i], s.theta[i]], { azimuth: -40, elevation: 24 }),
];
boxes[0].space.board.legend.append("over the places (x, y) of the end");
boxes[1].space.board.legend.append("over the size λ² and the direction α of the force");
for (const box of boxes) box.space.board.key("fold", { colour: FOLDS });
const flats = [new RodView(new Board("tall", "the rod at the node"))];
if (data.map) flats.push(new StableView(new Board("tall", "stable equilibria over the disc")));

function show(at) {
  chosen = at;
  const s = nodes[at.sheet], i = at.node, index = s.index[i];
  const count = flats[1]?.count(s.x[i], s.y[i]);
  bar.querySelector(".status").textContent = [
    written(data.sheets[at.sheet].name), `λ = ${told(s.lambda[i])}`, `κ = ${told(s.kappa[i])}`, `α = ${told(s.alpha[i])}`, `θ(1) = ${told(s.theta[i])}`,
    `end at (${told(s.x[i])}, ${told(s.y[i])})`, index === null ? "" : index ? `unstable, Morse index ${index}` : "stable",
    count === null || count === undefined ? "" : `${count} stable equilibria with this end position`,
  ].filter(Boolean).join(" · ");
  [...boxes, ...flats].forEach((one) => one.draw());
}

/** What keys and buttons do. */
function actions() {
  const { rows, columns } = nodes[chosen.sheet], row = Math.floor(chosen.node / columns), column = chosen.node % columns;
  const to = (r, c) => show({ ...chosen, node: Math.max(0, Math.min(rows - 1, r)) * columns + Math.max(0, Math.min(columns - 1, c)) });
  const other = (by) => {
    const sheet = (chosen.sheet + by + nodes.length) % nodes.length;
    show({ sheet, node: Math.min(chosen.node, nodes[sheet].x.length - 1) });
  };
  return {
    ArrowLeft: () => to(row, column - 1), ArrowRight: () => to(row, column + 1), ArrowUp: () => to(row + 1, column), ArrowDown: () => to(row - 1, column),
    "[": () => other(-1), "]": () => other(1),
  };
}
turnByKeys(boxes.map((box) => box.space));
for (const { space } of boxes) zoomButtons(space.board, [space]);
document.addEventListener("keydown", (e) => {
  if (e.ctrlKey || e.metaKey || e.altKey || e.target.tagName === "SELECT") return;
  const action = actions()[e.key];
  if (!action) return;
  e.preventDefault();
  action();
});
for (const [act, text, name] of [["ArrowLeft", "‹", "back along the load"], ["ArrowRight", "›", "forward along the load"], ["ArrowDown", "⌄", "down across the load"], ["ArrowUp", "⌃", "up across the load"]]) {
  const button = document.createElement("button");
  Object.assign(button, { type: "button", textContent: text, title: name });
  button.setAttribute("aria-label", name);
  button.addEventListener("click", () => actions()[act]());
  bar.querySelector(".steps").append(button);
}
keys([["← →", "along the load"], ["↑ ↓", "across it"], ["[ ]", "previous, next sheet"], ...TURNING]);
window.addEventListener("resize", () => show(chosen));
const first = nodes[0];
const node = () => asked(first.x.length);
window.addEventListener("hashchange", () => show({ sheet: 0, node: node() ?? chosen.node }));
show({ sheet: 0, node: node() ?? Math.floor(first.rows / 2) * first.columns + Math.floor(first.columns / 3) });
