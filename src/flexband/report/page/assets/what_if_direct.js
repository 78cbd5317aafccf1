// μ and σ of a direct expansion Σ β_ij Φ_i(η) Ψ_j(ξ): σ² is a sum of squares over j > 0.
"use strict";
if (self.document) flexband.workerSources.push(document.currentScript.textContent);

flexband.DirectMoments = class {
  /** @param model of a direct expansion. @param m number of η. @param scales s of every ξ. */
  constructor(model, m, scales, coefficients) {
    this.model = model;
    this.coefficients = coefficients;
    this.outputs = model.outputs.length;
    this.times = model.constant.shape[1];
    this.polynomials = new flexband.ChebyshevProducts(model.interval_index, m);
    this._scale(scales);
    this.own = new Float64Array(this.outputs * this.i.length);
  }

  /** Find the terms Φ_i Ψ_j in ξ′ = ξ / s, and what those in ξ add to them. */
  _scale(scales) {
    const { model } = this, numbers = new Map(), norms = [];
    const number = (orders) => {
      const key = orders.join();
      if (!numbers.has(key)) {
        numbers.set(key, numbers.size);
        norms.push(orders.reduce((norm, k, v) => norm * model.norms[v][k], 1));
      }
      return numbers.get(key);
    };
    number(scales.map(() => 0));
    const matrices = scales.map((s, v) =>
      flexband.scaledPolynomials(model.families[v], model.norms[v].length - 1, s));
    const images = model.random_index.map((orders) => {
      let found = [[[], 1]];
      orders.forEach((k, v) => {
        found = found.flatMap(([own, weight]) =>
          Array.from(matrices[v][k]).flatMap((entry, j) =>
            entry === 0 ? [] : [[[...own, j], weight * entry]]));
      });
      return found.map(([own, weight]) => [number(own), weight]);
    });
    const terms = new Map();
    model.i.forEach((i, term) => {
      for (const [j, weight] of images[model.j[term]]) {
        const key = j * this.polynomials.count + i;
        if (!terms.has(key)) terms.set(key, []);
        terms.get(key).push([term, weight * Math.sqrt(norms[j])]);
      }
    });
    const keys = [...terms.keys()].sort((a, b) => a - b);
    this.i = Int32Array.from(keys, (key) => key % this.polynomials.count);
    this.j = Int32Array.from(keys, (key) => Math.floor(key / this.polynomials.count));
    this.from = keys.map((key) => terms.get(key));
  }

  /** Take the coefficients of a time. */
  load(t) {
    const { own, from, coefficients, outputs, times } = this;
    for (let o = 0, at = 0; o < outputs; o++) {
      for (let k = 0; k < from.length; k++, at++) {
        own[at] = 0;
        for (const [term, weight] of from[k]) {
          own[at] += weight * coefficients[(term * outputs + o) * times + t];
        }
      }
    }
  }

  /** Fill μ and σ of an output at points whose polynomials are `basis`, (points, Φ). */
  scan(o, basis, mean, std) {
    const { i, j, own, polynomials } = this, first = o * i.length;
    for (let p = 0, row = 0; p < mean.length; p++, row += polynomials.count) {
      let sum = 0, square = 0, group = 0;
      mean[p] = 0;
      for (let k = 0; k < i.length; k++) {
        if (j[k] !== group) {
          if (group === 0) mean[p] = sum;
          else square += sum * sum;
          group = j[k];
          sum = 0;
        }
        sum += own[first + k] * basis[row + i[k]];
      }
      if (group === 0) mean[p] = sum;
      else square += sum * sum;
      std[p] = Math.sqrt(square);
    }
  }

  /** Return μ + c σ from `rows` of polynomials and their derivatives, and fill its gradient. */
  value(o, rows, c, gradient) {
    const { i, j, own, polynomials } = this, M = polynomials.count, m = polynomials.m;
    const first = o * i.length, slope = new Float64Array(m), ofSquare = new Float64Array(m);
    let mean = 0, square = 0;
    gradient.fill(0);
    for (let k = 0; k < i.length;) {
      const group = j[k];
      let sum = 0;
      slope.fill(0);
      for (; k < i.length && j[k] === group; k++) {
        const factor = own[first + k];
        sum += factor * rows[i[k]];
        for (let a = 0; a < m; a++) slope[a] += factor * rows[(1 + a) * M + i[k]];
      }
      for (let a = 0; a < m; a++) {
        if (group === 0) gradient[a] = slope[a];
        else ofSquare[a] += sum * slope[a];
      }
      if (group === 0) mean = sum;
      else square += sum * sum;
    }
    const std = Math.sqrt(square);
    for (let a = 0; a < m && std > 0; a++) gradient[a] += c * ofSquare[a] / std;
    return mean + c * std;
  }
};
