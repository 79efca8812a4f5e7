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

// Okabe and Ito: told apart by all kinds of eyes, and by dashes and forms beside.
const INK = "#1c1c1c", FAINT = "#8a8a8a";
const BLUE = "#0072b2", ORANGE = "#d55e00", GREEN = "#009e73", PINK = "#cc79a7", SKY = "#56b4e9", AMBER = "#b58900";
