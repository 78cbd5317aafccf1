"""Polish extremes of μ + c σ over the box of the interval variables: Newton's method, compiled.

σ² is the sum over j ≥ 1 of squared polynomials in η, so the derivatives of σ follow from those of
the polynomials.
"""

from __future__ import annotations

import numpy as np

from flexband.compilation.functions import compiled
from flexband.uncertainty.expansions.bounds.bound_options import OPTIONS
from flexband.uncertainty.expansions.bounds.discs import RADIUS
from flexband.uncertainty.expansions.bounds.terms import chebyshev_powers, fill, largest, product


@compiled
def polish(terms, coefficients, c, sign, active, eta, reach, minimum):
    """Move η of active lanes, (m, lanes), towards a minimum of sign (μ + c σ), and fill its value.

    It ends when most lanes have arrived; the others stay active, for the next batch. `reach` is the
    part of Newton's step to try next, 1 at a start.
    """
    m, lanes = eta.shape
    groups = terms.depends.shape[1]
    orders = largest(terms.order, 0, len(terms.order)) + 1
    work = (
        np.empty((3, orders, m, lanes)),
        np.empty((groups, lanes)),
        np.empty((groups, lanes)),
        np.empty((m, groups, lanes)),
        np.empty((2, lanes)),
    )
    gradient = np.empty((m, lanes))
    hessian = np.empty((m, m, lanes))
    new_gradient = np.zeros((m, lanes))
    new_hessian = np.zeros((m, m, lanes))
    trial = eta.copy()
    value = np.empty(lanes)
    x = np.empty(m)
    slope = np.empty(m)
    curve = np.empty((m, m))
    y = np.empty(m)
    at_rim = np.zeros(m, np.bool_)
    fill(minimum, np.inf)
    # Count the lanes that move.
    active_count = 0
    for n in range(lanes):
        active_count += active[n]
    for k in range(OPTIONS.max_newton_steps):
        _evaluate(terms, coefficients, c, sign, trial, work, value, new_gradient, new_hessian)
        remaining = 0
        for n in range(lanes):
            if not active[n]:
                continue
            # Accept a step that is lower; otherwise try a part of it from the last point.
            if value[n] < minimum[n] or minimum[n] == np.inf:
                minimum[n] = value[n]
                reach[n] = reach[n] if k == 0 else 1.0
                for a in range(m):
                    eta[a, n] = trial[a, n]
                    gradient[a, n] = new_gradient[a, n]
                    for b in range(a + 1):
                        hessian[a, b, n] = new_hessian[a, b, n]
            else:
                reach[n] *= 0.25
            # Take Newton's step, in the coordinates of discs.
            for a in range(m):
                x[a] = eta[a, n]
                slope[a] = gradient[a, n]
                for b in range(a + 1):
                    curve[a, b] = curve[b, a] = hessian[a, b, n]
            _to_discs(terms.partner, x, slope, curve, at_rim)
            gain = step(x, slope, curve, reach[n], y)
            _from_discs(terms.partner, eta[:, n], at_rim, y)
            active[n] = gain > OPTIONS.min_relative_gain * abs(minimum[n])
            remaining += active[n]
            for a in range(m):
                trial[a, n] = y[a]
        if remaining == 0 or (k > 0 and OPTIONS.min_active_part * remaining < active_count):
            break


