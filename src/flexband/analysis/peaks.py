"""How low a sampled curve may be between its points: cubics, parabolas, and corners after impacts.

Between two points a cubic goes through the four nearest ones, and two parabolas through three of
them: before the first points and after the last ones, those of their neighbours go on. The cubic
is the estimate. The parabolas are a second rule: where the curve is resolved, they hardly differ.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import xarray as xr

from flexband.requirements.corridors import ALWAYS, Window
from flexband.uncertainty.surrogates.axes import axes_of

BESIDE = 3
"""Times outside of a window that tell of a curve at its ends: the other points of a cubic."""


@dataclass(frozen=True, eq=False)
class TimeAxis:
    """Increasing times of curves, three or more, and the window of them that counts."""

    times: np.ndarray  # (times,)
    window: Window = ALWAYS

    @staticmethod
    def from_labels(labels: xr.DataArray, window: Window = ALWAYS) -> TimeAxis | None:
        """Return the times of a response; None where they have no order, or are too few."""
        axes = axes_of(labels)
        last = axes.time
        if last is None or axes.times < 3:
            return None
        if last not in labels.coords:
            return TimeAxis(np.arange(float(axes.times)), window)
        if labels[last].dtype.kind not in "iuf":
            return None
        times = labels[last].values.astype(float)
        if (np.diff(times) < 0).all():
            times = -times
            window = (-window[1], -window[0])
        return TimeAxis(times, window) if (np.diff(times) > 0).all() else None

    @property
    def inside(self) -> np.ndarray:
        """Which times are in the window, (times,)."""
        first, last = self.window
        return (self.times >= first) & (self.times <= last)

    def window_slice(self) -> slice:
        """Return the slice of times in the window, and those that tell of a curve at its ends."""
        first, last = np.searchsorted(self.times, self.window)
        return slice(max(0, int(first) - BESIDE), int(last) + BESIDE)

    def at(self, times: slice) -> TimeAxis:
        """Return some of the times."""
        return replace(self, times=self.times[times])


class LeastBetween(NamedTuple):
    """The least value of curves between each time and the next, inside a window, ∞ outside of it.

    All have the shape (…, times − 1).
    """

    estimate: np.ndarray  # by the cubic
    place: np.ndarray  # the time of the estimate
    lowest: np.ndarray  # by the rule that is lowest
    highest: np.ndarray  # by the rule that is highest
    ends: np.ndarray  # the lower of the values at both ends

    @property
    def at_most(self) -> np.ndarray:
        """How low curves are at most, if rules are off by no more than they differ."""
        with np.errstate(invalid="ignore"):  # outside of a window all are infinite
            return np.fmin(2 * self.highest - self.lowest, self.ends)


def least_between(curves: np.ndarray, axis: TimeAxis, *, impacts: bool = False) -> LeastBetween:
    """Return how low curves, (…, times), are between their times.

    Where there may be `impacts`, a curve turns at once: it may be as low as where the lines before
    and after meet.
    """
    step = np.diff(axis.times)
    count = len(axis.times)
    first = np.maximum(axis.window[0] - axis.times[:-1], 0.0)
    last = np.minimum(axis.window[1] - axis.times[:-1], step)
    slope = np.diff(curves, axis=-1) / step
    # divided differences of the second and the third order, of the points around each step
    second = np.diff(slope, axis=-1) / (step[:-1] + step[1:])
    before = second[..., [0, *range(count - 2)]]
    after = second[..., [*range(count - 2), -1]]
    third = np.zeros(slope.shape)
    shift = np.append(-step[:2].sum(), step[:-1])
    if count > 3:
        inner = np.diff(second, axis=-1) / (step[:-2] + step[1:-1] + step[2:])
        third = inner[..., [0, *range(count - 3), -1]]
    rules = [(before + third * shift, third), (before, 0.0 * third), (after, 0.0 * third)]
    pieces = [_Pieces(curves[..., :-1], slope, step, *rule) for rule in rules]
    lows, places = zip(*(piece.minimum_between(first, last) for piece in pieces), strict=True)
    ends = np.minimum(pieces[0].values(first), pieces[0].values(last))
    lowest = np.min(lows, axis=0)
    if impacts:
        lowest = np.minimum(lowest, _corners(curves, slope, step, first, last))
    outside = first > last
    place = axis.times[:-1] + places[0]
    minima = (lows[0], lowest, np.max(lows, axis=0), ends)
    estimate, lowest, highest, ends = (np.where(outside, np.inf, minimum) for minimum in minima)
    return LeastBetween(estimate, place, lowest, highest, ends)


class _Pieces(NamedTuple):
    """Polynomials y + d u + u (u − h) (a + e u) on steps h, u being the time after the first."""

    y: np.ndarray
    d: np.ndarray
    h: np.ndarray
    a: np.ndarray
    e: np.ndarray

    def values(self, u: np.ndarray) -> np.ndarray:
        """Return their values at u."""
        return self.y + u * (self.d + (u - self.h) * (self.a + self.e * u))

    def minimum_between(self, first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return their minima between two u, and where they are."""
        bend = self.a - self.e * self.h
        slope = self.d - self.a * self.h
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(bend**2 - 3 * self.e * slope)
            u = np.where(bend < 0, (root - bend) / (3 * self.e), -slope / (bend + root))
            inside = (u > first) & (u < last)
        places = np.stack(np.broadcast_arrays(np.where(inside, u, first), first, last))
        values = np.stack([self.values(place) for place in places])
        best = values.argmin(axis=0)[None]
        minimum, place = (np.take_along_axis(array, best, axis=0)[0] for array in (values, places))
        return minimum, place


