"""What an adaptive method knows after some batches of runs, whatever model it fits to them.

The models of the batches before, on the newest decomposition, tell how the bands have changed and
how far each batch was from what was known before it.
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import Protocol

import numpy as np

from flexband.uncertainty.adaptive.expected_error import (
    CAUTION,
    DOUBT,
    apart,
    at_all_times,
    chosen_carriers,
    rms,
    running,
    stacked,
    steady_miss,
    thinned,
)
from flexband.uncertainty.expansions.expansion import Expansion, extremes_of
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.phases.decomposition import Stage, decompose
from flexband.uncertainty.phases.expansion import expansion_of
from flexband.uncertainty.phases.layout import PartColumns

BATCH = 8
"""Runs are asked for in multiples of this: as many as the lanes of a SIMD register."""

RESOLUTION = 5e-5
"""Of an output's size: with carriers an expected error is never below, for the split of runs is not
better than that."""

OTHER = 0.5
"""Part of the mean's error that is expected in the error bar too, and the other way round."""

NEGLIGIBLE = 1e-10
"""An output below this part of the largest one is round-off."""


class Runs(Protocol):
    """Where runs are."""

    @property
    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """ξ and η, shapes (runs, n) and (runs, m)."""
        ...

    @property
    def families(self) -> Sequence[Family]:
        """The polynomials of each ξ."""
        ...

    def __len__(self) -> int: ...


class BatchModel(ABC):
    """The models after every batch.

    Parameters
    ----------
    F : all runs, shape (runs, outputs, times), at steps of dt.
    design : where they are.
    batches : how many runs there were after the last three batches or fewer, this one included.
    phase_resolved : whether carriers are looked for.
    """

    def __init__(
        self,
        F: np.ndarray,
        dt: float,
        design: Runs,
        batches: Sequence[int],
        phase_resolved: bool,
    ):
        self.F, self.points, self.batches = F, design.points, batches
        self.families = design.families
        self.stages = decompose(F, dt) if phase_resolved else [Stage([], F)]
        self.size, self.varied = rms(F) + 1e-300, rms(F - F.mean(axis=0))
        errors, self.misses = [], []
        for stage in self.stages:
            found = [self._predicted(stage, *pair) for pair in self._pairs]
            errors.append(found[-1][0])
            self.misses.append(np.max([miss for _, miss in found], axis=0))
        self.carriers = chosen_carriers(errors)
        self.frequencies = [c.frequency for c in self.stages[-1].carriers]
        self.thin, self.period = thinned(self.frequencies, dt, F.shape[-1])

    @staticmethod
    @abstractmethod
    def start(m: int, families: Sequence[Family], most: int) -> tuple[Runs, list[int]]:
        """Return the first runs in m variables η and those ξ, and where their batches end."""

    @abstractmethod
    def extended(self, count: int) -> Runs:
        """Return the design with so many further runs, or fewer."""

    @abstractmethod
    def _terms(self, stage: Stage, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the terms that the first runs tell.

        Their orders, shape (terms, variables), and the coefficients of the parts, (terms, series).
        """

    @abstractmethod
    def _scaled(self, change: np.ndarray) -> np.ndarray:
        """Return the errors expected, of how the bands have changed, both (2, outputs, times)."""

    @property
    @abstractmethod
    def orders(self) -> np.ndarray:
        """The highest order in each variable, η first."""

    @property
    @abstractmethod
    def tested(self) -> bool:
        """Whether a batch has been run of which it was known what to expect."""

    @property
    def _pairs(self) -> list[tuple[int, int]]:
        """How many runs there were before and after each batch that is predicted."""
        return list(itertools.pairwise(self.batches))

    def _parts(self, stage: Stage, count: int) -> HybridExpansion:
        """Return the expansion of the parts that the first runs tell."""
        index, terms = self._terms(stage, count)
        return HybridExpansion.of_terms(index, terms, self.families)

    def _predicted(self, stage: Stage, before: int, now: int) -> tuple[np.ndarray, np.ndarray]:
        """Return how far the runs of a batch are from what was known before.

        The relative error of each output, shape (outputs,), and `steady_miss`.
        """
        unseen = stage.runs(slice(before, now))
        xi, eta = (v[before:now] for v in self.points)
        weight = self._weight(xi)[:, None, None]
        parts = self._parts(stage, before).evaluate(xi, eta)
        signal = PartColumns.of_stage(stage).join(parts)
        error = rms(weight * (signal - unseen.signal)) / self.size
        return error, steady_miss(parts, unseen, weight)

    def _weight(self, xi: np.ndarray) -> np.ndarray:
        """Return how much the misses of runs at ξ count, shape (runs,)."""
        return np.ones(len(xi))

    def expansions(self, count: int) -> list[Expansion]:
        """Return the model that the first runs tell, by the number of carriers."""
        found = []
        for k in np.unique(self.carriers):
            parts = self._parts(self.stages[k], count)
            whole = expansion_of(parts, PartColumns.of_stage(self.stages[k]))
            found.append(whole.of(np.flatnonzero(self.carriers == k)))
        return found

    @cached_property
    def _bands(self) -> list[np.ndarray]:
        """Bounds at thinned times before and after the last batch, (sigmas, 2, outputs, times)."""
        found = (extremes_of(self.expansions(count), self.thin) for count in self.batches[-2:])
        return [stacked(extremes) for extremes in found]

    @cached_property
    def expected_error(self) -> np.ndarray:
        """The errors expected of interval mean and error bar, shape (2, outputs, times).

        What the change of the bands by a batch tells; what was missed where there is no trust.
        """
        change = apart(self._bands[-1], self._bands[-2])
        error = self._scaled(change + OTHER * change[::-1])
        missed = np.minimum(self._missed, self.size[:, None])
        least = RESOLUTION * self.size * (self.carriers > 0)
        doubt = np.where(self.trusted[:, None], least[:, None], CAUTION * missed)
        error = np.maximum(at_all_times(error, self.thin, self.F.shape[-1]), doubt)
        return running(error, max(self.period, self.thin.step))

    @property
    def _missed(self) -> np.ndarray:
        """How far base and envelopes missed the last runs, shape (outputs, times)."""
        return np.stack([self.misses[k][o] for o, k in enumerate(self.carriers)])

    @property
    def trusted(self) -> np.ndarray:
        """Whether the variation of each output's base and envelopes is foreseen, (outputs,).

        Outputs that vary by round-off are not looked at.
        """
        missed = np.sqrt(np.mean(self._missed**2, axis=1))
        return (missed < DOUBT * self.varied) | (self.varied < NEGLIGIBLE * self.size.max())

    @property
    def _width(self) -> np.ndarray:
        """The error bar's mean width, shape (outputs,)."""
        return (self._bands[-1][2, 1] - self._bands[-1][1, 0]).mean(axis=-1)

    def _relative(self, error: np.ndarray) -> np.ndarray:
        """Return errors in parts of the error bar's mean width, shape (2, outputs).

        A band that is narrower than round-off counts as that wide.
        """
        width = self._width
        least = NEGLIGIBLE * np.maximum(self.size, NEGLIGIBLE * self.size.max())
        counts = self.size > NEGLIGIBLE * self.size.max()
        return error.mean(axis=-1) * counts / np.maximum(width, np.maximum(least, 1e-300))

    @property
    def relative_error(self) -> float:
        """The largest error expected, in parts of the error bar's mean width."""
        return float(self._relative(self.expected_error).max())
