"""Search for the least values of sign (μ + c σ) on the box of the interval variables, compiled.

Points of a scan that are not above their neighbours are starts. From each, Newton's method finds
the minimum nearby, and one variable after the other moves to where the function is lowest along it,
in turns until neither moves. Each series is its own problem. Those that wait for the same are
served together, `LANES` at a time, in lanes side by side.
"""

from __future__ import annotations

import numpy as np

from flexband.caching import cached_on_disk, compiled
from flexband.uncertainty.expansions.bounds.coordinates import descend
from flexband.uncertainty.expansions.bounds.loops import copy, fill
from flexband.uncertainty.expansions.bounds.polish import polish

LANES = 32

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

MAX_TURNS = 40
"""Most steps of both kinds from one start."""

FLAT = 1e-13
"""Variation of a constant, as a part of its value, that is due to rounding."""

START, LINES, NEWTON, NOTHING = 0, 1, 2, 3
"""What a series waits for."""


def search(terms, scan, lines, coefficients, targets, values, places):
    """Fill `values`, (targets, series), and `places`, (targets, series, m), of bounds.

    Parameters
    ----------
    scan : values of Φ_i of all terms, (terms, points), η, (points, m), neighbours, (points, count).
    lines : values of η to try in each variable, (m, count), their Chebyshev polynomials,
        (m, count, orders), and how many there are, (m,).
    coefficients : (series, terms), weighted so that σ² is a sum of squares.
    targets : rows (c, sign): sign (μ + c σ) is minimized.
    """
    shape = *values.shape, STARTS
    bound, which = np.empty(shape), np.empty(shape, np.int64)
    resolved = places.shape[2] <= RESOLVED_DIMENSION and scan[2].shape[1] > 0
    starts(terms, scan, coefficients, targets, resolved, bound, which)
    for k, target in enumerate(targets):  # a function of its own, which is compiled in less time
        start_points = scan[1], which[k], bound[k]
        descents(terms, coefficients, target, resolved, lines, start_points, values[k], places[k])
        values[k] *= target[1]


@cached_on_disk
def starts(terms, scan, coefficients, targets, resolved, bound, which):
    """Fill what may be reached from points of the scan, lowest first, and which points these are.

    Both have the shape (targets, series, STARTS).
    """
    basis, points, neighbours = scan
    series, count = len(coefficients), len(points)
    mean, std, height = np.empty(count), np.empty(count), np.empty(count)
    for n in range(series):
        _moments(terms, basis, coefficients[n], mean, std, height)
        for k in range(len(targets)):
            c, sign = targets[k]
            for p in range(count):
                height[p] = sign * (mean[p] + c * std[p])
            lowest(height, neighbours, MAX_HEIGHT if resolved else 1.0, bound[k, n], which[k, n])
            _bound(height, neighbours, resolved, bound[k, n], which[k, n])


@compiled
def _moments(terms, basis, coefficients, mean, std, part):
    """Fill μ and σ of a series at the points of the scan."""
    fill(std, 0.0)
    for j in range(len(terms.first_of_group) - 1):
        fill(part, 0.0)
        begin, end = terms.first_of_group[j], terms.first_of_group[j + 1]
        for k in range(begin, end - 1, 2):  # two at a time load and store less
            t, u = terms.of_group[k], terms.of_group[k + 1]
            a, b = coefficients[t], coefficients[u]
            for p in range(len(part)):
                part[p] += a * basis[t, p] + b * basis[u, p]
        if (end - begin) % 2:
            t = terms.of_group[end - 1]
            a = coefficients[t]
            for p in range(len(part)):
                part[p] += a * basis[t, p]
        if j:
            for p in range(len(part)):
                std[p] += part[p] * part[p]
        else:
            copy(mean, part)
    for p in range(len(std)):
        std[p] = np.sqrt(std[p])


@compiled
def lowest(height, neighbours, part, best, which):
    """Fill the lowest values that are not above their neighbours, in order, and their points.

    They are in the lower `part` of the range of all values; of a constant only one counts. Shapes
    are (points,) of `height` and (starts,) of `best` and `which`; ∞ and 0 fill what is left.
    """
    fill(best, np.inf)
    fill(which, 0)
    place, least, highest = 0, height[0], height[0]
    for p in range(len(height)):
        if height[p] < least:
            place, least = p, height[p]
        highest = max(highest, height[p])
    if highest - least <= FLAT * max(abs(least), abs(highest)):
        best[0], which[0] = least, place
        return
    top = least + part * (highest - least)
    for p in range(len(height)):
        value = height[p]
        is_start = value <= top and value < best[-1]
        for k in range(neighbours.shape[1]):
            if not is_start:
                break
            is_start = value <= height[neighbours[p, k]]
        if is_start:
            k = len(best) - 1
            while k > 0 and value < best[k - 1]:
                best[k], which[k] = best[k - 1], which[k - 1]
                k -= 1
            best[k], which[k] = value, p


