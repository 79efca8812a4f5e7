// Which picture is shown: the scrubber, the keys, and the pace.

/** Pictures a second at speed 1. */
const PACE = 25;
/** How long a picture stands, by its place in the motion: on the way, at a fold, in its layer, at a landing. */
const STANDS = { ".": 1, f: 10, y: 2.5, l: 10 };
const REST = 30;

const KEYS = [
  ["space", "play, pause"], ["← →", "one frame back, forward"], ["shift ← →", "ten frames"], ["Home End", "first, last frame"], ["[ ]", "previous, next snap"],
  ["↑ ↓", "faster, slower"], ["T", "even in time, or slow where the motion is fast"], ["G", "ghosts"],
];

class Player {
  constructor(show) {
    this.show = show;
    this.count = data.t.length;
    this.stands = Array.from(data.place, (letter) => STANDS[letter]);
    this.stands[this.count - 1] = REST;
    this.snaps = this.found();
    this.frame = 0;
    this.stood = 0;
    this.speed = 1;
    this.even = false;
    this.ghosts = true;
    this.playing = false;
    this.choices = new Map();
    this.build();
    document.addEventListener("keydown", (e) => this.key(e));
    requestAnimationFrame((now) => this.tick(now, now));
  }

  /** The pictures at which snaps are. */
  found() {
    const at = new Set();
    Array.from(data.place).forEach((letter, i) => letter === "l" && at.add(i));
    for (const t of data.marks) {
      const i = data.t.findIndex((other) => other >= t);
      if (i >= 0 && !/[fyl]/.test(data.place.slice(Math.max(0, i - 1), i + 2))) at.add(i);
    }
    return [...at].sort((a, b) => a - b);
  }

  build() {
    const bar = document.createElement("div");
    bar.className = "controls";
    this.bar = bar;
    const step = (act, text, name) => `<button type="button" data-act="${act}" title="${name}" aria-label="${name}">${text}</button>`;
    const snaps = (act, text, name) => (this.snaps.length ? step(act, text, name) : "");
    bar.innerHTML = `<button type="button" class="play"></button>
      <span class="steps">${snaps("[", "|‹", "previous snap")}${step("ArrowLeft", "‹", "one frame back")}${step("ArrowRight", "›", "one frame forward")}${snaps("]", "›|", "next snap")}</span>
      <div class="scrub"><input type="range" min="0" max="${this.count - 1}" step="1" value="0" aria-label="frame"><canvas aria-hidden="true"></canvas></div>
      <label>playback speed <select aria-label="playback speed">${[0.125, 0.25, 0.5, 1, 2, 4, 8].map((s) => `<option${s === 1 ? " selected" : ""}>${s}</option>`).join("")}</select></label>
      <label><input type="checkbox" class="even"> even in time</label>
      <label><input type="checkbox" class="ghosts" checked> ghosts</label>
      <div class="status" role="status" aria-live="off"></div>`;
    document.getElementById("stage").append(bar);
    const part = (name) => bar.querySelector(name);
    [this.button, this.slider, this.select, this.status] = [".play", "input[type=range]", "select", ".status"].map(part);
    [this.evenBox, this.ghostBox, this.ticks] = [".even", ".ghosts", ".scrub canvas"].map(part);
    this.button.addEventListener("click", () => this.play(!this.playing));
    this.slider.addEventListener("input", () => this.go(Number(this.slider.value)));
    this.select.addEventListener("change", () => (this.speed = Number(this.select.value)));
    this.evenBox.addEventListener("change", () => (this.even = this.evenBox.checked));
    this.ghostBox.addEventListener("change", () => this.setGhosts(this.ghostBox.checked));
    for (const button of bar.querySelectorAll("[data-act]")) button.addEventListener("click", () => this.actions(1)[button.dataset.act]());
    this.play(false);
  }

  /** Adds a box to the bar that turns something on and off, and a key that does the same. */
  choice(key, name, on, set) {
    const label = document.createElement("label"), box = document.createElement("input");
    Object.assign(box, { type: "checkbox", checked: on });
    label.append(box, ` ${name}`);
    this.bar.insertBefore(label, this.status);
    const to = (now) => {
      set((box.checked = now));
      this.draw();
    };
    box.addEventListener("change", () => to(box.checked));
    this.choices.set(key, () => to(!box.checked));
  }

  setGhosts(on) {
    this.ghosts = this.ghostBox.checked = on;
    this.show(this.frame);
  }

  play(on) {
    this.playing = on;
    this.button.textContent = on ? "❚❚ pause" : "▶ play";
    if (on && this.frame === this.count - 1) this.go(0, true);
  }

