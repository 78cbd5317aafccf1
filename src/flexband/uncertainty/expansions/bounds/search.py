"""Search for the least values of sign (μ + c σ) on the box of the interval variables, compiled.

Points of a scan that are not above their neighbours are starts. From each, Newton's method finds
the minimum nearby. From the lowest of these, one variable after the other moves to where the
function is lowest along it, which leaves every minimum that a single variable can leave. Each
series is its own problem, in a lane of its own.
"""

from __future__ import annotations

import numpy as np

from flexband.caching import cached_on_disk
from flexband.uncertainty.expansions.bounds.coordinates import descend
from flexband.uncertainty.expansions.bounds.polish import polish

STARTS = 64
"""Most points of the scan to descend from."""

PATIENCE, ALONE = 12, 8
"""The search ends when so many descents have reached the lowest minimum, `ALONE` if it is the only
one that is known."""

SAME_PLACE = 1e-4
"""Distance in η below which two minima count as one."""

RESOLVED_DIMENSION, MAX_GRID_DIMENSION = 3, 5
"""Up to so many variables a grid resolves all waves, and only the lowest minimum is left along
single variables. Beyond the second number they move first: the scan is far from minima."""

MAX_HEIGHT = 0.5
"""Higher points of such a grid, in parts of the range of its values, are no starts."""

MAX_DROP = 0.5
"""A minimum next to a point of such a grid may be lower than it by this part of how much all its
neighbours together are higher. For a parabola it is 1/8 at most."""

MAX_ROUNDS = 8
"""Most alternations between Newton's method and single variables."""


@cached_on_disk
def search(terms, scan, lines, coefficients, begin, targets, values, places):
    """Fill `values`, (targets, series), and `places`, (targets, series, m), of bounds.

    Parameters
    ----------
    scan : values of all Φ_i, (M, points), η, (points, m), neighbours, (points, count).
    lines : values of η to try in each variable, (m, count), their Chebyshev polynomials,
        (m, count, orders), and how many there are, (m,).
    coefficients : (blocks, terms, lanes), weighted so that σ² is a sum of squares, of the series
        from number `begin` on.
    targets : rows (c, sign): sign (μ + c σ) is minimized.
    """
    basis, points, neighbours = scan
    (count, m), lanes = points.shape, coefficients.shape[2]
    mean, std, height = np.empty((count, lanes)), np.empty((count, lanes)), np.empty((count, lanes))
    bound, which = np.empty((STARTS, lanes)), np.empty((STARTS, lanes), np.int64)
    least, place = np.empty(lanes), np.empty((m, lanes))
    for s in range(len(coefficients)):
        own = coefficients[s]
        _moments(terms, basis, own, mean, std)
        for k in range(len(targets)):
            c, sign = targets[k]
            for p in range(count):
                for n in range(lanes):
                    height[p, n] = sign * (mean[p, n] + c * std[p, n])
            resolved = m <= RESOLVED_DIMENSION and neighbours.shape[1] > 0
            lowest(height, neighbours, MAX_HEIGHT if resolved else 1.0, bound, which)
            _bound(height, neighbours, resolved, bound, which)
            if resolved:
                place[:] = 0.0
                polish(terms, own, c, sign, points, which, bound, least, place)
                everywhere, none = least < np.inf, np.zeros(lanes, np.int64)
                _leave(terms, own, c, sign, lines, everywhere, none, place, place, least)
            else:
                _descents(terms, own, c, sign, lines, points, which, bound, least, place)
            for n in range(lanes):
                values[k, begin + s * lanes + n] = sign * least[n]
                for a in range(m):
                    places[k, begin + s * lanes + n, a] = place[a, n]


@cached_on_disk
def _moments(terms, basis, own, mean, std):
    """Fill μ and σ at the points of the scan, (points, lanes)."""
    lanes, sums = own.shape[1], np.empty((terms.group.max() + 1, own.shape[1]))
    for p in range(len(mean)):
        sums[:] = 0.0
        for i in range(len(basis)):
            phi = basis[i, p]
            for t in range(terms.first[i], terms.first[i + 1]):
                j = terms.group[t]
                for n in range(lanes):
                    sums[j, n] += phi * own[t, n]
        for n in range(lanes):
            mean[p, n], std[p, n] = sums[0, n], 0.0
        for j in range(1, len(sums)):
            for n in range(lanes):
                std[p, n] += sums[j, n] * sums[j, n]
        for n in range(lanes):
            std[p, n] = np.sqrt(std[p, n])


