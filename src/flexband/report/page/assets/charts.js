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
  flexband.ready.then(() => made[0].tell(made[0].x[made[0].widest()])); // all parts are there
  const again = () => made.forEach((chart) => chart.drawn && chart.draw(true));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
  addEventListener("beforeprint", () => made.forEach((chart) => chart.draw()));
  document.addEventListener("flexband:time", (e) => made.forEach((c) => c.point(e.detail.time)));
  document.addEventListener("flexband:what-if", (e) => made.forEach((c) => c.compare(e.detail)));
});

/** Return a slider that moves the cursor of all charts. */
flexband.timeSlider = function ({ name, unit, values }) {
  const x = values.values, row = flexband.element("label", { className: "tools screen-only" });
  const slider = flexband.element("input", { type: "range", max: x.length - 1, value: 0 });
  const text = flexband.element("span");
  const show = (k) => {
    text.textContent = `${name} = ${flexband.number(x[k])} ${unit}`;
    slider.setAttribute("aria-valuetext", text.textContent);
  };
  slider.style.flex = "1";
  slider.addEventListener("input", () => {
    const detail = { time: x[slider.value], from: "slider" };
    document.dispatchEvent(new CustomEvent("flexband:time", { detail }));
  });
  document.addEventListener("flexband:time", ({ detail }) => {
    const k = flexband.nearest(x, detail.time);
    slider.value = k;
    show(k);
  });
  show(0);
  row.append(flexband.element("span", {}, "Cursor"), slider, text);
  return row;
};

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
    this.plot.style.height = output.contributions ? "36rem" : "24rem";
    this.reading = flexband.element("figcaption", { className: "reading", "aria-live": "polite" });
    this.keys = flexband.element("div", { className: "keys" });
    figure.append(this.plot, this.keys, this.reading);
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
        for (const one of bar.children) one.setAttribute("aria-pressed", String(one === button));
        this.draw(true);
      });
      bar.append(button);
    }
    return bar;
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
    area(own.bar, `interval error bar ${this.charts.bar}`, color("shade"), color("accent"));
    area(own.mean, "interval mean", color("accent"), color("accent"));
    found[found.length - 1].hoverinfo = "none"; // the numbers are below the chart
    if (own.nominal) line(own.nominal, "nominal", { color: color("ink"), width: 1, dash: "dot" });
    for (const limit of output.limits || []) {
      const moved = this.view === "deviation" || (this.view === "envelope" && output.narrow);
      const base = moved ? this.all.nominal : null;
      const y = base ? limit.values.values.map((v, k) => v - base[k]) : limit.values.values;
      const style = { color: color("bad"), width: 1.6, dash: "dash" };
      const named = found.some((one) => one.name === flexband.plain(limit.name));
      line(y, limit.name, style, { legendgroup: limit.name, showlegend: !named });
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
      stackgroup: "inputs", line: { width: 0 }, fillcolor: colors[k], hoverinfo: "skip",
      legend: "legend2",
    }));
    found.push({
      x: this.x, y: smooth(own.width.values), name: "width of the error bar", yaxis: "y2", mode: "lines",
      line: { color: flexband.color("ink"), width: 1 }, hoverinfo: "skip", legend: "legend2",
    });
    return found;
  }

  layout() {
    const output = this.output, own = output.contributions;
    const narrow = this.narrow(), split = own && (narrow ? [0.3, 0, 0.36, 1] : [0.26, 0.38, 0.46, 0.93]);
    const domain = split ? [split[2], split[3]] : [0, narrow ? 1 : 0.9];
    const { name, unit } = this.charts.x;
    const deviation = `deviation from nominal${this.output.unit ? ` [${this.output.unit}]` : ""}`;
    const envelope = this.output.narrow ? deviation : this.title;
    const words = { values: this.title, deviation, envelope };
    const axis = flexband.plotAxis, part = output.unit ? ` [${output.unit}]` : "";
    return {
      ...flexband.plotLayout(), dragmode: "zoom", hovermode: "x", uirevision: this.view,
      showlegend: !narrow,
      legend: { orientation: "h", y: 1.0, yanchor: "top", x: 0 },
      xaxis: { ...axis(unit ? `${name} [${unit}]` : name), anchor: split ? "y2" : "y" },
      yaxis: { ...axis(words[this.view]), domain },
      ...(split && {
        legend2: { orientation: "h", y: split[1], yanchor: "top", x: 0 },
        yaxis2: { ...axis(`part of the width${part}`), domain: [0, split[0]] },
      }),
      shapes: this.cursor === undefined ? [] : [this.line()],
    };
  }

  line() {
    const style = { color: flexband.color("muted"), width: 1, dash: "dot" };
    return { type: "line", x0: this.cursor, x1: this.cursor, yref: "paper", y0: 0, y1: 1, line: style };
  }

  /** Return whether legends would take several lines in the chart; they are below it then. */
  narrow() {
    return this.plot.clientWidth < 600;
  }

  /** Draw the chart, if it is not drawn yet or has changed. */
  draw(changed = false) {
    if (this.drawn && !changed) return;
    const first = !this.drawn;
    this.drawn = true;
    const traces = this.traces();
    Plotly.react(this.plot, traces, this.layout(), flexband.plotOptions);
    this.keys.replaceChildren(...(this.narrow() ? flexband.keysOf(traces) : []));
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
    const { all, output, charts } = this, { name, unit } = charts.x, g = flexband.number;
    const finest = (all.bar[1][k] - all.bar[0][k]) / 1000 || Infinity;
    const range = (pair) => `${g(pair[0][k], finest)} … ${g(pair[1][k], finest)}`;
    let text = `${name} = ${g(this.x[k])} ${unit}: interval mean ${range(all.mean)}, ` +
      `error bar ${range(all.bar)} ${output.unit}`;
    if (all.nominal) text += `, nominal ${g(all.nominal[k], finest)}`;
    if (all.error) text += `; expected error ± ${g(all.error[k])}`;
    const parts = Object.entries(output.errors || {}).map(([w, e]) => `${w} ${g(e.values[k])}`);
    if (parts.length) text += ` (${parts.join(", ")})`;
    if (output.worst && charts.inputs.length) {
      const n = this.x.length;
      const at = (b) => charts.inputs.map(
        (input, i) => `${input} = ${g(output.worst.values[(2 * i + b) * n + k])}`).join(", ");
      text += `. Lowest with ${at(0)}; highest with ${at(1)}`;
    }
    this.reading.textContent = text + ".";
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