  /** Shows a picture; whoever asks for one by hand stops the motion. */
  go(frame, on = false) {
    if (!on && this.playing) this.play(false);
    this.frame = Math.max(0, Math.min(this.count - 1, frame));
    this.stood = 0;
    this.draw();
    if (!on) follow(this.frame + 1);
  }

  draw() {
    this.slider.value = this.frame;
    this.slider.setAttribute("aria-valuetext", `t = ${told(data.t[this.frame])}`);
    this.status.textContent = this.words();
    this.show(this.frame);
  }

  words() {
    const i = this.frame, time = data.units.time;
    const on = data.on.of[i] === null ? "" : ` · ${data.exact ? "on" : "near"} ${data.on.names[data.on.of[i]]}`;
    const where = { ".": "", f: " · at the fold, before the snap", y: " · during the snap: time is stopped", l: " · after the snap" }[data.place[i]];
    const passes = this.even ? (data.t[this.count - 1] - data.t[0]) / this.count : data.t[Math.min(i + 1, this.count - 1)] - data.t[i];
    const pace = data.place[i] === "." && i < this.count - 1 ? ` · playback speed: ${told(Number((passes * PACE * this.speed).toPrecision(2)))} ${time || "time units"} per second` : "";
    return `t = ${told(data.t[i])}${time && ` ${time}`} · frame ${i + 1} of ${this.count}${on}${where}${pace}`;
  }

  tick(now, before) {
    if (this.playing) this.advance(Math.min(0.1, (now - before) / 1000));
    requestAnimationFrame((next) => this.tick(next, now));
  }

  advance(seconds) {
    let frame = this.frame;
    const last = this.count - 1;
    this.stood += seconds * PACE * this.speed;
    // How long picture i stands.
    const mean = (data.t[last] - data.t[0]) / last;
    const stands = (i) => (i === last ? REST : this.even ? (data.t[i + 1] - data.t[i]) / mean : this.stands[i]);
    while (this.stood >= stands(frame)) {
      this.stood -= stands(frame);
      frame = frame === last ? 0 : frame + 1;
    }
    if (frame !== this.frame) {
      this.frame = frame;
      this.draw();
    }
  }

  key(e) {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const on = e.target, own = on.tagName === "SELECT" || (on.tagName === "INPUT" && on.type === "range" && /^(Arrow|Home|End|Page)/.test(e.key) && !e.shiftKey);
    if (own && on === this.slider && /^Arrow(Up|Down)$/.test(e.key) === false) return;
    if (on.tagName === "SELECT" || ((on.tagName === "BUTTON" || on.type === "checkbox") && e.key === " ")) return;
    const name = e.key.length === 1 ? e.key.toLowerCase() : e.key;
    const action = this.choices.get(name) ?? this.actions(e.shiftKey ? 10 : 1)[name];
    if (!action) return;
    e.preventDefault();
    action();
  }

  /** What keys and buttons do; steps are so many frames. */
  actions(by) {
    const speeds = Array.from(this.select.options, (option) => Number(option.value));
    const faster = (k) => {
      this.speed = speeds[Math.max(0, Math.min(speeds.length - 1, speeds.indexOf(this.speed) + k))];
      this.select.value = String(this.speed);
    };
    return {
      " ": () => this.play(!this.playing),
      ArrowLeft: () => this.go(this.frame - by),
      ArrowRight: () => this.go(this.frame + by),
      Home: () => this.go(0),
      End: () => this.go(this.count - 1),
      "[": () => this.go(this.snaps.filter((i) => i < this.frame).at(-1) ?? 0),
      "]": () => this.go(this.snaps.find((i) => i > this.frame) ?? this.count - 1),
      ArrowUp: () => faster(1),
      ArrowDown: () => faster(-1),
      t: () => (this.even = this.evenBox.checked = !this.even),
      g: () => this.setGhosts(!this.ghosts),
    };
  }

  /** Marks where snaps are below the scrubber. */
  mark() {
    const canvas = this.ticks, g = canvas.getContext("2d"), sharp = window.devicePixelRatio || 1;
    [canvas.width, canvas.height] = [canvas.clientWidth * sharp, canvas.clientHeight * sharp];
    g.fillStyle = ORANGE;
    // The middle of the knob moves between these ends.
    const inset = 8 * sharp;
    for (const i of this.snaps) g.fillRect(inset + (i / (this.count - 1)) * (canvas.width - 2 * inset) - sharp, 0, 2 * sharp, canvas.height);
  }
}
