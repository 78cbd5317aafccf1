"""Kinks and jumps of functions of time, each located between two times as near as rounding allows.

A second difference that stands out among its neighbours is looked at on ever finer grids. It stays
the same at a jump, falls in proportion to the spacing at a kink and with its square where a
function is smooth.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.mechanics.time_functions.evaluation import Evaluation

POINTS, MOST_POINTS, MOST_CALLS = 64, 2**18, 2**14
"""Points per step, and the most points of a run with one call for many of them or for each."""

POINTS_AT_ONCE = 2**20
"""The most numbers that a function is asked for in one call."""

SMALLEST_CHANGE = 1e-3
"""Of the scale of a function: a second difference over two points that is looked at."""

OUTSTANDING = 4.0
"""Such a difference over the median of its neighbours; it is at most 2 near an inflection."""

FINER_POINTS = 65
"""On the four intervals around such a difference, so that both ends of a pulse are seen."""

PARTS, LEVELS = 8, 26
"""An interval is divided into so many parts, the two of the largest difference again, and so on."""

ROUNDING = 64 * np.finfo(float).eps
"""Of a second difference relative to the values, and of an interval relative to its times."""

SMOOTH, LATEST_LEVELS = 1.5, 5
"""Order in the spacing above which a second difference is that of a smooth function, as seen on the
last levels that rounding does not spoil."""


class Breakpoints(NamedTuple):
    """Kinks and jumps, sorted by column and time, arrays of shape (breakpoints,)."""

    column: np.ndarray
    before: np.ndarray  # a time just before [s]
    after: np.ndarray  # and just after

    @staticmethod
    def none() -> Breakpoints:
        """Return no breakpoints."""
        return Breakpoints(np.zeros(0, dtype=int), np.zeros(0), np.zeros(0))


def points_per_step(at: Evaluation, steps: int) -> int:
    """Return at how many points of each step a function is looked at, an even number."""
    return max(2, min(POINTS, (MOST_POINTS if at.at_once else MOST_CALLS) // steps) // 2 * 2)


def locate(
    at: Evaluation,
    times: np.ndarray,
    noticed: np.ndarray,
    scale: np.ndarray,
    largest: np.ndarray,
) -> Breakpoints:
    """Return the kinks and jumps of a function in some steps, each column judged alone.

    A column with more of them than the run has steps is left as it is. Breakpoints that the
    function states, as `breakpoints` [s], are taken instead of being searched.

    Parameters
    ----------
    times : equidistant [s].
    noticed : the steps to look at, a mask of shape (steps, columns).
    scale : of each column; smaller changes than a part of it are not looked at.
    largest : value of each column, of which rounding errors are a part.
    """
    h, per = times[1] - times[0], points_per_step(at, len(times) - 1)
    spacing, noise = h / per, ROUNDING * largest
    stated = getattr(at.function, "breakpoints", None)
    if stated is not None:
        return _stated(at, times, scale, np.asarray(stated, dtype=float), spacing)
    steps = np.flatnonzero(noticed.any(axis=1))
    columns, centres = [np.zeros(0, dtype=int)], [np.zeros(0)]
    count = max(1, POINTS_AT_ONCE // ((per + 4) * at.columns))
    for first in range(0, len(steps), count):
        block = steps[first : first + count]
        start = np.clip(times[block] - 2 * spacing, times[0], times[-1] - (per + 4) * spacing)
        grid = start[:, None] + spacing * np.arange(per + 5)
        f = at(np.minimum(grid, times[-1]).ravel()).reshape(*grid.shape, -1)
        f = f.transpose(0, 2, 1).reshape(-1, grid.shape[1])
        row, place = _spikes(f, np.tile(np.maximum(SMALLEST_CHANGE * scale, noise), len(block)))
        step, column = block[row // at.columns], row % at.columns
        chosen = noticed[step, column]
        columns.append(column[chosen])
        centres.append(grid[row // at.columns, place][chosen])
    column, centre = np.concatenate(columns), np.concatenate(centres)
    few = _few(column, times)
    column, centre = column[few], centre[few]
    start = np.clip(centre - 2 * spacing, times[0], times[-1] - 4 * spacing)
    grid = np.linspace(start, start + 4 * spacing, FINER_POINTS, axis=1)
    f = at.points(grid.ravel(), np.repeat(column, FINER_POINTS)).reshape(grid.shape)
    change = np.abs(np.diff(f, 2, axis=1)).max(axis=1, initial=0.0)
    row, place = _spikes(f, np.maximum(SMALLEST_CHANGE * change, noise[column]))
    before = grid[row, np.maximum(place - 2, 0)]
    after = grid[row, np.minimum(place + 2, FINER_POINTS - 1)]
    narrowed = _narrowed(at, column[row], before, after, noise)
    return _distinct(narrowed, spacing / FINER_POINTS)


def _spikes(f: np.ndarray, smallest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return row and place of second differences that stand out in rows of values."""
    second = np.abs(np.diff(f, 2, axis=1))
    if not second.size:
        return np.zeros(0, dtype=int), np.zeros(0, dtype=int)
    high = np.maximum(smallest, OUTSTANDING * np.median(second, axis=1))
    beside = np.pad(second, ((0, 0), (1, 1)))
    peak = (second >= beside[:, :-2]) & (second > beside[:, 2:]) & (second > high[:, None])
    row, place = np.nonzero(peak)
    return row, place + 1


