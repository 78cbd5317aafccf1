"""Jumps of tabulated functions of time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.basics.user_functions import evaluate_function_each
from flexband.errors import InputError
from flexband.mechanics.kernels.forms import TimeFunction


class JumpSearch(NamedTuple):
    """How jumps of a prescribed motion are searched for."""

    min_intervals: int = 4
    """Intervals between times that are looked into at least, those of sharpest changes first."""
    max_intervals: int = 100
    """The same at most."""
    lasting: float = 0.5
    """Sharpness at half the distance of the times, relative to that at the whole distance: 1 at a
    jump, between 1/6 and 3/2 at a kink, and 1/16 where a function is smooth."""
    parts: int = 8
    """Parts of an interval, of which the one that differs most is divided again."""
    divisions: int = 14
    """Such divisions, one after the other."""
    min_jump: float = 1e-6
    """Smallest jump, relative to the range of the values in the table."""
    rounding: float = 1e-9
    """The same, relative to the values themselves."""
    floor: float = 1e-12
    """The same [m] or [rad]."""


def refuse_jumps(name: str, function: TimeFunction, times: np.ndarray, values: np.ndarray) -> None:
    """Raise `InputError` if a function of time jumps between two of the times.

    A change that is left in an interval after many divisions is a jump. Looked into are intervals
    in which fourth differences do not become smaller with the distance of the times, and the
    sharpest ones. `values` have shape (times, n), an odd number of times.
    """
    search = JumpSearch()
    spread = np.ptp(values, axis=0).max()
    largest = np.abs(values).max()
    threshold = max(search.min_jump * spread, search.rounding * largest, search.floor)
    # Rank the intervals by how sharp changes are in them.
    sharp = _sharpness(values)
    coarse = np.repeat(_sharpness(values[::2]), 2)
    lasting = sharp > np.maximum(search.lasting * coarse, threshold)
    count = min(max(search.min_intervals, np.count_nonzero(lasting)), search.max_intervals)
    # Divide the sharpest ones until the change vanishes, or stays: a jump.
    for k in np.lexsort((sharp, lasting))[::-1][:count]:
        if sharp[k] <= threshold:
            break
        (a, b), ends = times[k : k + 2], values[k : k + 2]
        for _ in range(search.divisions):
            if np.abs(ends[1] - ends[0]).max() <= threshold:
                break
            inner = np.linspace(a, b, search.parts + 1)
            inner_values = np.array(
                [np.ravel(v) for v in evaluate_function_each(function, inner.tolist())]
            )
            changes = np.diff(inner_values, axis=0)
            part = np.argmax(np.abs(changes - np.median(changes, axis=0)).max(axis=1))
            (a, b), ends = inner[part : part + 2], inner_values[part : part + 2]
        else:
            raise InputError(
                f"{name} must be prescribed by a continuous function of time; it jumps at "
                f"t = {a:.6g} s"
            )


def _sharpness(values: np.ndarray) -> np.ndarray:
    """Return the fourth differences at both ends of each interval, summed, shape (intervals,)."""
    if len(values) < 5:
        return np.zeros(len(values) - 1)
    fourth = np.pad(np.abs(np.diff(values, 4, axis=0)).max(axis=1), 2, mode="edge")
    return fourth[1:] + fourth[:-1]
