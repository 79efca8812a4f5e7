// A list of equilibria: a numbered panel for each, all seen from one side.

const states = data.states.map((state) => ({
  ...state,
  rods: state.rods.map((rod) => ({ ...rod, at: reals(rod.at), d1: unitVectors(rod.d1) })),
}));
const bounds = [0, 1, 2].map((k) => {
  const of = states.flatMap(({ rods, bodies }) => [
    ...rods.map((rod) => range(rod.at.filter((_, j) => j % 3 === k))),
    ...bodies.map((place) => [place[k], place[k]]),
  ]);
  return of.reduce(([a, b], [c, d]) => [Math.min(a, c), Math.max(b, d)]);
});
const { low, high, longest, camera } = roomy(bounds);
const labels = ["x", "y", "z"].map((name) => labelled(name, data.units.length));
let directors = false;

/** What is told of an equilibrium. */
function words(state, k) {
  const stable = data.conservative && state.index !== null ? (state.index ? "unstable" : "stable") : "";
  return [
    `${k + 1}: ${labelled(`energy ${told(state.energy)}`, data.units.energy)}`,
    [stable, state.index === null ? "no index" : `index ${state.index}`].filter(Boolean).join(", "),
    state.flat === null ? "" : `in the plane ${state.flat}`,
    state.neutral ? "one of a continuous family" : "",
    state.how,
  ].filter(Boolean).join(" · ");
}

/** One equilibrium. */
class Panel {
  constructor(state, k) {
    this.state = state;
    const board = new Board("half", words(state, k));
    board.legend.append(words(state, k));
    this.space = new Space(board, { low, high, labels, ...camera });
  }

  draw() {
    const space = this.space, { rods, bodies } = this.state;
    space.begin();
    space.box();
    for (const rod of rods) {
      const points = threes(rod.at, 0, rod.sections);
      space.strip(points, threes(rod.d1, 0, rod.sections), 0.014 * longest, directors);
      space.dot(points[0], INK, 4);
    }
    for (const place of bodies) space.dot(place, BODY, 6, 0.01);
    space.paint();
  }
}

document.getElementById("about").textContent =
  `${states.length === 1 ? "One equilibrium" : `${states.length} equilibria`}. Sought: ${data.sought}. Proven: ${data.proven}.`;
const panels = states.map((state, k) => new Panel(state, k));
const draw = () => panels.forEach((panel) => panel.draw());
// All panels turn together.
for (const { space } of panels) {
  space.changed = () => {
    for (const { space: other } of panels) {
      [other.azimuth, other.elevation, other.zoom] = [space.azimuth, space.elevation, space.zoom];
    }
    draw();
  };
}
if (panels.length) turnByKeys([panels[0].space]);
document.addEventListener("keydown", (e) => {
  if (e.ctrlKey || e.metaKey || e.altKey || e.key.toLowerCase() !== "f") return;
  directors = !directors;
  draw();
});
keys([["F", "directors"], ...TURNING]);
window.addEventListener("resize", draw);
draw();
