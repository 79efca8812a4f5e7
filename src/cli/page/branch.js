// Branches: a diagram whose points show their shapes.

const at = reals(data.at);
const columns = data.columns.map((column) => ({ ...column, values: reals(column.values) }));
const rods = data.pictures.rods.map((rod) => ({ ...rod, at: reals(rod.at), d1: unitVectors(rod.d1) }));
const bodies = data.pictures.bodies.map((body) => ({ ...body, at: body.at.map(reals) }));
const rows = data.pictures.rows;
const many = Math.max(0, ...data.branch) + 1;
const COLOURS = [BLUE, ORANGE, GREEN, PINK, AMBER, SKY];
const MARKS = { fold: ORANGE, "branch point": GREEN, cusp: PINK };
const markOf = (kind) => MARKS[kind] ?? INK;
// A number that is rounding beside others of its unit is 0.
const sizes = {};
for (const { unit, values } of columns) sizes[unit] = Math.max(sizes[unit] ?? 0, ...range(values).map(Math.abs));
const exactly = ({ unit, values }, row) => told(Math.abs(values[row]) < 1e-6 * sizes[unit] ? 0 : values[row]);
const special = (row) => data.specials.find((one) => one.row === row);

/** The corners of the mark of a special point: each kind has a form of its own. */
const FORMS = { fold: [[0, -7], [6.5, 5], [-6.5, 5]], "branch point": [[-5, -5], [5, -5], [5, 5], [-5, 5]] };
const formOf = (kind) => FORMS[kind] ?? [[0, -7], [6, 0], [0, 7], [-6, 0]];

/** Marks special points on axes, each { x, y, kind, label }, the labels where no mark, no other label and no border of the frame is. */
function mark(axes, points) {
  const g = axes.g, at = points.map(({ x, y }) => [axes.px(x), axes.py(y)]);
  const [left, top, wide, high] = axes.box, taken = at.map(([x, y]) => [x - 6, y - 6, x + 6, y + 6]);
  at.forEach(([x, y], k) => {
    g.beginPath();
    for (const [a, b] of formOf(points[k].kind)) g.lineTo(x + a, y + b);
    g.closePath();
    g.fillStyle = markOf(points[k].kind);
    g.fill();
    g.strokeStyle = PAGE;
    g.lineWidth = 1.2;
    g.stroke();
  });
  g.fillStyle = INK;
  g.textAlign = "left";
  g.textBaseline = "middle";
  const free = ([x0, y0, x1, y1]) => x0 > left && y0 > top && x1 < left + wide && y1 < top + high && taken.every(([a, b, c, d]) => x1 < a || c < x0 || y1 < b || d < y0);
  at.forEach(([x, y], k) => {
    const long = g.measureText(points[k].label).width, right = x + 7, before = x - 7 - long;
    // Beside the mark, above and below it, then farther off.
    const places = [10, 22, 34].flatMap((far) => [[right, y - far], [right, y + far], [before, y - far], [before, y + far], [x - long / 2, y - far - 3], [x - long / 2, y + far + 3]]);
    const boxes = places.map(([from, middle]) => [from, middle - 6, from + long, middle + 6]), box = boxes.find(free) ?? boxes[0];
    taken.push(box);
    g.fillText(points[k].label, box[0], box[1] + 6);
  });
}

/** What a kind of special points is called: without a potential of the loads the index does not decide stability. */
const called = (kind) => (data.conservative ? kind : kind.replace("stability change", "index change"));

/** A column over the parameter; points of another index than 0 dashed. */
class Diagram {
  constructor(board, pick) {
    this.board = board;
    board.canvas.classList.add("picks");
    const select = document.createElement("select");
    select.setAttribute("aria-label", "quantity drawn over the parameter");
    columns.forEach((column, k) => select.add(new Option(labelled(column.name, column.unit), k)));
    select.addEventListener("change", () => {
      this.choose(columns[select.value]);
      this.draw(this.row);
    });
    board.legend.append("over the parameter: ", select);
    board.key(data.conservative ? "stable" : "index 0", { colour: INK });
    board.key(data.conservative ? "unstable" : "another index, or unknown", { colour: INK, dash: [4, 4] });
    for (const kind of new Set(data.specials.map((one) => one.kind))) board.key(called(kind), { colour: markOf(kind), corners: formOf(kind) });
    this.choose(columns[0]);
    const nearest = (e) => {
      const box = board.canvas.getBoundingClientRect(), [x, y] = [e.clientX - box.left, e.clientY - box.top];
      const far = (row) => Math.hypot(this.axes.px(at[row]) - x, this.axes.py(this.column.values[row]) - y);
      let best = 0;
      rows.forEach((row, k) => far(row) < far(rows[best]) && (best = k));
      return far(rows[best]) < 40 ? best : -1;
    };
    const to = (e) => {
      const found = nearest(e);
      if (found >= 0) pick(found);
    };
    board.canvas.addEventListener("pointermove", to);
    board.canvas.addEventListener("pointerdown", to);
  }

