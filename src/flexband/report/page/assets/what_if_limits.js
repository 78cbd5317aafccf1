// The margins of limits in the what-if panel.
"use strict";

/** Return the table of margins, and what shows those of bounds; null where no limit is drawn. */
flexband.whatIfLimits = function ({ what_if: data, charts }) {
  if (!charts || !charts.limits || charts.outputs.length !== data.outputs.length) return null;
  const { element } = flexband, { sigmas, least, at } = charts.limits;
  const rows = Object.keys(least).map((name) => {
    const curves = charts.outputs.flatMap(({ limits }, output) =>
      (limits || []).filter((own) => own.name === name).map((own) => ({ ...own, output })));
    const cells = ["study", "now", "at"].map((head) => element("td", { "data-of": head }));
    const row = element("tr", {}, element("th", { scope: "row", textContent: name }), ...cells);
    const unit = curves.length ? charts.outputs[curves[0].output].unit : "";
    return { name, curves, cells, row, unit };
  }).filter(({ curves }) => curves.length);
  if (!rows.length) return null;
  data.limits = { sigmas, outputs: [...new Set(rows.flatMap(({ curves }) => curves.map((own) => own.output)))] };
  const heads = ["limit", "study", "now", "at"].map((text) =>
    element("th", { scope: "col", textContent: text }));
  const caption = `Least margin of μ ± ${sigmas === 1 ? "" : sigmas}σ (below zero: the limit is violated)`;
  const table = element("table", { className: "what-if-table what-if-limits" },
    element("caption", { textContent: caption }), element("thead", {}, element("tr", {}, ...heads)),
    element("tbody", {}, ...rows.map(({ row }) => row)));
  const shown = (v, unit) => `${flexband.power(Number(v.toPrecision(4)))}${unit && ` ${unit}`}`;

  /** Return the least margin of curves, and the time where it is. */
  function margin(curves, { times, limit_bar: [lower, upper] }) {
    let found = [Infinity];
    for (const { output, side, values } of curves) {
      times.forEach((t, k) => {
        const at = output * times.length + k, limit = values.values[t];
        const own = side === "below" ? limit - upper[at] : lower[at] - limit;
        if (own < found[0]) found = [own, charts.x.values.values[t]];
      });
    }
    return found;
  }

  /** Show the margins of bounds, or those of the study. */
  function show(bounds) {
    for (const { name, curves, cells, unit } of rows) {
      const [own, t] = bounds ? margin(curves, bounds) : [least[name], at[name]];
      const known = !bounds || bounds.done; // at a few of the times, a margin looks too large
      cells[0].textContent = shown(least[name], unit);
      cells[1].textContent = known ? shown(own, unit) : "…";
      cells[1].className = known && own < 0 ? "no" : "";
      const { name: free, unit: of } = charts.x;
      cells[2].textContent = t === undefined ? "" : `${free} = ${flexband.number(t)} ${of}`;
    }
  }
  return { table, show };
};
