"""Search for the least values of sign (μ + c σ) on the box of the interval variables, compiled.

Points of a scan that are not above their neighbours are starts. From each, Newton's method finds
the minimum nearby, and one variable after the other moves to where the function is lowest along it,
in turns until neither moves. Each series is its own problem. Those that wait for the same are
served together, some at a time, in lanes side by side.
"""

from __future__ import annotations

import numpy as np

from flexband.compilation.caching import cached_on_disk
from flexband.compilation.functions import compiled
from flexband.uncertainty.expansions.bounds.bound_options import OPTIONS, NextStep
from flexband.uncertainty.expansions.bounds.coordinates import descend
from flexband.uncertainty.expansions.bounds.polish import polish
from flexband.uncertainty.expansions.bounds.terms import copy, fill


def search(terms, scan, lines, coefficients, targets, values, places):
    """Fill `values`, (targets, series), and `places`, (targets, series, m), of bounds.

    The scan has values of Φ_i, (terms, points), η, (points, m), and neighbours; lines have values
    of η to try, (m, count), their Chebyshev polynomials, (m, count, orders), and their number;
    `coefficients`, (series, terms), are weighted so that σ² is a sum of squares; rows (c, sign) of
    `targets` minimize sign (μ + c σ).
    """
    shape = *values.shape, OPTIONS.max_starts
    bound = np.empty(shape)
    which = np.empty(shape, np.int64)
    resolved = places.shape[2] <= OPTIONS.resolved_dimension and scan[2].shape[1] > 0
    resolved = resolved and bool(np.all(terms.partner < 0))
    starts(terms, scan, coefficients, targets, resolved, bound, which)
    for k, target in enumerate(targets):  # a function of its own, which is compiled in less time
        start_points = scan[1], which[k], bound[k]
        descents(terms, coefficients, target, resolved, lines, start_points, values[k], places[k])
        values[k] *= target[1]


@cached_on_disk
def starts(terms, scan, coefficients, targets, resolved, bound, which):
    """Fill what may be reached from points of the scan, and these, (targets, series, starts)."""
    basis, points, neighbours = scan
    series = len(coefficients)
    count = len(points)
    mean = np.empty(count)
    std = np.empty(count)
    height = np.empty(count)
    for n in range(series):
        _moments(terms, basis, coefficients[n], mean, std, height)
        for k in range(len(targets)):
            c, sign = targets[k]
            for p in range(count):
                height[p] = sign * (mean[p] + c * std[p])
            part = OPTIONS.max_start_height if resolved else 1.0
            lowest(height, neighbours, part, bound[k, n], which[k, n])
            if np.any(terms.partner >= 0):
                _lowest_apart(height, neighbours, bound[k, n], which[k, n])
            _bound(height, neighbours, resolved, bound[k, n], which[k, n])


@compiled
def _moments(terms, basis, coefficients, mean, std, part):
    """Fill μ and σ of a series at the points of the scan."""
    fill(std, 0.0)
    for j in range(len(terms.first_of_group) - 1):
        fill(part, 0.0)
        begin = terms.first_of_group[j]
        end = terms.first_of_group[j + 1]
        for k in range(begin, end - 1, 2):  # two at a time load and store less
            t = terms.of_group[k]
            u = terms.of_group[k + 1]
            a = coefficients[t]
            b = coefficients[u]
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
    """Fill the lowest values not above their neighbours, in order, and their points.

    They are in the lower `part` of the range of all values; of a constant only one counts. ∞ and 0
    fill what is left.
    """
    fill(best, np.inf)
    fill(which, 0)
    # Find the range of the values; a constant has one start.
    place = 0
    minimum = height[0]
    highest = height[0]
    for p in range(len(height)):
        if height[p] < minimum:
            place = p
            minimum = height[p]
        highest = max(highest, height[p])
    if highest - minimum <= OPTIONS.flat * max(abs(minimum), abs(highest)):
        best[0] = minimum
        which[0] = place
        return
    # Insert each local minimum below the top into the ordered list.
    top = minimum + part * (highest - minimum)
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
                best[k] = best[k - 1]
                which[k] = which[k - 1]
                k -= 1
            best[k] = value
            which[k] = p


@compiled
def _lowest_apart(height, neighbours, best, which):
    """Fill what `lowest` does with the lowest values of points that are not next to each other.

    Along the rim of a disc a scan has few points, of which a minimum may be next to a lower one.
    """
    candidates = np.full(len(height), True)
    for k in range(len(best)):
        minimum = np.inf
        for p in range(len(height)):
            if candidates[p] and height[p] < minimum:
                which[k] = p
                minimum = height[p]
        best[k] = minimum
        candidates[which[k]] = False
        for q in range(neighbours.shape[1]):
            candidates[neighbours[which[k], q]] = False


