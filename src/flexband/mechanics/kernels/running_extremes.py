"""Extremes and integrals of forms of the state over all steps of a run, on lanes.

Each has a kind and a window of time. The rows in z are the results, then the values of the forms at
the last step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.mechanics.kernels.lanes import (
    compiled,
    less,
    load,
    magnitude,
    maximum,
    minimum,
    splat,
    store,
    where,
)


class Kinds(NamedTuple):
    """What is made of the values of a form.

    A work is ∫ Q dq, where the form is Q and the next one, a coordinate, is q. Closings are how
    often it became negative. An instant with a number k added is the time of the
    k-th of them; instants 1, 2, … follow the closings of the same form.
    """

    largest: int = 0
    smallest: int = 1
    integral: int = 2
    closings: int = 3
    work: int = 4
    coordinate: int = 5
    instant: int = 8


KINDS = Kinds()


@compiled
def begin_extremes(extremes, state, z):
    """Set integrals to zero, and extremes to NaN, as they are before their windows."""
    for k in range(len(extremes.kind)):
        kind = extremes.kind[k]
        counted = kind in (KINDS.integral, KINDS.closings, KINDS.work)
        none = splat(0.0) if counted else splat(np.nan)
        store(z, state.extreme + k, none)


@compiled
def update_extremes(extremes, windows, state, z, forms, before, time, mask):
    """Take the values of the forms at a time into account, where `mask` is true.

    `forms` are their rows, and `before` is the time of the last step, which is `time` at the start
    and where forces jump. Between both a form is linear.
    """
    count = len(extremes.kind)
    result = state.extreme
    for k in range(count):
        first = load(windows, 2 * k)
        last = load(windows, 2 * k + 1)
        value = load(forms, k)
        previous = load(z, result + k)
        latest = load(z, result + count + k)
        # Leave out what is outside of the window.
        inside = where(less(time, first), splat(0.0), mask)
        inside = where(less(last, time), splat(0.0), inside)
        new = value
        kind = extremes.kind[k]
        closed = where(less(splat(0.0), latest), less(value, splat(0.0)), splat(0.0))
        # Find the new value of the extreme, by its kind.
        if kind > KINDS.instant:
            number = load(z, result + k - (kind - KINDS.instant))
            nth = less(magnitude(number - float(kind - KINDS.instant)), splat(0.5))
            new = splat(1.0) * time
            inside = where(closed, where(nth, inside, splat(0.0)), closed)
        elif kind == KINDS.closings:
            new = previous + closed
        elif kind == KINDS.integral:
            length = where(less(before, time), time - before, splat(1.0))
            low = maximum(before, first)
            high = minimum(time, last)
            covered = maximum(high - low, splat(0.0))
            slope = (value - latest) / length
            middle = latest + slope * (0.5 * (low + high) - before)
            part = where(less(before, time), covered * middle, splat(0.0))
            new = previous + part
            inside = mask
        elif kind == KINDS.work:
            moved = load(forms, k + 1) - load(z, result + count + k + 1)
            part = where(less(before, time), 0.5 * (latest + value) * moved, splat(0.0))
            new = previous + part
            inside = mask
        elif kind == KINDS.largest:
            new = where(less(value, previous), previous, value)
        else:
            new = where(less(previous, value), previous, value)
        store(z, result + k, where(inside, new, load(z, result + k)))
        store(z, result + count + k, where(mask, value, latest))
