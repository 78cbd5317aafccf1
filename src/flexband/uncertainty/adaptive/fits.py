"""Expansions fitted to runs, and how they grow where random variables have rare values."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from flexband.uncertainty.adaptive.rare_values import RareValues
from flexband.uncertainty.adaptive.response_runs import RareRuns, ResponseRuns
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.interpolation import Interpolation
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.phases.expansion import expansion_of
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.surrogates.diagnostics import rms

BATCH = 8
"""Runs are asked for in multiples of this: as many as the lanes of a SIMD register."""

Weights = Callable[[int], np.ndarray]
"""For what part of all inputs each run of a design speaks, from the run of this number on."""


def compared_times(stage: Stage, count: int = 128) -> Stage:
    """Return a stage at about so many of the times, without the memory of all of them."""
    some = stage.part(times=slice(None, None, max(1, stage.base.shape[-1] // count)))
    return some.copy() if stage.carriers else some


class Split(NamedTuple):
    """All runs split into parts, with the numbers of carriers that are in use."""

    stages: list[Stage]  # all runs, those of the design first, at `compared_times`
    outputs: list[np.ndarray]  # that each stage stands for
    holdout: ResponseRuns  # the check runs, which are the last

    @staticmethod
    def from_stages(
        stages: Sequence[Stage], carriers: np.ndarray, holdout: ResponseRuns, counted: np.ndarray
    ) -> Split:
        """Take the stages that outputs use, by the number of carriers of each output.

        A stage with fewer carriers stands for one that does not exist. Outputs that are not
        `counted`, (outputs,), are left out.
        """
        carriers = np.minimum(carriers, len(stages) - 1)
        carrier_counts = np.unique(carriers[counted])
        outputs = [np.flatnonzero(counted & (carriers == k)) for k in carrier_counts]
        return Split([stages[k] for k in carrier_counts], outputs, holdout)

    def rows(self, combined: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Return combinations of runs, relative to the size of each output, (rows, parts, times).

        Parts are the base, real and imaginary part of each envelope, and phases times the mean
        envelope, of every output. Those of all runs, (runs, series), are `combined` to (rows,
        series).
        """
        parts = []
        for stage, which in zip(self.stages, self.outputs, strict=True):
            columns = PartColumns.of_stage(stage)
            size = rms(stage.signal)[which, None] + 1e-300
            base, carriers = columns.unpack(combined(columns.pack(stage)))
            parts.append(base[:, which] / size)
            for (phase, re, im), c in zip(carriers, stage.carriers, strict=True):
                mean = np.abs(c.envelope).mean(axis=0)[which]
                parts += [part / size for part in (re[:, which], im[:, which], phase * mean)]
        return np.concatenate(parts, axis=1)


class Design(Protocol):
    """Where runs are, which are as many as its length, and how their parts are fitted."""

    def __len__(self) -> int: ...

    def fit(self, stage: Stage) -> HybridExpansion | Interpolation:
        """Return the expansion of the parts of runs at these points."""
        ...


