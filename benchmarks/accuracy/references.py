"""Cases, and reference bands computed from moments on a grid of the interval inputs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

Orders = tuple[dict[str, int], dict[str, int]]
"""Orders of random and of interval inputs, by name."""


@dataclass(frozen=True)
class Case:
    """A study, the orders to apply, and its true bands.

    Attributes
    ----------
    orders : orders for the phase-resolved method; may be empty.
    reference : returns the true bands.
    """

    response: Callable[..., xr.DataArray]
    inputs: dict
    orders: list[Orders]
    reference: Callable[[], xr.Dataset]


def normal_rule(count: int, tail: float = 7.0) -> tuple[np.ndarray, np.ndarray]:
    """Return midpoints of equal steps and their weights for the mean over a normal variable."""
    x = tail * (2 * np.arange(count) + 1 - count) / count
    weights = np.exp(-x * x / 2)
    return x, weights / weights.sum()


def moments(weights: np.ndarray, F: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and variance of values (points, …) with the given weights."""
    mean = np.tensordot(weights, F, 1)
    return mean, np.tensordot(weights, (F - mean) ** 2, 1)


def bands(
    mean: np.ndarray, variance: np.ndarray, counts: Sequence[int], dims: tuple, labels: dict
) -> xr.Dataset:
    """Return the bands of moments (Π counts, …) on a uniform grid of the interval inputs."""
    std = np.sqrt(np.maximum(variance, 0.0))
    band_values = {
        "mean": np.stack([_minimum(mean, counts), -_minimum(-mean, counts)]),
        "error_bar": np.stack([_minimum(mean - std, counts), -_minimum(-mean - std, counts)]),
    }
    return xr.Dataset({name: (dims, v) for name, v in band_values.items()}, coords=labels)


def _minimum(values: np.ndarray, counts: Sequence[int]) -> np.ndarray:
    """Return the minimum of values (Π counts, …), refined by a parabola in each variable."""
    flat = values.reshape(len(values), -1)
    best = flat.argmin(axis=0)
    series = np.arange(flat.shape[1])
    bottom = flat[best, series]
    gain = np.zeros_like(bottom)
    for a, (count, where) in enumerate(zip(counts, np.unravel_index(best, counts), strict=True)):
        inner = (where > 0) & (where < count - 1)
        step = inner * math.prod(counts[a + 1 :])
        below = flat[best - step, series]
        above = flat[best + step, series]
        bend = below + above - 2 * bottom
        gain += (above - below) ** 2 / (8 * np.where(bend > 0, bend, np.inf))
    return (bottom - gain).reshape(values.shape[1:])
