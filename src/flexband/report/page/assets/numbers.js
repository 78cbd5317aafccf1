// Numbers as text.
"use strict";
window.flexband = window.flexband || {};

/** Return a number with five digits, or as many as tell differences of a size. */
flexband.number = function (v, size = Infinity) {
  if (!Number.isFinite(v)) return "–";
  const digits = Math.ceil(Math.log10(Math.abs(v) / size)) + 1;
  return flexband.power(Number(v.toPrecision(Math.min(Math.max(5, digits), 15))));
};

/** Return a number as text: 0.0123 and −12300, but 7.67e−5 and 2.8e9, as report/text/numbers.py does. */
flexband.power = function (v) {
  const size = Math.abs(v), [head, power] = v.toExponential().split("e");
  return flexband.withMinus(size >= 1e6 || (size > 0 && size < 1e-4) ? `${head}e${Number(power)}` : String(v));
};

/** Return the text of a number with minus signs, as axes have, in place of hyphens. */
flexband.withMinus = (text) => text.replaceAll("-", "−");

/** Return the number rounded down to 1, 2 or 5 times a power of ten. */
flexband.roundNumber = function (value) {
  const power = 10 ** Math.floor(Math.log10(value)), digit = value / power;
  return (digit >= 5 ? 5 : digit >= 2 ? 2 : 1) * power;
};
