"""Bounds of μ + c σ from smooth moments: scan, then descend in the box from the best points.

The smooth moments are given as polynomials in η, so the scan and the gradients have closed forms.
Each time is a small problem of its own.
"""

from __future__ import annotations

import numpy as np

from flexband.compilation.caching import cached_on_disk
from flexband.compilation.functions import compiled
from flexband.uncertainty.expansions.bounds.polish import step
from flexband.uncertainty.expansions.bounds.search import lowest
from flexband.uncertainty.expansions.bounds.terms import (
    chebyshev_powers,
    copy,
    fill,
    largest,
    multiply,
)
from flexband.uncertainty.phases.phase_options import SEARCH


@cached_on_disk
def search(
    smooth, index, basis, points, neighbours, columns, turning, targets, starts, values, places
):
    """Fill bounds `values`, (targets, outputs, times), and their `places`, (…, m).

    Parameters
    ----------
    smooth : coefficients of the table of smooth moments, (times, terms, width).
    index : orders of the Chebyshev polynomials in every term, (terms, m).
    basis, points : the scan: polynomials, (points, terms), and η, (points, m).
    neighbours : the points next to each point, (points, count).
    targets : rows (c, sign): sign (μ + c σ) is minimized.
    starts : number of points, the lowest of those not above their neighbours, to descend from.
    """
    times, terms, width = smooth.shape
    m = points.shape[1]
    block = columns.block
    carriers = columns.carriers
    scanned = np.empty((len(points), width))
    mean = np.empty(len(points))
    std = np.empty(len(points))
    aim = np.empty(len(points))
    coefficients = np.empty((terms, block + carriers))
    turns = np.empty((len(points), columns.turns), np.complex128)
    best = np.empty(starts)
    which = np.empty(starts, np.int64)
    eta = np.empty(m)
    for t in range(times):
        multiply(basis, smooth[t], scanned)
        for p in range(len(points)):
            _turn(scanned[p, columns.phase :], turning, turns[p])
        for o in range(columns.outputs):
            # The moments of one output at all points of the scan, and its coefficients.
            for p in range(len(points)):
                mean[p], variance = _moments(scanned[p, o * block :], turns[p], columns)
                std[p] = np.sqrt(max(variance, 0.0))
            for term in range(terms):
                copy(coefficients[term, :block], smooth[t, term, o * block :])
                copy(coefficients[term, block:], smooth[t, term, columns.phase :])
            for a in range(len(targets)):
                c, sign = targets[a]
                for p in range(len(points)):
                    aim[p] = sign * (mean[p] + c * std[p])
                # Descend from the lowest points.
                lowest(aim, neighbours, 1.0, best, which)
                values[a, o, t] = best[0]
                copy(places[a, o, t], points[which[0]])
                for k in range(starts if m else 0):
                    if best[k] < np.inf:
                        copy(eta, points[which[k]])
                        bound = _descend(coefficients, index, columns, turning, c, sign, eta)
                        if bound < values[a, o, t]:
                            values[a, o, t] = bound
                            copy(places[a, o, t], eta)
                values[a, o, t] *= sign


@compiled
def _turn(phases, turning, turns):
    """Fill e^{iψ} of every turning part."""
    for k in range(len(turning)):
        c, d, s = turning[k]
        if s == 0:
            turns[k] = complex(np.cos(phases[c]), np.sin(phases[c]))
        else:
            turns[k] = turns[c] * (turns[d] if s > 0 else np.conj(turns[d]))


@compiled
def _moments(v, turns, columns):
    """Return μ and σ² of the smooth moments of an output."""
    mean = v[columns.mean]
    variance = v[columns.variance]
    for c in range(columns.carriers):
        mean += v[columns.mean_real + c] * turns[c].real - v[columns.mean_imag + c] * turns[c].imag
    for k in range(columns.turns):
        re = v[columns.turn_real + k]
        im = v[columns.turn_imag + k]
        variance += re * turns[k].real - im * turns[k].imag
    return mean, variance


