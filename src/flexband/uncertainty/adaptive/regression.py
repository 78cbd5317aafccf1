"""The adaptive model of few terms out of many: sparse regression, for many variables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexband.uncertainty.adaptive.batches import BATCH, NEGLIGIBLE, BatchModel
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.regression import (
    Fit,
    candidates,
    normalized_values,
    sparse_fit,
    term_scales,
)
from flexband.uncertainty.inputs.sampling import nested_points
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.phases.layout import PartColumns

LEAST_RUNS = 2 * BATCH

SAFETY = 1.0
"""Factor of the estimate, so that true errors are as often larger as smaller."""

LEAST_FALL, LEAST_SEEN = 0.2, 0.8
"""A batch lowers what is expected of the bands, and of further runs, to these parts at most: a
small leave-one-out error may be luck, until the next batch has met it."""


@dataclass(frozen=True)
class Samples:
    """Runs at the first points of a sequence.

    count : of runs. interval_dimension : m. families : the polynomials of each ξ.
    """

    count: int
    interval_dimension: int
    families: Sequence[Family]

    @property
    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """ξ and η of the runs, shapes (runs, n) and (runs, m)."""
        return nested_points(self.count, self.interval_dimension, self.families)

    def __len__(self) -> int:
        return self.count


class RegressionModel(BatchModel):
    """The models after every batch of runs: each part by terms of its own."""

    def __init__(
        self,
        F: np.ndarray,
        dt: float,
        design: Samples,
        batches: Sequence[int],
        phase_resolved: bool,
    ):
        self.design = design
        self.index = candidates(design.interval_dimension + len(design.families))
        self.scales = term_scales(self.index, design.families)
        self.values = normalized_values(self.index, *design.points, design.families)
        self._fits: dict[tuple[int, int], list[tuple[np.ndarray, Fit]]] = {}
        super().__init__(F, dt, design, batches, phase_resolved)

    @staticmethod
    def start(m: int, families: Sequence[Family], most: int) -> tuple[Samples, list[int]]:
        """Return the fewest runs, and where their batches end."""
        del most
        return Samples(LEAST_RUNS, m, families), [BATCH, LEAST_RUNS]

    def extended(self, count: int) -> Samples:
        """Return the samples with so many more."""
        return replace(self.design, count=self.design.count + count)

    def _fitted(self, stage: Stage, count: int) -> list[tuple[np.ndarray, Fit]]:
        """Return the series and the fit to the first runs of each part.

        Of base and envelopes every output counts by its variation, but for round-off.
        """
        key = len(stage.carriers), count
        if key not in self._fits:
            layout = PartColumns.of_stage(stage)
            series = layout.pack(stage.runs(slice(count)))
            counts = self.varied > NEGLIGIBLE * np.maximum(self.size, self.varied.max())
            weight = np.where(counts, 1 / np.where(counts, self.varied, 1.0), 0.0)
            self._fits[key] = [
                (part.ravel(), self._fit(series[:, part.ravel()], _weights(part, weight)))
                for part in layout.parts(series.shape[1])
            ]
        return self._fits[key]

    def _fit(self, series: np.ndarray, weight: np.ndarray) -> Fit:
        return sparse_fit(self.values[: len(series)], self.index, series, weight)

    def _terms(self, stage: Stage, count: int) -> tuple[np.ndarray, np.ndarray]:
        fits = self._fitted(stage, count)
        which = np.unique(np.concatenate([fit.which for _, fit in fits]))
        terms = np.zeros((len(which), sum(len(part) for part, _ in fits)))
        for part, fit in fits:
            terms[np.ix_(np.searchsorted(which, fit.which), part)] = fit.coefficients
        return self.index[which], terms / self.scales[which][:, None]

    def _left_out(self, count: int) -> np.ndarray:
        """Return the leave-one-out error of base and envelopes, shape (outputs, times)."""
        found = np.zeros(self.F.shape[1:])
        for k in np.unique(self.carriers):
            which, stage = np.flatnonzero(self.carriers == k), self.stages[k]
            series = np.zeros((count, sum(len(part) for part, _ in self._fitted(stage, count))))
            for part, fit in self._fitted(stage, count):
                series[:, part] = fit.correction * fit.left_out
            base, carriers = PartColumns.of_stage(stage).unpack(series)
            miss = np.abs(base) + sum(np.hypot(re, im) for _, re, im in carriers)
            found[which] = np.sqrt(np.mean(miss**2, axis=0))[which]
        return found

    @property
    def orders(self) -> np.ndarray:
        """The highest order in each variable, η first."""
        stages = (self.stages[k] for k in np.unique(self.carriers))
        return np.max([self._terms(one, len(self.F))[0].max(axis=0) for one in stages], axis=0)

    @property
    def tested(self) -> bool:
        """Whether there have been three batches."""
        return len(self.batches) > 2

    @property
    def _fall(self) -> np.ndarray:
        """The leave-one-out error over that before the last batch, shape (outputs, 1)."""
        now, before = (
            np.sqrt(np.mean(self._left_out(count) ** 2, axis=1, keepdims=True))
            for count in self.batches[:-3:-1]
        )
        return np.clip(now / np.maximum(before, 1e-300), LEAST_FALL, 1.0)

    @property
    def _pairs(self) -> list[tuple[int, int]]:
        """The last batch."""
        return super()._pairs[-1:]

    @property
    def _missed(self) -> np.ndarray:
        """How far base and envelopes miss further runs, shape (outputs, times).

        The leave-one-out error, or what was missed in the last batch times its fall.
        """
        seen = super()._missed * np.maximum(self._fall, LEAST_SEEN)
        return np.maximum(self._left_out(len(self.F)), seen)

    @property
    def _width(self) -> np.ndarray:
        """The error bar's mean width, not less than the runs' own: a constant alone has none."""
        return np.maximum(super()._width, 2 * self.F.std(axis=0).mean(axis=-1))

    def _scaled(self, change: np.ndarray) -> np.ndarray:
        """Return the errors expected, of how the bands have changed, both (2, outputs, times).

        The change times the fall of the leave-one-out error e, which adds itself: e/√N to the mean
        of N runs, and as much as is missed of the variation s, s − √(s² − e²), to the error bar.
        """
        missed, spread = self._missed[:, self.thin], self.F[..., self.thin].std(axis=0)
        mean = missed / np.sqrt(len(self.F))
        lost = spread - np.sqrt(np.maximum(spread**2 - missed**2, 0.0))
        return SAFETY * self._fall * change + np.stack([mean, mean + lost])


def _weights(part: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the weight of every series of a part, (outputs or 1, times), flat."""
    one = weight[:, None] if len(part) % len(weight) == 0 else np.ones((1, 1))
    return np.tile(one, (len(part) // len(one), part.shape[1])).ravel()