  choose(column) {
    this.column = column;
    this.axes = new Axes(this.board, { x: wider(range(at)), y: wider(range(column.values)), xLabel: data.parameter, yLabel: labelled(column.name, column.unit) });
  }

  draw(row) {
    this.row = row;
    const axes = this.axes, values = this.column.values, g = axes.begin();
    for (let from = 0; from < at.length; ) {
      // As far as branch and stability stay; the next piece begins where this one ends.
      const unstable = (k) => data.index[k] === null || data.index[k] > 0;
      let to = from + 1;
      while (to < at.length && data.branch[to] === data.branch[from] && (to === from + 1 || unstable(to) === unstable(to - 1))) to++;
      const dash = unstable(to - 1) ? [4, 4] : [];
      axes.line(at, values, { colour: COLOURS[data.branch[from] % COLOURS.length], width: 2, dash }, from, to);
      from = to < at.length && data.branch[to] === data.branch[from] ? to - 1 : to;
    }
    // Close dots would hide what is dashed.
    for (const k of rows.length > 150 ? [] : rows) {
      g.beginPath();
      g.arc(axes.px(at[k]), axes.py(values[k]), 1.7, 0, 2 * Math.PI);
      g.fillStyle = COLOURS[data.branch[k] % COLOURS.length];
      g.fill();
    }
    mark(axes, data.specials.map(({ row, kind, label }) => ({ x: at[row], y: values[row], kind, label: data.specials.length <= 20 ? label : "" })));
    axes.line([at[row], at[row]], axes.y, { colour: FAINT, width: 1 });
    axes.dot(at[row], values[row], INK, 6);
    axes.end();
  }
}

/** The rods at a point, those of other points of its branch behind them. */
class Shapes {
  constructor(board) {
    const bounds = [0, 1, 2].map((k) => {
      const of = [...rods.map((rod) => rod.at.filter((_, j) => j % 3 === k)), ...bodies.map((body) => body.at[k])].map(range);
      return of.reduce(([a, b], [c, d]) => [Math.min(a, c), Math.max(b, d)]);
    });
    const { low, high, longest, camera } = roomy(bounds);
    const labels = ["x", "y", "z"].map((name) => labelled(name, data.units.length));
    this.space = new Space(board, { low, high, labels, ...camera });
    this.half = 0.014 * longest;
    this.directors = false;
    board.key("rod at the point", { colour: FRONT, width: 6 });
    board.key("the other side of the rod", { colour: BACK, width: 6 });
    board.key("neighbours on its branch", { colour: GHOSTLY, width: 1.3 });
  }

  draw(k) {
    this.k = k;
    const space = this.space, shape = (rod, i) => threes(rod.at, i * rod.sections, rod.sections);
    space.begin();
    space.box();
    const step = Math.max(1, Math.round(rows.length / many / 14));
    rows.forEach((row, i) => {
      if (data.branch[row] !== data.branch[rows[k]] || (i - k) % step || i === k) return;
      for (const rod of rods) space.line(smooth(shape(rod, i)), { colour: GHOSTLY, width: 1, alpha: Math.max(0.12, 0.5 - 0.06 * Math.abs(i - k) / step) });
    });
    for (const rod of rods) {
      const points = shape(rod, k);
      space.strip(points, threes(rod.d1, k * rod.sections, rod.sections), this.half, this.directors);
      space.dot(points[0], INK, 5);
    }
    for (const body of bodies) space.dot(body.at.map((of) => of[k]), BODY, 7, 0.01);
    space.paint();
  }
}

/** Fold curves in two parameters. */
class Folds {
  constructor(board) {
    this.curves = data.folds.curves.map(({ x, y }) => [reals(x), reals(y)]);
    const of = (k) => this.curves.map((curve) => range(curve[k])).reduce(([a, b], [c, d]) => [Math.min(a, c), Math.max(b, d)]);
    this.axes = new Axes(board, { x: wider(of(0)), y: wider(of(1)), xLabel: data.folds.x, yLabel: data.folds.y });
    board.key("fold curve", { colour: BLUE });
  }

