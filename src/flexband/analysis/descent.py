"""Lowest values of many functions of η over the box [−1, 1]^m, by a pattern search.

The functions need no derivatives: quantiles of samples, for instance, have kinks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Function = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""η of shape (rows, m) and the number of the function of each row -> values, (rows,)."""


@dataclass(frozen=True)
class SearchOptions:
    """How the lowest values over the interval inputs are searched."""

    first_step: float = 0.3
    """First step of η."""
    near_step: float = 0.1
    """First step near the place of a neighbour."""
    last_step: float = 0.01
    """Smallest step."""
    step_divisor: float = 4.0
    """What a step is divided by where it finds nothing."""
    max_sweeps: int = 24
    """Most sweeps over all variables."""
    neighbour_rounds: int = 3
    """Rounds in which the places of neighbours are tried."""
    max_scanned: int = 20_000
    """Most points times times of a scan."""
    starts: int = 2
    """Points of a scan from which each function is searched."""


def descend(
    function: Function,
    which: np.ndarray,
    eta: np.ndarray,
    values: np.ndarray,
    tolerance: np.ndarray,
    first_step: float | None = None,
    *,
    options: SearchOptions = SearchOptions(),
) -> tuple[np.ndarray, np.ndarray]:
    """Return values and places of local minima near given places.

    Each variable is tried on both sides of a place; where both are higher, the vertex of the
    parabola is tried as well; after a sweep over all variables, its whole change once more. The
    functions `which`, (rows,), have the `values`, (rows,), at the starts `eta`, (rows, m); gains up
    to `tolerance`, (rows,), count as none.
    """
    best, lowest, m = eta.copy(), values.copy(), eta.shape[1]
    step = np.full(len(best), first_step or options.first_step)
    rows = np.arange(len(best)) if m else np.zeros(0, dtype=int)

    def try_places(rows: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Try places and take the lower ones; return all values, infinite where nothing changes."""
        new_values = np.full(len(rows), np.inf)
        new = np.flatnonzero(np.any(places != best[rows], axis=1))
        if len(new):
            new_values[new] = function(places[new], which[rows[new]])
            better = new[new_values[new] < lowest[rows[new]]]
            best[rows[better]] = places[better]
            lowest[rows[better]] = new_values[better]
        return new_values

    for _ in range(options.max_sweeps):
        if not len(rows):
            break
        before = lowest[rows].copy()
        at_start = best[rows].copy()
        # Try both sides along every variable, and the vertex where both are higher.
        for k in range(m):
            middle = best[rows].copy()
            center = lowest[rows].copy()
            sides = []
            for sign in (-1.0, 1.0):
                places = middle.copy()
                places[:, k] = np.clip(middle[:, k] + sign * step[rows], -1, 1)
                sides.append((places[:, k] - middle[:, k], try_places(rows, places)))
            (a, value_at_a), (b, value_at_b) = sides
            inside = np.flatnonzero(
                np.isfinite(value_at_a + value_at_b) & (center < np.minimum(value_at_a, value_at_b))
            )
            if len(inside):
                a, b, value_at_a, value_at_b, center = (
                    v[inside] for v in (a, b, value_at_a, value_at_b, center)
                )
                slopes = (value_at_a - center) / a, (value_at_b - center) / b
                bend = (slopes[1] - slopes[0]) / (b - a)
                vertex = -(slopes[0] - bend * a) / (2 * bend)
                places = middle[inside]
                places[:, k] = np.clip(places[:, k] + np.clip(vertex, a, b), -1, 1)
                try_places(rows[inside], places)
        # Repeat the change of the whole sweep, then shorten the steps that gained nothing.
        if m > 1:
            sweep_change = best[rows] - at_start
            try_places(rows, np.clip(best[rows] + sweep_change, -1, 1))
        step[rows[before - lowest[rows] <= tolerance[rows]]] /= options.step_divisor
        rows = rows[step[rows] > options.last_step]
    return lowest, best


def local_minima(values: np.ndarray, beside: np.ndarray, count: int) -> np.ndarray:
    """Return the lowest points of a scan that no neighbour is below, shape (count, series).

    Where there are fewer, the lowest one is repeated. Values have the shape (points, series);
    `beside` has the numbers of the points next to each, (points, neighbours).
    """
    is_minimum = np.ones(values.shape, dtype=bool)
    for neighbours in beside.T:
        is_minimum &= values <= values[neighbours]
    ranked = np.where(is_minimum, values, np.inf)
    count = min(count, len(values))
    points = np.argpartition(ranked, count - 1, axis=0)[:count]
    first = ranked.argmin(axis=0)
    ranks = np.take_along_axis(ranked, points, axis=0)
    return np.where(np.isfinite(ranks), points, first)


def lowest_over_times(
    functions: Callable[[np.ndarray, np.ndarray], np.ndarray],
    scan: tuple[np.ndarray, np.ndarray],
    times: int,
    tolerance: float,
    *,
    options: SearchOptions = SearchOptions(),
) -> tuple[np.ndarray, np.ndarray]:
    """Return the places of the lowest values at all times, (kinds, times, m), and a scan.

    The functions return values of all kinds, (kinds, rows), at η (rows, m) and times (rows,). The
    `scan` has points η, and the numbers of the points next to each; if they are many, it takes only
    some of the times. Its values, (kinds, points, times), are each time's nearest ones.
    """

    def function(eta: np.ndarray, which: np.ndarray) -> np.ndarray:
        kind, time = np.divmod(which, times)
        return functions(eta, time)[kind, np.arange(len(eta))]

    points, beside = scan
    m = points.shape[1]
    stride = max(1, len(points) * times // options.max_scanned)
    coarse = np.arange(0, times, stride)
    scan_values = functions(np.repeat(points, len(coarse), axis=0), np.tile(coarse, len(points)))
    kinds = len(scan_values)
    scan_values = scan_values.reshape(len(scan_values), len(points), -1)
    nearest = np.minimum((np.arange(times) + stride // 2) // stride, len(coarse) - 1)
    if not m:
        return np.zeros((kinds, times, 0)), scan_values[..., nearest]
    by_point = scan_values.swapaxes(0, 1).reshape(len(points), -1)
    starts = points[local_minima(by_point, beside, options.starts)]
    starts = starts.reshape(len(starts), kinds, len(coarse), m)[:, :, nearest]
    starts = starts.reshape(len(starts), kinds * times, m)
    which = np.arange(kinds * times)
    gains = np.full(len(which), tolerance)
    eta = lowest_of_neighbours(function, which, starts, gains, options=options)
    return eta.reshape(kinds, times, m), scan_values[..., nearest]


def lowest_of_neighbours(
    function: Function,
    which: np.ndarray,
    starts: np.ndarray,
    tolerance: np.ndarray,
    descents: int | None = None,
    *,
    options: SearchOptions = SearchOptions(),
) -> np.ndarray:
    """Return the places of the lowest values of functions that change little from each to the next.

    Searches for the functions with the numbers `which` start at `starts`, (starts, functions, m),
    and descend as `descend` does, with its `tolerance`, from the lowest `descents` of them; by
    default from all.
    """
    count, rows, m = starts.shape
    row_numbers = np.arange(rows)
    repeated = np.tile(which, count)
    values = function(starts.reshape(-1, m), repeated).reshape(count, rows)
    first_step = options.first_step
    if descents is not None:
        lowest_starts = values.argsort(axis=0)[:descents]
        starts = starts[lowest_starts, row_numbers]
        values = np.take_along_axis(values, lowest_starts, axis=0)
        count = descents
        first_step = options.near_step
        repeated = np.tile(which, descents)
    gains = np.tile(tolerance, count)
    flat, places = descend(
        function, repeated, starts.reshape(-1, m), values.ravel(), gains, first_step,
        options=options,
    )  # fmt: skip
    best = flat.reshape(count, rows).argmin(axis=0)
    lowest = flat.reshape(count, rows)[best, row_numbers]
    eta = places.reshape(count, rows, m)[best, row_numbers]
    for _ in range(options.neighbour_rounds):
        improved = np.zeros(0, dtype=int)
        for shift in (1, -1):
            other = np.clip(row_numbers + shift, 0, rows - 1)
            distance = np.abs(eta[other] - eta).max(axis=1, initial=0)
            differ = np.flatnonzero(distance > options.near_step)
            there = function(eta[other[differ]], which[differ]) if len(differ) else np.zeros(0)
            better = there < lowest[differ]
            rows_better = differ[better]
            eta[rows_better] = eta[other[rows_better]]
            lowest[rows_better] = there[better]
            improved = np.union1d(improved, rows_better)
        if not len(improved):
            break
        at = which[improved], eta[improved], lowest[improved], tolerance[improved]
        descended = descend(function, *at, options.near_step, options=options)
        lowest[improved], eta[improved] = descended
    return eta
