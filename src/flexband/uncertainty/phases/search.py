"""Bounds of μ + c σ from gentle moments: scan, then descend in the box from the best points.

The moments of `phase_moments` are given as polynomials in η, so the scan and the gradients have
closed forms. Each time is a small problem by itself.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from flexband.uncertainty.expansions.polish import chebyshev_powers, newton_step

SWEEPS = 40
ENOUGH = 1e-9
"""A step that is to gain less than this part of the value is not made."""

FIRST = 0.05
"""Length of the first step."""

FEW = 16
"""Points of a matrix product: so small that the library does not start threads of its own."""


@njit(nogil=True, cache=True, error_model="numpy")
def search(  # noqa: PLR0912
    gentle, index, basis, points, neighbours, outputs, turning, targets, starts, values, places
):
    """Fill bounds `values`, (targets, outputs, times), and their `places`, (…, m).

    Parameters
    ----------
    gentle : coefficients of the table of `phase_moments`, (times, terms, width).
    index : orders of the Chebyshev polynomials in every term, (terms, m).
    basis, points : the scan: polynomials, (points, terms), and η, (points, m).
    neighbours : which points are next to each other, (points, count).
    targets : rows (c, sign): the least of sign (μ + c σ) is looked for.
    starts : so many of the lowest points, of those not above their neighbours, are improved.
    """
    times, terms, width = gentle.shape
    m, parts = points.shape[1], len(turning)
    carriers = _carriers(parts)
    own = 2 + 2 * carriers + 2 * parts
    scanned = np.empty((len(points), width))
    mean, std, aim = np.empty(len(points)), np.empty(len(points)), np.empty(len(points))
    chosen = np.empty((terms, own + carriers))
    turns = np.empty((len(points), parts), np.complex128)
    best, which = np.empty(starts), np.empty(starts, np.int64)
    eta = np.empty(m)
    work = _workspace(m, index, own + carriers)
    for t in range(times):
        for k in range(0, len(points), FEW):
            np.dot(basis[k : k + FEW], gentle[t], scanned[k : k + FEW])
        for p in range(len(points)):
            _turn(scanned[p, outputs * own :], turning, turns[p])
        for o in range(outputs):
            for p in range(len(points)):
                mean[p], variance = _moments(scanned[p, o * own :], turns[p], carriers)
                std[p] = np.sqrt(max(variance, 0.0))
            for i in range(terms):
                for k in range(own):
                    chosen[i, k] = gentle[t, i, o * own + k]
                for k in range(carriers):
                    chosen[i, own + k] = gentle[t, i, outputs * own + k]
            for a in range(len(targets)):
                c, sign = targets[a]
                for p in range(len(points)):
                    aim[p] = sign * (mean[p] + c * std[p])
                _lowest(aim, neighbours, best, which)
                values[a, o, t] = best[0]
                places[a, o, t] = points[which[0]]
                for k in range(starts if m else 0):
                    if best[k] < np.inf:
                        eta[:] = points[which[k]]
                        found = _descend(chosen, index, turning, c, sign, eta, work)
                        if found < values[a, o, t]:
                            values[a, o, t] = found
                            places[a, o, t] = eta
                values[a, o, t] *= sign


@njit(nogil=True, cache=True, error_model="numpy")
def _carriers(parts):
    """Return C of C + C(C+1)/2 + C(C−1)/2 = C + C² turning parts."""
    return round((np.sqrt(1 + 4 * parts) - 1) / 2)


@njit(nogil=True, cache=True, error_model="numpy")
def _lowest(aim, neighbours, best, which):
    """Fill the lowest values that are not above their neighbours', in order, and where they are."""
    starts = len(best)
    for k in range(starts):
        best[k], which[k] = np.inf, 0
    for p in range(len(aim)):
        lowest = aim[p] < best[starts - 1]
        for other in neighbours[p]:
            lowest = lowest and aim[p] <= aim[other]
        if lowest:
            k = starts - 1
            while k > 0 and aim[p] < best[k - 1]:
                best[k], which[k] = best[k - 1], which[k - 1]
                k -= 1
            best[k], which[k] = aim[p], p


@njit(nogil=True, cache=True, error_model="numpy")
def _turn(phases, turning, turns):
    """Fill e^{iψ} of every turning part."""
    for k in range(len(turning)):
        c, d, s = turning[k]
        if s == 0:
            turns[k] = complex(np.cos(phases[c]), np.sin(phases[c]))
        else:
            turns[k] = turns[c] * (turns[d] if s > 0 else np.conj(turns[d]))


