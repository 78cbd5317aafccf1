"""Numbers and arrays over samples, stacked to rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError


def stack(values: Sequence[ArrayLike]) -> np.ndarray:
    """Stack numbers and arrays of shape (n,) to shape (rows, n or 1)."""
    arrays = [np.atleast_1d(np.asarray(v, dtype=float)) for v in values]
    stacked = np.empty((len(arrays), count_samples(arrays)))
    for row, array in zip(stacked, arrays, strict=True):
        row[:] = array
    return stacked


def count_samples(arrays) -> int:
    """Return the number of samples, the last axis of all arrays that are longer than one.

    Raises
    ------
    InputError
        Where they differ.
    """
    sizes = sorted({a.shape[-1] for a in arrays} - {1})
    if len(sizes) > 1:
        raise InputError(f"parameters have different numbers of samples: {sizes}")
    return sizes[0] if sizes else 1


def indices(values) -> np.ndarray:
    """Return whole numbers as an array."""
    return np.fromiter(values, dtype=np.int64)