class PartsFit(NamedTuple):
    """The expansion of the parts of some outputs, with some number of carriers."""

    outputs: np.ndarray  # their numbers, increasing
    parts: HybridExpansion | Interpolation
    columns: PartColumns
    frequencies: list[float]  # of the carriers, in cycles per unit of time
    runs: int  # number of runs that are fitted, the first of a design

    @staticmethod
    def from_design(design: Design, stage: Stage) -> PartsFit:
        """Fit all outputs to the runs of a design, which are the first of the stage."""
        parts = design.fit(stage.part(slice(len(design))))
        columns = PartColumns.of_stage(stage)
        frequencies = [c.frequency for c in stage.carriers]
        return PartsFit(np.arange(columns.outputs), parts, columns, frequencies, len(design))

    def of_outputs(self, outputs: np.ndarray) -> PartsFit:
        """Return the fit of some of its outputs, by number."""
        if len(outputs) == len(self.outputs):
            return self
        which = self.columns.of_outputs(np.searchsorted(self.outputs, outputs))
        parts = self.parts.of_rows(self.columns.width, which, slice(None))
        columns = PartColumns.from_outputs(len(outputs), self.columns.carriers)
        return PartsFit(outputs, parts, columns, self.frequencies, self.runs)

    @property
    def hybrid(self) -> HybridExpansion:
        """The expansion of the parts, with all of its coefficients."""
        return self.parts.to_hybrid()

    def at(self, times: slice | np.ndarray) -> PartsFit:
        rows = self.columns.width
        return self._replace(parts=self.parts.of_rows(rows, np.arange(rows), times))

    @property
    def expansion(self) -> Expansion:
        return expansion_of(self.outputs, self.hybrid, self.columns)

    def evaluate(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return its outputs at ξ and η, shape (points, outputs, times)."""
        return self.columns.join(self.parts.evaluate(xi, eta))

    def residual_batches(self, runs: ResponseRuns) -> Iterator[tuple[slice, np.ndarray]]:
        """Yield batches of runs and their residuals, shape (runs, outputs, times)."""
        for k in range(0, len(runs.values), BATCH):
            rows = slice(k, k + BATCH)
            some = runs.which(rows)
            yield rows, some.values[:, self.outputs] - self.evaluate(some.xi, some.eta)

    def mean_square_missed(self, runs: ResponseRuns, weights: np.ndarray) -> np.ndarray:
        """Return the weighted sum of squares of what it misses of runs, shape (outputs, times)."""
        square = np.zeros((len(self.outputs), runs.values.shape[2]))
        for rows, missed in self.residual_batches(runs):
            square += np.einsum("p,pot->ot", weights[rows], missed**2)
        return square

    def overshoot(
        self, runs: ResponseRuns, places: Sequence[np.ndarray], rare: RareRuns, thin: slice
    ) -> tuple[np.ndarray, RareValues]:
        """Return how far it leaves the range of all runs at rare values of random variables.

        Parameters
        ----------
        runs, thin : all runs at some of the times, and which these are.
        places : groups of η, shapes (places, m). The one where it is farthest outside counts.
        rare : runs at rare values, which it may miss.

        Returns
        -------
        Root mean square, shape (outputs, times), and a batch of the values where it is farthest.
        """
        parts = self.at(thin).hybrid
        fit = self._replace(parts=parts)
        random_terms = (parts.random_index, parts.families)
        groups = [RareValues.from_index(*random_terms, eta) for eta in places if len(eta)]
        squares, shares = zip(*(fit._outside(runs, values) for values in groups), strict=True)
        missed = rare.runs.at(thin).values[:, self.outputs]
        missed = missed - fit.evaluate(rare.runs.xi, rare.runs.eta)
        square = np.max(squares, axis=0) + np.einsum("p,pot->ot", rare.weight, missed**2)
        values = RareValues.concatenate(groups).first(np.concatenate(shares), BATCH)
        return np.sqrt(square), values._replace(weight=values.weight / len(groups))

    def _outside(
        self, runs: ResponseRuns, rare: RareValues, at_once: int = 64
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean square of how far it is outside, and the share of each value in it.

        Shapes are (outputs, times), and (points,): the mean over outputs relative to their ranges.
        """
        values = runs.values[:, self.outputs]
        low = values.min(axis=0)
        high = values.max(axis=0)
        size = np.ptp(values, axis=(0, 2))[:, None]
        size[size == 0] = np.inf
        square = np.zeros(low.shape)
        shares = [np.zeros(0)]
        for k in range(0, len(rare.weight), at_once):
            some = rare.which(slice(k, k + at_once))
            off = np.abs(self.evaluate(some.xi, some.eta) - (low + high) / 2)
            off -= some.growth_limit(runs.xi)[:, None, None] * (high - low) / 2
            off = np.maximum(off, 0.0)
            square += np.einsum("p,pot->ot", some.weight, off**2)
            shares.append(some.weight * np.mean((off / size) ** 2, axis=(1, 2)))
        return square, np.concatenate(shares)
