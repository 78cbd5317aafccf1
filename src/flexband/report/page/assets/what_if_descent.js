// Minima in a box around 0: quasi-Newton steps (BFGS), in which bounds hold variables.
"use strict";
if (self.document) flexband.workerSources.push(document.currentScript.textContent);

/**
 * Move x to a nearby minimum of a function in the box; return the minimum.
 * @param value (x, gradient): the function, of values of about 1; it fills the gradient.
 * @param ends of the variables, which are in [−end, end].
 */
flexband.descend = function (value, x, ends) {
  const MAX_STEPS = 200, LEAST_GAIN = 1e-15, FIRST_STEP = 0.05, m = x.length;
  let gradient = new Float64Array(m), newGradient = new Float64Array(m);
  const trial = new Float64Array(m), hessian = Array.from({ length: m }, () => new Float64Array(m));
  let best = value(x, gradient), reach = 1, fresh = true;
  const restart = (size) => hessian.forEach((row, a) => row.fill(0).fill(size, a, a + 1));
  restart(Math.hypot(...gradient) / FIRST_STEP + 1e-300);
  for (let k = 0; k < MAX_STEPS; k++) {
    if (!(flexband.boundedStep(x, gradient, hessian, reach, ends, trial) > LEAST_GAIN)) break;
    const next = value(trial, newGradient);
    const moved = trial.map((t, a) => t - x[a]), along = newGradient.map((g, a) => g - gradient[a]);
    const dot = (u, v) => u.reduce((sum, one, a) => sum + one * v[a], 0);
    const curve = dot(moved, along), bend = dot(along, along);
    if (curve > 1e-12 * bend) {
      if (fresh) restart(bend / curve);
      fresh = false;
      const image = hessian.map((row) => dot(row, moved)), inner = dot(image, moved);
      for (let a = 0; a < m; a++) {
        for (let b = 0; b < m; b++) {
          hessian[a][b] += along[a] * along[b] / curve - image[a] * image[b] / inner;
        }
      }
    }
    if (next < best) {
      best = next;
      reach = 1;
      x.set(trial);
      [gradient, newGradient] = [newGradient, gradient];
    } else {
      reach *= 0.3;
    }
  }
  return best;
};

/** Fill `trial` with the quasi-Newton step from x, clipped to the box; return the expected gain. */
flexband.boundedStep = function (x, gradient, hessian, reach, ends, trial) {
  const free = [];
  for (let a = 0; a < x.length; a++) {
    const held = (x[a] <= -ends[a] && gradient[a] > 0) || (x[a] >= ends[a] && gradient[a] < 0);
    if (!held) free.push(a);
  }
  const rows = free.map((a) => [...free.map((b) => hessian[a][b]), -gradient[a]]);
  for (let p = 0; p < rows.length; p++) { // Gauss elimination: the matrix is positive definite
    for (let q = p + 1; q < rows.length; q++) {
      const factor = rows[q][p] / rows[p][p];
      for (let b = p; b <= rows.length; b++) rows[q][b] -= factor * rows[p][b];
    }
  }
  trial.set(x);
  let gain = 0;
  for (let p = rows.length - 1; p >= 0; p--) {
    let move = rows[p][rows.length];
    for (let q = p + 1; q < rows.length; q++) move -= rows[p][q] * rows[q].move;
    rows[p].move = move / rows[p][p];
    const a = free[p];
    trial[a] = Math.min(ends[a], Math.max(-ends[a], x[a] + reach * rows[p].move));
    gain -= gradient[a] * (trial[a] - x[a]);
  }
  return gain;
};
