// Bounds computed beside the page, in a worker: some times first, then all.
"use strict";
if (self.document) flexband.workerSources.push(document.currentScript.textContent);

/**
 * Return a function that computes bounds on a part of the inputs.
 * @param report gets {times, mean, error_bar, done}: of every eighth time, then of all.
 */
flexband.boundsOnRequest = function (data, report) {
  const CHUNK = 64, FEW = 100, own = new flexband.WhatIf(data);
  const all = Array.from({ length: data.times }, (_, t) => t);
  const first = data.times > FEW ? all.filter((t) => t % 8 === 0) : all;
  const rest = data.times > FEW ? all.filter((t) => t % 8 !== 0) : [];

  function empty(count) {
    const pair = () => [0, 1].map(() => new Float64Array(own.outputs * count));
    return { mean: pair(), error_bar: pair() };
  }

  /** Copy the columns `from` of some bounds to the columns `to` of others. */
  function copy(some, from, others, to) {
    for (const name of ["mean", "error_bar"]) {
      some[name].forEach((values, bound) => {
        const into = others[name][bound];
        const [width, wide] = [values.length / own.outputs, into.length / own.outputs];
        for (let o = 0; o < own.outputs; o++) {
          from.forEach((column, k) => { into[o * wide + to[k]] = values[o * width + column]; });
        }
      });
    }
    return others;
  }

  return async function (parts) {
    const found = empty(all.length);
    own.take(parts);
    for (const times of [first, rest]) {
      for (let k = 0; k < times.length; k += CHUNK) {
        await new Promise((resolve) => { setTimeout(resolve); }); // the page stays responsive
        const some = times.slice(k, k + CHUNK);
        copy(own.bounds(some), [...some.keys()], found, some);
      }
      if (times === first && rest.length) {
        const few = copy(found, times, empty(times.length), [...times.keys()]);
        report({ times, ...few, done: false });
      }
    }
    report({ times: all, ...found, done: true });
  };
};

/** Return the same function in a worker, or in the page where it may have none. */
flexband.boundsBeside = function (data, report) {
  const here = () => flexband.boundsOnRequest(data, report);
  const served = "let ask; onmessage = ({ data }) => { if (data.models) ask = " +
    "flexband.boundsOnRequest(data, (found) => postMessage(found)); else ask(data); };";
  let ask, last;
  try {
    const text = new Blob([...flexband.workerSources, served].map((own) => `${own}\n`));
    const worker = new Worker(URL.createObjectURL(text));
    ask = (parts) => worker.postMessage(parts);
    worker.onmessage = (message) => report(message.data);
    worker.onerror = (event) => {
      event.preventDefault();
      ask = here();
      if (last) ask(last);
    };
    worker.postMessage(data);
  } catch {
    ask = here();
  }
  return (parts) => {
    last = parts;
    ask(parts);
  };
};
