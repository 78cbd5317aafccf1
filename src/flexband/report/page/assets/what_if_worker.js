// Bounds computed beside the page, in workers: some times first, then all.
"use strict";

/**
 * Return a function that computes bounds on a part of the inputs.
 * @param report gets {times, mean, error_bar, limit_bar, done}: of every eighth time, then of all.
 */
flexband.boundsBeside = function (data, report) {
  const names = ["mean", "error_bar", ...(data.limits ? ["limit_bar"] : [])];
  const CHUNK = 32, FEW = 100, workers = flexband.boundsWorkers(data);
  const all = Array.from({ length: data.times }, (_, t) => t), outputs = data.outputs.length;
  const some = data.times > FEW ? all.filter((t) => t % 8 === 0) : [];
  const others = data.times > FEW ? all.filter((t) => t % 8 !== 0) : all;

  /** Copy the columns `from` of some bounds to the columns `to` of others. */
  function copy(bounds, from, into, to) {
    for (const name of names) {
      bounds[name].forEach((values, bound) => {
        const width = values.length / outputs, wide = into[name][bound].length / outputs;
        for (let o = 0; o < outputs; o++) {
          from.forEach((column, k) => {
            into[name][bound][o * wide + to[k]] = values[o * width + column];
          });
        }
      });
    }
    return into;
  }

  function empty(count) {
    const pair = () => [0, 1].map(() => new Float64Array(outputs * count));
    return Object.fromEntries(names.map((name) => [name, pair()]));
  }

  async function fill(found, parts, times) {
    const chunks = [];
    for (let k = 0; k < times.length; k += CHUNK) chunks.push(times.slice(k, k + CHUNK));
    await Promise.all(workers.map(async (bounds) => {
      for (let own = chunks.shift(); own; own = chunks.shift()) {
        copy(await bounds(parts, own), [...own.keys()], found, own);
      }
    }));
  }

  return async function (parts) {
    const found = empty(all.length);
    if (some.length) {
      await fill(found, parts, some);
      const few = copy(found, some, empty(some.length), [...some.keys()]);
      report({ times: some, ...few, done: false });
    }
    await fill(found, parts, others);
    report({ times: all, ...found, done: true });
  };
};

/** Return functions of parts and times, one per worker; in the page where it may have none. */
flexband.boundsWorkers = function (data) {
  const MOST = 4, count = Math.max(1, Math.min(MOST, (navigator.hardwareConcurrency || 2) - 1));
  const script = "let own; onmessage = ({ data: { model, parts, times } }) => { if (model) " +
    "own = new flexband.WhatIf(model); else { own.take(parts); postMessage(own.bounds(times)); } };";
  const text = new Blob([...flexband.workerSources, script].map((own) => `${own}\n`));
  let own = null;

  async function here(parts, times) {
    await new Promise((resolve) => { setTimeout(resolve); }); // the page stays responsive
    own = own || new flexband.WhatIf(data);
    own.take(parts);
    return own.bounds(times);
  }

  function started() {
    let worker, dead = false;
    try {
      worker = new Worker(URL.createObjectURL(text));
      worker.postMessage({ model: data });
    } catch {
      return here;
    }
    return (parts, times) => new Promise((resolve) => {
      if (dead) {
        resolve(here(parts, times));
        return;
      }
      worker.onmessage = ({ data: found }) => resolve(found);
      worker.onerror = (event) => {
        event.preventDefault();
        dead = true; // it answers nothing from now on
        resolve(here(parts, times));
      };
      worker.postMessage({ parts, times });
    });
  }
  return Array.from({ length: count }, started);
};
