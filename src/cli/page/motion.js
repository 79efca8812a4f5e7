// A motion: the rods and bodies, the energies, the phase plane, the sheet with the path on it.

const { units, flat, length } = data;
const rods = data.rods.map((rod) => ({ ...rod, at: reals(rod.at), d1: rod.d1 && unitVectors(rod.d1) }));
const bodies = data.bodies.map((body) => ({
  ...body,
  at: body.at.map(reals),
  velocity: body.velocity.map(reals),
  turn: body.turn.map(reals),
  way: body.way.map(reals),
  speed: body.speed.map(reals),
}));
const grooves = data.grooves.map((of) => of.map(reals));
const obstacles = (data.obstacles ?? []).map((of) => of.map(reals));
// Contacts of every picture: place and force on the body.
const contacts = data.contacts ?? [];
const hasContacts = contacts.some((of) => of.length);
const strongest = Math.max(...contacts.flat().map((of) => Math.hypot(of[3], of[4], of[5])));
let showsContacts = true;

/** Contact forces of picture i as lines from their places; the strongest of the motion is a fifth of the rod long. */
function pushes(i) {
  const end = (of) => [0, 1, 2].map((k) => of[k] + ((0.2 * length) / strongest) * of[k + 3]);
  return showsContacts ? (contacts[i] ?? []).map((of) => [of.slice(0, 3), end(of)]) : [];
}
const energies = data.energies.map((one) => ({ ...one, values: reals(one.values), trace: reals(one.trace) }));
// Curves have points of their own, closer than the pictures; up to each picture so many of them.
const trace = reals(data.trace);
const upTo = Array.from(data.t, (t, i) => {
  const last = data.place[i] === "f" || data.place[i] === "y";
  let k = trace.findIndex((other) => other > t + 1e-9 * Math.abs(t));
  if (k < 0) k = trace.length;
  return last ? k - 1 : k;
});
const axes = flat ? ["x", "y"] : ["x", "y", "z"];
const lengths = axes.map((name) => labelled(name, units.length));

/**
 * Which points of a series of times are joined to the one before: those that the velocities of both explain. Elsewhere
 * the motion between two samples is unknown, and the samples are dots.
 */
function joins(times, places, velocities) {
  const spans = places.map((at) => Math.max(...range(at).map(Math.abs), 1e-3 * length));
  return Array.from(times, (t, k) => k > 0 && places.every((at, i) => {
    const by = 0.5 * (t - times[k - 1]) * (velocities[i][k] + velocities[i][k - 1]);
    return Math.abs(at[k] - at[k - 1] - by) < 0.03 * spans[i];
  }));
}
for (const body of bodies) {
  body.joined = joins(trace, body.way, body.speed);
  body.seen = joins(data.t, body.at, body.velocity);
}
const allJoined = Array.from(trace, (_, k) => bodies.every((body) => body.joined[k]));

/** Section k of a rod in picture i. */
function section(rod, i, k) {
  const n = axes.length, from = (i * rod.sections + k) * n;
  return Array.from(rod.at.subarray(from, from + n));
}

const sections = (rod, i) => Array.from({ length: rod.sections }, (_, k) => section(rod, i, k));

/** The rod in picture i, as a smooth curve through its sections. */
function shape(rod, i) {
  return smooth(sections(rod, i));
}

const place = (body, i) => axes.map((_, k) => body.at[k][i]);
const turn = (body, i) => unit4([0, 1, 2, 3].map((k) => body.turn[k][i]));
const unit4 = (q) => q.map((x) => x / (Math.hypot(...q) || 1));
/** The middle of mass of a body, and from it to the middles of three faces. */
const middle = (body, i) => plus(place3(body, i), 1, turned(turn(body, i), body.offset));
const place3 = (body, i) => [0, 1, 2].map((k) => body.at[k][i]);
// Mass and inertia do not say how large a body is: a box larger than a tenth of the rod is shown smaller, unless the
// scene gives a solid, or true sizes are wanted.
let trueSizes = false;
const reach = (body) => Math.hypot(...body.edges);
const size = (body) => (trueSizes || body.solid ? 1 : Math.min(1, (0.1 * length) / reach(body)));
const edges = (body, i) => [0, 3, 6].map((k) => turned(turn(body, i), body.edges.slice(k, k + 3).map((x) => x * size(body))));
const isPoint = (body) => body.edges.every((x) => x === 0);
/** Ends of rods that are fixed to a body: there the place in the frame of the body does not change. */
function fixedTo(body) {
  const ends = rods.flatMap((rod) => [0, rod.sections - 1].map((k) => ({ rod, k }))).filter(({ rod, k }) => !rod.ground[k ? 1 : 0]);
  const local = ({ rod, k }, i) => {
    const [x, y, z = 0] = section(rod, i, k), [a, b, c, w] = turn(body, i);
    return turned([-a, -b, -c, w], plus([x, y, z], -1, place3(body, i)));
  };
  return ends.filter((end) => {
    const first = local(end, 0);
    return [0.25, 0.5, 0.75, 1].every((part) => Math.hypot(...plus(local(end, Math.floor(part * (data.t.length - 1))), -1, first)) < 2e-3 * length);
  });
}
const STRUT = { colour: FAINT, width: 1.2 };
for (const body of bodies) body.ends = isPoint(body) ? [] : fixedTo(body);

