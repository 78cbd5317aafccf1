"""The runs of a response, in memory that they can grow in."""

from __future__ import annotations

import numpy as np

from flexband.uncertainty.adaptive.fits import Runs

RESERVED = 2**31
"""Bytes that are reserved at most for all runs of a budget; they are used once there are runs."""


class MadeRuns:
    """Runs that are fitted, and those held out after them.

    More of either are added without a copy of all. Fitted runs stay in their place, so fits may
    refer to them.
    """

    def __init__(self, runs: Runs, fitted: int, most: int):
        """Copy runs, of which the first are fitted; `most` is the budget."""
        self.fit_count, size = fitted, max(1, runs.values[0].nbytes)
        capacity = max(len(runs.values), min(most, RESERVED // size))
        self.memory = _larger(runs, capacity)
        self.count = len(runs.values)

    @property
    def all(self) -> Runs:
        """All runs."""
        return self.memory.which(slice(self.count))

    @property
    def fitted(self) -> Runs:
        """The runs that are fitted."""
        return self.memory.which(slice(self.fit_count))

    @property
    def held(self) -> Runs:
        """The runs held out."""
        return self.memory.which(slice(self.fit_count, self.count))

    def fit(self, new: Runs) -> None:
        """Add runs that are fitted."""
        first, end = self.fit_count, self.fit_count + len(new.values)
        self._make_room(len(new.values))
        for own, held, added in zip(self.memory, self.held, new, strict=True):
            own[end : end + len(held)] = held.copy()
            own[first:end] = added
        self.fit_count, self.count = end, self.count + len(new.values)

    def hold(self, new: Runs) -> None:
        """Add runs that are held out."""
        self._make_room(len(new.values))
        for own, added in zip(self.memory, new, strict=True):
            own[self.count : self.count + len(added)] = added
        self.count += len(new.values)

    def _make_room(self, more: int) -> None:
        if self.count + more > len(self.memory.values):
            self.memory = _larger(self.all, 2 * (self.count + more))


def _larger(runs: Runs, capacity: int) -> Runs:
    """Return a copy of runs in memory for more."""
    found = Runs(*(np.empty((capacity, *own.shape[1:])) for own in runs))
    for own, known in zip(found, runs, strict=True):
        own[: len(known)] = known
    return found
