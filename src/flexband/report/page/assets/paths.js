// The path of a point, and the regions in which the point is at every time.
"use strict";
window.flexband = window.flexband || {};
flexband.starters = flexband.starters || [];

flexband.starters.push(function ({ path }) {
  const panel = document.querySelector("#path .panel");
  if (!path || !panel) return;
  const [x, y] = path.names, [regions, , vertices] = path.vertices.shape;
  const n = path.nominal.shape[1], places = path.places.values;
  const text = `The path of ${x} and ${y}, and the regions of its point for ${path.bar}: at most ` +
    `${flexband.number(path.radius)} ${path.unit} from the nominal path.`;
  const plot = flexband.element("div", { className: "plot", role: "img", "aria-label": text });
  plot.style.height = "30rem";
  panel.append(plot, flexband.element("p", { className: "reading" }, text));

  /** Return the closed polygon of a region. */
  const region = (k) => [0, 1].map((axis) => {
    const own = flexband.row(path.vertices, 2 * k + axis, vertices);
    return [...own, own[0]];
  });
  const all = [[], []];
  for (let k = 0; k < regions; k++) {
    region(k).forEach((own, axis) => all[axis].push(...own, null));
  }

  function draw() {
    const color = flexband.color, axis = (name) => flexband.plotAxis(`${name} [${path.unit}]`);
    const [first, second] = region(0);
    Plotly.react(plot, [
      { x: all[0], y: all[1], mode: "lines", name: `regions ${path.bar}`, fill: "toself",
        fillcolor: color("shade"), line: { color: color("accent"), width: 0.3 }, hoverinfo: "skip" },
      { x: flexband.row(path.nominal, 0, n), y: flexband.row(path.nominal, 1, n), mode: "lines",
        name: "nominal", line: { color: color("ink"), width: 1 } },
      { x: first, y: second, mode: "lines", name: "at the cursor", fill: "toself",
        line: { color: color("second"), width: 2 }, hoverinfo: "skip" },
    ], {
      ...flexband.plotLayout(), legend: { orientation: "h", y: 1.02, yanchor: "bottom" },
      xaxis: axis(x),
      yaxis: { ...axis(y), scaleanchor: "x", scaleratio: 1 },
    }, flexband.plotOptions);
  }
  draw();
  document.addEventListener("flexband:time", ({ detail }) => {
    if (!places.length) return;
    const [first, second] = region(flexband.nearest(places, detail.time));
    Plotly.restyle(plot, { x: [first], y: [second] }, [2]);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
});
