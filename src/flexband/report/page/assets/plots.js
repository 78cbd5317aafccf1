// What charts have in common: the cursor, legends, layouts, options.
"use strict";
window.flexband = window.flexband || {};

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

/** Return traces without those whose names were switched off in the legend of a plot. */
flexband.shown = (traces, plot) => {
  plot.off ??= new Set();
  return traces.map((own) => ({ ...own, visible: !plot.off.has(own.legendgroup || own.name) }));
};

/** Return the names of traces with their colours and dashes: a legend, which switches traces off and on. */
flexband.keysOf = (traces, plot) => traces.filter((own) => own.showlegend !== false).map((own) => {
  const name = own.name.replaceAll("&lt;", "<").replaceAll("&amp;", "&"), group = own.legendgroup || own.name;
  const key = flexband.element("button", { type: "button", title: "Show or hide" }, name);
  key.setAttribute("aria-pressed", own.visible !== false);
  key.addEventListener("click", () => {
    const visible = plot.off.delete(group);
    if (!visible) plot.off.add(group);
    key.setAttribute("aria-pressed", visible);
    const which = plot.data.flatMap((trace, k) => ((trace.legendgroup || trace.name) === group ? [k] : []));
    Plotly.restyle(plot, { visible }, which);
  });
  key.className = own.fill && own.fillcolor !== "transparent" ? "area" : { dot: "dotted", dash: "dashed" }[own.line.dash] || "solid";
  key.style.setProperty("--key", key.className === "area" ? own.fillcolor : own.line.color);
  return key;
});

/** Return the largest absolute value of curves. */
flexband.largest = (curves) => curves.reduce(
  (most, own) => own.reduce((a, v) => (Math.abs(v) > a ? Math.abs(v) : a), most), 0);

/** Return the largest contributions, the first ones, and the sum of the others as the last one. */
flexband.mostlyLargest = function ({ names, values }, n, most) {
  const all = names.map((name, k) => ({ name, values: flexband.row(values, k, n) }));
  if (all.length <= most) return all;
  const others = all.slice(most - 1), sum = new Float64Array(n);
  for (const own of others) own.values.forEach((v, k) => { sum[k] += v; });
  return [...all.slice(0, most - 1), { name: `${others.length} others`, values: sum }];
};

/** Return what layouts of all charts have in common, in the colours of the page. */
flexband.plotLayout = () => ({
  paper_bgcolor: "transparent", plot_bgcolor: "transparent",
  font: { color: flexband.color("ink"), family: "system-ui, sans-serif", size: 12 },
  margin: { l: 64, r: 12, t: 8, b: 44 },
  ...(flexband.printing() ? { autosize: false, ...flexband.PAPER } : { autosize: true }),
});

/** Return an axis with a title, whose numbers are written as in tables, without prefixes of units. */
flexband.plotAxis = function (title, largest = 1) {
  const line = flexband.color("line"), plain = largest === 0 || (largest >= 1e-4 && largest < 1e6);
  const text = { text: flexband.plain(title), font: { size: 12 }, standoff: 8 };
  return { gridcolor: line, zerolinecolor: line, linecolor: line, title: text, automargin: true,
    exponentformat: plain ? "none" : "e" };
};

/** Options of charts: no button that sends anything anywhere. */
flexband.plotOptions = {
  responsive: true, displaylogo: false, toImageButtonOptions: { format: "svg" },
  modeBarButtons: [["toImage", "zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"]],
};

/** Return a text in which Plotly finds no markup. */
flexband.plain = (text) => text.replace(/[<&]/g, (c) => (c === "<" ? "&lt;" : "&amp;"));