@cached_on_disk
def lowest(height, neighbours, part, best, which):
    """Fill the lowest values that are not above their neighbours, in order, and their points.

    They are in the lower `part` of the range of all values.
    Shapes are (points, lanes) of `height` and (starts, lanes) of `best` and `which`.
    """
    (count, lanes), starts = height.shape, len(best)
    best[:], which[:] = np.inf, 0
    highest, above, least = height[0].copy(), np.empty(lanes), height[0].copy()
    for p in range(count):
        for n in range(lanes):
            least[n] = min(least[n], height[p, n])
            highest[n] = max(highest[n], height[p, n])
    for n in range(lanes):
        highest[n] = least[n] + part * (highest[n] - least[n]) if part < 1 else np.inf
    for p in range(count):
        low = 0.0
        for n in range(lanes):
            above[n] = 1.0 if height[p, n] > highest[n] else 0.0
        for n in range(lanes):
            low += 1 - above[n]
        for k in range(neighbours.shape[1] if low > 0 else 0):
            for n in range(lanes):
                above[n] += 1.0 if height[p, n] > height[neighbours[p, k], n] else 0.0
        for n in range(lanes if low > 0 else 0):
            if above[n] == 0 and height[p, n] < best[starts - 1, n]:
                k = starts - 1
                while k > 0 and height[p, n] < best[k - 1, n]:
                    best[k, n], which[k, n] = best[k - 1, n], which[k - 1, n]
                    k -= 1
                best[k, n], which[k, n] = height[p, n], p


@cached_on_disk
def _bound(height, neighbours, resolved, best, which):
    """Lower the values of starts to what the minima next to them may reach; ∞ is no start."""
    for n in range(best.shape[1]):
        for k in range(len(best)):
            if best[k, n] == np.inf:
                break
            drop = 0.0 if resolved else np.inf
            for q in range(neighbours.shape[1]):
                drop += MAX_DROP * (height[neighbours[which[k, n], q], n] - best[k, n])
            best[k, n] -= drop


@cached_on_disk
def _descents(terms, own, c, sign, lines, points, which, bound, least, place):
    """Fill the least value that is found from points of the scan, and its place, (m, lanes).

    The search ends when some descents have reached the same lowest minimum.
    """
    m, lanes = place.shape
    eta, found, active = np.zeros((m, lanes)), np.empty(lanes), np.empty(lanes, np.bool_)
    alone, hits = np.ones(lanes, np.bool_), np.zeros(lanes, np.int64)
    least[:], place[:] = np.inf, 0.0
    for start in range(len(which)):
        for n in range(lanes):
            patient = hits[n] < (ALONE if alone[n] else PATIENCE)
            active[n] = bound[start, n] < np.inf and patient
            for a in range(m if active[n] else 0):
                eta[a, n] = points[which[start, n], a]
        if not active.any():
            break
        if m > MAX_GRID_DIMENSION:
            descend(terms, own, c, sign, lines, active.copy(), eta)
            for n in range(lanes):
                if _same(n, active, hits, place, eta):
                    hits[n], active[n] = hits[n] + 1, False
        _polish(terms, own, c, sign, active, eta, found)
        _leave(terms, own, c, sign, lines, active, hits, place, eta, found)
        for n in range(lanes):
            same = _same(n, active, hits, place, eta)
            if active[n] and not same:
                alone[n] = hits[n] == 0
                hits[n] = 0 if found[n] < least[n] else hits[n]
            hits[n] += same or (active[n] and hits[n] == 0)
            if active[n] and found[n] < least[n]:
                least[n] = found[n]
                for a in range(m):
                    place[a, n] = eta[a, n]


@cached_on_disk
def _leave(terms, own, c, sign, lines, active, hits, place, eta, found):
    """Leave minima that a single variable can leave, but for the lowest one that is known."""
    moving = active.copy()
    for _ in range(MAX_ROUNDS):
        for n in range(len(moving)):
            moving[n] = moving[n] and not _same(n, active, hits, place, eta)
        if not moving.any():
            break
        descend(terms, own, c, sign, lines, moving, eta)
        if not moving.any():
            break
        _polish(terms, own, c, sign, moving, eta, found)


@cached_on_disk
def _polish(terms, own, c, sign, active, eta, found):
    """Move η of active lanes to the nearby minimum, and fill it."""
    m, lanes = eta.shape
    if not active.any():
        return
    points, starts, bound = eta.T.copy(), np.arange(lanes).reshape(1, lanes), np.empty((1, lanes))
    least, place = np.empty(lanes), eta.copy()
    bound[0] = np.where(active, -np.inf, np.inf)
    polish(terms, own, c, sign, points, starts, bound, least, place)
    for n in range(lanes):
        if active[n]:
            found[n] = least[n]
            for a in range(m):
                eta[a, n] = place[a, n]


@cached_on_disk
def _same(n, active, hits, place, eta):
    """Return whether an active lane is at the lowest minimum that is known."""
    same = active[n] and hits[n] > 0
    for a in range(len(eta)):
        same = same and abs(eta[a, n] - place[a, n]) < SAME_PLACE
    return same