def _narrowed(
    at: Evaluation, column: np.ndarray, before: np.ndarray, after: np.ndarray, noise: np.ndarray
) -> Breakpoints:
    """Return the kinks and jumps between two times each."""
    sizes = np.zeros((LEVELS, len(column)))
    before, after = before.copy(), after.copy()
    going = np.ones(len(column), dtype=bool)
    for level in range(LEVELS):
        k = np.flatnonzero(going)
        if not len(k):
            break
        x = np.linspace(before[k], after[k], PARTS + 1, axis=1)
        f = at.points(x.ravel(), np.repeat(column[k], PARTS + 1)).reshape(x.shape)
        second = np.abs(np.diff(f, 2, axis=1))
        place = second.argmax(axis=1)
        size = second.max(axis=1)
        seen = size > noise[column[k]]
        sizes[level, k] = np.where(seen, size, 0.0)
        narrower, row = k[seen], np.flatnonzero(seen)
        before[narrower], after[narrower] = x[row, place[row]], x[row, place[row] + 2]
        wide = after[k] - before[k] > ROUNDING * np.maximum(np.abs(after[k]), after[k] - x[:, 0])
        going[k] = seen & wide
    levels = np.count_nonzero(sizes, axis=0)
    first = np.maximum(levels - LATEST_LEVELS, 0)
    column, before, after = (array[levels > 1] for array in (column, before, after))
    k, first, levels = np.flatnonzero(levels > 1), first[levels > 1], levels[levels > 1]
    fall = np.log(sizes[first, k] / sizes[levels - 1, k])
    rough = fall < SMOOTH * np.log(PARTS / 2) * (levels - 1 - first)
    return Breakpoints(column[rough], before[rough], after[rough])


def _stated(
    at: Evaluation,
    times: np.ndarray,
    scale: np.ndarray,
    stated: np.ndarray,
    spacing: float,
) -> Breakpoints:
    """Return the breakpoints that a function states, where they are not too small to matter."""
    inside = stated[(stated >= times[0]) & (stated < times[-1])]
    before = np.nextafter(inside, -np.inf)
    around = (before - spacing, before, inside, inside + spacing)
    f = [at(np.clip(x, times[0], times[-1])) for x in around]
    change = np.maximum(np.abs(f[2] - f[1]), np.abs(f[3] - f[2] - f[1] + f[0]))
    k, column = np.nonzero(change > SMALLEST_CHANGE * scale)
    few = _few(column, times)
    k, column = k[few], column[few]
    return _distinct(Breakpoints(column, before[k], inside[k]), 0.0)


def _few(column: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return which breakpoints are in columns with no more of them than the run has steps."""
    return np.bincount(column)[column] <= len(times) - 1


def _distinct(found: Breakpoints, apart: float) -> Breakpoints:
    """Return the breakpoints in order, without those that were located twice."""
    order = np.lexsort((found.before, found.column))
    column, before, after = (array[order] for array in found)
    new = np.ones(len(column), dtype=bool)
    new[1:] = (np.diff(column) > 0) | (before[1:] - after[:-1] > apart)
    return Breakpoints(column[new], before[new], after[new])
