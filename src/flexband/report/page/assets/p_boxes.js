// The distribution function of an output at a time: its bounds over the interval inputs.
"use strict";
window.flexband = window.flexband || {};
flexband.starters = flexband.starters || [];

flexband.starters.push(function ({ p_boxes: boxes, charts }) {
  const panel = document.querySelector("#p-boxes .panel");
  if (!boxes || !charts || !panel) return;
  const names = charts.outputs.map((one) => (one.unit ? `${one.name} [${one.unit}]` : one.name));
  const choice = (label, texts, start) => {
    const select = flexband.element("select", {}, ...texts.map((text, k) =>
      flexband.element("option", { value: k, selected: k === start }, text)));
    panel.append(flexband.element("label", { className: "tools" }, label, select));
    select.addEventListener("change", draw);
    return select;
  };
  const { name, unit } = charts.x;
  const output = choice("Output", names, 0);
  const place = choice(name, boxes.places.map((x) => `${flexband.number(x)} ${unit}`), 0);
  const plot = flexband.element("div", { className: "plot", role: "img" });
  const caption = flexband.element("p", { className: "reading", "aria-live": "polite" });
  panel.append(plot, caption);
  plot.style.height = "20rem";

  function draw() {
    const o = Number(output.value), p = Number(place.value), color = flexband.color;
    const n = boxes.values[o].shape[1];
    const x = flexband.row(boxes.values[o], p, n);
    const [lower, upper] = [0, 1].map((b) => flexband.row(boxes.distribution[o], 2 * p + b, n));
    const line = { color: color("accent"), width: 1 };
    const traces = [
      { x, y: lower, name: "lowest", line, mode: "lines" },
      { x, y: upper, name: "highest", line, mode: "lines", fill: "tonexty", fillcolor: color("shade") },
    ];
    Plotly.react(plot, traces, {
      ...flexband.plotLayout(), showlegend: false, hovermode: "x",
      xaxis: flexband.plotAxis(names[o], flexband.largest([x])),
      yaxis: { ...flexband.plotAxis("probability of a value up to this"), range: [0, 1] },
    }, flexband.plotOptions);
    const median = [upper, lower].map((f) => x[f.findIndex((v) => v >= 0.5)]);
    const size = x[n - 1] - x[0];
    caption.textContent = `The median of ${names[o]} at ${name} = ` +
      `${flexband.number(boxes.places[p])} ${unit} is between ` +
      `${flexband.number(median[0], size / 1000)} and ${flexband.number(median[1], size / 1000)}. ` +
      `Probabilities are of ${boxes.samples} samples of the surrogate, ` +
      `± ${flexband.number(Number(boxes.error[o][p].toPrecision(2)))}.`;
    plot.setAttribute("aria-label", caption.textContent);
  }
  draw();
  document.addEventListener("flexband:time", ({ detail }) => {
    const next = flexband.nearest(boxes.places, detail.time);
    if (next === Number(place.value)) return;
    place.value = next;
    draw();
  });
  flexband.whenColorsChange(draw);
});
