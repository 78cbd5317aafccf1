// Polynomials of the what-if panel: Chebyshev ones in η, orthogonal ones in ξ.
// Scripts of the panel that need no document run in a worker too, which gets their texts.
"use strict";
self.flexband = self.flexband || {};
flexband.workerSources = flexband.workerSources || [];
if (self.document) flexband.workerSources.push(document.currentScript.textContent);

/** Products Π_v T_k(η_v) of the orders `index`, shape (terms, m). */
flexband.ChebyshevProducts = class {
  constructor(index, m) {
    this.count = index.length;
    this.m = m;
    this.orders = Int32Array.from(index.flat());
    this.highest = this.orders.reduce((most, k) => Math.max(most, k), 0);
    this.values = new Float64Array(m * (this.highest + 1));
    this.slopes = new Float64Array(m * (this.highest + 1));
  }

  /** Fill `rows`, (1 + m, terms), with values at η and derivatives; from `at` on, values alone. */
  fill(eta, rows, at = 0, derivatives = false) {
    const { count, m, orders, highest, values, slopes } = this, width = highest + 1;
    for (let v = 0; v < m; v++) {
      const x = eta[v], T = v * width;
      values[T] = 1;
      slopes[T] = 0;
      if (highest > 0) {
        values[T + 1] = x;
        slopes[T + 1] = 1;
      }
      for (let k = 2; k <= highest; k++) {
        values[T + k] = 2 * x * values[T + k - 1] - values[T + k - 2];
        slopes[T + k] = 2 * (values[T + k - 1] + x * slopes[T + k - 1]) - slopes[T + k - 2];
      }
    }
    for (let i = 0; i < count; i++) {
      let product = 1;
      for (let v = 0; v < m; v++) product *= values[v * width + orders[i * m + v]];
      rows[at + i] = product;
      for (let a = 0; derivatives && a < m; a++) {
        let slope = slopes[a * width + orders[i * m + a]];
        for (let v = 0; v < m && slope !== 0; v++) {
          if (v !== a) slope *= values[v * width + orders[i * m + v]];
        }
        rows[at + (1 + a) * count + i] = slope;
      }
    }
  }
};

/** a and b of P_{k+1} = a x P_k − b P_{k−1}, for families that stay their own for s ξ. */
flexband.RECURRENCES = {
  Hermite: (k) => [1, k],
  Legendre: (k) => [(2 * k + 1) / (k + 1), k / (k + 1)],
};

/** Return P_0 … P_order at x. */
flexband.orthogonal = function (family, order, x) {
  const found = [1];
  for (let k = 0; k < order; k++) {
    const [a, b] = flexband.RECURRENCES[family](k);
    found.push(a * x * found[k] - (k ? b * found[k - 1] : 0));
  }
  return found;
};

/** Return the rows M_k of P_k(s x) = Σ_j M_kj P_j(x), k = 0 … order. */
flexband.scaledPolynomials = function (family, order, s) {
  if (s === 1) {
    return Array.from({ length: order + 1 }, (_, k) =>
      Array.from({ length: order + 1 }, (_, j) => +(j === k)));
  }
  const step = flexband.RECURRENCES[family];
  const found = [new Float64Array(order + 1).fill(1, 0, 1)];
  for (let k = 0; k < order; k++) {
    const [a, b] = step(k), next = new Float64Array(order + 1);
    for (let j = 0; j <= k; j++) {
      const [ownA, ownB] = step(j), part = a * s * found[k][j] / ownA; // x P_j has P_{j±1}
      next[j + 1] += part;
      if (j) next[j - 1] += part * ownB;
    }
    for (let j = 0; k && j < k; j++) next[j] -= b * found[k - 1][j];
    found.push(next);
  }
  return found;
};

/** Return the coefficients of a model, (terms, rows, times), the constant term first. */
flexband.coefficientsOf = function (model) {
  const { constant, others } = model, found = new Float64Array(
    constant.values.length + others.values.length);
  found.set(constant.values);
  found.set(others.values, constant.values.length);
  return found;
};
