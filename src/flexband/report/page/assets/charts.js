// One chart per output: bands, their expected error, limits, and which input matters when.
"use strict";
window.flexband = window.flexband || {};
flexband.starters = flexband.starters || [];

flexband.starters.push(function (data) {
  const charts = data.charts, panel = document.querySelector("#charts .panel");
  if (!charts || !panel) return;
  panel.append(flexband.timeSlider(charts.x));
  const made = charts.outputs.map((output, k) => new flexband.Chart(charts, output, k, panel));
  const seen = new IntersectionObserver(
    (entries) => entries.forEach((e) => e.isIntersecting && made[e.target.dataset.number].draw()),
    { rootMargin: "400px" },
  );
  made.forEach((chart) => seen.observe(chart.plot));
  const rest = () => { // one by one, so that a picture of the whole page has them all
    const next = made.find((chart) => !chart.drawn);
    if (next) { next.draw(); setTimeout(rest, 20); }
  };
  addEventListener("load", () => setTimeout(rest, 300));
  flexband.ready.then(() => made[0].tell(made[0].x[made[0].widest()])); // all parts are there
  flexband.whenColorsChange(() =>
    made.forEach((chart) => (chart.drawn || flexband.printing()) && chart.draw(true)));
  document.addEventListener("flexband:time", (e) => made.forEach((c) => c.point(e.detail.time)));
  document.addEventListener("flexband:what-if", (e) => made.forEach((c) => c.compare(e.detail)));
});

/** What the lower chart shows. */
flexband.MATTERS = "Lower chart: how much narrower the band gets without that tolerance (below zero: wider). " +
  "The curves need not add up.";

