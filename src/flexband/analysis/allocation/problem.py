"""Margins at some points as functions of tolerances, sizes and compensators.

The compensators of each place are variables of their own, which all margins there share.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexband.analysis.allocation.tolerances import STEP
from flexband.analysis.allocation.worst_case import WatchedPlaces, WorstCase


@dataclass(frozen=True, eq=False)
class Problem:
    """Margins that have to be kept.

    Its variables are those of the search, x, and then the compensators of one place after the
    other.
    """

    worst: WorstCase
    points: WatchedPlaces

    @cached_property
    def columns(self) -> list[int]:
        """The numbers of the compensators among η."""
        return list(self.worst.tolerances.compensators.values())

    @cached_property
    def owner(self) -> np.ndarray:
        """The number of each point's place, (points,)."""
        keys = self.points.keys(self.columns)[:, 2:]
        return np.unique(keys, axis=0, return_inverse=True)[1].ravel()

    @property
    def adjusted(self) -> np.ndarray:
        """The compensators of all places, the last that are known, (places × compensators,)."""
        if not self.columns or not len(self.points):
            return np.zeros(0)
        compensators = np.zeros((self.owner.max() + 1, len(self.columns)))
        compensators[self.owner] = self.points.places[:, self.columns]
        return compensators.ravel()

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """The least and the largest values of all variables."""
        low, high = self.worst.tolerances.bounds
        reach = np.ones(len(self.adjusted))
        return np.concatenate([low, -reach]), np.concatenate([high, reach])

    def split(self, v: np.ndarray) -> tuple[np.ndarray, WatchedPlaces]:
        """Return the variables of the search, and the points with the compensators of v."""
        count = len(self.worst.tolerances.bounds[0])
        if not self.columns:
            return v, self.points
        places = self.points.places.copy()
        places[:, self.columns] = v[count:].reshape(-1, len(self.columns))[self.owner]
        return v[:count], replace(self.points, places=places)

    def margins(self, v: np.ndarray) -> np.ndarray:
        """Return the margins, (points,)."""
        x, points = self.split(v)
        return self.worst.values(x[None], points)[0]

    def derivatives(self, v: np.ndarray) -> np.ndarray:
        """Return the derivatives of the margins by all variables, (points, variables)."""
        x, points = self.split(v)
        steps = STEP * np.eye(len(x))
        up = np.minimum(x + steps, self.worst.tolerances.bounds[1])
        down = x - steps
        after, before = np.split(self.worst.values(np.concatenate([up, down]), points), 2)
        by_x = ((after - before) / np.diag(up - down)[:, None]).T
        by_adjusted = np.zeros((len(points), len(v) - len(x)))
        rows = np.arange(len(points))
        for k, column in enumerate(self.columns):
            ends = []
            for sign in (1.0, -1.0):
                places = points.places.copy()
                places[:, column] += sign * STEP
                ends.append(self.worst.values(x[None], replace(points, places=places))[0])
            slope = (ends[0] - ends[1]) / (2 * STEP)
            by_adjusted[rows, self.owner * len(self.columns) + k] = slope
        return np.concatenate([by_x, by_adjusted], axis=1)