@compiled
def _evaluate(terms, coefficients, c, sign, eta, work, value, gradient, hessian):  # noqa: PLR0912
    """Fill sign (μ + c σ) at η, its gradient and the lower triangle of its Hessian."""
    powers, sums, along, slopes, (part, scale) = work
    m, groups, lanes = slopes.shape
    chebyshev_powers(eta, powers)
    _sums(terms, coefficients, powers, sums, slopes, part)
    for n in range(lanes):
        scale[n] = 0.0
    for j in range(1, groups):
        for n in range(lanes):
            scale[n] += sums[j, n] * sums[j, n]
    for n in range(lanes):
        std = np.sqrt(scale[n])
        value[n] = sign * (sums[0, n] + c * std)
        scale[n] = sign * c / std if std > 0 else 0.0  # at σ = 0 its derivatives count as zero
        along[0, n] = sign
    for j in range(1, groups):  # the derivative of the value by each sum
        for n in range(lanes):
            along[j, n] = scale[n] * sums[j, n]
    _curvatures(terms, coefficients, powers, along, part, hessian)
    for a in range(m):
        for n in range(lanes):
            gradient[a, n] = 0.0
        for j in range(1, groups):
            for n in range(lanes if terms.depends[a, j] else 0):
                gradient[a, n] += along[j, n] * slopes[a, j, n]
        for b in range(a + 1 if c != 0 else 0):
            for n in range(lanes):
                part[n] = 0.0
            for j in range(1, groups):
                for n in range(lanes if terms.depends[a, j] and terms.depends[b, j] else 0):
                    part[n] += slopes[a, j, n] * slopes[b, j, n]
            for n in range(lanes):
                of_std = gradient[a, n] * gradient[b, n] / (c * c)  # ∂σ/∂η_a ∂σ/∂η_b
                hessian[a, b, n] += scale[n] * (part[n] - of_std)
    for a in range(m):
        for n in range(lanes):
            gradient[a, n] += sign * slopes[a, 0, n]


@compiled
def _sums(terms, coefficients, powers, sums, slopes, part):
    """Fill the sum of the terms of each Ψ_j and its derivatives by every variable."""
    lanes = len(part)
    fill(sums, 0.0)
    fill(slopes, 0.0)
    for i in range(len(terms.first) - 1):
        begin = terms.first[i]
        end = terms.first[i + 1]
        # Add Φ_i to the sums of its terms.
        product(terms, i, -1, powers, part)
        for t in range(begin, end):
            j = terms.group[t]
            for n in range(lanes):
                sums[j, n] += part[n] * coefficients[t, n]
        # Add its derivative by each of its variables.
        for f in range(terms.first_factor[i], terms.first_factor[i + 1]):
            a = terms.variable[f]
            k = terms.order[f]
            product(terms, i, a, powers, part)
            for n in range(lanes):
                part[n] *= powers[1, k, a, n]
            for t in range(begin, end):
                j = terms.group[t]
                for n in range(lanes):
                    slopes[a, j, n] += part[n] * coefficients[t, n]


@compiled
def _curvatures(terms, coefficients, powers, along, part, hessian):
    """Fill the second derivatives of the terms, weighted by j, into the lower triangle."""
    lanes = len(part)
    weight = np.empty(len(part))
    fill(hessian, 0.0)
    for i in range(len(terms.first) - 1):
        begin = terms.first_factor[i]
        end = terms.first_factor[i + 1]
        for n in range(lanes):
            weight[n] = 0.0
        for t in range(terms.first[i], terms.first[i + 1] if end > begin else 0):
            j = terms.group[t]
            for n in range(lanes):
                weight[n] += coefficients[t, n] * along[j, n]
        for f in range(begin, end):
            a = terms.variable[f]
            k = terms.order[f]
            for g in range(begin, f + 1):
                b = terms.variable[g]
                order = terms.order[g]
                for n in range(lanes):
                    second = powers[1, k, a, n] * powers[1, order, b, n]
                    part[n] = weight[n] * (powers[2, k, a, n] if f == g else second)
                # Multiply by the factors of the other variables.
                for h in range(begin, end):
                    if h != f and h != g:  # noqa: PLR1714 (a tuple is slow)
                        d = terms.variable[h]
                        order = terms.order[h]
                        for n in range(lanes):
                            part[n] *= powers[0, order, d, n]
                for n in range(lanes):
                    hessian[a, b, n] += part[n]


