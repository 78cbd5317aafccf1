"""Sparse regression: few terms out of many, from fewer runs than there are terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from flexband.uncertainty.adaptive.fits import BATCH, Split
from flexband.uncertainty.expansions.families import Family, existing_terms
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.regression.sparse_fit import (
    candidates,
    normalized_values,
    sparse_fit,
    term_scales,
)
from flexband.uncertainty.inputs.sampling import nested_points
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.surrogates.diagnostics import rms, variation

MIN_RUNS = 2 * BATCH


@dataclass(frozen=True)
class SampledDesign:
    """Runs at the first points of a sequence, and the terms of all orders that may be few."""

    count: int  # number of runs
    interval_dimension: int  # number m of variables η
    families: Sequence[Family]  # the polynomials of each ξ
    discs: tuple[int, ...] = ()  # as of `HybridExpansion`

    sampled: ClassVar[bool] = True  # few terms are chosen out of more than there are runs

    @property
    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """ξ and η, shapes (runs, n) and (runs, m)."""
        return nested_points(self.count, self.interval_dimension, self.families, discs=self.discs)

    @property
    def highest(self) -> np.ndarray:
        """No order is the highest."""
        return np.full(self.interval_dimension + len(self.families), np.inf)

    @cached_property
    def index(self) -> np.ndarray:
        """Orders of the terms to choose from, (terms, variables)."""
        index = candidates(self.interval_dimension + len(self.families))
        return index[existing_terms(index, self.families)]

    def __len__(self) -> int:
        return self.count

    def fit(self, stage: Stage) -> HybridExpansion:
        """Return the expansion of the parts of runs at these points, each in terms of its own."""
        return fitted_parts(self.index, self.points, self.families, stage, self.discs)

    @property
    def few(self) -> int:
        """The number of runs that tell a mean."""
        return BATCH

    def small(self, series: np.ndarray) -> HybridExpansion:
        """Return the expansion of small series in the first few runs: a constant."""
        mean = series.mean(axis=0, keepdims=True)
        return HybridExpansion(tuple(self.families), self.index[:1], mean, self.discs)

    def extend(self, count: int, split: Split) -> SampledDesign:
        """Return the design with `count` further samples."""
        del split
        return replace(self, count=self.count + count)

    def weights(self, first: int) -> np.ndarray:
        """Return the same part for each later run, since they are spread over all inputs."""
        return np.full(self.count - first, 1 / max(1, self.count - first))


def fitted_parts(
    index: np.ndarray,
    points: tuple[np.ndarray, np.ndarray],
    families: Sequence[Family],
    stage: Stage,
    discs: tuple[int, ...] = (),
) -> HybridExpansion:
    """Return the expansion of the parts of runs at points (ξ, η), each in terms of its own.

    Terms are chosen among those of orders `index`. Of base and envelopes every output counts by its
    variation, but for round-off.
    """
    columns = PartColumns.of_stage(stage)
    weight = _weight(stage.signal)
    series = columns.pack(stage)
    values = normalized_values(index, *points, families)
    parts = list(columns.parts(series.shape[1]))
    fits = []
    for part in parts:
        part_series = series[:, part.ravel()]
        fits.append(sparse_fit(values, index, part_series, _weights(part, weight)))
    term_rows = np.unique(np.concatenate([[0], *(fit.active_terms for fit in fits)]))
    terms = np.zeros((len(term_rows), series.shape[1]))
    for part, fit in zip(parts, fits, strict=True):
        mask = np.isin(fit.which, term_rows)
        rows = np.searchsorted(term_rows, fit.which[mask])
        terms[np.ix_(rows, part.ravel())] = fit.coefficients[mask]
    terms /= term_scales(index[term_rows], families)[:, None]
    return HybridExpansion(tuple(families), index[term_rows], terms, discs)


def _weight(F: np.ndarray) -> np.ndarray:
    """Return one over the variation of each output of runs; zero where it is round-off.

    An output that varies by less than 1e-13 of the largest does not count.
    """
    varied = variation(F)
    counts = varied > 1e-13 * max(varied.max(), rms(F).max())
    return np.where(counts, 1 / np.where(counts, varied, 1.0), 0.0)


def _weights(part: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the weight of every series of a part, (outputs or 1, times), flat."""
    weights = weight[:, None] if len(part) % len(weight) == 0 else np.ones((1, 1))
    return np.tile(weights, (len(part) // len(weights), part.shape[1])).ravel()
