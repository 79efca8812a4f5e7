// What the page holds: numbers made by the library. Nothing is integrated here.

const data = JSON.parse(document.getElementById("data").textContent);

/** The bytes of a text in base 64. */
function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

/** Numbers of 16 bits as what they stand for; NaN where there is none. */
function reals({ mid, step, q }) {
  const view = new DataView(bytes(q).buffer);
  return Float64Array.from({ length: view.byteLength / 2 }, (_, i) => {
    const whole = view.getInt16(2 * i, true);
    return whole === -32768 ? NaN : mid + step * whole;
  });
}

/** Components of unit vectors. */
function unitVectors(text) {
  return Float64Array.from(new Int8Array(bytes(text).buffer), (x) => x / 127);
}

/** Which of so many pictures or points the address asks for, counted from 0: run.html#120 asks for picture 120 of those that the page counts from 1. */
function asked(count) {
  const number = parseInt(location.hash.slice(1), 10);
  return number >= 0 ? Math.min(Math.max(number, 1), count) - 1 : null;
}

/** "name (unit)". */
function labelled(name, unit) {
  return unit ? `${name} (${unit})` : name;
}

/** A number for people: five digits. */
function told(x) {
  if (x === 0) return "0";
  const size = Math.abs(x);
  return size >= 1e-3 && size < 1e5 ? String(Number(x.toPrecision(5))) : x.toExponential(3);
}

/** Smallest and largest of the finite values. */
function range(values) {
  let low = Infinity, high = -Infinity;
  for (const x of values) {
    if (x < low) low = x;
    if (x > high) high = x;
  }
  return low <= high ? [low, high] : [0, 0];
}

// A page takes the light or the dark of the system; a change opens it anew.
const dark = matchMedia("(prefers-color-scheme: dark)");
dark.addEventListener("change", () => location.reload());
const shade = (light, night) => (dark.matches ? night : light);
const PAGE = shade("#ffffff", "#16181b"), INK = shade("#1c1c1c", "#ececec"), FAINT = shade("#8a8a8a", "#8f959c");
const RULE = shade("#ececec", "#2a2e33"), EDGE = shade("#c4c4c4", "#50565d"), BODY = shade("#3d3d3d", "#d0d4d8"), GHOSTLY = shade("#5f7890", "#7f9bb5");
// Okabe and Ito: told apart by all kinds of eyes, and by dashes and forms beside.
const BLUE = shade("#0072b2", "#4aa3df"), ORANGE = shade("#d55e00", "#ff8a3d"), GREEN = shade("#009e73", "#2bbf95"), PINK = "#cc79a7", SKY = "#56b4e9", AMBER = shade("#b58900", "#d8ac2a");
const FRONT = "#3d9be0", BACK = "#f0b264", SPINE = shade("#0d3b5e", "#bfe0f7");
