"""Expansions of a standardized random field: zero mean, unit variance, homogeneous, Gaussian.

The field is û(x) = Σ ξ_i b_i(x), with independent standard normal ξ_i.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from flexband.errors import InputError
from flexband.uncertainty.expansions.threads import in_threads
from flexband.uncertainty.inputs.fields.correlation import (
    Correlation,
    check_eigenvalues,
    correlations,
)


@dataclass(frozen=True)
class Series(ABC):
    """A truncated expansion on a domain."""

    # ρ as a function of distance over the correlation length
    correlation: Correlation
    length: float
    domain: tuple[float, float]  # start and end
    # the largest ones of a matrix, and vectors in columns
    eigenvalues: np.ndarray
    eigenvectors: np.ndarray

    def first(self, terms: int) -> Self:
        """Return the expansion with the first terms only; raise `InputError` if there are fewer."""
        if terms > len(self.eigenvalues):
            raise InputError(
                f"RandomField terms must be {len(self.eigenvalues)} or less here; got {terms}"
            )
        values = self.eigenvalues[:terms]
        vectors = self.eigenvectors[:, :terms]
        return replace(self, eigenvalues=values, eigenvectors=vectors)

    @abstractmethod
    def basis(self, x: np.ndarray) -> np.ndarray:
        """Return b_i at positions x, shape (terms, *x.shape)."""

    @abstractmethod
    def places(self) -> np.ndarray:
        """Return positions at which the error is judged, in increasing order."""

    def second_moments(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return Var[û(x)] and Cov[u, û], equal for best estimates, by terms, (terms, *x.shape)."""
        variance = np.cumsum(self.basis(x) ** 2, axis=0)
        return variance, variance

    def acceleration_error(self) -> float:
        """Return what û″ lacks of the variance of u″, relative to it, on average."""
        positions = 101  # where second differences are taken
        small_distance = 0.02  # between values of which they are taken, in correlation lengths
        start, end = self.domain
        h = min(small_distance * self.length, (end - start) / 8)
        x = np.linspace(start + h, end - h, positions) + h * np.arange(-1, 2)[:, None]
        before, center, after = np.moveaxis(self.basis(x), 1, 0)
        variance = np.mean(np.sum((before - 2 * center + after) ** 2, axis=0))
        rho = correlations(self.correlation, np.array([0.0, 1.0, 2.0]) * h / self.length)
        return 1 - float(variance / (rho @ [6.0, -8.0, 2.0]))


Discretization = Callable[[Correlation, float, tuple[float, float], int], Series]
"""``discretization(correlation, length, domain, nodes)``: the series with all its terms."""


def decompose(matrix: np.ndarray, *, of_correlations: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return eigenvalues above rounding, the largest first, and vectors; refuse negative ones."""
    smallest = 1e-12  # eigenvalue, relative to the largest, that is told from rounding
    decompositions = []
    in_threads(lambda square_matrix: decompositions.append(np.linalg.eigh(square_matrix)), [matrix])
    ((values, vectors),) = decompositions
    if of_correlations:
        check_eigenvalues(values)
    values = values[::-1]
    vectors = vectors[:, ::-1]
    usable = int(np.sum(values > smallest * values[0]))
    return values[:usable], vectors[:, :usable]
