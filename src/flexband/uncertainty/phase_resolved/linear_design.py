"""A few runs of a design, from which small series are expanded linearly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexband.uncertainty.adaptive.response_runs import ResponseRuns
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.index_sets import first_terms


@dataclass(frozen=True)
class LinearDesign:
    """The runs of a design that tell a linear function of its variables."""

    families: tuple[Family, ...]  # the polynomials of each ξ
    index: np.ndarray  # the terms 1, and x of each variable that varies, (terms, variables)
    rows: np.ndarray  # numbers of the runs
    matrix: np.ndarray  # the terms in these runs, (runs, terms)

    @staticmethod
    def from_runs(runs: ResponseRuns, families: Sequence[Family]) -> LinearDesign:
        """Choose runs that differ in one variable from the one nearest to the middle.

        Of a design in which there are none, these are the first ones, two for each term.
        """
        xi, eta, _ = runs
        x = np.concatenate([eta, xi], axis=1)
        size = np.ptp(x, axis=0)
        which = np.flatnonzero(size > 0)
        scaled = (x - (x.max(axis=0) + x.min(axis=0)) / 2)[:, which] / size[which]
        center = int(np.argmin(np.sum(scaled**2, axis=1).round(9)))
        distances = np.abs(scaled - scaled[center])
        rows = [center]
        for v in range(len(which)):
            alone = distances[:, v] * (np.delete(distances, v, axis=1) < 1e-9).all(axis=1)
            rows += [int(np.argmax(alone.round(9)))] * bool(alone.max() > 0)
        if len(rows) <= len(which):
            rows = list(range(min(len(x), 2 * (1 + len(which)))))
        index = first_terms(eta.shape[1], xi.shape[1], 1 + x.shape[1])[[0, *(1 + which)]]
        terms = HybridExpansion(tuple(families), index, np.zeros((len(index), 0)))
        numbers = np.array(rows)
        matrix = terms.terms(xi[numbers], eta[numbers])
        return LinearDesign(tuple(families), index, numbers, matrix)

    def small(self, series: np.ndarray) -> HybridExpansion:
        """Return the linear expansion of series in these runs, (runs, series)."""
        terms = np.linalg.lstsq(self.matrix, series, rcond=None)[0]
        return HybridExpansion(self.families, self.index, terms)
