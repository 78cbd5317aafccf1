// Numbers of the bands of one output, and the views of them: values, deviation, envelope.
"use strict";
window.flexband = window.flexband || {};

/** Return row k of a packed array with rows of the length of the axis. */
flexband.row = (array, k, n) => array.values.subarray(k * n, (k + 1) * n);

/** Return the curves of an output: {mean: [low, high], bar: [low, high], error, nominal}. */
flexband.curvesOf = function (output, n) {
  const pair = (array) => [flexband.row(array, 0, n), flexband.row(array, 1, n)];
  return {
    mean: pair(output.mean),
    bar: pair(output.error_bar),
    error: output.error ? output.error.values : null,
    nominal: output.nominal ? output.nominal.values : null,
  };
};

/** Return curves less a base curve. */
flexband.less = function (curves, base) {
  const minus = (own) => own && own.map((v, k) => v - base[k]);
  return {
    mean: curves.mean.map(minus),
    bar: curves.bar.map(minus),
    error: curves.error,
    nominal: minus(curves.nominal),
  };
};

/** Return the largest (sign = 1) or the smallest (−1) value within half a window of each place. */
flexband.running = function (x, values, window, sign) {
  const n = x.length, found = new Float64Array(n), queue = [];
  let last = 0;
  for (let k = 0; k < n; k++) {
    while (last < n && x[last] <= x[k] + window / 2) {
      while (queue.length && sign * values[queue[queue.length - 1]] <= sign * values[last]) queue.pop();
      queue.push(last++);
    }
    while (x[queue[0]] < x[k] - window / 2) queue.shift();
    found[k] = values[queue[0]];
  }
  return found;
};

/** Return the curves of an envelope: the extremes of the bands over one period of a vibration. */
flexband.envelope = function (x, curves, period) {
  const ends = ([low, high]) => [
    flexband.running(x, low, period, -1),
    flexband.running(x, high, period, 1),
  ];
  return {
    mean: ends(curves.mean),
    bar: ends(curves.bar),
    error: curves.error && flexband.running(x, curves.error, period, 1),
    nominal: null,
  };
};

/** Return the mean of the values within half a window of each place. */
flexband.smoothed = function (x, values, window) {
  const sums = [0];
  for (const v of values) sums.push(sums[sums.length - 1] + v);
  let first = 0, last = 0;
  return Float64Array.from(x, (at) => {
    while (x[first] < at - window / 2) first++;
    while (last < x.length && x[last] <= at + window / 2) last++;
    return (sums[last] - sums[first]) / (last - first);
  });
};

/** Return the number of the place next to x in an increasing array. */
flexband.nearest = function (places, x) {
  let low = 0, high = places.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (places[middle] <= x) low = middle;
    else high = middle;
  }
  return x - places[low] <= places[high] - x ? low : high;
};