/** The corners of the faces of a box, each seen from outside against the clock. */
const FACES = [0, 1, 2].flatMap((axis) => [1, -1].map((side) => [axis, side]));
function faces(body, i) {
  const c = middle(body, i), e = edges(body, i);
  return FACES.map(([axis, side]) => {
    const [u, v] = [e[(axis + 1) % 3], e[(axis + 2) % 3]], m = plus(c, side, e[axis]);
    return [[1, 1], [-side, side], [-1, -1], [side, -side]].map(([a, b]) => plus(plus(m, a, u), b, v));
  });
}

/** What the picture of the rods spans, on every axis. */
const bounds = axes.map((_, k) => {
  const of = rods.map((rod) => range(rod.at.filter((_, j) => j % axes.length === k)));
  const bulk = bodies.flatMap((body) => {
    const far = Math.hypot(...body.offset) + reach(body) * size(body), [a, b] = range(body.at[k]);
    return isPoint(body) ? [[a, b]] : [[a - far, b + far]];
  });
  const beside = grooves.map((groove) => range(groove[k]));
  return [...of, ...bulk, ...beside].reduce(([a, b], [c, d]) => [Math.min(a, c), Math.max(b, d)]);
});

/** Ends of rods on the ground, which may move. */
const grounds = rods.flatMap((rod) => [0, rod.sections - 1].map((k, end) => ({ rod, k, joint: rod.ground[end] }))).filter(({ joint }) => joint);

const ROD = { colour: BLUE, width: 3.2 }, GHOST = { colour: GHOSTLY, width: 1.3 };
const BEFORE = { colour: ORANGE, width: 2, dash: [7, 4] }, AFTER = { colour: GREEN, width: 2, dash: [2, 4] };
const FALL = { colour: ORANGE, width: 1, alpha: 0.45 }, WAY = { colour: PINK, width: 1.6 }, MARKED = { colour: ORANGE, width: 1, alpha: 0.5 };
const OBSTACLE = { colour: FAINT, width: 1.4 };
const CONTACT = { colour: shade("#b8322a", "#ff6b60"), width: 2.2 };
const GROOVE = { colour: EDGE, width: 4 };
const hasFolds = data.place.includes("f"), hasLayers = data.place.includes("y");

/** Pictures whose shapes stand behind that of picture i: some ten from the last second and a half, by what they show. */
function past(i) {
  const step = Math.max(1, Math.round(data.t.length / 50)), found = [];
  for (let k = i - step; k >= 0 && found.length < 12; k -= step) if (data.place[k] === ".") found.push([k, 0.8 * (1 - found.length / 12)]);
  return found.reverse();
}

/** The last snap up to picture i: the picture before it, those of its layer up to i, and that of its landing if it is past. */
function lastSnap(i) {
  const fold = data.place.lastIndexOf("f", i);
  if (fold < 0) return null;
  const landing = data.place.indexOf("l", fold);
  return { fold, layer: [...data.place.slice(fold + 1, Math.min(i + 1, landing))].map((_, k) => fold + 1 + k), landing: landing >= 0 && landing <= i ? landing : null, fresh: i - landing < 0.12 * data.t.length };
}

/** The rods in the plane. */
class FlatView {
  constructor(board) {
    let [x, y] = bounds.map((of) => wider(of));
    const folds = (data.folds ?? []).map((fold) => ({ x: reals(fold.x), y: reals(fold.y) }));
    this.folds = folds;
    const least = 0.25 * length;
    [x, y] = [x, y].map(([a, b]) => (b - a < least ? [(a + b - least) / 2, (a + b + least) / 2] : [a, b]));
    this.axes = new Axes(board, { x, y, xLabel: lengths[0], yLabel: lengths[1], equal: true });
  }

