"""The rows of a table as a design, and the terms that they can tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexband.errors import InputError
from flexband.uncertainty.adaptive.regression import fitted_parts
from flexband.uncertainty.expansions.families import Family, existing_terms
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.index_sets import bounded_terms
from flexband.uncertainty.expansions.regression.sparse_fit import candidates
from flexband.uncertainty.phases.decomposition import Stage


@dataclass(frozen=True)
class TableDesign:
    """The rows of a table, as a `Design`."""

    xi: np.ndarray
    eta: np.ndarray
    families: Sequence[Family]
    index: np.ndarray  # orders of the terms to choose from

    def __len__(self) -> int:
        return len(self.xi)

    def fit(self, stage: Stage) -> HybridExpansion:
        return fitted_parts(self.index, (self.xi, self.eta), self.families, stage)

    def which(self, rows: np.ndarray) -> TableDesign:
        """Return the design of some rows, with fewer terms to choose from."""
        few = terms_of(self.eta.shape[1], self.families, int(np.count_nonzero(rows)))
        return replace(self, xi=self.xi[rows], eta=self.eta[rows], index=few)


def terms_of(m: int, families: Sequence[Family], rows: int) -> np.ndarray:
    """Return the orders of terms to choose from: those of the highest total order there may be."""
    highest = 8
    per_row = 2
    dimension = m + len(families)
    index = candidates(dimension)
    for order in range(4, highest + 1):
        try:
            larger_index = bounded_terms(dimension, order, 1.0, max(per_row * rows, len(index)))
        except InputError:
            break
        index = larger_index
    return index[existing_terms(index, families)]
