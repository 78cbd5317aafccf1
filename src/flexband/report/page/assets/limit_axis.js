// The axis of bands that have limits: limits which are far away do not flatten the bands.
"use strict";
window.flexband = window.flexband || {};

/** Part of the bands' range by which limits widen the axis at each end. */
flexband.REACH = 1;

/** Return the range of traces of bands with the limits near them, and the limits that leave it.
 *
 * Traces of limits have the meta "limit". Without any that leave it, the range is null.
 */
flexband.limitAxis = function (traces) {
  const limits = traces.filter((own) => own.meta === "limit");
  let [low, high] = flexband.ends(traces.filter((own) => own.meta !== "limit"));
  const reach = flexband.REACH * (high - low), [least, most] = [low - reach, high + reach];
  const near = (v) => v >= least && v <= most;
  if (!(reach > 1e-9 * Math.max(Math.abs(low), Math.abs(high)))) return { range: null, outside: [] };
  for (const v of limits.flatMap((own) => Array.from(own.y).filter(near))) {
    [low, high] = [Math.min(low, v), Math.max(high, v)];
  }
  const margin = 0.05 * (high - low), names = new Map();
  for (const { legendgroup: name, y } of limits) {
    const own = Array.from(y).filter(Number.isFinite), inside = own.filter(near).length;
    if (inside < own.length) names.set(name, (names.get(name) || 0) + inside);
  }
  const outside = Array.from(names, ([name, inside]) => ({ name, inside }));
  return { range: outside.length ? [low - margin, high + margin] : null, outside };
};

/** Return the least and the largest finite value of traces. */
flexband.ends = (traces) => traces.reduce((found, { y }) => y.reduce(
  ([low, high], v) => (Number.isFinite(v) ? [Math.min(low, v), Math.max(high, v)] : [low, high]), found),
  [Infinity, -Infinity]);

/** Return which limits leave the axis, in words, and how to see them. */
flexband.outsideInWords = function (outside) {
  const told = outside.map(({ name, inside }) => (inside
    ? `“${name}” is outside this axis where it is far from the bands.`
    : `“${name}” is far from the bands at all times, outside this axis.`));
  const how = flexband.element("span", { className: "screen-only" }, " “Whole limits”, or a double click, widens it.");
  return told.length ? [told.join(" "), how] : [];
};