  draw(i, ghosts) {
    const at = this.axes, g = at.begin();
    for (const fold of this.folds) at.line(fold.x, fold.y, { colour: AMBER, width: 1.2, dash: [6, 3, 1, 3] });
    for (const groove of grooves) at.line(groove[0], groove[1], GROOVE);
    for (const line of obstacles) at.line(line[0], line[1], OBSTACLE);
    const rod = (one, k, style) => {
      const points = shape(one, k);
      at.line(points.map((p) => p[0]), points.map((p) => p[1]), style);
    };
    if (ghosts) for (const [k, alpha] of past(i)) for (const one of rods) rod(one, k, { ...GHOST, alpha });
    for (const body of bodies) at.line(body.way[0], body.way[1], WAY, 0, upTo[i], (k) => body.joined[k]);
    const snap = ghosts && lastSnap(i);
    if (snap && (snap.fresh || snap.landing === null)) {
      for (const one of rods) {
        for (const k of snap.layer) rod(one, k, FALL);
        rod(one, snap.fold, BEFORE);
        if (snap.landing !== null) rod(one, snap.landing, AFTER);
      }
    }
    for (const one of rods) rod(one, i, ROD);
    for (const ground of grounds) this.ground(ground, i);
    for (const body of bodies) this.body(body, i);
    for (const [a, b] of pushes(i)) {
      at.line([a[0], b[0]], [a[1], b[1]], CONTACT);
      at.dot(a[0], a[1], CONTACT.colour, 3.5);
    }
    at.end();
  }

  ground({ rod, k, joint }, i) {
    const [x, y] = section(rod, i, k), next = section(rod, i, k ? k - 1 : 1), g = this.axes.g;
    if (joint === "ball") return this.axes.dot(x, y, INK, 5);
    g.save();
    g.translate(this.axes.px(x), this.axes.py(y));
    g.rotate(-Math.atan2(next[1] - y, next[0] - x));
    g.strokeStyle = INK;
    g.lineWidth = 2;
    g.beginPath();
    g.moveTo(0, -12);
    g.lineTo(0, 12);
    g.stroke();
    g.lineWidth = 1;
    g.beginPath();
    for (let v = -12; v < 12; v += 5) {
      g.moveTo(0, v);
      g.lineTo(-6, v + 6);
    }
    g.stroke();
    g.restore();
  }

  body(body, i) {
    if (isPoint(body)) return this.axes.dot(body.at[0][i], body.at[1][i], BODY, 8);
    const g = this.axes.g, c = middle(body, i);
    for (const { rod, k } of body.ends) {
      const end = section(rod, i, k);
      this.axes.line([c[0], end[0]], [c[1], end[1]], STRUT);
    }
    // A body that moves in the plane shows one face, whichever of its axes is across.
    for (const face of faces(body, i)) {
      g.beginPath();
      face.forEach(([x, y], k) => (k ? g.lineTo : g.moveTo).call(g, this.axes.px(x), this.axes.py(y)));
      g.closePath();
      g.fillStyle = "#7d8288";
      g.fill();
      g.strokeStyle = INK;
      g.lineWidth = 1;
      g.stroke();
    }
    this.axes.dot(c[0], c[1], BODY, 3.5);
  }
}

/** Stretches [from, to) of the first points of a series within which each is joined to the one before. */
function stretches(joined, count) {
  const found = [];
  for (let k = 0; k < count; k++) joined[k] && found.length ? found.at(-1)[1]++ : found.push([k, k + 1]);
  return found;
}

/** The rods in space: strips whose sides are told apart, bodies as boxes. */
class SpaceView {
  constructor(board) {
    const { low, high, longest, camera } = roomy(bounds);
    this.space = new Space(board, { low, high, labels: lengths, ...camera });
    this.half = 0.016 * longest;
    this.directors = false;
  }

