"""Parts of the variance of series that random inputs cause, at given values of the intervals.

With independent groups of random variables, the variance is a sum of parts, one for each set of
groups (Sobol', 2001). Polynomials have them in closed form: γ_j g_j(η)² belongs to the groups that
Ψ_j contains. Where a series is put together from phases, they are means over samples (Jansen,
1999).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.special import ndtri

from flexband.analysis.sampled import REPLICATES, SampledSeries
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.inputs.sampling import of_normals, sobol


@dataclass(frozen=True)
class VarianceOptions:
    """How variances are computed."""

    samples: int = 2048
    """Samples of each set if there are phases."""
    searched_samples: int = 128
    """Samples of a search."""
    values_at_once: int = 2**17
    """Numbers that are computed together."""


class Variances(Protocol):
    """Variances of the times of one output."""

    def __call__(self, eta: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return variances and their parts, shape (1 + 2 groups, rows, replicates).

        First is the variance, then what each group causes alone, then what each group takes part
        in. There is one replicate where the parts are exact. The shapes of η and of the numbers of
        the times are (rows, m) and (rows,).
        """
        ...


def variances_of(
    series: SampledSeries,
    families: Sequence[Family],
    groups: Sequence[Sequence[int]],
    seed: int,
    *,
    options: VarianceOptions = VarianceOptions(),
) -> tuple[Variances, Variances]:
    """Return the variances of a series, and of groups of ξ, for a search and for its result."""
    if series.columns is None:
        exact = Exact(series, groups, options)
        return exact, exact
    counts = (options.searched_samples, seed + 1), (options.samples, seed)
    search_variances, final_variances = (
        Sampled.from_series(series, families, groups, *count, options) for count in counts
    )
    return search_variances, final_variances


@dataclass(frozen=True)
class Exact:
    """Variances of polynomials."""

    series: SampledSeries
    groups: Sequence[Sequence[int]]
    options: VarianceOptions

    @cached_property
    def _parts(self) -> np.ndarray:
        """Return γ_j, with which the parts are sums, (1 + 2 groups, N)."""
        hybrid = self.series.hybrid
        index = hybrid.random_index
        contains = np.stack([np.any(index[:, list(k)] > 0, axis=1) for k in self.groups])
        count = np.sum(contains, axis=0, keepdims=True)
        return np.concatenate([count > 0, contains & (count == 1), contains]) * hybrid.norms

    def __call__(self, eta: np.ndarray, times: np.ndarray) -> np.ndarray:
        hybrid = self.series.hybrid
        blocks = []
        block_size = max(1, self.options.values_at_once // len(hybrid.j))
        for first in range(0, len(eta), block_size):
            rows = slice(first, first + block_size)
            terms = hybrid.coefficients[:, times[rows]] * hybrid.chebyshev(eta[rows])[:, hybrid.i].T
            blocks.append(self._parts @ self.series.sums(terms) ** 2)
        return np.concatenate(blocks, axis=1)[..., None]


@dataclass(frozen=True)
class Sampled:
    """Variances by samples of pairs that share the values of some groups.

    There are two independent sets of samples, and one for each group: the first with the values of
    this group from the second.
    """

    series: SampledSeries
    psi: np.ndarray  # polynomials of the samples, (sets × replicates × samples, N)
    sets: int  # their number
    options: VarianceOptions

    @staticmethod
    def from_series(
        series: SampledSeries,
        families: Sequence[Family],
        groups: Sequence[Sequence[int]],
        samples: int,
        seed: int,
        options: VarianceOptions,
    ) -> Sampled:
        """Return the variances of a series with scrambled Sobol' sequences."""
        n = len(families)
        count = samples // REPLICATES
        u = [sobol(count, 2 * n, seed * REPLICATES + k) for k in range(REPLICATES)]
        normals = ndtri(np.concatenate(u))
        sets = [of_normals(v, families) for v in (normals[:, :n], normals[:, n:])]
        for group in groups:
            sets.append(sets[0].copy())
            sets[-1][:, group] = sets[1][:, group]
        return Sampled(series, series.basis(np.concatenate(sets)), len(sets), options)

    def __call__(self, eta: np.ndarray, times: np.ndarray) -> np.ndarray:
        variances = []
        block_size = max(1, self.options.values_at_once // len(self.psi))
        for first in range(0, len(eta), block_size):
            rows = slice(first, first + block_size)
            values = self.series.values(self.psi, eta[rows], times[rows])
            values = np.moveaxis(values.reshape(len(values), self.sets, REPLICATES, -1), 1, 0)
            first_set = values[0]
            second_set = values[1]
            mixed = values[2:]
            # of the same pairs: their errors cancel in indices
            variance = _half_square(first_set, second_set)
            alone = variance - _half_square(second_set, mixed)
            total = _half_square(first_set, mixed)
            variances.append(np.concatenate([variance[None], alone, total]))
        return np.concatenate(variances, axis=1)


def _half_square(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return half the mean square of differences, over the last axis."""
    difference = a - b
    return np.einsum("...q,...q->...", difference, difference) / (2 * difference.shape[-1])
