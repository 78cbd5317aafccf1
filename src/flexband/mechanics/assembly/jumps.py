"""Jumps of tabulated functions of time."""

from __future__ import annotations

import numpy as np

from flexband.errors import InputError, returned
from flexband.mechanics.forms import TimeFunction

CANDIDATES = 4
"""Number of the intervals between times, those next to the sharpest bends, that are looked into."""

HALVINGS = 35
SMALLEST_JUMP, ROUNDING, NOTHING = 1e-6, 1e-9, 1e-12
"""Relative to the range of the values in the table and to the values themselves, and [m] or [rad].
"""


def refuse_jumps(name: str, function: TimeFunction, times: np.ndarray, values: np.ndarray) -> None:
    """Raise `InputError` if a function of time jumps between two of the times.

    A change that is left in an interval after many halvings is a jump: that of a continuous
    function becomes smaller with the interval.

    Parameters
    ----------
    name : of what the function prescribes, for the message.
    values : those of the function at the times [s], shape (times, n).
    """
    spread, largest = np.ptp(values, axis=0).max(), np.abs(values).max()
    allowed = max(SMALLEST_JUMP * spread, ROUNDING * largest, NOTHING)
    bends = np.abs(np.diff(values, 2, axis=0)).max(axis=1)
    sharpest = np.maximum(np.append(bends, 0.0), np.append(0.0, bends))
    for k in np.argsort(sharpest)[::-1][:CANDIDATES]:
        (a, b), (fa, fb) = times[k : k + 2], values[k : k + 2]
        for _ in range(HALVINGS):
            if np.abs(fb - fa).max() <= allowed:
                break
            middle = (a + b) / 2
            fm = np.ravel(returned(function, float(middle)))
            if np.abs(fm - fa).max() > np.abs(fb - fm).max():
                b, fb = middle, fm
            else:
                a, fa = middle, fm
        else:
            raise InputError(
                f"{name} must be prescribed by a continuous function of time; it jumps at "
                f"t = {a:.6g} s"
            )
