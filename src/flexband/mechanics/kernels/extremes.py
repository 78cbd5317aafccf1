"""Extremes and integrals of forms of the state over all steps of a run, on lanes.

Each has a kind and a window of time. The rows in z are the results, then the values of the forms at
the last step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.mechanics.kernels.lanes import compiled, filled, less, load, maximum, store, where


class Kinds(NamedTuple):
    """What is made of the values of a form."""

    largest: int = 0
    smallest: int = 1
    integral: int = 2


KINDS = Kinds()


@compiled
def minimum(a, b):
    """Return the smaller of two lanes."""
    return -maximum(-a, -b)


@compiled
def begin_extremes(extremes, state, z):
    """Set integrals to zero, and extremes to NaN, as they are before their windows."""
    for k in range(len(extremes.kind)):
        none = filled(0.0) if extremes.kind[k] == KINDS.integral else filled(np.nan)
        store(z, state.extreme + k, none)


@compiled
def update_extremes(extremes, windows, state, z, forms, before, time, chosen):
    """Take the values of the forms at a time into account, where `chosen` is true.

    `forms` are their rows, and `before` is the time of the last step, which is `time` at the start
    and where forces jump. Between both a form is linear.
    """
    count, result = len(extremes.kind), state.extreme
    for k in range(count):
        first, last = load(windows, 2 * k), load(windows, 2 * k + 1)
        value, known = load(forms, k), load(z, result + k)
        latest = load(z, result + count + k)
        inside = where(less(time, first), filled(0.0), chosen)
        inside = where(less(last, time), filled(0.0), inside)
        new = value
        if extremes.kind[k] == KINDS.integral:
            length = where(less(before, time), time - before, filled(1.0))
            low, high = maximum(before, first), minimum(time, last)
            covered = maximum(high - low, filled(0.0))
            slope = (value - latest) / length
            middle = latest + slope * (0.5 * (low + high) - before)
            part = where(less(before, time), covered * middle, filled(0.0))
            new, inside = known + part, chosen
        elif extremes.kind[k] == KINDS.largest:
            new = where(less(value, known), known, value)
        else:
            new = where(less(known, value), known, value)
        store(z, result + k, where(inside, new, load(z, result + k)))
        store(z, result + count + k, where(chosen, value, latest))
