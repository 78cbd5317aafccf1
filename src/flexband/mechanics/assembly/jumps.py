"""Jumps of tabulated functions of time."""

from __future__ import annotations

import numpy as np

from flexband.errors import InputError, returned
from flexband.mechanics.forms import TimeFunction

CANDIDATES = 8
"""Number of the largest changes between neighbouring times that are looked into."""

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
    changes = np.abs(np.diff(values, axis=0)).max(axis=1)
    spread, largest = np.ptp(values, axis=0).max(), np.abs(values).max()
    allowed = max(SMALLEST_JUMP * spread, ROUNDING * largest, NOTHING)
    for k in np.argsort(changes)[::-1][:CANDIDATES]:
        if changes[k] <= allowed:
            return
        (a, b), (fa, fb) = times[k : k + 2], values[k : k + 2]
        for _ in range(HALVINGS):
            middle = (a + b) / 2
            fm = np.ravel(returned(function, float(middle)))
            if np.abs(fm - fa).max() > np.abs(fb - fm).max():
                b, fb = middle, fm
            else:
                a, fa = middle, fm
        if np.abs(fb - fa).max() > allowed:
            raise InputError(
                f"{name} must be prescribed by a continuous function of time; it jumps at "
                f"t = {a:.6g} s"
            )
