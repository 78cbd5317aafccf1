"""Rotations and prescribed motions about which a mechanism is linearized."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Spin:
    """A steady rotation of everything at `rate` Ω [rad/s], or none."""

    rate: float
    # the coordinates of a mechanism shrunk to the centre of rotation: its position in the rows of
    # positions, zero in those of directions
    centre: np.ndarray

    def scale_centrifugal(self, part: float) -> Spin:
        """Return a slower rotation, with this part of the centrifugal forces."""
        return Spin(np.sqrt(part) * self.rate, self.centre)

    def pace(self, size: np.ndarray) -> float:
        """Return how fast the motion is [1/s], |Ω|."""
        return abs(self.rate)

    def velocity(self, q: np.ndarray) -> np.ndarray:
        """Return Ω J (q − centre)."""
        return self.rate * rotate_vectors(q - self.centre)

    def acceleration(self, q: np.ndarray) -> np.ndarray:
        """Return −Ω² (q − centre)."""
        return -(self.rate**2) * (q - self.centre)


@dataclass(frozen=True)
class Driven(Spin):
    """The steady motion of what drives move, while all else rests."""

    # the velocities and accelerations of the coordinates
    v: np.ndarray
    a: np.ndarray

    def pace(self, size: np.ndarray) -> float:
        """Return the largest velocity relative to the size of the mechanism [1/s]."""
        return float(np.abs(self.v / size).max())

    def velocity(self, q: np.ndarray) -> np.ndarray:
        return self.v

    def acceleration(self, q: np.ndarray) -> np.ndarray:
        return self.a


def rotate_vectors(q: np.ndarray) -> np.ndarray:
    """Return J q: all vectors of the plane, which are pairs of rows, turned by 90°."""
    pairs = q.reshape(-1, 2, *q.shape[1:])
    return np.stack([-pairs[:, 1], pairs[:, 0]], axis=1).reshape(q.shape)


def rotate_columns(matrix: np.ndarray) -> np.ndarray:
    """Return `matrix` J, what a matrix gives for turned vectors."""
    return -rotate_vectors(matrix.T).T