  draw() {
    const axes = this.axes;
    axes.begin();
    for (const [x, y] of this.curves) axes.line(x, y, { colour: BLUE, width: 2 });
    mark(axes, data.folds.specials);
    axes.end();
  }
}

document.getElementById("about").textContent =
  `${at.length} points of ${many === 1 ? "a branch" : `${many} branches`} of equilibria, ${rows.length} of them with their computed shapes. Point at one to see its shape.`;
const bar = document.createElement("div");
bar.className = "controls";
bar.innerHTML = `<div class="scrub"><input type="range" min="0" max="${rows.length - 1}" step="1" value="0" aria-label="point"></div>
  <span class="steps">${[["[", "|‹", "previous special point"], ["ArrowLeft", "‹", "one point back"], ["ArrowRight", "›", "one point forward"], ["]", "›|", "next special point"]]
    .map(([act, text, name]) => `<button type="button" data-act="${act}" title="${name}" aria-label="${name}">${text}</button>`).join("")}</span>
  <label><input type="checkbox"> directors</label><div class="status" role="status" aria-live="off"></div>`;
document.getElementById("stage").append(bar);
const [slider, box, status] = ["input[type=range]", "input[type=checkbox]", ".status"].map((name) => bar.querySelector(name));
let chosen = 0;
const diagram = new Diagram(new Board("tall", "a measure of the equilibria over the parameter"), show);
const shapes = new Shapes(new Board("tall", "the rods at the point"));
const folds = data.folds && new Folds(new Board("wide", "fold curves"));
const table = document.createElement("p");
table.className = "keys";
document.getElementById("stage").append(table);

function show(k) {
  chosen = Math.max(0, Math.min(rows.length - 1, k));
  const row = rows[chosen], here = special(row), index = data.index[row];
  slider.value = chosen;
  status.textContent = [
    `${data.parameter} = ${told(at[row])}`,
    many > 1 ? `branch ${data.branch[row]}` : "",
    index === null ? "index unknown" : [data.conservative && (index ? "unstable" : "stable"), `Morse index ${index}`].filter(Boolean).join(", "),
    here ? `${called(here.kind)} ${here.label}` : "",
    `${columns[0].name} = ${exactly(columns[0], row)}`,
  ].filter(Boolean).join(" · ");
  table.textContent = columns.map((column) => `${column.name} = ${exactly(column, row)}${column.unit && ` ${column.unit}`}`).join("; ") + ".";
  diagram.draw(row);
  shapes.draw(chosen);
}

const specials = () => data.specials.map((one) => rows.indexOf(one.row)).filter((k) => k >= 0).sort((a, b) => a - b);
/** What keys and buttons do; steps are so many points. */
const actions = (by) => ({
  ArrowLeft: () => show(chosen - by),
  ArrowRight: () => show(chosen + by),
  Home: () => show(0),
  End: () => show(rows.length - 1),
  "[": () => show(specials().filter((k) => k < chosen).at(-1) ?? 0),
  "]": () => show(specials().find((k) => k > chosen) ?? rows.length - 1),
  f: () => directors(!shapes.directors),
});
const directors = (on) => {
  shapes.directors = box.checked = on;
  shapes.draw(chosen);
};
shapes.space.changed = () => shapes.draw(chosen);
slider.addEventListener("input", () => show(Number(slider.value)));
box.addEventListener("change", () => directors(box.checked));
turnByKeys([shapes.space]);
document.addEventListener("keydown", (e) => {
  if (e.ctrlKey || e.metaKey || e.altKey || e.target.tagName === "SELECT") return;
  const action = actions(e.shiftKey ? 10 : 1)[e.key.length === 1 ? e.key.toLowerCase() : e.key];
  if (!action) return;
  e.preventDefault();
  action();
});
for (const button of bar.querySelectorAll("[data-act]")) button.addEventListener("click", () => actions(1)[button.dataset.act]());
zoomButtons(shapes.space.board, [shapes.space]);
keepingButtons(bar, () => status.textContent, () => chosen + 1);
keys([["← →", "one point back, forward"], ["shift ← →", "ten points"], ["Home End", "first, last point"], ["[ ]", "previous, next special point"], ["F", "directors"], ...TURNING]);
function fit() {
  show(chosen);
  folds?.draw();
}
window.addEventListener("resize", fit);
window.addEventListener("hashchange", () => show(asked(rows.length) ?? chosen));
chosen = asked(rows.length) ?? specials()[0] ?? 0;
fit();
