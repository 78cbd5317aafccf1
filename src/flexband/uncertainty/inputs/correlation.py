"""Correlation functions of homogeneous random fields, of the distance over the length."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexband.errors import finite

Correlation = Callable[[np.ndarray], np.ndarray]


def squared_exponential(distance: np.ndarray) -> np.ndarray:
    """Return exp(−d²), Eq. (30): smooth fields."""
    return np.exp(-(finite("distance", distance, rank=None) ** 2))


def exponential(distance: np.ndarray) -> np.ndarray:
    """Return exp(−|d|): continuous, rough fields."""
    return np.exp(-np.abs(finite("distance", distance, rank=None)))
