"""Functions of time from values at times."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.checks import check_finite
from flexband.errors import InputError


class PiecewiseLinear:
    """A function of time that is linear between values, with kinks at its `breakpoints`."""

    def __init__(self, times: np.ndarray, values: np.ndarray):
        self.breakpoints = times
        self.values = values

    def __call__(self, time: ArrayLike) -> np.ndarray:
        times = self.breakpoints
        values = self.values
        moment = np.asarray(time, dtype=float)
        k = np.clip(np.searchsorted(times, moment, side="right") - 1, 0, len(times) - 2)
        length = times[k + 1] - times[k]
        part = np.divide(moment - times[k], length, out=np.ones_like(moment), where=length > 0)
        columns = () if values.ndim == 1 else (np.arange(values.shape[1]),)
        low = values[k, *columns]
        high = values[k + 1, *columns]
        return low + np.clip(part, 0.0, 1.0) * (high - low)


def table(times: ArrayLike, values: ArrayLike) -> PiecewiseLinear:
    """Return a function of time that is linear between values, and constant before and after them.

    A run takes steps that end at its kinks and jumps. A function that prescribes a motion may have
    kinks, where an impulse acts, but no jumps.

    Parameters
    ----------
    times : increasing [s], shape (k,). A time that is given twice is that of a jump, after which
        the second value holds.
    values : shape (k,), or (k, n) with one column per sample.

    Raises
    ------
    InputError
        If there are fewer than two times, they decrease, one is given three times, or the shapes do
        not fit.

    Examples
    --------
    >>> torque = fb.table([0.0, 1.0, 2.0], [0.0, 5.0, 4.0])  # [N m]
    >>> [float(torque(t)) for t in (0.5, 1.5, 9.0)]
    [2.5, 4.5, 4.0]
    """
    moments = check_finite("times [s]", times, rank=None)
    rows = check_finite("values", values, rank=None)
    if moments.ndim != 1 or len(moments) < 2:
        raise InputError(f"times must be at least two numbers; got shape {moments.shape}")
    if rows.ndim not in (1, 2) or len(rows) != len(moments):
        raise InputError(
            f"values must have shape ({len(moments)},) or ({len(moments)}, n), as times do; got "
            f"shape {rows.shape}"
        )
    wrong = np.flatnonzero(np.diff(moments) < 0)
    if len(wrong):
        raise InputError(f"times must increase; {moments[wrong[0] + 1]:g} s comes too late")
    thrice = np.flatnonzero(moments[2:] == moments[:-2])
    if len(thrice):
        raise InputError(
            f"times may be given twice, for a jump; {moments[thrice[0]]:g} s is given more often"
        )
    return PiecewiseLinear(moments, rows)