@compiled
def _descend(coefficients, index, columns, turning, c, sign, eta):
    """Move η to a nearby minimum of sign (μ + c σ) by quasi-Newton steps; return the minimum."""
    m = len(eta)
    highest = largest(index.flat, 0, index.size)
    work = (
        np.empty((3, highest + 1, m, 1)),
        np.empty((1 + m, len(index))),
        np.empty((1 + m, coefficients.shape[1])),
    )
    gradient = np.empty(m)
    new_gradient = np.empty(m)
    trial = np.empty(m)
    moved = np.empty(m)
    along = np.empty(m)
    best = _value(coefficients, index, columns, turning, c, sign, eta, work, gradient)
    square = 0.0
    hessian = np.zeros((m, m))
    for a in range(m):
        square += gradient[a] ** 2
    for a in range(m):
        hessian[a, a] = np.sqrt(square) / SEARCH.first_step + 1e-300
    reach = 1.0
    fresh = True
    # Take steps that lower the value; shorten the reach after those that do not.
    for _ in range(SEARCH.max_steps):
        if not step(eta, gradient, hessian, reach, trial) > SEARCH.min_relative_gain * abs(best):
            break
        value = _value(coefficients, index, columns, turning, c, sign, trial, work, new_gradient)
        curve = 0.0
        bend = 0.0
        for a in range(m):
            moved[a] = trial[a] - eta[a]
            along[a] = new_gradient[a] - gradient[a]
            curve += moved[a] * along[a]
            bend += along[a] ** 2
        if curve > 1e-12 * bend:
            if fresh:
                for a in range(m):
                    hessian[a, a] = bend / curve
                fresh = False
            _update(hessian, moved, along, curve)
        if value < best:
            best = value
            reach = 1.0
            copy(eta, trial)
            copy(gradient, new_gradient)
        else:
            reach = 0.3 if reach == 1.0 else 0.3 * reach
    return best


@compiled
def _update(hessian, moved, along, curve):
    """Update an estimate of the Hessian by the change of the gradient (BFGS)."""
    m = len(moved)
    image = np.zeros(m)
    inner = 0.0
    for a in range(m):
        for b in range(m):
            image[a] += hessian[a, b] * moved[b]
        inner += moved[a] * image[a]
    for a in range(m):
        for b in range(m):
            hessian[a, b] += along[a] * along[b] / curve - image[a] * image[b] / inner


@compiled
def _value(coefficients, index, columns, turning, c, sign, eta, work, gradient):
    """Return sign (μ + c σ) at η and fill its gradient."""
    powers, basis, rows = work
    m = len(eta)
    chebyshev_powers(eta[:, None], powers)
    fill(basis, 1.0)
    for a in range(-1, m):  # −1: not differentiated
        for v in range(m):
            d = 1 if v == a else 0
            for i in range(len(index)):
                basis[1 + a, i] *= powers[d, index[i, v], v, 0]
    multiply(basis, coefficients, rows)
    turns = np.empty(columns.turns, np.complex128)
    _turn(rows[0, columns.block :], turning, turns)
    mean, variance = _moments(rows[0], turns, columns)
    std = np.sqrt(max(variance, 0.0))
    per_std = 0.5 * c / std if std > 0 else 0.0
    # The slopes of mean and variance in each direction.
    for a in range(m):
        d = rows[1 + a]
        v = rows[0]
        phase_slope = d[columns.block :]
        mean_slope, slope = _moments(d, turns, columns)
        for k in range(columns.turns):
            carrier, other, s = turning[k]
            turn_slope = phase_slope[carrier] + (s * phase_slope[other] if s else 0.0)
            re = turns[k].real * turn_slope
            im = turns[k].imag * turn_slope  # e^{iψ} ψ′, to be times i
            slope -= v[columns.turn_real + k] * im + v[columns.turn_imag + k] * re
            if s == 0:
                mean_slope -= (
                    v[columns.mean_real + carrier] * im + v[columns.mean_imag + carrier] * re
                )
        gradient[a] = sign * (mean_slope + per_std * slope)
    return sign * (mean + c * std)