@compiled
def _bound(height, neighbours, resolved, best, which):
    """Lower the values of starts to what the minima next to them may reach; ∞ is no start."""
    for k in range(len(best)):
        if best[k] == np.inf:
            break
        drop = 0.0 if resolved else np.inf
        for q in range(neighbours.shape[1]):
            drop += MAX_DROP * (height[neighbours[which[k], q]] - best[k])
        best[k] -= drop


@cached_on_disk
def descents(  # noqa: PLR0912, PLR0915
    terms, coefficients, target, resolved, lines, at_start, least, place
):
    """Fill the least value that is found from points of the scan, and its place, (series, m).

    A start counts if its bound is below the least value so far. The search of a series ends when
    some descents have reached the same lowest minimum.
    """
    c, sign = target
    points, which, bound = at_start
    series, m = place.shape
    lane_coefficients, at = np.zeros((coefficients.shape[1], LANES)), np.zeros((m, LANES))
    height, part, reach = np.empty(LANES), np.ones(LANES), np.ones(series)
    chosen, active = np.empty(LANES, np.int64), np.empty(LANES, np.bool_)
    eta, values, todo = np.zeros((series, m)), np.full(series, np.inf), np.full(series, START)
    taken, turns = np.full(series, -1), np.zeros(series, np.int64)
    hits, alone = np.zeros(series, np.int64), np.ones(series, np.bool_)
    via, entry = np.full((2, series, m), np.inf)  # ends of the first LINES
    fill(least, np.inf)
    fill(place, 0.0)
    first = LINES if m > MAX_GRID_DIMENSION else NEWTON
    while True:
        more = 0
        for n in range(series):
            if todo[n] == START:
                patient = resolved or hits[n] < (ALONE if alone[n] else PATIENCE)
                k = taken[n] = _next(bound[n], taken[n] + 1, least[n] if patient else -np.inf)
                todo[n] = NOTHING if k == len(bound[n]) else first
                copy(eta[n], points[which[n, min(k, len(bound[n]) - 1)]])
                turns[n], reach[n] = 0, 1.0
            more += (todo[n] == LINES) - (todo[n] == NEWTON)
        kind, count = LINES if more > 0 else NEWTON, 0
        for n in range(series):
            if todo[n] == kind and count < LANES:
                copy(lane_coefficients[:, count], coefficients[n])
                copy(at[:, count], eta[n])
                part[count] = reach[n]
                chosen[count], count = n, count + 1
        if count == 0:
            break
        for lane in range(LANES):
            active[lane] = lane < count
        if kind == LINES:
            descend(terms, lane_coefficients, c, sign, lines, active, at)
        else:
            polish(terms, lane_coefficients, c, sign, active, at, part, height)
        for lane in range(count):
            n = chosen[lane]
            copy(eta[n], at[:, lane])
            turns[n] += 1
            if kind == LINES and turns[n] == 1:
                copy(via[n], eta[n])
            known = hits[n] > 0 and (_near(eta[n], place[n]) or _near(eta[n], entry[n]))
            if kind == NEWTON:
                values[n], reach[n] = height[lane], part[lane] if active[lane] else 1.0
                onward = active[lane] or values[n] < least[n] or not resolved
                onward, todo[n] = onward and turns[n] < MAX_TURNS, NEWTON if active[lane] else LINES
            else:
                onward = turns[n] == 1 or active[lane]
                todo[n] = NEWTON
            if onward and not known:
                continue
            todo[n], lower = START, values[n] < least[n] and not known
            alone[n] = alone[n] if known else hits[n] == 0
            hits[n] = 1 if lower or not hits[n] else hits[n] + known
            if lower:
                least[n] = values[n]
                copy(place[n], eta[n])
                copy(entry[n], via[n])


@compiled
def _next(bound, k, least):
    """Return the number of the next start, from k on, that may lead below a value, or of all."""
    while k < len(bound) and not bound[k] < least:
        k += 1
    return k


@compiled
def _near(eta, place):
    """Return whether two places count as one."""
    near = True
    for a in range(len(eta)):
        near = near and abs(eta[a] - place[a]) < SAME_PLACE
    return near