  draw(i, ghosts) {
    const space = this.space;
    space.begin();
    space.box();
    for (const groove of grooves) space.line(Array.from(groove[0], (_, k) => groove.map((of) => of[k])), GROOVE);
    for (const line of obstacles) space.line(Array.from(line[0], (_, k) => line.map((of) => of[k])), OBSTACLE);
    if (ghosts) for (const [k, alpha] of past(i)) for (const rod of rods) space.line(shape(rod, k), { ...GHOST, alpha });
    for (const body of bodies) {
      // Of a body its middle, which the trace does not tell.
      const way = isPoint(body) ? Array.from({ length: upTo[i] }, (_, k) => body.way.map((of) => of[k])) : Array.from({ length: i + 1 }, (_, k) => middle(body, k));
      const joined = isPoint(body) ? body.joined : body.seen;
      // The shadow on the floor tells depth.
      for (const [from, to] of stretches(joined, way.length)) {
        const part = from + 1 === to ? [way[from], way[from]] : way.slice(from, to);
        space.line(part, WAY);
        space.line(part.map(([x, y]) => [x, y, space.low[2]]), { colour: EDGE, width: 1 });
      }
    }
    const snap = ghosts && lastSnap(i);
    for (const rod of rods) {
      if (snap && (snap.fresh || snap.landing === null)) {
        for (const k of snap.layer) space.line(shape(rod, k), FALL);
        space.line(shape(rod, snap.fold), BEFORE);
        if (snap.landing !== null) space.line(shape(rod, snap.landing), AFTER);
      }
      space.strip(sections(rod, i), threes(rod.d1, i * rod.sections, rod.sections), this.half, this.directors);
    }
    for (const { rod, k } of grounds) space.dot(section(rod, i, k), INK, 5, 0.02);
    for (const body of bodies) {
      for (const { rod, k } of body.ends) space.line([middle(body, i), section(rod, i, k)], STRUT);
      if (!isPoint(body)) for (const face of faces(body, i)) space.face(face, "#a8a8a8", "#a8a8a8", { alpha: 0.6 });
      space.dot(middle(body, i), BODY, isPoint(body) ? 7 : 3, isPoint(body) ? 0 : 0.02);
    }
    for (const [a, b] of pushes(i)) {
      space.line([a, b], CONTACT, 0.03);
      space.dot(a, CONTACT.colour, 4, 0.03);
    }
    space.paint();
  }
}

/** The sum of all terms, which stays what it is. */
const TOTAL = energies.at(-1).name;

/** The energies over time, with a cursor. */
class EnergyView {
  constructor(board) {
    const looks = {
      kinetic: { colour: BLUE }, "rod kinetic": { colour: SKY, dash: [6, 3] }, elastic: { colour: ORANGE }, potential: { colour: GREEN, dash: [8, 3] },
      dissipated: { colour: PINK, dash: [3, 3] }, work: { colour: AMBER, dash: [9, 3, 2, 3] }, [TOTAL]: { colour: INK, dash: [1, 4], width: 2 },
    };
    // Where gravity's constant would hide all else, what it adds is told from the start on.
    const potential = energies.find(({ name }) => name === "potential");
    const others = energies.filter(({ name }) => name !== "potential" && name !== TOTAL).flatMap(({ trace }) => range(trace));
    const base = potential && Math.abs(potential.trace[0]) > 5 * Math.max(...others.map(Math.abs)) ? potential.trace[0] : 0;
    const less = ({ name }) => (name === "potential" || name === TOTAL ? base : 0);
    this.lines = energies.map((one) => ({
      values: one.values.map((x) => x - less(one)),
      trace: one.trace.map((x) => x - less(one)),
      style: { width: 1.8, ...looks[one.name] },
    }));
    const constant = `${base < 0 ? "+" : "−"} ${told(Math.abs(base))}${units.energy && ` ${units.energy}`}`;
    energies.forEach((one, k) => board.key(less(one) ? `${one.name} ${constant}` : one.name, this.lines[k].style));
    const of = this.lines.map(({ trace }) => range(trace));
    const y = wider([Math.min(0, ...of.map((r) => r[0])), Math.max(...of.map((r) => r[1]))]);
    this.axes = new Axes(board, { x: [data.t[0], data.t.at(-1)], y, xLabel: labelled("t", units.time), yLabel: labelled("energy", units.energy) });
    if (data.marks.length) board.key(data.marked, MARKED);
  }

  draw(i) {
    const at = this.axes;
    at.begin();
    for (const t of data.marks) at.line([t, t], at.y, MARKED);
    for (const line of this.lines) at.line(trace, line.trace, line.style, 0, trace.length, (k) => allJoined[k]);
    at.line([data.t[i], data.t[i]], at.y, { colour: INK, width: 1 });
    for (const { values, style } of this.lines) at.dot(data.t[i], values[i], style.colour, 3.5);
    at.end();
  }
}

