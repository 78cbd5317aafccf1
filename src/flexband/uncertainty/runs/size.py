"""The size of outputs: their squares must not vanish, as they must not overflow."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.errors import InputError
from flexband.uncertainty.surrogates.axes import names_of_outputs, series
from flexband.words import number_of

SMALLEST = 1e-120
"""Squares of parts of smaller values vanish."""


def check_size(values: xr.DataArray) -> None:
    """Raise `InputError` if an output is not zero, but smaller than `SMALLEST` in all runs."""
    signal = series(values)
    size = np.maximum(
        np.nanmax(signal, axis=(0, 2), initial=0.0), -np.nanmin(signal, axis=(0, 2), initial=0.0)
    )
    for name, magnitude in zip(names_of_outputs(values), size.tolist(), strict=True):
        if 0 < magnitude < SMALLEST:
            raise InputError(
                f"{name} is at most {magnitude:.3g} in size in {number_of(len(values), 'run')}, "
                "and its square "
                f"vanishes; it must be zero, or reach {SMALLEST:g}: choose another unit"
            )
