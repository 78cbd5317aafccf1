// The path of a point, and the regions in which the point is at every time.
"use strict";
window.flexband = window.flexband || {};
flexband.starters = flexband.starters || [];

/** Part of the path's size that the largest region has at most after it has been magnified. */
flexband.PATH_PART = 0.05;

/** Least length of an axis relative to the path's size, since a path along a guide has no width. */
flexband.PATH_WIDTH = 0.3;

flexband.starters.push(function ({ path }) {
  const panel = document.querySelector("#path .panel");
  if (!path || !panel) return;
  const { element, number, row, color } = flexband;
  const [x, y] = path.names, [regions, , vertices] = path.vertices.shape;
  const n = path.nominal.shape[1], places = path.places.values;
  const nominal = [0, 1].map((axis) => row(path.nominal, axis, n));
  const size = Math.max(...nominal.map((own) => Math.max(...own) - Math.min(...own)));
  const wanted = path.radius > 0 ? (flexband.PATH_PART * size) / path.radius : 1;
  const own = wanted > 2 ? flexband.roundNumber(wanted) : 1;
  const factors = [...new Set([1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, own])].sort((a, b) => a - b);
  const select = element("select", {}, ...factors.map((factor) =>
    element("option", { value: factor, selected: factor === own }, `× ${factor}`)));
  const plot = element("div", { className: "plot", role: "img" });
  const caption = element("p", { className: "reading" }), keys = element("div", { className: "keys" });
  plot.style.height = "30rem";
  panel.append(element("label", { className: "tools screen-only" }, "Deviations from the nominal path ", select),
    keys, plot, caption);

  /** Return the closed polygon of a region, magnified about the nominal point. */
  const region = (k) => [0, 1].map((axis) => {
    const middle = nominal[axis][k * path.step], factor = Number(select.value);
    const all = Array.from(row(path.vertices, 2 * k + axis, vertices), (v) => middle + factor * (v - middle));
    return [...all, all[0]];
  });
  let cursor = 0;

  function draw() {
    const factor = Number(select.value), all = [[], []];
    for (let k = 0; k < regions; k++) region(k).forEach((own, a) => all[a].push(...own, null));
    const axis = (name, a) => {
      const values = [...nominal[a], ...all[a].filter((v) => v !== null)];
      const low = Math.min(...values), high = Math.max(...values), least = flexband.PATH_WIDTH * size;
      const range = high - low < least ? { range: [(low + high - least) / 2, (low + high + least) / 2] } : {};
      return { ...flexband.plotAxis(`${name} [${path.unit}]`, size), ...range };
    };
    const [first, second] = region(cursor);
    const [large, told] = factor === 1 ? ["", ""] : [`, deviations drawn ${factor} times as large`,
      " The numbers that the mouse shows beside the path are not magnified."];
    caption.textContent = `The path of ${x} and ${y}, and the regions of its point for ${path.bar}${large}: at most ` +
      `${number(path.radius)} ${path.unit} from the nominal path.${told}`;
    plot.setAttribute("aria-label", caption.textContent);
    const names = [x, y].map(flexband.plain), unit = flexband.plain(path.unit);
    const traces = flexband.shown([
      { x: all[0], y: all[1], mode: "lines", name: `regions ${path.bar}${factor === 1 ? "" : `, × ${factor}`}`,
        fill: "toself", fillcolor: color("shade"), line: { color: color("accent"), width: 0.3 }, hoverinfo: "skip" },
      { x: nominal[0], y: nominal[1], mode: "lines", name: "nominal", line: { color: color("ink"), width: 1 },
        customdata: Array.from(path.reach.values, (v) => number(v)),
        hovertemplate: `${names[0]} %{x} ${unit}<br>${names[1]} %{y} ${unit}<br>` +
          `at most %{customdata} ${unit} away<extra></extra>` },
      { x: first, y: second, mode: "lines", name: "at the cursor", fill: "toself",
        fillcolor: "transparent", line: { color: color("second"), width: 2 }, hoverinfo: "skip" },
    ], plot);
    keys.replaceChildren(...flexband.keysOf(traces, plot));
    Plotly.react(plot, traces, {
      ...flexband.plotLayout(), showlegend: false,
      xaxis: axis(x, 0),
      yaxis: { ...axis(y, 1), scaleanchor: "x", scaleratio: 1 },
    }, flexband.plotOptions);
  }
  draw();
  select.addEventListener("change", draw);
  document.addEventListener("flexband:time", ({ detail }) => {
    if (!places.length) return;
    cursor = flexband.nearest(places, detail.time);
    const [first, second] = region(cursor);
    Plotly.restyle(plot, { x: [first], y: [second] }, [2]);
  });
  flexband.whenColorsChange(draw);
});
