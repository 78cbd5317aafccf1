"""Values of a surrogate at fixed samples of ξ, at places η that differ from series to series.

An expansion is Σ_j Ψ_j(ξ) g_j(η), of which the Ψ_j at the samples are computed once. Plain loops in
compiled code serve several threads at a time, and keep the parts of a ringing series in the cache.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.special import ndtri, stdtrit

from flexband.compilation.caching import cached_on_disk
from flexband.compilation.functions import compiled
from flexband.errors import InputError
from flexband.uncertainty.expansions.bounds.scan import scan
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.inputs.sampling import of_normals, sobol
from flexband.uncertainty.phases.expansion import PhaseExpansion
from flexband.uncertainty.phases.integration.rules import scan_points
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.phases.terms import PartTerms
from flexband.uncertainty.phases.trigonometry import cos_and_sin

REPLICATES = 8
"""Independent sets of samples, whose differences tell the sampling error."""

CONFIDENCE = 0.95
"""Of sampling errors."""

MIN_BEYOND = 10
"""Samples that must be expected beyond a quantile."""

BLOCK = 512
"""Samples whose parts stay in the processor's cache."""


def samples_of(families: Sequence[Family], samples: int, seed: int) -> np.ndarray:
    """Return ξ of `REPLICATES` scrambled Sobol' sequences, (samples, n); one sample if n is 0."""
    if not families:
        return np.zeros((1, 0))
    count = -(-samples // REPLICATES)
    u = [sobol(count, len(families), seed * REPLICATES + k) for k in range(REPLICATES)]
    return of_normals(ndtri(np.concatenate(u)), families)


def sampling_attrs(count: int, seed: int, search_details: str = "") -> dict[str, int | float | str]:
    """Return the attributes of an answer that a search on so many samples made."""
    made = f"{count} quasi-random samples of the surrogate; bounds by a search{search_details}"
    return {"samples": count, "seed": seed, "confidence": CONFIDENCE, "made": made}


def sampling_error(replicates: np.ndarray, axis: int) -> np.ndarray:
    """Return half the width of the confidence interval of the mean over the replicates."""
    factor = stdtrit(REPLICATES - 1, (1 + CONFIDENCE) / 2) / math.sqrt(REPLICATES)
    return factor * replicates.std(axis=axis, ddof=1)


@dataclass(frozen=True)
class SampledSeries:
    """The times of one output as functions of η, at fixed samples of ξ."""

    output: int  # its number
    expansion: Expansion  # that of the output alone
    hybrid: HybridExpansion  # of the series themselves, or of their parts
    columns: PartColumns | None  # where the parts of phases are; None of polynomials
    scan: tuple[np.ndarray, np.ndarray]  # η that are tried first, and the numbers of neighbours

    @property
    def interval_scan(self) -> tuple[np.ndarray, np.ndarray]:
        """The scan for a search over intervals alone; raise `InputError` if there is a disc."""
        if self.hybrid.discs:
            raise InputError(
                "quantiles, p-boxes, Sobol' indices and derived quantities do not take a Play; "
                "they are searched over intervals only"
            )
        return self.scan

    @staticmethod
    def of_outputs(expansion: Expansion) -> Iterator[SampledSeries]:
        """Yield the series of each output of an expansion."""
        for output in expansion.outputs:
            series = expansion.select(np.array([output]))
            hybrid = series.hybrid
            columns = None
            if isinstance(series, PhaseExpansion):
                columns = series.columns
                m = hybrid.interval_dimension
                terms = PartTerms.from_expansion(hybrid, columns)
                reach = terms.reach()[:m] * (not terms.averages_vanish)
                points = scan_points(2 * terms.orders[:m], reach)
            else:
                points = scan(hybrid.interval_orders)
            yield SampledSeries(int(output), series, hybrid, columns, points)

    @property
    def times(self) -> int:
        """Number of series."""
        rows = self.columns.width if self.columns else 1
        return self.hybrid.coefficients.shape[1] // rows

    def basis(self, xi: np.ndarray) -> np.ndarray:
        """Return Ψ_j at ξ of shape (samples, n), shape (samples, N)."""
        return np.asfortranarray(self.hybrid.orthogonal(xi))

    @cached_property
    def _order(self) -> tuple[np.ndarray, np.ndarray]:
        """The order of terms in which those of each Ψ_j follow each other, and where they start."""
        j = self.hybrid.j
        order = np.argsort(j, kind="stable")
        return order, np.searchsorted(j[order], np.arange(len(self.hybrid.random_index)))

    def sums(self, terms: np.ndarray) -> np.ndarray:
        """Return the sums of terms (terms, …) of each Ψ_j, (N, …)."""
        order, starts = self._order
        return np.add.reduceat(terms[order], starts, axis=0)

    def values(self, psi: np.ndarray, eta: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return samples (series, samples) of series at η (series, m) and times; ψ is a `basis`."""
        hybrid = self.hybrid
        terms = hybrid.coefficients.reshape(len(hybrid.index), -1, self.times)[..., times]
        factors = self.sums(terms * hybrid.chebyshev(eta)[:, hybrid.i].T[:, None, :])
        phase = len(terms[0])
        block = 1
        if self.columns:
            phase = self.columns.phase
            block = self.columns.block
        values = np.empty((len(times), len(psi)))
        arrays = np.ascontiguousarray(factors), np.ascontiguousarray(psi.T)
        fill_samples(*arrays, phase, block, values)
        return values


@cached_on_disk
def fill_samples(factors, psi, phase, block, values):
    """Fill samples b + Σ_c Re[Z_c e^{iφ_c}] of series, whose parts are Σ_j Ψ_j g_j.

    Parameters
    ----------
    factors : g_j of the parts b, then φ, Re Z, Im Z of each carrier; shape (N, parts, series).
    psi : Ψ_j at the samples, shape (N, samples).
    phase, block : the first φ, and the number of parts from each φ to the next.
    values : shape (series, samples).
    """
    parts = np.empty((factors.shape[1], BLOCK))
    cos = np.empty(BLOCK)
    sin = np.empty(BLOCK)
    for row in range(len(values)):
        for first in range(0, values.shape[1], BLOCK):
            samples = values[row][first : first + BLOCK]
            for k in range(len(parts)):
                fill_part(factors, k, row, psi, first, parts[k][: len(samples)])
            samples[:] = parts[0, : len(samples)]
            for c in range(phase, len(parts), block):
                cos_and_sin(parts[c][: len(samples)], 0.0, cos, sin)
                for q in range(len(samples)):
                    samples[q] += parts[c + 1, q] * cos[q] - parts[c + 2, q] * sin[q]


@partial(compiled, fastmath={"contract"})
def fill_part(factors, k, row, psi, first, part):
    """Fill samples, from the first on, of one part of a series."""
    part[:] = 0.0
    for j in range(len(psi)):
        g = factors[j, k, row]
        polynomial = psi[j][first : first + len(part)]
        for q in range(len(part)):
            part[q] += g * polynomial[q]
