"""Expansion optimal linear estimation (EOLE) of random fields.

Li and Der Kiureghian (1993); Eqs. (29)–(31), with the correlation matrix of unit variance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexband.uncertainty.inputs.fields.correlation import (
    Correlation,
    correlation_matrix,
    correlations,
    equidistant,
)
from flexband.uncertainty.inputs.fields.series import Series, decompose


def eole(correlation: Correlation, length: float, domain: tuple[float, float], nodes: int) -> Eole:
    """Return the EOLE expansion on equidistant nodes: the best estimate from the field there.

    Parameters
    ----------
    correlation : function of distance over length.
    length, domain, nodes : those of a `RandomField`.

    Raises
    ------
    InputError
        If an argument or the correlations at the nodes are impossible.
    """
    length, x = equidistant(correlation, length, domain, nodes)
    matrix = correlation_matrix(correlation, length, x)
    values, vectors = decompose(matrix, of_correlations=True)
    return Eole(correlation, length, domain, values, vectors, x)


@dataclass(frozen=True)
class Eole(Series):
    """û(x) = Σ ξ_i b_i(x), b_i(x) = ρ(x)ᵀ φ_i / √χ_i.

    χ_i and φ_i are eigenvalues and eigenvectors of the correlation matrix at `nodes`, x_1 … x_p.
    """

    nodes: np.ndarray

    def basis(self, x: np.ndarray) -> np.ndarray:
        """Return b_i at positions x, shape (terms, *x.shape), Eq. (29)."""
        rho = correlations(self.correlation, (np.asarray(x)[..., None] - self.nodes) / self.length)
        return np.moveaxis(rho @ self.eigenvectors / np.sqrt(self.eigenvalues), -1, 0)

    def places(self) -> np.ndarray:
        """Return the nodes and the positions halfway between them."""
        return np.sort(np.concatenate([self.nodes, (self.nodes[1:] + self.nodes[:-1]) / 2]))