@compiled
def _to_discs(partner, x, slope, curve, at_rim):
    """Write the variables of discs as steps of −1 … 1, in place, with their derivatives.

    Where the value falls outwards at a rim, they are a radius, held at its bound, and the way along
    the rim, whose second derivative is less by the slope outwards over the radius. Elsewhere they
    are steps in both variables.
    """
    part_of_slope = 0.1
    for a in range(len(x)):
        b = partner[a]
        if b < a:
            continue
        size = np.sqrt(x[a] ** 2 + x[b] ** 2)
        outwards = x[a] * slope[a] + x[b] * slope[b]
        at_rim[a] = size >= RADIUS * (1 - 1e-9) and outwards < 0
        if at_rim[a]:
            # Rotate slope and curvature into the directions outwards and along the rim.
            c = x[a] / size
            s = x[b] / size
            slope[a], slope[b] = c * slope[a] + s * slope[b], c * slope[b] - s * slope[a]
            for k in range(len(x)):
                u = curve[a, k]
                v = curve[b, k]
                curve[a, k] = c * u + s * v
                curve[b, k] = c * v - s * u
            for k in range(len(x)):
                u = curve[k, a]
                v = curve[k, b]
                curve[k, a] = c * u + s * v
                curve[k, b] = c * v - s * u
            # The rim bends inwards.
            curve[b, b] -= slope[a] / RADIUS
            x[a] = 1.0
            x[b] = 0.0
        else:
            shift = part_of_slope * np.sqrt(slope[a] ** 2 + slope[b] ** 2)
            curve[a, a] += shift
            curve[b, b] += shift
            x[a] = 0.0
            x[b] = 0.0


@compiled
def _from_discs(partner, eta, at_rim, y):
    """Write steps of `_to_discs` from η as places in the discs, in place."""
    for a in range(len(eta)):
        b = partner[a]
        if b < a:
            continue
        if at_rim[a]:
            turn = y[b] / RADIUS
            c = np.cos(turn)
            s = np.sin(turn)
            y[a] = c * eta[a] - s * eta[b]
            y[b] = s * eta[a] + c * eta[b]
        else:
            y[a] += eta[a]
            y[b] += eta[b]
        size = np.sqrt(y[a] ** 2 + y[b] ** 2)
        if at_rim[a] or size > RADIUS:
            y[a] *= RADIUS / size
            y[b] *= RADIUS / size


@compiled
def step(eta, gradient, hessian, reach, trial):
    """Fill η − reach (H + τ I)⁻¹ gradient, clipped to the box; return the expected gain.

    Variables that are held by a bound do not move. τ is zero if the Hessian H of the others is
    positive definite; otherwise it grows until H + τ I is.
    """
    m = len(eta)
    at_bound = np.empty(m, np.bool_)
    factor = np.empty((m, m))
    size = 1e-300
    shift = 0.0
    gain = 0.0
    for a in range(m):
        at_bound[a] = (eta[a] <= -1 and gradient[a] > 0) or (eta[a] >= 1 and gradient[a] < 0)
        trial[a] = 0.0 if at_bound[a] else -gradient[a]
        for b in range(m):
            size = max(size, abs(hessian[a, b]))
    while not _cholesky(hessian, at_bound, shift, 1e-10 * size, factor):
        shift = max(4 * shift, 1e-3 * size)
        if not shift < 1e6 * size:  # only if the Hessian is not finite
            return 0.0
    substitute(factor, trial)
    for a in range(m):
        trial[a] = min(1.0, max(-1.0, eta[a] + reach * trial[a]))
        gain -= gradient[a] * (trial[a] - eta[a])
    return gain


@compiled
def substitute(factor, x):
    """Solve L Lᵀ y = x in place for a lower triangular L, real or complex."""
    n = len(x)
    for a in range(n):
        for b in range(a):
            x[a] -= factor[a, b] * x[b]
        x[a] /= factor[a, a]
    for a in range(n - 1, -1, -1):
        for b in range(a + 1, n):
            x[a] -= factor[b, a] * x[b]
        x[a] /= factor[a, a]


@compiled
def _cholesky(hessian, at_bound, shift, smallest_pivot, factor):
    """Factor H + shift I without variables at a bound; return whether all pivots suffice."""
    for a in range(len(at_bound)):
        for b in range(a + 1):
            is_interior = not (at_bound[a] or at_bound[b])
            total = hessian[a, b] if is_interior else 0.0
            if a == b:
                total = total + shift if is_interior else 1.0
            for k in range(b):
                total -= factor[a, k] * factor[b, k]
            if a > b:
                factor[a, b] = total / factor[b, b]
            elif total > smallest_pivot or at_bound[a]:
                factor[a, a] = np.sqrt(total)
            else:
                return False
    return True
