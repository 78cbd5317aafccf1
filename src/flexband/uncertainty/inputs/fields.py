"""Discretization of random fields by expansion optimal linear estimation (EOLE).

Li and Der Kiureghian (1993); Eqs. (29)–(31), with the correlation matrix of unit variance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexband.errors import InputError

Correlation = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Eole:
    """A field of zero mean and unit variance as Σ ξ_i b_i(x), b_i(x) = ρ(x)ᵀ φ_i / √χ_i.

    Attributes
    ----------
    correlation, length : ρ as a function of distance over length [m].
    nodes : positions x_1 … x_p [m].
    eigenvalues, eigenvectors : χ_i, the largest of the correlation matrix, and φ_i in columns.
    """

    correlation: Correlation
    length: float
    nodes: np.ndarray
    eigenvalues: np.ndarray
    eigenvectors: np.ndarray

    @staticmethod
    def on(
        nodes: np.ndarray,
        correlation: Correlation,
        length: float,
        terms: int | None,
        tolerance: float,
    ) -> Eole:
        """Return the expansion with `terms` terms, or as many as `tolerance` asks for.

        The tolerance is on the largest variance error at the nodes and halfway between them.

        Raises
        ------
        InputError
            Where the nodes allow no such expansion.
        """
        matrix = correlation((nodes[:, None] - nodes) / length)
        values, vectors = np.linalg.eigh(matrix)
        values, vectors = values[::-1], vectors[:, ::-1]
        usable = int(np.sum(values > 1e-12 * values[0]))
        full = Eole(correlation, length, nodes, values[:usable], vectors[:, :usable])
        if terms is None:
            places = np.sort(np.concatenate([nodes, (nodes[1:] + nodes[:-1]) / 2]))
            errors = 1 - np.cumsum(full.basis(places) ** 2, axis=0)
            enough = np.flatnonzero(errors.max(axis=1) <= tolerance)
            if not len(enough):
                raise InputError(
                    f"RandomField tolerance {tolerance:g} on the variance error is not met by "
                    f"{usable} terms on {len(nodes)} nodes; the best is {errors.max(1).min():.3g}"
                )
            terms = int(enough[0]) + 1
        if terms > usable:
            raise InputError(f"RandomField terms must be {usable} or less here; got {terms}")
        return Eole(correlation, length, nodes, values[:terms], vectors[:, :terms])

    @property
    def terms(self) -> int:
        """Number of standard normal variables."""
        return len(self.eigenvalues)

    def basis(self, x: np.ndarray) -> np.ndarray:
        """Return b_i at positions x [m], shape (terms, *x.shape), Eq. (29)."""
        rho = self.correlation((np.asarray(x)[..., None] - self.nodes) / self.length)
        return np.moveaxis(rho @ self.eigenvectors / np.sqrt(self.eigenvalues), -1, 0)

    def variance_error(self, x: np.ndarray) -> np.ndarray:
        """Return the variance that the expansion lacks at x, as a part of the whole, Eq. (31)."""
        return 1 - np.sum(self.basis(x) ** 2, axis=0)
