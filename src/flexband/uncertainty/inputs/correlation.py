"""Correlation functions of homogeneous random fields, of the distance over the length."""

from __future__ import annotations

import numpy as np


def squared_exponential(distance: np.ndarray) -> np.ndarray:
    """Return exp(−d²), Eq. (30): smooth fields."""
    return np.exp(-(distance**2))


def exponential(distance: np.ndarray) -> np.ndarray:
    """Return exp(−|d|): continuous, rough fields."""
    return np.exp(-np.abs(distance))
