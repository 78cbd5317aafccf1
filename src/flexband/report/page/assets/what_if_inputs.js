// The inputs of the what-if panel: what sliders stand for, and the same in Python.
"use strict";

/** Inputs at positions of sliders; `data` is what what_if.py makes. */
flexband.WhatIfInputs = class {
  constructor(data) {
    this.data = data;
    this.reset();
  }

  static STEPS = 200; // of a slider for an interval

  reset() {
    this.intervals = this.data.intervals.map(() => [0, flexband.WhatIfInputs.STEPS]);
    this.scales = this.data.sizes.map(() => 1);
  }

  get changed() {
    return this._changes().length > 0;
  }

  _narrower(k) {
    const [low, high] = this.intervals[k];
    return low > 0 || high < flexband.WhatIfInputs.STEPS;
  }

  /**
   * Move an end of an interval; the other end follows so that the middle stays, or makes way.
   * @param end 0 for the lower one, 1 for the upper one.
   */
  move(k, end, to, symmetric) {
    const STEPS = flexband.WhatIfInputs.STEPS, own = this.intervals[k], sum = own[0] + own[1];
    const within = (x, low, high) => Math.min(high, Math.max(low, x));
    if (symmetric) {
      const most = Math.min(sum, 2 * STEPS - sum) / 2; // half the widest with this middle
      const half = within(end ? to - sum / 2 : sum / 2 - to, 0, most);
      this.intervals[k] = [sum / 2 - half, sum / 2 + half];
    } else {
      own[end] = end ? within(to, own[0], STEPS) : within(to, 0, own[1]);
    }
  }

  /** Return the lower and the upper end of an interval. */
  ends(k) {
    const { lower, upper } = this.data.intervals[k], STEPS = flexband.WhatIfInputs.STEPS;
    const unit = 10 ** Math.floor(Math.log10((upper - lower) / (5 * STEPS)));
    return this.intervals[k].map((at) => {
      if (at === 0) return lower;
      if (at === STEPS) return upper;
      const rounded = Math.round((lower + (upper - lower) * at / STEPS) / unit) * unit;
      return Math.min(upper, Math.max(lower, Number(rounded.toPrecision(14))));
    });
  }

  /** Return the size of an input: its std, say, its variation or its radius. */
  size(k) {
    const { of, size } = this.data.sizes[k], own = size * this.scales[k];
    return of === "coefficient of variation" ? Math.sqrt(Math.expm1(own ** 2)) : own;
  }

  /** Return the part of the inputs in standard variables; other variables keep all of theirs. */
  parts() {
    const { intervals, sizes, interval_dimension: m, random_dimension: n } = this.data;
    const centers = Array(m).fill(0), radii = Array(m).fill(1), scales = Array(n).fill(1);
    intervals.forEach(({ lower, upper, variable }, k) => {
      const [low, high] = this.ends(k).map((x) => (2 * x - lower - upper) / (upper - lower));
      centers[variable] = (low + high) / 2;
      radii[variable] = (high - low) / 2;
    });
    sizes.forEach(({ variables, random }, k) => {
      for (const v of variables) (random ? scales : radii)[v] = this.scales[k];
    });
    return { centers, radii, scales };
  }

  /** Return the changes as Python writes them, by name. */
  _changes() {
    const found = this.data.intervals.flatMap(({ name }, k) => {
      const [low, high] = this.ends(k).map(String);
      return this._narrower(k) ? [[name, `fb.Interval(${low}, ${high})`]] : [];
    });
    this.data.sizes.forEach(({ name, python, ends, fixed }, k) => {
      const s = this.scales[k];
      const write = (own, [a, b], e) =>
        own.replace(`{${e}}`, String(Number((a + b * s).toPrecision(15))));
      const text = ends.reduce(write, python);
      if (s !== 1) found.push([name, s === 0 ? String(fixed) : text]);
    });
    return found;
  }

  /** Return the line of Python that computes the same. */
  python() {
    const k = this.data.sigmas, plain = /^[\p{L}_][\p{L}\p{N}_]*$/u, changes = this._changes();
    const words = changes.filter(([name]) => plain.test(name)).map((own) => own.join("="));
    const others = changes.filter(([name]) => !plain.test(name));
    const items = others.map(([name, text]) => `${JSON.stringify(name)}: ${text}`);
    if (items.length) words.push(`**{${items.join(", ")}}`);
    return `surrogate${words.length ? `.narrowed(${words.join(", ")})` : ""}.bands(${k === 1 ? "" : k})`;
  }

  /** Return the changes in short: "crank_length 0.197 … 0.203, youngs_modulus 50 %". */
  label() {
    const { intervals, sizes } = this.data;
    const own = intervals.flatMap(({ name, scale }, k) =>
      this._narrower(k) ? [`${name} ${this.ends(k).map((x) => flexband.power(Number((x * scale).toPrecision(12)))).join(" … ")}`] : []);
    own.push(...sizes.flatMap(({ name, word }, k) =>
      this.scales[k] === 1 ? [] : [`${word} of ${name} × ${this.scales[k]}`]));
    return own.join(", ");
  }
};