/** Velocity over place, of one component of one body. */
class PhaseView {
  constructor(board) {
    this.board = board;
    this.choices = bodies.flatMap((body) => ["x", "y", "z"].map((name, k) => ({ body, name, k })));
    const span = ({ body, k }) => range(body.way[k])[1] - range(body.way[k])[0];
    this.choices = this.choices.filter((one) => span(one) > 1e-7 * length);
    if (!this.choices.length) this.choices = [{ body: bodies[0], name: "x", k: 0 }];
    const best = this.choices.reduce((a, b) => (span(b) > span(a) ? b : a));
    const select = document.createElement("select");
    select.setAttribute("aria-label", "component in the phase plane");
    this.choices.forEach((one, k) => select.add(new Option(one.body.name && bodies.length > 1 ? `${one.body.name}.${one.name}` : one.name, k, false, one === best)));
    select.addEventListener("change", () => {
      this.choose(this.choices[select.value]);
      this.draw(this.i);
    });
    board.legend.append("phase plane of ", select);
    this.choose(best);
  }

  choose({ body, name, k }) {
    [this.xs, this.vs, this.x, this.v, this.joined] = [body.way[k], body.speed[k], body.at[k], body.velocity[k], body.joined];
    const of = bodies.length > 1 ? `${body.name}.` : "";
    this.axes = new Axes(this.board, {
      x: wider(range(this.xs)), y: wider(range(this.vs)), xLabel: labelled(of + name, units.length), yLabel: labelled(`${of}v${name}`, units.velocity),
    });
  }

  draw(i) {
    this.i = i;
    const at = this.axes;
    at.begin();
    const joined = (k) => this.joined[k];
    at.line(this.xs, this.vs, { colour: FAINT, width: 1, alpha: 0.7 }, 0, this.xs.length, joined);
    at.line(this.xs, this.vs, WAY, upTo[Math.max(0, i - 60)], upTo[i], joined);
    data.place.split("").forEach((letter, k) => letter === "l" && at.dot(this.x[k], this.v[k], ORANGE, 4));
    at.dot(this.x[i], this.v[i], BODY, 5.5);
    at.end();
  }
}

/** The stable sheets of the elastica over the places of the end, with the path on them. */
class SheetView {
  constructor(board) {
    this.patches = data.sheet.patches.map((patch) => ({ ...patch, at: patch.at.map(reals) }));
    this.path = data.sheet.path.map(reals);
    const of = (k) => [...this.patches.map((patch) => range(patch.at[k])), range(this.path[k])].reduce(([a, b], [c, d]) => [Math.min(a, c), Math.max(b, d)]);
    const [low, high] = [0, 1].map((side) => [of(0)[side], of(1)[side], of(2)[side]]);
    // The angle counts as a length so that the box is a cube.
    const scale = [1, 1, (high[0] - low[0]) / (high[2] - low[2])];
    // As in surface.svg.
    const places = (data.sheet.from_clamp ? ["along the clamp", "across it"] : ["x", "y"]).map((name) => labelled(name, units.length));
    this.space = new Space(board, { low, high, labels: [...places, `θ(${length === 1 ? 1 : "L"}) (rad)`], scale, azimuth: -52, elevation: 24 });
    this.picture = document.createElement("canvas");
    this.space.changed = () => {
      this.drawn = null;
      this.draw(this.i);
    };
    board.key("κ > 0", { colour: FRONT, width: 6 });
    board.key("κ < 0", { colour: BACK, width: 6 });
    board.key("path", WAY);
  }

  point = (k) => this.path.map((of) => of[k]);

  draw(i) {
    this.i = i;
    const canvas = this.space.board.canvas, size = `${canvas.clientWidth} ${canvas.clientHeight} ${window.devicePixelRatio}`;
    this.space.begin();
    // Sheets and path change with the camera alone.
    if (this.drawn !== size) {
      this.surface();
      this.drawn = size;
      [this.picture.width, this.picture.height] = [canvas.width, canvas.height];
      this.picture.getContext("2d").drawImage(canvas, 0, 0);
    } else {
      const g = this.space.g;
      g.save();
      g.setTransform(1, 0, 0, 1, 0, 0);
      g.drawImage(this.picture, 0, 0);
      g.restore();
    }
    this.space.dot(this.point(i), INK, 6, 3);
    this.space.paint();
  }

