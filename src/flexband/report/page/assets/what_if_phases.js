// μ and σ of a phase expansion F = b + Σ_c Re[Z_c e^{iφ_c}], from smooth moments as in
// flexband/uncertainty/phases/moments.py: polynomials in η, found from values at few η.
"use strict";
if (self.document) flexband.workerSources.push(document.currentScript.textContent);

flexband.PhaseMoments = class {
  /** @param model of a phase expansion. @param m number of η. @param scales s of every ξ. */
  constructor(model, m, scales, coefficients) {
    const O = this.outputs = model.outputs.length, C = this.carriers = model.carriers;
    this.model = model;
    this.coefficients = coefficients;
    this.turning = model.turning;
    this.turns = model.turning.length;
    this.block = 2 + 2 * C + 2 * this.turns; // columns of an output: μ, σ², and what turns
    this.phase = O * this.block;
    this.width = this.phase + C;
    this.times = model.constant.shape[model.constant.shape.length - 1];
    this.polynomials = new flexband.ChebyshevProducts(model.orders, m);
    this.known = new Map();
    this.re = new Float64Array(this.turns);
    this.im = new Float64Array(this.turns);
    if (model.points) this._prepare(m, scales);
  }

  /** Compute Φ at the nodes η, and Ψ at the points s ξ′ of the rule. */
  _prepare(m, scales) {
    const { model } = this, nodes = model.nodes, [Q, n] = model.points.shape;
    const products = new flexband.ChebyshevProducts(model.interval_index, m);
    this.phi = new Float64Array(nodes.shape[0] * products.count);
    for (let e = 0; e < nodes.shape[0]; e++) {
      const eta = nodes.values.subarray(e * m, (e + 1) * m);
      products.fill(eta, this.phi, e * products.count);
    }
    this.M = products.count;
    this.N = model.random_index.length;
    this.psi = new Float64Array(Q * this.N).fill(1);
    for (let q = 0; q < Q; q++) {
      for (let v = 0; v < n; v++) {
        const highest = model.norms[v].length - 1, x = scales[v] * model.points.values[q * n + v];
        const table = model.polynomials[v].values.subarray(q * (highest + 1));
        const own = model.families[v] in flexband.RECURRENCES
          ? flexband.orthogonal(model.families[v], highest, x) : table;
        for (let j = 0; j < this.N; j++) this.psi[q * this.N + j] *= own[model.random_index[j][v]];
      }
    }
  }

  /** Take the smooth moments of a time, (polynomials, width), which are computed once. */
  load(t) {
    if (!this.known.has(t)) {
      this.known.set(t, this._used(this.model.points ? this._smooth(t) : this._given(t)));
    }
    [this.smooth, this.used] = this.known.get(t);
  }

  /** Return smooth moments, and the numbers of the polynomials that matter. */
  _used(smooth) {
    const NEGLIGIBLE = 1e-10, { width } = this; // relative to the width of the bands, or rad
    const used = [...Array(this.polynomials.count).keys()].filter((k) =>
      smooth.subarray(k * width, (k + 1) * width).some((x) => Math.abs(x) > NEGLIGIBLE));
    return [smooth, Int32Array.from(used)];
  }

  _given(t) {
    const { coefficients, times } = this, count = this.polynomials.count * this.width;
    return Float64Array.from({ length: count }, (_, k) => coefficients[k * times + t]);
  }

  _smooth(t) {
    const { phi, M, N, psi, width, coefficients, times, model } = this, terms = model.i.length;
    const { i, j } = model, count = this.polynomials.count, inverse = model.inverse.values;
    const parts = coefficients.length / times / terms, weights = model.weights.values;
    const own = Float64Array.from({ length: terms * parts }, (_, k) => coefficients[k * times + t]);
    const rows = new Float64Array(N * parts), values = new Float64Array(psi.length / N * parts);
    const row = new Float64Array(width), smooth = new Float64Array(count * width);
    for (let e = 0; e < count; e++) {
      rows.fill(0);
      for (let k = 0; k < terms; k++) {
        const factor = phi[e * M + i[k]];
        for (let p = 0; p < parts; p++) rows[j[k] * parts + p] += factor * own[k * parts + p];
      }
      values.fill(0);
      for (let q = 0, at = 0; q < psi.length; q += N, at += parts) {
        for (let k = 0; k < N; k++) {
          const factor = psi[q + k];
          for (let p = 0; p < parts; p++) values[at + p] += factor * rows[k * parts + p];
        }
      }
      this._row(rows, values, parts, weights, row);
      for (let k = 0; k < count; k++) {
        const factor = inverse[k * count + e];
        for (let p = 0; p < width; p++) smooth[k * width + p] += factor * row[p];
      }
    }
    return smooth;
  }

  /** Fill the smooth moments at one η from the parts at the points of the rule. */
  _row(rows, values, parts, weights, row) {
    const { outputs: O, carriers: C, turning, turns, block } = this, own = 1 + 2 * O;
    const cos = new Float64Array(C), sin = new Float64Array(C);
    const re = new Float64Array(C), im = new Float64Array(C);
    row.fill(0);
    for (let q = 0; q < weights.length; q++) {
      const at = q * parts, w = weights[q];
      for (let c = 0; c < C; c++) {
        const angle = values[at + O + c * own] - rows[O + c * own];
        cos[c] = Math.cos(angle);
        sin[c] = Math.sin(angle);
      }
      for (let o = 0; o < O; o++) {
        const b = values[at + o] - rows[o], to = o * block;
        row[to] += w * b;
        row[to + 1] += w * b * b;
        for (let c = 0; c < C; c++) {
          const x = values[at + O + c * own + 1 + o], y = values[at + O + c * own + 1 + O + o];
          re[c] = x * cos[c] - y * sin[c];
          im[c] = x * sin[c] + y * cos[c];
          row[to + 1] += 0.5 * w * (x * x + y * y);
          row[to + 2 + c] += w * re[c];
          row[to + 2 + C + c] += w * im[c];
        }
        for (let k = 0; k < turns; k++) {
          const [c, d, s] = turning[k], x = s === 0 ? b : re[d], y = s === 0 ? 0 : s * im[d];
          row[to + 2 + 2 * C + k] += w * (re[c] * x - im[c] * y);
          row[to + 2 + 2 * C + turns + k] += w * (re[c] * y + im[c] * x);
        }
      }
    }
    for (let o = 0; o < O; o++) this._centre(row, o * block);
    for (let o = 0; o < O; o++) row[o * block] += rows[o];
    for (let c = 0; c < C; c++) row[this.phase + c] = rows[O + c * own];
  }

  /** Make covariances of the expectations of products of an output. */
  _centre(row, at) {
    const { carriers: C, turning, turns } = this, mean = row[at], A = at + 2, B = at + 2 + C;
    row[at + 1] -= mean * mean;
    for (let c = 0; c < C; c++) row[at + 1] -= 0.5 * (row[A + c] ** 2 + row[B + c] ** 2);
    for (let k = 0; k < turns; k++) {
      const [c, d, s] = turning[k], real = at + 2 + 2 * C + k, imag = real + turns;
      const x = s === 0 ? mean : row[A + d], y = s === 0 ? 0 : s * row[B + d];
      const factor = s === 0 ? 2 : s > 0 && c === d ? 0.5 : 1;
      row[real] = factor * (row[real] - (row[A + c] * x - row[B + c] * y));
      row[imag] = factor * (row[imag] - (row[A + c] * y + row[B + c] * x));
    }
  }

  /** Fill μ and σ of an output at points whose polynomials are `basis`, (points, polynomials). */
  scan(o, basis, mean, std) {
    const row = new Float64Array(this.block + this.carriers), count = this.polynomials.count;
    for (let p = 0; p < mean.length; p++) {
      this._at(o, basis, p * count, row);
      this._turn(row);
      mean[p] = this._mean(row);
      std[p] = Math.sqrt(Math.max(this._variance(row), 0));
    }
  }

  /** Fill the smooth moments of an output and the phases where the polynomials are `basis`. */
  _at(o, basis, first, row) {
    const { smooth, used, width, block, phase, carriers } = this;
    row.fill(0);
    for (let u = 0; u < used.length; u++) {
      const k = used[u], factor = basis[first + k], own = k * width + o * block;
      for (let p = 0; p < block; p++) row[p] += factor * smooth[own + p];
      const phases = k * width + phase;
      for (let c = 0; c < carriers; c++) row[block + c] += factor * smooth[phases + c];
    }
  }

  /** Take e^{iψ} of what turns, at the phases of a row. */
  _turn(row) {
    const { re, im, turning, block } = this;
    turning.forEach(([c, d, s], k) => {
      const angle = row[block + c] + (s ? s * row[block + d] : 0);
      re[k] = Math.cos(angle);
      im[k] = Math.sin(angle);
    });
  }

  _mean(row) {
    const { re, im, carriers: C } = this;
    let mean = row[0];
    for (let c = 0; c < C; c++) mean += row[2 + c] * re[c] - row[2 + C + c] * im[c];
    return mean;
  }

  _variance(row) {
    const { re, im, carriers: C, turns } = this, first = 2 + 2 * C;
    let variance = row[1];
    for (let k = 0; k < turns; k++) {
      variance += row[first + k] * re[k] - row[first + turns + k] * im[k];
    }
    return variance;
  }

  /** Return μ + c σ from `rows` of polynomials and their derivatives, and fill its gradient. */
  value(o, rows, c, gradient) {
    const { re, im, carriers: C, turning, turns, block } = this, { count, m } = this.polynomials;
    const here = new Float64Array(block + C), slope = new Float64Array(block + C);
    this._at(o, rows, 0, here);
    this._turn(here);
    const mean = this._mean(here), std = Math.sqrt(Math.max(this._variance(here), 0));
    for (let a = 0; a < m; a++) {
      this._at(o, rows, (1 + a) * count, slope);
      let ofMean = this._mean(slope), ofVariance = this._variance(slope);
      for (let k = 0; k < turns; k++) {
        const [one, other, s] = turning[k], at = 2 + 2 * C + k;
        const turned = slope[block + one] + (s ? s * slope[block + other] : 0);
        const x = re[k] * turned, y = im[k] * turned; // e^{iψ} ψ′, to be times i
        ofVariance -= here[at] * y + here[at + turns] * x;
        if (s === 0) ofMean -= here[2 + one] * y + here[2 + C + one] * x;
      }
      gradient[a] = ofMean + (std > 0 ? 0.5 * c * ofVariance / std : 0);
    }
    return mean + c * std;
  }
};
