"""Move one interval variable after the other to where μ ± c σ is lowest along it, compiled."""

from __future__ import annotations

import numpy as np

from flexband.compilation.functions import compiled
from flexband.uncertainty.expansions.bounds.bound_options import OPTIONS
from flexband.uncertainty.expansions.bounds.discs import RADIUS
from flexband.uncertainty.expansions.bounds.terms import (
    aim,
    chebyshev_powers,
    copy,
    fill,
    largest,
    product,
)


@compiled
def descend(terms, coefficients, c, sign, lines, active, eta):  # noqa: PLR0912
    """Move variables of active lanes to the best of `lines`; leave active those that move."""
    line_points, polynomials, counts = lines
    (m, lanes), orders, groups = eta.shape, polynomials.shape[2], terms.depends.shape[1]
    powers, sums = np.empty((3, orders, m, lanes)), np.zeros((groups, lanes))
    along, part = np.empty((orders, groups, lanes)), np.empty(lanes)
    height, value, best = np.empty(lanes), np.empty(lanes), np.empty(lanes)
    rest, mean, square = np.empty(lanes), np.empty(lanes), np.empty(lanes)
    least_gain, at = np.zeros(lanes), np.empty(lanes, np.int64)
    idle_count, move_mask = np.zeros(lanes, np.int64), np.zeros(lanes, np.bool_)
    # Evaluate the sums of the terms at the start.
    chebyshev_powers(eta, powers)
    for i in range(len(terms.first) - 1):
        product(terms, i, -1, powers, part)
        for t in range(terms.first[i], terms.first[i + 1]):
            j = terms.group[t]
            for n in range(lanes):
                sums[j, n] += part[n] * coefficients[t, n]
                least_gain[n] += OPTIONS.min_gain * abs(coefficients[t, n])
    aim(sums, c, sign, value)
    # Visit one variable after the other, until no lane has moved in any of them.
    for step in range(OPTIONS.max_sweeps * m):
        a, continues = step % m, False
        for n in range(lanes):
            continues = continues or (active[n] and idle_count[n] < m)
        if not continues:
            break
        highest = _along(terms, coefficients, a, powers, part, sums, along)
        for n in range(lanes):
            best[n], at[n], rest[n] = value[n] - least_gain[n], -1, 0.0
        for j in range(1, groups):
            for n in range(0 if terms.depends[a, j] else lanes):
                rest[n] += sums[j, n] * sums[j, n]
        # Find the lowest value along the line.
        for g in range(counts[a] if highest else 0):
            copy(mean, sums[0])
            copy(square, rest)
            for j in range(groups):
                if terms.depends[a, j]:
                    _on_line(polynomials[a, g], highest, along[:, j], part)
                    for n in range(lanes):
                        if j:
                            square[n] += part[n] * part[n]
                        else:
                            mean[n] = part[n]
            for n in range(lanes):
                height[n] = sign * (mean[n] + c * np.sqrt(square[n]))
            if terms.partner[a] >= 0:
                _leave_out(line_points[a, g], eta[terms.partner[a]], height)
            for n in range(lanes):
                if height[n] < best[n]:
                    best[n], at[n] = height[n], g
        # Move the variable there, and update powers and sums.
        for n in range(lanes):
            if not active[n] or idle_count[n] == m:
                continue
            idle_count[n] += 1
            if at[n] >= 0:
                value[n], idle_count[n], move_mask[n], eta[a, n] = (
                    best[n],
                    0,
                    True,
                    line_points[a, at[n]],
                )
                for k in range(highest + 1):
                    powers[0, k, a, n] = polynomials[a, at[n], k]
                for j in range(groups):
                    if terms.depends[a, j]:
                        sums[j, n] = along[0, j, n]
                        for k in range(1, highest + 1):
                            sums[j, n] += along[k, j, n] * powers[0, k, a, n]
    copy(active, move_mask)


@compiled
def _leave_out(place, others, height):
    """Fill ∞ where a variable and the other one of its disc are outside."""
    for n in range(len(height)):
        if place**2 + others[n] ** 2 > RADIUS**2:
            height[n] = np.inf


@compiled
def _on_line(polynomials, highest, along, total):
    """Fill the sum of the terms of a Ψ_j at a value of one variable."""
    for n in range(len(total)):
        total[n] = along[0, n]
    for k in range(1, highest + 1):
        T = polynomials[k]
        for n in range(len(total)):
            total[n] += T * along[k, n]


@compiled
def _along(terms, coefficients, a, powers, part, sums, along):
    """Fill the factors of each T_k(η_a) in the sums of each Ψ_j; return the highest k."""
    first = terms.first_owner[a]
    last = terms.first_owner[a + 1]
    highest = largest(terms.owner_order, first, last)
    for j in range(len(sums)):
        if terms.depends[a, j]:
            copy(along[0, j], sums[j])
            for k in range(1, highest + 1):
                fill(along[k, j], 0.0)
    for o in range(first, last):
        i = terms.owner[o]
        k = terms.owner_order[o]
        product(terms, i, a, powers, part)
        for t in range(terms.first[i], terms.first[i + 1]):
            j = terms.group[t]
            for n in range(len(part)):
                term_part = part[n] * coefficients[t, n]
                along[k, j, n] += term_part
                along[0, j, n] -= term_part * powers[0, k, a, n]
    return highest
