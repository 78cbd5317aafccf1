"""Values of a surrogate at fixed samples of ξ, at places η that differ from series to series.

An expansion is Σ_j Ψ_j(ξ) g_j(η). With Ψ_j at the samples computed once, samples of all series,
each at its own η, are one product of matrices.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from flexband.uncertainty.expansions.bounds.scan import scan
from flexband.uncertainty.expansions.direct import DirectExpansion
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.inputs.sampling import of_normals, sobol
from flexband.uncertainty.phases.expansion import PhaseExpansion
from flexband.uncertainty.phases.rules import scan_points
from flexband.uncertainty.phases.terms import Terms

REPLICATES = 8
"""Independent sets of samples, whose differences tell the sampling error."""


def samples_of(families: Sequence[Family], samples: int, seed: int) -> np.ndarray:
    """Return ξ of scrambled Sobol' sequences, shape (samples, n); one without random inputs.

    They are `REPLICATES` independently scrambled sequences, one after the other.
    """
    if not families:
        return np.zeros((1, 0))
    count = -(-samples // REPLICATES)
    u = [sobol(count, len(families), seed * REPLICATES + k) for k in range(REPLICATES)]
    return of_normals(ndtri(np.concatenate(u)), families)


@dataclass(frozen=True)
class SampledSeries:
    """The times of one output as functions of η, at fixed samples of ξ.

    Attributes
    ----------
    output : number of the output.
    expansion : that of the output alone.
    hybrid : the expansion of the series themselves, or of their parts.
    scanned : η among which bounds are searched first, and the numbers of the points next to each.
    """

    output: int
    expansion: Expansion
    hybrid: HybridExpansion
    scanned: tuple[np.ndarray, np.ndarray]

    @staticmethod
    def of_outputs(expansion: Expansion) -> Iterator[SampledSeries]:
        """Yield the series of each output of an expansion."""
        for output in expansion.outputs:
            one = expansion.of(np.array([output]))
            if isinstance(one, PhaseExpansion):
                m = one.parts.interval_dimension
                terms = Terms.of(one.parts, one.columns)
                reach = terms.reach()[:m] * (not terms.saturated)
                yield SampledSeries(
                    int(output), one, one.parts, scan_points(2 * terms.orders[:m], reach)
                )
            else:
                assert isinstance(one, DirectExpansion)
                orders = one.values.interval_orders
                yield SampledSeries(int(output), one, one.values, scan(orders))

    @property
    def times(self) -> int:
        """Number of series."""
        rows = self.expansion.columns.width if isinstance(self.expansion, PhaseExpansion) else 1
        return self.hybrid.coefficients.shape[1] // rows

    def values(
        self, psi: np.ndarray, eta: np.ndarray, times: np.ndarray, *, single: bool = False
    ) -> np.ndarray:
        """Return samples of some series, each at its own η, shape (series, samples).

        Parameters
        ----------
        psi : what `basis` returns.
        eta : shape (series, m).
        times : their numbers, shape (series,).
        single : as in `PartColumns.join`.
        """
        return self.joined(self.parts(psi, eta, times), single=single)

    def parts(self, psi: np.ndarray, eta: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return the parts that `joined` makes the values of, shape (parts, series, samples)."""
        hybrid = self.hybrid
        own = hybrid.coefficients.reshape(len(hybrid.index), -1, self.times)[..., times]
        own = own * hybrid.chebyshev(eta)[:, hybrid.i].T[:, None, :]
        order = np.argsort(hybrid.j, kind="stable")
        starts = np.searchsorted(hybrid.j[order], np.arange(psi.shape[1]))
        factors = np.add.reduceat(own[order], starts, axis=0)
        return np.moveaxis(factors, 0, -1) @ psi.T

    def joined(self, parts: np.ndarray, *, single: bool = False) -> np.ndarray:
        """Return the values of parts."""
        if isinstance(self.expansion, PhaseExpansion):
            joined = self.expansion.columns.join(parts.reshape(-1), single=single)
            return joined.reshape(parts.shape[1:])
        return parts[0]

    def basis(self, xi: np.ndarray) -> np.ndarray:
        """Return Ψ_j at ξ of shape (samples, n), shape (samples, N)."""
        return self.hybrid.orthogonal(xi)
