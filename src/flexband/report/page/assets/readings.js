// The numbers of an output at the cursor, in words.
"use strict";
window.flexband = window.flexband || {};

/** Part of the largest width below which an input is left out where the worst inputs are told. */
flexband.HARDLY = 0.005;

/** Return from which place on an output has no band, in words. */
flexband.noBand = ({ name, unit, values }, end) => (end < 0 ? "No band holds" :
  `No band holds after ${name} = ${flexband.number(values.values[end])} ${unit}`.trimEnd()) +
  ": the motion of a single part is unpredictable. Sampled parts show how peaks and counts are distributed.";

/** Return the bands of a chart's output at place k. */
flexband.readingOf = function ({ all, output, charts, x }, k) {
  const { name, unit } = charts.x, g = flexband.number;
  if (Number.isNaN(all.mean[0][k])) return `${name} = ${g(x[k])} ${unit}: no band.`;
  const finest = (all.bar[1][k] - all.bar[0][k]) / 1000 || Infinity;
  const range = (pair) => `${g(pair[0][k], finest)} … ${g(pair[1][k], finest)}`;
  const spread = ([low, high]) => high[k] - low[k], wider = 1 - spread(all.mean) / spread(all.bar);
  const of = output.unit ? ` ${output.unit}` : "";
  let text = `${name} = ${g(x[k])} ${unit}: interval mean ${range(all.mean)}${of}, ` +
    `error bar ${range(all.bar)}${of}`;
  if (wider > 0 && wider < 0.01) text += ` (only ${g(Number((100 * wider).toPrecision(2)))} % wider)`;
  if (all.nominal) text += `, nominal ${g(all.nominal[k], finest)}${of}`;
  if (all.error) text += `; expected error ± ${g(all.error[k])}${of}`;
  return `${text}.`;
};

/** Return the inputs with which the bounds are reached at place k, and the parts of the expected error. */
flexband.backgroundOf = function (chart, k) {
  const { output, charts, x } = chart, g = flexband.number, told = [];
  const own = output.worst ? flexband.mattering(chart) : [];
  if (own.length) {
    const at = (b) => own.map(
      (i) => `${charts.inputs[i]} = ${g(output.worst.values[(2 * i + b) * x.length + k])} ${charts.input_units[i]}`
        .trimEnd()).join(", ");
    const few = own.length < charts.inputs.length;
    const others = few ? `; others matter by less than ${100 * flexband.HARDLY} % of the width` : "";
    told.push(`Lowest with ${at(0)}; highest with ${at(1)}${others}.`);
  }
  const parts = Object.entries(output.errors || {}).map(([w, e]) =>
    `${w} ${g(e.values[k])} ${output.unit}`.trimEnd());
  if (parts.length) told.push(`Parts of the expected error: ${parts.join(", ")}.`);
  return told.join(" ");
};

/** Return the numbers of the interval inputs that an output depends on, as far as is known. */
flexband.mattering = function ({ output, charts, x }) {
  const all = [...charts.inputs.keys()], own = output.contributions;
  if (!own) return all;
  const least = flexband.HARDLY * flexband.largest([own.width.values]);
  return all.filter((i) => {
    const k = own.names.indexOf(charts.inputs[i]);
    return k < 0 || flexband.largest([flexband.row(own.values, k, x.length)]) > least;
  });
};
