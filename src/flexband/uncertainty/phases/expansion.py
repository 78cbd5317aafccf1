"""The phase expansion: base, envelopes and phases are expanded, and put together again.

    F = base + Σ_c Re[Z_c e^{iφ_c}]

The parts, real and imaginary part of Z apart, are series of one `HybridExpansion`, so they share
its design and its fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexband.uncertainty.expansions.direct import DirectExpansion
from flexband.uncertainty.expansions.expansion import Expansion, Extremes
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.phases.bounds import phase_extremes
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.phases.terms import phase_moments


@dataclass(frozen=True)
class PhaseExpansion:
    """The expansion of outputs that share one or more carriers.

    Attributes
    ----------
    outputs : numbers of the response's outputs.
    parts : the expansion of the parts.
    columns : where the parts are among its series.
    """

    outputs: np.ndarray
    parts: HybridExpansion
    columns: PartColumns

    def evaluate(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the outputs at ξ (points, n) and η (points, m), shape (points, outputs, times)."""
        return self.columns.join(self.parts.evaluate(xi, eta))

    def moments(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return μ and σ over ξ at η (points, m), each of shape (points, outputs, times)."""
        return phase_moments(self.parts, self.columns, eta)

    def extremes(self, sigmas: Sequence[float]) -> list[Extremes]:
        """Return the bounds of μ(η) + c σ(η) over η ∈ [−1, 1]^m for each c of `sigmas`."""
        return phase_extremes(self.parts, self.columns, sigmas)

    def of(self, outputs: np.ndarray, times: slice = slice(None)) -> PhaseExpansion:
        """Return the expansion of some of its outputs, by number, at some of the times."""
        which = self.columns.of_outputs(np.searchsorted(self.outputs, outputs))
        parts = self.parts.of_rows(self.columns.width, which, times)
        return PhaseExpansion(outputs, parts, PartColumns.of(len(outputs), self.columns.carriers))

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the arrays that a file keeps."""
        carriers = np.array(self.columns.carriers)
        return {"outputs": self.outputs, "carriers": carriers, **vars(self.parts)}

    @staticmethod
    def of_arrays(outputs: np.ndarray, carriers: np.ndarray, **parts: np.ndarray) -> PhaseExpansion:
        """Return the expansion of `arrays`."""
        columns = PartColumns.of(len(outputs), int(carriers))
        return PhaseExpansion(outputs, HybridExpansion(**parts), columns)


def expansion_of(parts: HybridExpansion, columns: PartColumns) -> Expansion:
    """Return the expansion of a response by its parts: the plain one if there are no carriers."""
    outputs = np.arange(columns.outputs)
    if columns.carriers:
        return PhaseExpansion(outputs, parts, columns)
    return DirectExpansion(outputs, parts)
