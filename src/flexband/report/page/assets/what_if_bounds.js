// Interval mean and interval error bar on a part of the inputs: a scan, and descents from its
// lowest points, as flexband/uncertainty/phases/search.py does.
"use strict";
if (self.document) flexband.workerSources.push(document.currentScript.textContent);

/** Bounds of all outputs of a surrogate; `data` is what what_if.py makes. */
flexband.WhatIf = class {
  constructor(data) {
    this.data = data;
    this.outputs = data.outputs.length;
    this.coefficients = data.models.map(flexband.coefficientsOf);
    this.scales = null;
  }

  /**
   * Take a part of the inputs.
   * @param parts.centers, parts.radii of all η of the surrogate, whose box is [−1, 1]^m; of the
   *   pairs in a disc around the box both radii are the same.
   * @param parts.scales s of every ξ.
   */
  take(parts) {
    const { models } = this.data, m = parts.centers.length, text = JSON.stringify(parts);
    if (text === this.text) return;
    this.text = text;
    if (this.scales !== parts.scales.join()) {
      this.scales = parts.scales.join();
      this.moments = models.map((model, k) => {
        const kind = model.kind === "direct" ? flexband.DirectMoments : flexband.PhaseMoments;
        return new kind(model, m, parts.scales, this.coefficients[k]);
      });
    }
    this.parts = parts;
    this.free = [...parts.radii.keys()].filter((a) => parts.radii[a] > 0);
    this.discs = this.data.discs.map((a) => this.free.indexOf(a));
    this.ends = new Float64Array(this.free.length).fill(1);
    for (const k of this.discs) this.ends.set([Math.SQRT2, Infinity], k);
    this.scans = models.map((model, k) => this._scan(model, this.moments[k].polynomials));
  }

  /** Return the points of a scan within the box, their polynomials and their neighbours. */
  _scan(model, polynomials) {
    const { free, parts } = this, [P, m] = model.scan.shape, beside = model.beside.shape[1];
    const first = new Map(), number = new Int32Array(P), points = [];
    for (let p = 0; p < P; p++) { // points that differ in fixed variables only are one
      const x = free.map((a) => model.scan.values[p * m + a]), key = x.join();
      if (!first.has(key)) {
        first.set(key, points.length);
        points.push(x);
      }
      number[p] = first.get(key);
    }
    const basis = new Float64Array(points.length * polynomials.count);
    points.forEach((x, p) => polynomials.fill(this._eta(x), basis, p * polynomials.count));
    const neighbours = points.map(() => new Set());
    for (let p = 0; p < P; p++) {
      for (let k = 0; k < beside; k++) {
        neighbours[number[p]].add(number[model.beside.values[p * beside + k]]);
      }
    }
    return { points, basis, neighbours: neighbours.map((own) => Int32Array.from(own)) };
  }

  /** Return η at x of the variables that are not fixed; x of a disc are its radius and angle. */
  _eta(x) {
    const { centers, radii } = this.parts, eta = Float64Array.from(centers), y = [...x];
    for (const k of this.discs) {
      y.splice(k, 2, x[k] * Math.cos(x[k + 1]), x[k] * Math.sin(x[k + 1]));
    }
    this.free.forEach((a, k) => { eta[a] += radii[a] * y[k]; });
    return eta;
  }

  /** Fill the gradient in x from that in η. */
  _fillGradient(x, slope, gradient) {
    this.free.forEach((a, k) => { gradient[k] = this.parts.radii[a] * slope[a]; });
    for (const k of this.discs) {
      const cos = Math.cos(x[k + 1]), sin = Math.sin(x[k + 1]), [u, v] = gradient.slice(k, k + 2);
      gradient.set([u * cos + v * sin, x[k] * (v * cos - u * sin)], k);
    }
  }

  /**
   * Return {mean, error_bar} of [lower, upper] at times, (outputs × times) each; with limits also
   * limit_bar, the error bar of which limits take the margin.
   */
  bounds(times) {
    const k = this.data.sigmas, count = times.length;
    const fresh = () => [Infinity, -Infinity].map((none) =>
      new Float64Array(this.outputs * count).fill(none));
    const found = { mean: fresh(), error_bar: fresh() }, { limits } = this.data;
    const [mean, bar] = [found.mean, found.error_bar];
    if (limits) found.limit_bar = fresh();
    times.forEach((t, column) => {
      this.moments.forEach((moments, number) => { // several of an output are those of options
        moments.load(t);
        const { outputs, scale } = this.data.models[number];
        outputs.forEach((output, o) => {
          const at = output * count + column;
          const wanted = [[0, 1], [0, -1], [-k, 1], [k, -1]];
          if (limits && limits.outputs.includes(output)) {
            wanted.push([-limits.sigmas, 1], [limits.sigmas, -1]);
          }
          const own = this._extremes(moments, this.scans[number], o, wanted).map((x) => x * scale[o]);
          mean[0][at] = Math.min(mean[0][at], own[0]);
          mean[1][at] = Math.max(mean[1][at], own[1]);
          bar[0][at] = Math.min(bar[0][at], own[2]);
          bar[1][at] = Math.max(bar[1][at], own[3]);
          if (own.length < 5) return;
          found.limit_bar[0][at] = Math.min(found.limit_bar[0][at], own[4]);
          found.limit_bar[1][at] = Math.max(found.limit_bar[1][at], own[5]);
        });
      });
    });
    return found;
  }

  /** Return the lowest (sign 1) or highest (−1) μ + cσ of each wanted [c, sign]. */
  _extremes(moments, scan, o, wanted) {
    const { parts } = this, P = scan.points.length;
    const mean = new Float64Array(P), std = new Float64Array(P), height = new Float64Array(P);
    moments.scan(o, scan.basis, mean, std);
    const rows = new Float64Array((1 + parts.centers.length) * moments.polynomials.count);
    const slope = new Float64Array(parts.centers.length);
    return wanted.map(([c, sign]) => {
      const value = (x, gradient) => {
        moments.polynomials.fill(this._eta(x), rows, 0, true);
        const own = moments.value(o, rows, c, slope);
        this._fillGradient(x, slope.map((along) => sign * along), gradient);
        return sign * own;
      };
      for (let p = 0; p < P; p++) height[p] = sign * (mean[p] + c * std[p]);
      let least = Infinity;
      for (const p of this._starts(height, scan.neighbours)) {
        const found = flexband.descend(value, Float64Array.from(scan.points[p]), this.ends);
        least = Math.min(least, height[p], found);
      }
      return sign * least;
    });
  }

  /**
   * Return the lowest points that are not above their neighbours. Discs have few points along their
   * rims: other low points that are not beside each other are added.
   */
  _starts(height, neighbours) {
    const most = this.free.length > 3 ? 12 : 6, found = [];
    for (const p of [...height.keys()].sort((a, b) => height[a] - height[b])) {
      if (found.length === most) break;
      const apart = this.discs.length && !neighbours[p].some((q) => found.includes(q));
      if (apart || neighbours[p].every((q) => height[p] <= height[q])) found.push(p);
    }
    return found;
  }
};
