"""Search for the least values of sign (μ + c σ) on the box of the interval variables, compiled.

Points of a scan that are not above their neighbours are starts. From each, Newton's method finds
the minimum nearby; then one variable after the other moves to where the function is lowest along
it, which leaves every minimum that a single variable can leave. Each series is its own problem.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.caching import cached_on_disk
from flexband.uncertainty.expansions.polish import chebyshev_powers, polish, totals

STARTS = 64
"""Most points of the scan to descend from."""

PATIENCE, ALONE = 12, 8
"""The search ends when so many descents have reached the lowest minimum, `ALONE` if it is the only
one that is known."""

SAME_PLACE = 1e-4
"""Distance in η below which two minima count as one."""

MAX_GRID_DIMENSION = 5
"""Variables from which on single variables move first: points of the scan are far from minima."""

MAX_SWEEPS = 30
MIN_GAIN = 1e-13
"""A variable moves if that gains at least this fraction of the sum of all coefficients."""

MAX_ROUNDS = 8
"""Most alternations between Newton's method and single variables."""


class SparseTerms(NamedTuple):
    """The terms of an expansion, in the order of Ψ_j, with the variables that each contains.

    Attributes
    ----------
    group : j of each term, increasing, (terms,).
    first : number of the first factor of each term, (terms + 1,).
    variable, order : of each factor T_order(η_variable).
    owner_first : where the terms that contain each variable start, (m + 1,).
    owner, owner_order : these terms, those of μ first, and their orders in the variable.
    owner_means : how many of them are terms of μ, (m,).
    """

    group: np.ndarray
    first: np.ndarray
    variable: np.ndarray
    order: np.ndarray
    owner_first: np.ndarray
    owner: np.ndarray
    owner_order: np.ndarray
    owner_means: np.ndarray

    @staticmethod
    def of(index: np.ndarray, group: np.ndarray) -> SparseTerms:
        """Return the terms with these orders, (terms, m), and j, increasing."""
        term, variable = np.nonzero(index)
        column, owner = np.nonzero(index.T)
        return SparseTerms(
            group,
            np.searchsorted(term, np.arange(len(index) + 1)),
            variable,
            index[term, variable],
            np.searchsorted(column, np.arange(index.shape[1] + 1)),
            owner,
            index[owner, column],
            np.count_nonzero(index[group == 0], axis=0),
        )


@cached_on_disk
def search(terms, scan, lines, coefficients, begin, targets, values, places):
    """Fill `values`, (targets, series), and `places`, (targets, series, m), of bounds.

    Parameters
    ----------
    scan : the terms' values, (terms, points), η, (points, m), neighbours, (points, count).
    lines : values of η to try in each variable, (m, count), their Chebyshev polynomials,
        (m, count, orders), and how many there are, (m,).
    coefficients : (series, terms), weighted so that σ² is a sum of squares, of the series from
        number `begin` on.
    targets : rows (c, sign): sign (μ + c σ) is minimized.
    """
    basis, points, neighbours = scan
    count = basis.shape[1]
    mean, std, last, aim = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    best, which = np.empty(STARTS), np.empty(STARTS, np.int64)
    for s in range(len(coefficients)):
        own = coefficients[s]
        _moments(terms, basis, own, mean, std, last)
        for k in range(len(targets)):
            c, sign = targets[k]
            for p in range(count):
                aim[p] = sign * (mean[p] + c * std[p])
            lowest(aim, neighbours, best, which)
            place = places[k, begin + s]
            least = _descents(terms, own, c, sign, lines, points, which, best, place)
            values[k, begin + s] = sign * least


@cached_on_disk
def _moments(terms, basis, own, mean, std, last):
    """Fill μ and σ of a series at the points of the scan."""
    size, count = basis.shape
    mean[:], std[:], last[:] = 0.0, 0.0, 0.0
    for i in range(size):
        j, factor = terms.group[i], own[i]
        total = last if j else mean
        for p in range(count):
            total[p] += factor * basis[i, p]
        if j and (i + 1 == size or terms.group[i + 1] != j):
            for p in range(count):
                std[p] += last[p] * last[p]
                last[p] = 0.0
    for p in range(count):
        std[p] = np.sqrt(std[p])