def _corners(
    curves: np.ndarray, slope: np.ndarray, step: np.ndarray, first: np.ndarray, last: np.ndarray
) -> np.ndarray:
    """Return how low the lines before and after each step are in it, ∞ where they do not fall."""
    lowest = np.full(slope.shape, np.inf)
    before = slope[..., :-2]
    after = slope[..., 2:]
    inner = slice(1, -1)
    start_value = curves[..., 1:-2]
    end_value = curves[..., 2:-1]
    h = step[inner]
    with np.errstate(invalid="ignore", divide="ignore"):
        meeting = (end_value - start_value - after * h) / (before - after)
    falls = (before < 0) & (after > 0) & (meeting > 0) & (meeting < h)
    place = np.clip(np.where(falls, meeting, 0.0), first[inner], last[inner])
    low = np.maximum(start_value + before * place, end_value + after * (place - h))
    lowest[..., inner] = np.where(falls, low, np.inf)
    return lowest


def lowest_of_impacts(margins: np.ndarray, axis: TimeAxis) -> np.ndarray:
    """Return how low margins of curves with impacts, (curves, …, times), may be, (curves, …).

    Every second time should tell of the others: what corners and parabolas between these miss of
    the least margin, those between all times may miss of what is there. If most of the curves that
    leave their bounds do so as no second time tells, any may leave them.
    """
    smallest_margin = margins[..., axis.inside].min(axis=-1, initial=np.inf)
    lowest = least_between(margins, axis, impacts=True).lowest.min(axis=-1)
    missed = np.zeros(smallest_margin.shape)
    for first in (0, 1):
        half = replace(axis, times=axis.times[first::2])
        if len(half.times) < 3:
            continue
        estimate = least_between(margins[..., first::2], half, impacts=True).lowest.min(axis=-1)
        finite_mask = np.isfinite(estimate)
        missed[finite_mask] = np.maximum(
            missed, estimate - np.where(finite_mask, smallest_margin, 0.0)
        )[finite_mask]
    out = smallest_margin < 0
    unforeseen = np.count_nonzero(out & (smallest_margin + missed > 0), axis=0)
    hidden = 2 * unforeseen > np.count_nonzero(out, axis=0)
    return np.where(hidden, -np.inf, lowest - missed)
