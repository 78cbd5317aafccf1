"""Numbers and arrays over samples, stacked in rows, and trees of such arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError


def stack(values: Sequence[ArrayLike]) -> np.ndarray:
    """Stack numbers and arrays of shape (n,) to shape (rows, n or 1)."""
    arrays = [np.asarray(v, dtype=float) for v in values]
    if arrays and all(array.size == 1 for array in arrays):
        return np.concatenate([array.ravel() for array in arrays])[:, None]
    arrays = [np.atleast_1d(array) for array in arrays]
    stacked = np.empty((len(arrays), count_samples(arrays)))
    for row, array in zip(stacked, arrays, strict=True):
        row[:] = array
    return stacked


def count_samples(arrays: Sequence[np.ndarray]) -> int:
    """Return the number of samples: the length of the last axis of all arrays, unless it is 1."""
    sizes = sorted({a.shape[-1] for a in arrays} - {1})
    if len(sizes) > 1:
        raise InputError(f"parameters have different numbers of samples: {sizes}")
    return sizes[0] if sizes else 1


def indices(values) -> np.ndarray:
    """Return whole numbers as an array."""
    return np.fromiter(values, dtype=np.int64)


def starts(groups: Sequence[Sequence]) -> np.ndarray:
    """Return where each group starts if all are laid end to end, and where the last one ends."""
    return np.cumsum([0] + [len(group) for group in groups])


def map_tree(function: Callable, tree: Any) -> Any:
    """Return a tree of named tuples with the function applied to all that is not a tuple."""
    if isinstance(tree, tuple):
        return type(tree)(*(map_tree(function, branch) for branch in tree))
    return function(tree)


def leaves(tree: tuple) -> list[np.ndarray]:
    """Return all that is not a tuple in a tree of named tuples."""
    arrays: list[np.ndarray] = []
    map_tree(arrays.append, tree)
    return arrays