@cached_on_disk
def _descents(terms, own, c, sign, lines, points, which, scanned, place):
    """Return the least value that is found from points of the scan, and move `place` there."""
    starts, m = len(which), len(place)
    kept, eta = np.empty((starts, m)), np.empty(m)
    least, best, done, hits = np.inf, -1, 0, 0
    for start in range(starts):
        if scanned[start] == np.inf or hits >= (PATIENCE if done > 1 else ALONE):
            break
        for a in range(m):
            eta[a] = points[which[start], a]
        if m > MAX_GRID_DIMENSION:
            _descend(terms, own, c, sign, lines, eta)
        found = polish(terms, own, c, sign, eta)
        known = _known(kept, done, eta)
        for _ in range(MAX_ROUNDS):
            if known >= 0 or not _descend(terms, own, c, sign, lines, eta):
                break
            found = polish(terms, own, c, sign, eta)
            known = _known(kept, done, eta)
        if known >= 0:
            hits += known == best
            continue
        for a in range(m):
            kept[done, a] = eta[a]
        if found < least:
            least, best, hits = found, done, 1
            for a in range(m):
                place[a] = eta[a]
        done += 1
    return least


@cached_on_disk
def _known(kept, done, eta):
    """Return the number of the minimum at η, or −1 if it is none of those kept."""
    for k in range(done):
        same = True
        for a in range(len(eta)):
            same = same and abs(kept[k, a] - eta[a]) < SAME_PLACE
        if same:
            return k
    return -1


@cached_on_disk
def lowest(aim, neighbours, best, which):
    """Fill the lowest values that are not above their neighbours, in order, and their points."""
    starts = len(best)
    for k in range(starts):
        best[k], which[k] = np.inf, 0
    for p in range(len(aim)):
        least = aim[p] < best[starts - 1]
        for k in range(neighbours.shape[1] if least else 0):
            least = least and aim[p] <= aim[neighbours[p, k]]
        if least:
            k = starts - 1
            while k > 0 and aim[p] < best[k - 1]:
                best[k], which[k] = best[k - 1], which[k - 1]
                k -= 1
            best[k], which[k] = aim[p], p


@cached_on_disk
def _descend(terms, own, c, sign, lines, eta):  # noqa: PLR0912
    """Move one variable after the other to the best of the values to try; return if any moves."""
    tried, polynomials, counts = lines
    m, orders, groups = len(eta), polynomials.shape[2], terms.group[-1] + 1 if c != 0 else 1
    powers, sums, along = np.empty((3, m, orders)), np.empty(groups), np.empty((orders, groups))
    chebyshev_powers(eta, powers)
    value, least_gain = totals(terms, own, c, sign, powers, sums), 0.0
    for i in range(len(own)):
        least_gain += MIN_GAIN * abs(own[i])
    improved, unmoved, a = False, 0, -1
    for _ in range(MAX_SWEEPS * m):
        if unmoved == m:
            break
        a, unmoved = (a + 1) % m, unmoved + 1
        highest = _along(terms, own, a, powers, sums, along)
        best, at = value - least_gain, -1
        for g in range(counts[a] if highest else 0):
            mean, variance = 0.0, 0.0
            for j in range(groups):
                x = along[0, j]
                for k in range(1, highest + 1):
                    x += along[k, j] * polynomials[a, g, k]
                if j == 0:
                    mean = x
                else:
                    variance += x * x
            trial = sign * (mean + c * np.sqrt(variance))
            if trial < best:
                best, at = trial, g
        if at >= 0:
            value, unmoved, improved, eta[a] = best, 0, True, tried[a, at]
            for k in range(orders):
                powers[0, a, k] = polynomials[a, at, k]
            for j in range(groups):
                sums[j] = along[0, j]
                for k in range(1, highest + 1):
                    sums[j] += along[k, j] * polynomials[a, at, k]
    return improved


@cached_on_disk
def _along(terms, own, a, powers, sums, along):
    """Fill the factors of each T_k(η_a) in the sums of each Ψ_j; return the highest k."""
    orders, groups = along.shape
    for j in range(groups):
        along[0, j] = sums[j]
        for k in range(1, orders):
            along[k, j] = 0.0
    begin, end, highest = terms.owner_first[a], terms.owner_first[a + 1], 0
    for t in range(begin, end if groups > 1 else begin + terms.owner_means[a]):
        i, k = terms.owner[t], terms.owner_order[t]
        rest, j = own[i], terms.group[i]
        for f in range(terms.first[i], terms.first[i + 1]):
            if terms.variable[f] != a:
                rest *= powers[0, terms.variable[f], terms.order[f]]
        along[k, j] += rest
        along[0, j] -= rest * powers[0, a, k]
        highest = max(highest, k)
    return highest