@compiled
def _bound(height, neighbours, resolved, best, which):
    """Lower the values of starts to what the minima next to them may reach; ∞ is no start."""
    for k in range(len(best)):
        if best[k] == np.inf:
            break
        drop = 0.0 if resolved else np.inf
        for q in range(neighbours.shape[1]):
            drop += OPTIONS.max_drop * (height[neighbours[which[k], q]] - best[k])
        best[k] -= drop


@cached_on_disk
def descents(  # noqa: PLR0912, PLR0915
    terms, coefficients, target, resolved, lines, at_start, minimum, place
):
    """Fill the lowest minimum reached from points of the scan, and its place, (series, m).

    The search of a series ends when some descents have reached the same lowest minimum.
    """
    c, sign = target
    points, which, bound = at_start
    series, m = place.shape
    lanes = OPTIONS.lanes
    lane_coefficients = np.zeros((coefficients.shape[1], lanes))
    at = np.zeros((m, lanes))
    height = np.empty(lanes)
    part = np.ones(lanes)
    reach = np.ones(series)
    lane_series = np.empty(lanes, np.int64)
    active = np.empty(lanes, np.bool_)
    eta = np.zeros((series, m))
    values = np.full(series, np.inf)
    todo = np.full(series, NextStep.START)
    last_start = np.full(series, -1)
    turns = np.zeros(series, np.int64)
    hits = np.zeros(series, np.int64)
    alone = np.ones(series, np.bool_)
    via, entry = np.full((2, series, m), np.inf)  # ends of the first descent along lines
    fill(minimum, np.inf)
    fill(place, 0.0)
    first = NextStep.LINES if m > OPTIONS.max_grid_dimension else NextStep.NEWTON
    while True:
        # Begin the next descent of each series that waits for a start.
        line_majority = 0
        for n in range(series):
            if todo[n] == NextStep.START:
                patience = OPTIONS.patience_if_alone if alone[n] else OPTIONS.patience
                patient = resolved or hits[n] < patience
                k = last_start[n] = _next(
                    bound[n], last_start[n] + 1, minimum[n] if patient else -np.inf
                )
                todo[n] = NextStep.NOTHING if k == len(bound[n]) else first
                copy(eta[n], points[which[n, min(k, len(bound[n]) - 1)]])
                turns[n] = 0
                reach[n] = 1.0
            line_majority += (todo[n] == NextStep.LINES) - (todo[n] == NextStep.NEWTON)
        # Serve the step that most series wait for, as many as there are lanes.
        kind = NextStep.LINES if line_majority > 0 else NextStep.NEWTON
        count = 0
        for n in range(series):
            if todo[n] == kind and count < lanes:
                copy(lane_coefficients[:, count], coefficients[n])
                copy(at[:, count], eta[n])
                part[count] = reach[n]
                lane_series[count], count = n, count + 1
        if count == 0:
            break
        for lane in range(lanes):
            active[lane] = lane < count
        if kind == NextStep.LINES:
            descend(terms, lane_coefficients, c, sign, lines, active, at)
        else:
            polish(terms, lane_coefficients, c, sign, active, at, part, height)
        # Decide how each series goes on: another turn, or the end of its descent.
        for lane in range(count):
            n = lane_series[lane]
            copy(eta[n], at[:, lane])
            turns[n] += 1
            if kind == NextStep.LINES and turns[n] == 1:
                copy(via[n], eta[n])
            is_repeat = hits[n] > 0 and (
                _is_same_place(eta[n], place[n]) or _is_same_place(eta[n], entry[n])
            )
            if kind == NextStep.NEWTON:
                values[n] = height[lane]
                reach[n] = part[lane] if active[lane] else 1.0
                onward = active[lane] or values[n] < minimum[n] or not resolved
                onward = onward and turns[n] < OPTIONS.max_turns
                todo[n] = NextStep.NEWTON if active[lane] else NextStep.LINES
            else:
                onward = turns[n] == 1 or active[lane]
                todo[n] = NextStep.NEWTON
            if onward and not is_repeat:
                continue
            # Compare the minimum at the end of a descent with the lowest so far.
            todo[n] = NextStep.START
            lower = values[n] < minimum[n] and not is_repeat
            alone[n] = alone[n] if is_repeat else hits[n] == 0
            hits[n] = 1 if lower or not hits[n] else hits[n] + is_repeat
            if lower:
                minimum[n] = values[n]
                copy(place[n], eta[n])
                copy(entry[n], via[n])


@compiled
def _next(bound, k, limit):
    """Return the number of the next start, from k on, that may lead below a value, or of all."""
    while k < len(bound) and not bound[k] < limit:
        k += 1
    return k


@compiled
def _is_same_place(eta, place):
    """Return whether two places are equal within `OPTIONS.same_place`."""
    is_same = True
    for a in range(len(eta)):
        is_same = is_same and abs(eta[a] - place[a]) < OPTIONS.same_place
    return is_same