  surface() {
    const space = this.space;
    space.box();
    this.patches.forEach(({ rows, columns, at }, k) => {
      const node = (r, c) => at.map((of) => of[r * columns + c]);
      for (let r = 1; r < rows; r++) {
        for (let c = 1; c < columns; c++) {
          const four = [node(r - 1, c - 1), node(r - 1, c), node(r, c), node(r, c - 1)];
          const colour = k ? BACK : FRONT;
          if (four.every((p) => p.every((x) => x === x))) space.face(four, colour, colour);
        }
      }
    });
    let from = 0;
    for (let k = 1; k <= data.t.length; k++) {
      if (k < data.t.length && data.place[k] !== "l") continue;
      // From landing to fold on the sheet; between them a jump.
      const to = data.place.lastIndexOf("f", k - 1) >= from ? data.place.lastIndexOf("f", k - 1) + 1 : k;
      space.line(Array.from({ length: to - from }, (_, j) => this.point(from + j)), { colour: shade("#8f2f6b", "#ffd7ee"), width: 2 }, 0.03);
      if (k < data.t.length) space.line([this.point(to - 1), this.point(k)], { colour: INK, width: 1.4, dash: [4, 3] }, 0.03);
      from = k;
    }
    space.paint();
  }
}

const time = units.time && ` ${units.time}`;
const about = `${data.t.length} frames from t = ${told(data.t[0])} to ${told(data.t.at(-1))}${time}, each computed, none interpolated.`;
// Of a run of more steps than that curves do not show all.
const gap = Math.max(...trace.slice(1).map((t, i) => t - trace[i]));
const sampled = data.steps >= trace.length ? ` Curves have ${trace.length} points, at most ${told(Number(gap.toPrecision(2)))}${time} apart, of the run's ${data.steps} steps; faster changes are not shown.` : "";
const loose = allJoined.filter((on) => !on).length - 1;
const dotted = loose > 0.02 * trace.length ? " Where samples are too far apart to be joined, they are dots." : "";
document.getElementById("about").textContent = about + sampled + dotted;
let views = [];
const player = new Player((i) => views.forEach((view) => view.draw(i, player.ghosts)));
const stage = new Board("motion", "the rods and bodies");
if (rods.length) stage.key(rods.length > 1 ? "rods" : "rod", ROD);
stage.key(bodies.length > 1 ? "paths of the bodies" : "path of the body", WAY);
if (hasFolds) stage.key("before the snap", BEFORE);
if (hasLayers) stage.key("falling", FALL);
if (hasFolds) stage.key("after the snap", AFTER);
if (grooves.length) stage.key("groove", GROOVE);
if (obstacles.length) stage.key("obstacle", OBSTACLE);
if (hasContacts) stage.key("contact force", CONTACT);
if (data.folds) stage.key("first fold", { colour: AMBER, dash: [6, 3, 1, 3] });
const picture = flat ? new FlatView(stage) : new SpaceView(stage);
views = [picture, new EnergyView(new Board("wide", "energies over time"))];
views.push(new PhaseView(new Board(data.sheet ? "half" : "wide low", "phase plane")));
if (data.sheet) views.push(new SheetView(new Board("half", "the sheet of equilibria with the path on it")));
const spaces = views.map((view) => view.space).filter(Boolean);
if (!flat) picture.space.changed = () => picture.draw(player.frame, player.ghosts);
const hasBoxes = bodies.some((body) => !isPoint(body) && !body.solid && reach(body) > 0.1 * length);
if (hasBoxes) stage.key("bodies: boxes of their inertia, shown smaller", { colour: "#a8a8a8", width: 6 });
keys([...KEYS, ...(spaces.length ? TURNING : []), ...(flat ? [] : [["F", "directors"]]), ...(hasContacts ? [["C", "contact forces"]] : []),
  ...(hasBoxes ? [["B", "true sizes of the boxes"]] : [])]);
turnByKeys(spaces);
for (const view of views) if (view.space) zoomButtons(view.space.board, [view.space]);
if (!flat) player.choice("f", "directors", false, (on) => (picture.directors = on));
if (hasContacts) player.choice("c", "contact forces", true, (on) => (showsContacts = on));
if (hasBoxes) player.choice("b", "true sizes", false, (on) => (trueSizes = on));
function fit() {
  player.mark();
  player.draw();
}
window.addEventListener("resize", fit);
// A page opened as run.html#120 stands still at that picture.
const first = asked(data.t.length);
player.frame = first ?? 0;
fit();
if (first === null && !matchMedia("(prefers-reduced-motion: reduce)").matches) player.play(true);
window.addEventListener("hashchange", () => player.go(asked(data.t.length) ?? player.frame));
keepingButtons(player.bar, () => player.status.textContent, () => player.frame + 1);