@njit(nogil=True, cache=True, error_model="numpy")
def _moments(v, turns, carriers):
    """Return μ and σ² of one row of the table."""
    mean, variance, parts = v[0], v[1], len(turns)
    for c in range(carriers):
        mean += v[2 + c] * turns[c].real - v[2 + carriers + c] * turns[c].imag
    at = 2 + 2 * carriers
    for k in range(parts):
        variance += v[at + k] * turns[k].real - v[at + parts + k] * turns[k].imag
    return mean, variance


@njit(nogil=True, cache=True, error_model="numpy")
def _workspace(m, index, width):
    """Return arrays for `_descend`."""
    highest = index.max() if index.size else 0
    return (
        np.empty((3, m, highest + 1)),
        np.empty((1 + m, len(index))),
        np.empty((1 + m, width)),
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty((m, m)),
    )


@njit(nogil=True, cache=True, error_model="numpy")
def _descend(chosen, index, turning, c, sign, eta, work):  # noqa: PLR0912
    """Move η to where sign (μ + c σ) is least nearby, by quasi-Newton steps; return it."""
    m = len(eta)
    gradient, step, trial, new_gradient, along, image, hessian = work[3:]
    best = _value(chosen, index, turning, c, sign, eta, work, gradient)
    size = 0.0
    for a in range(m):
        size += gradient[a] ** 2
    size = np.sqrt(size) / FIRST + 1e-300
    for a in range(m):
        for b in range(m):
            hessian[a, b] = size if a == b else 0.0
    reach, fresh = 1.0, True
    for _ in range(SWEEPS):
        newton_step(eta, gradient, hessian, step)
        gain = 0.0
        for a in range(m):
            trial[a] = min(1.0, max(-1.0, eta[a] + reach * step[a]))
            gain -= gradient[a] * (trial[a] - eta[a])
        if not gain > ENOUGH * abs(best):
            break
        value = _value(chosen, index, turning, c, sign, trial, work, new_gradient)
        curve, bend = 0.0, 0.0
        for a in range(m):
            step[a] = trial[a] - eta[a]
            along[a] = new_gradient[a] - gradient[a]
            curve += step[a] * along[a]
            bend += along[a] ** 2
        if curve > 1e-12 * bend:
            if fresh:
                for a in range(m):
                    hessian[a, a] = bend / curve
                fresh = False
            _update(hessian, step, along, curve, image)
        if value < best:
            best, reach = value, 1.0
            for a in range(m):
                eta[a], gradient[a] = trial[a], new_gradient[a]
        else:
            reach = 0.3 if reach == 1.0 else 0.3 * reach
    return best


@njit(nogil=True, cache=True, error_model="numpy")
def _update(hessian, step, along, curve, image):
    """Update an estimate of the Hessian by the change of the gradient, after BFGS."""
    m = len(step)
    inner = 0.0
    for a in range(m):
        image[a] = 0.0
        for b in range(m):
            image[a] += hessian[a, b] * step[b]
        inner += step[a] * image[a]
    for a in range(m):
        for b in range(m):
            hessian[a, b] += along[a] * along[b] / curve - image[a] * image[b] / inner


@njit(nogil=True, cache=True, error_model="numpy")
def _value(chosen, index, turning, c, sign, eta, work, gradient):
    """Return sign (μ + c σ) at η and fill its gradient."""
    powers, basis, rows = work[0], work[1], work[2]
    m, parts = len(eta), len(turning)
    carriers = _carriers(parts)
    own = 2 + 2 * carriers + 2 * parts
    chebyshev_powers(eta, powers)
    basis[:] = 1.0
    for a in range(-1, m):  # −1: not differentiated
        for v in range(m):
            power = powers[1 if v == a else 0, v]
            for i in range(len(index)):
                basis[1 + a, i] *= power[index[i, v]]
    np.dot(basis, chosen, rows)
    turns = np.empty(parts, np.complex128)
    _turn(rows[0, own:], turning, turns)
    mean, variance = _moments(rows[0], turns, carriers)
    std = np.sqrt(max(variance, 0.0))
    per_std = 0.5 * c / std if std > 0 else 0.0
    for a in range(m):
        d, v = rows[1 + a], rows[0]
        mean_slope, slope = _moments(d, turns, carriers)
        for k in range(parts):
            one, other, s = turning[k]
            turned = d[own + one] + (s * d[own + other] if s else 0.0)
            re, im = turns[k].real * turned, turns[k].imag * turned  # e^{iψ} ψ′, to be times i
            at = 2 + 2 * carriers + k
            slope -= v[at] * im + v[at + parts] * re
            if s == 0:
                mean_slope -= v[2 + one] * im + v[2 + carriers + one] * re
        gradient[a] = sign * (mean_slope + per_std * slope)
    return sign * (mean + c * std)
