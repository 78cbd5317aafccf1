// The animated mechanism: a drawing, a time slider, a play button and what is drawn.
"use strict";
window.flexband = window.flexband || {};
flexband.starters = flexband.starters || [];

/** Return a length in metres, as all lengths of the page are, such as "0.00021 m". */
flexband.shownLength = (metres) => `${flexband.power(Number(metres.toPrecision(3)))} m`;

flexband.MotionPlayer = class {
  constructor(panel, data) {
    this.scene = new flexband.MotionScene(data);
    this.frame = 0;
    this.playing = false;
    const { times, count, samples, largestApart, size } = this.scene;
    this.duration = times[count - 1] - times[0];
    const wanted = largestApart ? (0.05 * size) / largestApart : 1;
    this.options = { factor: wanted > 2 ? flexband.roundNumber(wanted) : 1, samples: samples > 0, forces: true, names: false };
    this.build(panel);
    this.pen = new flexband.Pen(this.canvas);
    this.listen();
    this.restyle();
    this.say();
  }

  build(panel) {
    const { element } = flexband, { count, samples } = this.scene;
    this.canvas = element("canvas", { className: "motion-canvas", tabIndex: 0, role: "img" });
    this.legend = element("figcaption", { className: "motion-legend" });
    this.button = element("button", { type: "button", className: "motion-play" });
    this.slider = element("input", {
      type: "range", min: 0, max: count - 1, step: 1, value: 0, "aria-label": "time of the drawing",
    });
    this.output = element("span", { className: "motion-time" });
    const real = flexband.power(Number(this.duration.toPrecision(3)));
    this.speed = this.select([["8 s", 8], ["30 s", 30], [`${real} s, real time`, 0]], 8);
    const factors = [...new Set([1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, this.options.factor])];
    this.factor = this.select(factors.map((f) => [`× ${f}`, f]), this.options.factor);
    const play = element("div", { className: "motion-play-row screen-only" }, this.button, this.slider, this.output);
    const rest = element("div", { className: "motion-options screen-only" });
    rest.append(element("label", {}, "Duration ", this.speed));
    if (samples) rest.append(element("label", {}, "Deviations ", this.factor));
    for (const [name, text, shown] of [
      ["samples", "samples", samples > 0], ["forces", "forces", this.scene.largestForce > 0], ["names", "names", true],
    ]) {
      if (shown) rest.append(this.checkbox(name, text));
    }
    this.zooming = ["+", "−", "reset"].map((text) => element("button", {
      type: "button", textContent: text,
      "aria-label": { "+": "zoom in", "−": "zoom out", reset: "show the whole mechanism" }[text],
    }));
    rest.append(element("span", { className: "motion-zoom", role: "group", "aria-label": "zoom" }, ...this.zooming));
    if (count < 2) play.hidden = true;
    panel.append(element("figure", { className: "motion-figure" }, this.canvas, play, this.legend), rest);
  }

  select(options, value) {
    const made = flexband.element("select");
    for (const [text, own] of options) {
      made.append(flexband.element("option", { textContent: text, value: String(own), selected: own === value }));
    }
    return made;
  }

  checkbox(name, text) {
    const box = flexband.element("input", { type: "checkbox", checked: this.options[name] });
    box.addEventListener("change", () => {
      this.options[name] = box.checked;
      this.restyle();
    });
    return flexband.element("label", {}, box, ` ${text}`);
  }

  listen() {
    this.button.addEventListener("click", () => this.toggle());
    this.slider.addEventListener("input", () => {
      const frame = Number(this.slider.value); // before stop() tells the old one
      this.stop();
      this.show(frame, true);
    });
    this.factor.addEventListener("change", () => {
      this.options.factor = Number(this.factor.value);
      this.restyle();
    });
    for (const own of [this.canvas, this.slider]) {
      own.addEventListener("keydown", (event) => this.key(event));
    }
    document.addEventListener("flexband:time", ({ detail }) => {
      if (detail.from !== "motion") {
        this.stop();
        this.show(this.nearest(detail.time, this.scene.onAxis), false);
      }
    });
    this.zooming[0].addEventListener("click", () => this.zoom(1.6));
    this.zooming[1].addEventListener("click", () => this.zoom(1 / 1.6));
    this.zooming[2].addEventListener("click", () => this.zoom(0));
    this.canvas.addEventListener("pointermove", (event) => this.pan(event));
    new ResizeObserver(() => this.redraw()).observe(this.canvas.parentElement);
    flexband.whenColorsChange(() => {
      this.restyle();
      this.paint();
    });
  }

  key(event) {
    const last = this.scene.count - 1;
    const moved = { ArrowRight: 1, ArrowLeft: -1, PageUp: 10, PageDown: -10, Home: -last, End: last }[event.key];
    if (event.key === " ") this.toggle();
    else if (moved && event.target === this.canvas) {
      this.stop();
      this.show(this.frame + moved, true);
    } else return;
    event.preventDefault();
  }

  zoom(factor) {
    const { pen } = this;
    pen.zoom = factor ? Math.min(200, Math.max(1, pen.zoom * factor)) : 1;
    pen.center = pen.zoom > 1 ? pen.center || pen.middle : null;
    this.canvas.style.touchAction = pen.zoom > 1 ? "none" : "";
    this.canvas.style.cursor = pen.zoom > 1 ? "grab" : "";
    this.redraw();
  }

  pan(event) {
    const { pen } = this;
    if (!(event.buttons & 1) || pen.zoom === 1) return;
    pen.center = [pen.middle[0] - event.movementX / pen.scale, pen.middle[1] + event.movementY / pen.scale];
    this.redraw();
  }

  nearest(place, places = this.scene.times) {
    let best = 0;
    places.forEach((own, k) => {
      if (Math.abs(own - place) < Math.abs(places[best] - place)) best = k;
    });
    return best;
  }

  toggle() {
    if (this.playing) return this.stop();
    if (this.frame === this.scene.count - 1) this.show(0, true);
    this.playing = true;
    this.say();
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const begin = { clock: performance.now(), time: this.scene.times[this.frame] };
    const advance = (clock) => {
      if (!this.playing) return;
      const passed = Math.max(0, clock - begin.clock) / 1000;
      const steady = calm ? Math.floor(passed / 0.5) * 0.5 : passed; // no smooth motion
      const frame = this.nearest(begin.time + steady * this.rate());
      if (frame !== this.frame) this.show(frame, true);
      if (this.frame === this.scene.count - 1) this.stop();
      else requestAnimationFrame(advance);
    };
    requestAnimationFrame(advance);
  }

  /** Return how many seconds of the motion are shown in a second. */
  rate() {
    const wanted = Number(this.speed.value);
    return wanted ? this.duration / wanted : 1;
  }

  stop() {
    this.playing = false;
    this.say();
  }

  /** Show an instant; `tell` whether the rest of the page is to follow. */
  show(frame, tell) {
    this.frame = Math.min(this.scene.count - 1, Math.max(0, frame));
    this.say();
    this.redraw();
    const detail = { time: this.scene.onAxis[this.frame], from: "motion" };
    if (tell) document.dispatchEvent(new CustomEvent("flexband:time", { detail }));
  }

  /** Tell in words what is shown. */
  say() {
    const time = `t = ${this.seconds(this.scene.times[this.frame])}`;
    this.button.textContent = this.playing ? "❚❚ Pause" : "▶ Play";
    this.slider.value = String(this.frame);
    this.slider.setAttribute("aria-valuetext", time);
    this.output.textContent = time;
    const { data, samples, apart } = this.scene;
    const names = (items) => items.join(", ") || "none";
    const spread = samples ? ` The samples, ${samples} in number, deviate from it by at most ${flexband.shownLength(apart[this.frame])}.` : "";
    this.canvas.setAttribute("aria-label",
      `Drawing of the mechanism at ${time}. Bodies: ${names(data.names.bodies)}. Joints: ${names(data.names.joints)}.` +
      ` Loads: ${names(data.names.loads)}.${spread}`);
    this.now.textContent = samples ? ` Largest deviation now: ${flexband.shownLength(apart[this.frame])}.` : "";
  }

  /** Return a time with as many digits as tell apart instants of the motion. */
  seconds(time) {
    const step = this.duration / Math.max(1, this.scene.count - 1) || 1;
    return `${flexband.withMinus(time.toFixed(Math.max(0, Math.min(6, -Math.floor(Math.log10(step))))))} s`;
  }

  /** Draw with other colours or options. */
  restyle() {
    this.pen.readColors();
    this.tellLegend();
    this.redraw();
  }

  tellLegend() {
    const { element } = flexband, { samples, largestForce, largestAt, data } = this.scene, { options } = this;
    const entry = (kind, text) => element("span", { className: `motion-key motion-key-${kind}` }, text);
    const parts = [entry("nominal", "nominal motion")];
    if (options.samples) {
      const often = options.factor === 1 ? "true to scale" : `deviations drawn ${options.factor} times as large`;
      parts.push(entry("sample", `${samples} ${samples === 1 ? "sample" : "samples"} of the inputs, ${often}`));
    }
    if (options.forces && largestForce) {
      const { name, time } = largestAt, size = flexband.power(Number(largestForce.toPrecision(3)));
      parts.push(entry("reaction", `reactions; the longest arrow is ${size} N, at ${name}, t = ${this.seconds(time)}`));
    }
    if (data.forces.some((own) => own.kind === "force") && options.forces) parts.push(entry("load", "applied forces"));
    if (data.traces.length) parts.push(entry("trace", "paths of measured points"));
    if (options.names) parts.push(element("span", {}, "Names that would overlap are left out: zoom in."));
    this.now = this.now || element("span", { className: "motion-now" });
    this.legend.replaceChildren(...parts, this.now);
  }

  redraw() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = 0;
      this.paint();
    });
  }

  paint() {
    const { scene, pen } = this, [[left, bottom], [right, top]] = scene.box;
    const width = flexband.printing() ? flexband.PAPER.width : this.canvas.parentElement.clientWidth;
    if (!width) return;
    const flat = (top - bottom + 0.2 * scene.size) / (right - left + 0.2 * scene.size || 1);
    const height = Math.round(Math.min(Math.max(flat * width, 0.36 * width, 180), 0.72 * window.innerHeight, 560));
    this.canvas.style.height = `${height}px`;
    pen.begin(scene.box, width, height);
    scene.draw(pen, this.frame, this.options);
    this.drawScale();
  }

  drawScale() {
    const { pen } = this, length = flexband.roundNumber((0.22 * pen.width) / pen.scale);
    const y = pen.height - 12 * pen.point, ends = [14 * pen.point, 14 * pen.point + length * pen.scale];
    const [start, end] = ends.map((x) => pen.place([x, y]));
    pen.line([start, end], { color: "muted", width: 1.5 });
    for (const place of [start, end]) pen.line(pen.local(place, [0, 1], [[-3, 0], [3, 0]]), { color: "muted" });
    pen.text(end, flexband.shownLength(length), { color: "muted", shift: [6, 0], align: "left" });
  }
};

flexband.starters.push(function (data) {
  const panel = document.querySelector("#motion .panel");
  if (panel && data.motion) flexband.motion = new flexband.MotionPlayer(panel, data.motion);
});
