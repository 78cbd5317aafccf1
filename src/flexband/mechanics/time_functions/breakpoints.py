"""Kinks and jumps of functions of time, each located between two times as near as rounding allows.

A difference that stands out among its neighbours is looked at on ever finer grids. It stays the
same at a jump and falls in proportion to the spacing at a kink. A third difference falls with the
square of the spacing where the second derivative jumps. Where a function is smooth, differences
fall with the power of the spacing that is their order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexband.mechanics.time_functions.evaluation import Evaluation

ROUNDING = 64 * np.finfo(float).eps
"""Of a second difference relative to the values, and of an interval relative to its times."""


class Breakpoints(NamedTuple):
    """Kinks and jumps, sorted by column and time, arrays of shape (breakpoints,)."""

    column: np.ndarray
    before: np.ndarray  # a time just before [s]
    after: np.ndarray  # and just after
    power: np.ndarray  # of the spacing: 0 at a jump, 1 at a kink, 2 at a jump of f″

    @property
    def impulsive(self) -> np.ndarray:
        """Which are jumps or kinks, at which the rate of a function jumps."""
        return self.power < 1.5

    @staticmethod
    def none() -> Breakpoints:
        """Return no breakpoints."""
        return Breakpoints(np.zeros(0, dtype=int), *np.zeros((3, 0)))

    def those(self, selection: np.ndarray) -> Breakpoints:
        """Return some of them."""
        return Breakpoints(*(array[selection] for array in self))

    def merge(self, others: Breakpoints) -> Breakpoints:
        """Return these breakpoints and others, sorted by column and time."""
        union = Breakpoints(*map(np.concatenate, zip(self, others, strict=True)))
        return union.those(np.lexsort((union.before, union.column)))


def few(column: np.ndarray, columns: int, max_count: float) -> np.ndarray:
    """Return which columns have no more breakpoints than that."""
    return np.bincount(column, minlength=columns) <= max_count


def _distinct(breakpoints: Breakpoints, min_distance: float) -> Breakpoints:
    """Return the breakpoints in order, without those that were located twice."""
    sequence = breakpoints.those(np.lexsort((breakpoints.before, breakpoints.column)))
    distinct_mask = np.ones(len(sequence.column), dtype=bool)
    distinct_mask[1:] = (np.diff(sequence.column) > 0) | (
        sequence.before[1:] - sequence.after[:-1] > min_distance
    )
    return sequence.those(distinct_mask)


@dataclass(frozen=True)
class BreakpointSearch:
    """How kinks and jumps are searched for between the steps of a run."""

    points_per_step: int = 64
    """Points at which a function is looked at in each step, at most."""
    max_points: int = 2**18
    """Points of a run, if the function takes many times at once."""
    max_calls: int = 2**14
    """The same, if it is called for each."""
    points_at_once: int = 2**20  # the most numbers that a function is asked for in one call
    min_change: float = 1e-3
    """Smallest second difference over two points that is looked at, relative to the function's
    scale."""
    prominence: float = 4.0
    """Such a difference over the median of its neighbours; it is at most 2 near an inflection."""
    finer_points: int = 65
    """Points on the four intervals around such a difference, so that both ends of a pulse are
    seen."""
    max_per_step: int = 4
    """Such differences per step in a column that is looked at further."""
    curvature_points: int = 16
    """Points per step at which jumps of second derivatives are looked for: differences over shorter
    times would be those of rounding."""
    parts: int = 8
    """Parts of an interval, of which the two of the largest difference are divided again."""
    levels: int = 26
    """Such divisions, one after the other."""
    below_order: float = 0.5
    """By how much less than its order the power of the spacing is with which a difference falls
    where a function is not smooth."""
    latest_levels: int = 5
    """Last levels that rounding does not spoil, from which that power is taken."""

    def points_in_step(self, at: Evaluation, steps: int) -> int:
        """Return at how many points of each step a function is looked at, an even number."""
        limit = (self.max_points if at.at_once else self.max_calls) // steps
        return max(2, min(self.points_per_step, limit) // 2 * 2)

    def locate(
        self,
        at: Evaluation,
        times: np.ndarray,
        step_mask: np.ndarray,
        scale: np.ndarray,
        largest: np.ndarray,
    ) -> Breakpoints:
        """Return the kinks and jumps of a function, or those it states, each column judged alone.

        `step_mask` has the steps to look at, (steps, columns); changes below a part of a column's
        `scale`, or of rounding of its `largest` value, do not count, nor more breakpoints than
        steps.
        """
        h = times[1] - times[0]
        per = self.points_in_step(at, len(times) - 1)
        spacing = h / per
        noise = ROUNDING * largest
        if at.breakpoint_times is not None:
            return self._filter_breakpoints(at, times, scale, at.breakpoint_times, spacing)
        # Look for differences that stand out on a coarse grid.
        smallest = np.maximum(self.min_change * scale, noise)
        column, centre = self._find_large_differences(at, times, step_mask, smallest, per, order=2)
        # Look at them on a finer grid, and narrow each down.
        start = np.clip(centre - 2 * spacing, times[0], times[-1] - 4 * spacing)
        grid = np.linspace(start, start + 4 * spacing, self.finer_points, axis=1)
        f = at.points(grid.ravel(), np.repeat(column, self.finer_points)).reshape(grid.shape)
        change = np.abs(np.diff(f, 2, axis=1)).max(axis=1, initial=0.0)
        row, place = self._spikes(f, np.maximum(self.min_change * change, noise[column]), order=2)
        before = grid[row, np.maximum(place - 2, 0)]
        after = grid[row, np.minimum(place + 2, self.finer_points - 1)]
        breakpoints = self._narrow_breakpoints(at, column[row], before, after, noise, order=2)
        distinct = _distinct(breakpoints, spacing / self.finer_points)
        return distinct.those(few(distinct.column, at.columns, len(times) - 1)[distinct.column])

    def with_curvature_jumps(
        self,
        breakpoints: Breakpoints,
        at: Evaluation,
        times: np.ndarray,
        curvature: np.ndarray,
        largest: np.ndarray,
    ) -> Breakpoints:
        """Return breakpoints with those of the second derivative, and with small kinks.

        Jumps below a part of a column's largest `curvature` are not looked for, nor those by
        rounding of its `largest` value.
        """
        steps = len(times) - 1
        per = min(self.curvature_points, self.points_in_step(at, steps))
        rounding_of_sums = 64 * ROUNDING  # of third differences: values may be sums of larger ones
        spacing = (times[1] - times[0]) / per
        noise = rounding_of_sums * largest
        smallest = np.maximum(self.min_change * curvature * spacing**2, noise)
        everywhere = np.ones((steps, at.columns), dtype=bool)
        # Look for third differences that stand out.
        column, centre = self._find_large_differences(at, times, everywhere, smallest, per, order=3)
        before = np.clip(centre - 2 * spacing, times[0], times[-1] - 4 * spacing)
        curvature_jumps = self._narrow_breakpoints(
            at, column, before, before + 4 * spacing, noise, order=3
        )
        curvature_jumps = _distinct(curvature_jumps, spacing)
        curvature_jumps = curvature_jumps.those(
            few(curvature_jumps.column, at.columns, steps)[curvature_jumps.column]
        )
        # Leave out those that are at old breakpoints.
        line = 2 * (times[-1] - times[0])  # columns one after the other
        old_places, new_places = (
            points.column * line + points.before for points in (breakpoints, curvature_jumps)
        )
        bounds = np.searchsorted(old_places, [new_places - spacing, new_places + spacing])
        curvature_jumps = curvature_jumps.those(bounds[0] == bounds[1])
        return breakpoints.merge(curvature_jumps)

    def _find_large_differences(
        self,
        at: Evaluation,
        times: np.ndarray,
        step_mask: np.ndarray,
        smallest: np.ndarray,
        per: int,
        order: int,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return columns and times of outlying differences on `per` intervals per step."""
        spacing = (times[1] - times[0]) / per
        steps = np.flatnonzero(step_mask.any(axis=1))
        columns = [np.zeros(0, dtype=int)]
        centres = [np.zeros(0)]
        count = max(1, self.points_at_once // ((per + 4) * at.columns))
        # Look at blocks of steps, with two intervals more on either side.
        for first in range(0, len(steps), count):
            block = steps[first : first + count]
            start = np.clip(times[block] - 2 * spacing, times[0], times[-1] - (per + 4) * spacing)
            grid = start[:, None] + spacing * np.arange(per + 5)
            f = at(np.minimum(grid, times[-1]).ravel()).reshape(*grid.shape, -1)
            f = f.transpose(0, 2, 1).reshape(-1, grid.shape[1])
            row, place = self._spikes(f, np.tile(smallest, len(block)), order)
            step = block[row // at.columns]
            column = row % at.columns
            mask = step_mask[step, column]
            columns.append(column[mask])
            centres.append(grid[row // at.columns, place][mask])
        column = np.concatenate(columns)
        centre = np.concatenate(centres)
        # Columns with too many of them are noise.
        mask = few(column, at.columns, self.max_per_step * (len(times) - 1))[column]
        return column[mask], centre[mask]

    def _spikes(
        self, f: np.ndarray, smallest: np.ndarray, order: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return row and place of all differences that stand out in rows of values."""
        size = np.abs(np.diff(f, order, axis=1))
        if not size.size:
            return np.zeros(0, dtype=int), np.zeros(0, dtype=int)
        high = np.maximum(smallest, self.prominence * np.median(size, axis=1))
        beside = np.pad(size, ((0, 0), (1, 1)))
        peak = (size >= beside[:, :-2]) & (size >= beside[:, 2:]) & (size > high[:, None])
        row, place = np.nonzero(peak)
        return row, place + 1

    def _narrow_breakpoints(
        self,
        at: Evaluation,
        column: np.ndarray,
        before: np.ndarray,
        after: np.ndarray,
        noise: np.ndarray,
        order: int,
    ) -> Breakpoints:
        """Return the kinks and jumps between two times each, from differences of an order."""
        rounding_of_time = 8 * np.finfo(float).eps  # a function changes by its rate times this
        sizes = np.zeros((self.levels, len(column)))
        before = before.copy()
        after = after.copy()
        going = np.ones(len(column), dtype=bool)
        # Divide each interval, and go on in the parts of the largest difference.
        for level in range(self.levels):
            k = np.flatnonzero(going)
            if not len(k):
                break
            x = np.linspace(before[k], after[k], self.parts + 1, axis=1)
            f = at.points(x.ravel(), np.repeat(column[k], self.parts + 1)).reshape(x.shape)
            differences = np.abs(np.diff(f, order, axis=1))
            place = differences.argmax(axis=1)
            size = differences.max(axis=1)
            late = rounding_of_time * np.abs(after[k]) / (x[:, 1] - x[:, 0])
            mask = size > np.maximum(
                noise[column[k]], late * np.abs(np.diff(f, axis=1)).max(axis=1)
            )
            sizes[level, k] = np.where(mask, size, 0.0)
            narrower = k[mask]
            row = np.flatnonzero(mask)
            before[narrower] = x[row, place[row]]
            after[narrower] = x[row, place[row] + order]
            wide = after[k] - before[k] > ROUNDING * np.maximum(
                np.abs(after[k]), after[k] - x[:, 0]
            )
            going[k] = mask & wide
        # Read from the last levels by which power of the spacing the difference falls.
        levels = np.count_nonzero(sizes, axis=0)
        first = np.maximum(levels - self.latest_levels, 0)
        k = np.flatnonzero(levels > 1)
        first = first[k]
        last = levels[k] - 1
        fall = np.log(sizes[first, k] / sizes[last, k])
        power = fall / (np.log(self.parts / order) * (last - first))
        breakpoints = Breakpoints(column[k], before[k], after[k], power)
        return breakpoints.those(power < order - self.below_order)

    def _filter_breakpoints(
        self,
        at: Evaluation,
        times: np.ndarray,
        scale: np.ndarray,
        breakpoint_times: np.ndarray,
        spacing: float,
    ) -> Breakpoints:
        """Return the breakpoints that a function states, without those of negligible change."""
        inside = breakpoint_times[(breakpoint_times > times[0]) & (breakpoint_times < times[-1])]
        before = np.nextafter(inside, -np.inf)
        stencil = (before - spacing, before, inside, inside + spacing)
        f = [at(np.clip(x, times[0], times[-1])) for x in stencil]
        change = np.maximum(np.abs(f[2] - f[1]), np.abs(f[3] - f[2] - f[1] + f[0]))
        k, column = np.nonzero(change > self.min_change * scale)
        kinks = Breakpoints(column, before[k], inside[k], np.ones(len(k)))
        return _distinct(kinks.those(few(column, at.columns, len(times) - 1)[column]), 0.0)