flexband.Chart = class {
  constructor(charts, output, number, panel) {
    Object.assign(this, { charts, output, number, drawn: false, other: null });
    this.x = charts.x.values.values;
    this.all = flexband.curvesOf(output, this.x.length);
    const span = this.x[this.x.length - 1] - this.x[0], slowest = Math.min(...charts.carriers);
    this.rings = output.rings && charts.carriers.length > 0;
    this.view = output.narrow ? "deviation" : "values";
    if (this.rings && span * slowest > 40) this.view = "envelope"; // else they are a smear
    const figure = panel.appendChild(flexband.element("figure", { className: "chart" }));
    this.title = output.unit ? `${output.name} [${output.unit}]` : output.name;
    figure.append(flexband.element("h3", {}, this.title));
    figure.append(this.tools());
    const label = `Chart of ${this.title}: interval mean and interval error bar ${charts.bar}`;
    this.plot = flexband.element("div", { className: "plot", role: "img", "aria-label": label });
    this.plot.dataset.number = number;
    this.plot.style.height = output.contributions ? "32rem" : "22rem";
    this.reading = flexband.element("p", { className: "reading", "aria-live": "polite" });
    this.background = flexband.element("p");
    this.outside = flexband.element("p", { className: "note" });
    const end = this.all.mean[0].findLastIndex((v) => !Number.isNaN(v));
    if (end < this.x.length - 1) figure.append(flexband.element("p", { className: "note" }, flexband.noBand(charts.x, end)));
    this.keys = ["above", "below"].map(() => flexband.element("div", { className: "keys" }));
    figure.append(this.keys[0], this.outside, this.plot, this.keys[1]);
    if (output.contributions) figure.append(flexband.element("p", { className: "note" }, flexband.MATTERS));
    const summary = flexband.element("summary", {}, "Inputs at these bounds, and parts of the error");
    figure.append(flexband.element("figcaption", {}, this.reading,
      flexband.element("details", {}, summary, this.background)));
    this.read(this.widest());
  }

  tools() {
    const bar = flexband.element("div", { className: "tools screen-only" });
    const views = { values: "Values" };
    if (this.all.nominal) views.deviation = "Deviation from nominal";
    if (this.rings) views.envelope = `Envelope over ${flexband.number(this.period())} s`;
    for (const [view, text] of Object.entries(views)) {
      const chosen = String(view === this.view);
      const button = flexband.element("button", { type: "button", "aria-pressed": chosen }, text);
      button.addEventListener("click", () => {
        this.view = view;
        for (const one of Object.keys(views).keys()) {
          bar.children[one].setAttribute("aria-pressed", String(bar.children[one] === button));
        }
        this.draw(true);
      });
      bar.append(button);
    }
    this.whole = flexband.element("button", { type: "button", "aria-pressed": "false", hidden: true }, "Whole limits");
    this.whole.addEventListener("click", () => {
      this.whole.setAttribute("aria-pressed", String(!this.showsWhole()));
      this.draw(true);
    });
    bar.append(this.whole);
    return bar;
  }

  /** Return whether the axis holds limits that are far from the bands, too. */
  showsWhole() {
    return this.whole.getAttribute("aria-pressed") === "true";
  }

  /** Return curves as the view shows them. */
  shown(curves) {
    if (this.view === "deviation") return flexband.less(curves, this.all.nominal);
    if (this.view !== "envelope") return curves;
    const narrow = this.output.narrow; // then their envelope would be that of the motion
    const own = narrow ? flexband.less(curves, this.all.nominal) : curves;
    return flexband.envelope(this.x, own, this.period());
  }

  /** Return the period of the slowest vibration. */
  period() {
    return 1 / Math.min(...this.charts.carriers);
  }

  traces() {
    const output = this.output, own = this.shown(this.all), color = flexband.color, x = this.x, found = [];
    const line = (y, name, style, more = {}) =>
      found.push({
        x, y, name: flexband.plain(name), mode: "lines", line: style, hoverinfo: "skip", ...more,
      });
    const area = ([low, high], name, fill, edge) => {
      const border = { color: edge, width: 0.8 };
      line(low, name, border, { legendgroup: name, showlegend: false });
      line(high, name, border, { legendgroup: name, fill: "tonexty", fillcolor: fill });
    };
    if (own.error) {
      const moved = (curve, sign) => curve.map((v, k) => v + sign * own.error[k]);
      const wider = [moved(own.bar[0], -1), moved(own.bar[1], 1)];
      area(wider, "± expected error", color("line"), "transparent");
    }
    area(own.bar, `interval error bar ${this.charts.bar}`, color("shade"), color("edge"));
    area(own.mean, "interval mean", color("core"), "transparent");
    found[found.length - 1].hoverinfo = "none"; // the numbers are below the chart
    if (own.nominal) line(own.nominal, "nominal", { color: color("ink"), width: 1, dash: "dot" });
    for (const limit of output.limits || []) {
      const moved = this.view === "deviation" || (this.view === "envelope" && output.narrow);
      const base = moved ? this.all.nominal : null;
      const y = base ? limit.values.values.map((v, k) => v - base[k]) : limit.values.values;
      const style = { color: color("bad"), width: 1.6, dash: "dash" };
      const named = found.some((one) => one.name === flexband.plain(limit.name));
      line(y, limit.name, style, { meta: "limit", legendgroup: limit.name, showlegend: !named });
    }
    if (this.other) {
      const changed = this.shown({ ...this.other, error: null, nominal: this.all.nominal });
      const style = { color: color("second"), width: 1.4 };
      const group = { legendgroup: "what-if" };
      line(changed.bar[0], this.other.label, style, { ...group, showlegend: false });
      line(changed.bar[1], this.other.label, style, group);
    }
    return [...found, ...this.matters()];
  }

  /** Return traces of what each input contributes to the width of the error bar. */
  matters() {
    const own = this.output.contributions, n = this.x.length;
    if (!own) return [];
    const colors = ["#2f9e63", "#8e63c7", "#b08900", "#c2417c", "#4aa8b5", "#8a6d3b", "#5a6fd6", "#7b8794"];
    const smooth = (y) => (this.rings ? flexband.smoothed(this.x, y, this.period()) : y);
    const shown = flexband.mostlyLargest(own, n, colors.length);
    const found = shown.map(({ name, values }, k) => ({
      x: this.x, y: smooth(values), name: flexband.plain(name), yaxis: "y2", mode: "lines",
      line: { color: colors[k], width: 1.6 }, hoverinfo: "skip",
    }));
    found.push({
      x: this.x, y: smooth(own.width.values), name: "width of the error bar", yaxis: "y2", mode: "lines",
      line: { color: flexband.color("ink"), width: 1 }, hoverinfo: "skip",
    });
    return found;
  }

  layout(traces) {
    const { output } = this, split = Boolean(output.contributions), { name, unit } = this.charts.x;
    const deviation = `deviation from nominal${output.unit ? ` [${output.unit}]` : ""}`;
    const envelope = output.narrow ? deviation : this.title;
    const words = { values: this.title, deviation, envelope };
    const part = output.unit ? ` [${output.unit}]` : "";
    const of = (which) => traces.filter((own) => (own.yaxis || "y") === which);
    const axis = (title, which) => flexband.plotAxis(title, flexband.largest(of(which).map((own) => own.y)));
    const { range, outside } = flexband.limitAxis(of("y"));
    this.outside.replaceChildren(...flexband.outsideInWords(outside));
    this.whole.hidden = !outside.length;
    return {
      ...flexband.plotLayout(), dragmode: "zoom", hovermode: "x", showlegend: false,
      uirevision: `${this.view} ${this.showsWhole()}`,
      xaxis: { ...flexband.plotAxis(unit ? `${name} [${unit}]` : name, this.x[this.x.length - 1]),
        anchor: split ? "y2" : "y" },
      yaxis: { ...axis(words[this.view], "y"), domain: [split ? 0.4 : 0, 1],
        ...(range && !this.showsWhole() ? { range } : { autorange: true }) },
      ...(split && { yaxis2: { ...axis(`part of the width${part}`, "y2"), domain: [0, 0.34] } }),
      shapes: this.cursor === undefined ? [] : [this.line()],
    };
  }

  line() {
    const style = { color: flexband.color("muted"), width: 1, dash: "dot" };
    return { type: "line", x0: this.cursor, x1: this.cursor, yref: "paper", y0: 0, y1: 1, line: style };
  }

  /** Draw the chart, if it is not drawn yet or has changed. */
  draw(changed = false) {
    if (this.drawn && !changed) return;
    const first = !this.drawn;
    this.drawn = true;
    const traces = flexband.shown(this.traces(), this.plot);
    Plotly.react(this.plot, traces, this.layout(traces), flexband.plotOptions);
    for (const [k, keys] of this.keys.entries()) {
      keys.replaceChildren(...flexband.keysOf(traces.filter((own) => Number(own.yaxis === "y2") === k), this.plot));
    }
    if (first) this.plot.on("plotly_hover", (event) => this.tell(event.points[0].x));
  }

  /** Tell all parts of the page of another time. */
  tell(x) {
    const time = this.x[flexband.nearest(this.x, x)];
    const detail = { time, from: "charts" };
    document.dispatchEvent(new CustomEvent("flexband:time", { detail }));
  }

  /** Move the cursor, at most every 60 ms. */
  point(time) {
    this.cursor = time;
    this.read(flexband.nearest(this.x, time));
    if (!this.drawn || this.waiting) return;
    this.waiting = true;
    setTimeout(() => {
      this.waiting = false;
      Plotly.relayout(this.plot, { shapes: [this.line()] });
    }, 60);
  }

  /** Return the place where the error bar is the widest. */
  widest() {
    const [low, high] = this.all.bar;
    return high.reduce((best, v, k) => (v - low[k] > high[best] - low[best] ? k : best), 0);
  }

  /** Write the numbers at a place below the chart. */
  read(k) {
    this.reading.textContent = flexband.readingOf(this, k);
    this.background.textContent = flexband.backgroundOf(this, k);
    this.background.parentElement.hidden = !this.background.textContent;
  }

  /** Show the bands of other inputs, or none. */
  compare(detail) {
    const n = this.x.length, part = (rows) =>
      rows.map((own) => own.subarray(this.number * n, (this.number + 1) * n));
    this.other = detail && {
      label: detail.label, mean: part(detail.mean), bar: part(detail.error_bar),
    };
    if (this.drawn) this.draw(true);
  }
};
