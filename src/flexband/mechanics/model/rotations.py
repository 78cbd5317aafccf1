"""Turns of rigid bodies: one angle in the plane, a rotation vector in space."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

PLANES = {2: [(0, 1)], 3: [(1, 2), (2, 0), (0, 1)]}
"""The two components that each turn exchanges, by the number of all components."""


def wedge(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a × b of vectors (components, …): one number in the plane, three in space."""
    return np.stack([a[i] * b[j] - a[j] * b[i] for i, j in PLANES[len(a)]])


def spin(axes: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Return the angular velocity from axes g and ġ, shape (axes, components, …)."""
    squares = (axes**2).sum(axis=1)
    terms = wedge(np.moveaxis(axes, 1, 0), np.moveaxis(rates, 1, 0)) / squares
    return terms.sum(axis=1) / (axes.shape[1] - 1)


def turn_between(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return the angle [rad] by which axes turned, both of shape (axes, components, …)."""
    components = before.shape[1]
    sines = wedge(np.moveaxis(before, 1, 0), np.moveaxis(after, 1, 0)).sum(axis=1)
    cosines = (before * after).sum(axis=(0, 1)) - (components - 2)  # 1 + 2 cos φ in space
    return np.arctan2(np.linalg.norm(sines, axis=0), cosines)


def rotation(turn: np.ndarray) -> np.ndarray:
    """Return the matrices, (components, components, lanes), of turns (1 or 3, lanes)."""
    if len(turn) == 1:
        cosine = np.cos(turn[0])
        sine = np.sin(turn[0])
        return np.array([[cosine, -sine], [sine, cosine]])
    return Rotation.from_rotvec(turn.T).as_matrix().transpose(1, 2, 0)
