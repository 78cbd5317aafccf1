"""Arrays of lanes, C-ordered, of shape (rows, WIDTH): a lane is a row."""

from __future__ import annotations

from ctypes import addressof, c_char
from typing import Any

import numpy as np

WIDTH = 8
"""Samples in a lane: one AVX-512 register, or two to four narrower ones."""


def zeros(rows: int) -> np.ndarray:
    """Return zeros of shape (rows, WIDTH), each row aligned to cache lines."""
    memory = np.zeros(rows * WIDTH + WIDTH)
    skipped = -memory.ctypes.data % (8 * WIDTH) // 8
    return memory[skipped : skipped + rows * WIDTH].reshape(rows, WIDTH)


def address(array: Any) -> int:
    """Return the address of an array, 0 if it is empty."""
    return addressof(c_char.from_buffer(array)) if array.size else 0  # faster than NumPy's ways


def to_lanes(values: np.ndarray, block: int) -> np.ndarray:
    """Return block `block` of values of shape (rows, n or 1) as lanes, shape (rows, WIDTH).

    The last block is filled up with copies of the last sample.
    """
    lanes = zeros(len(values))
    if values.shape[1] == 1:  # much faster than by index, in tables of many times
        lanes[:] = values
        return lanes
    sample = np.arange(block * WIDTH, (block + 1) * WIDTH)
    lanes[:] = values[:, np.minimum(sample, values.shape[1] - 1)]
    return lanes
