"""The hybrid expansion of a response in Chebyshev and Hermite polynomials, Eq. (11)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np

from flexband.uncertainty.polynomials import (
    chebyshev_derivative,
    chebyshev_values,
    hermite_nodes,
    hermite_norms,
    hermite_transform,
    hermite_values,
)


def tensor_points(nodes: np.ndarray, dimension: int) -> np.ndarray:
    """Return the tensor product of the nodes, shape (count**dimension, dimension)."""
    grid = np.meshgrid(*[nodes] * dimension, indexing="ij")
    return np.stack(grid, axis=-1).reshape(-1, dimension) if dimension else np.zeros((1, 0))


def tensor_values(values: list[np.ndarray]) -> np.ndarray:
    """Return products of one-dimensional values: (points, count) each to (points, Π count)."""

    def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return (a[:, :, None] * b[:, None, :]).reshape(len(a), a.shape[1] * b.shape[1])

    return reduce(product, values)


@dataclass(frozen=True)
class HybridExpansion:
    """The surrogate Σ_ij β_ij Φ_i(η) Ψ_j(ξ) of a response, Eq. (11).

    Attributes
    ----------
    random_order, interval_order : k and q, per variable.
    random_dimension, interval_dimension : n and m.
    coefficients : β, shape ((q+1)^m, (k+1)^n, series): all times and outputs side by side.
    """

    random_order: int
    interval_order: int
    random_dimension: int
    interval_dimension: int
    coefficients: np.ndarray

    @staticmethod
    def design(
        random_order: int, interval_nodes: np.ndarray, n: int, m: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return ξ and η of all runs, shapes (runs, n) and (runs, m); ξ varies fastest."""
        xi = tensor_points(hermite_nodes(random_order), n)
        eta = tensor_points(interval_nodes, m)
        return np.tile(xi, (len(eta), 1)), np.repeat(eta, len(xi), axis=0)

    @staticmethod
    def fit(
        values: np.ndarray, random_order: int, interval_nodes: np.ndarray, n: int, m: int
    ) -> HybridExpansion:
        """Return the expansion through the values, shape (runs, series), of `design`.

        There are as many points as terms, so the least squares of Eq. (12) interpolate, and the
        inverse factors by dimension: a small matrix for each variable in turn.
        """
        q = len(interval_nodes) - 1
        to_hermite = hermite_transform(random_order)
        to_chebyshev = np.linalg.inv(chebyshev_values(q, interval_nodes))
        beta, before = values, 1
        for transform in [to_chebyshev] * m + [to_hermite] * n:
            beta = transform @ beta.reshape(before, len(transform), -1)
            before *= len(transform)
        beta = beta.reshape((q + 1) ** m, (random_order + 1) ** n, -1)
        return HybridExpansion(random_order, q, n, m, beta)

    @property
    def norms(self) -> np.ndarray:
        """γ_j of Eq. (15), products over the random variables."""
        one = hermite_norms(self.random_order)[None]
        return tensor_values([np.ones((1, 1)), *[one] * self.random_dimension])[0]

    @property
    def weighted(self) -> np.ndarray:
        """The coefficients times √γ_j: of these σ² is a sum of squares."""
        return self.coefficients * np.sqrt(self.norms)[:, None]

    def chebyshev(self, eta: np.ndarray) -> np.ndarray:
        """Return Φ_i at η of shape (points, m), shape (points, M)."""
        one = np.ones((len(eta), 1))
        return tensor_values([one, *(chebyshev_values(self.interval_order, x) for x in eta.T)])

    def chebyshev_gradient(self, eta: np.ndarray) -> np.ndarray:
        """Return Φ_i and its derivatives by each η_a at η, shape (points, 1 + m, M)."""
        one, m = np.ones((len(eta), 1)), self.interval_dimension
        D = chebyshev_derivative(self.interval_order)
        values = [(T, T @ D) for T in chebyshev_values(self.interval_order, eta.T)]
        parts = [[v[a == b] for b, v in enumerate(values)] for a in range(-1, m)]
        return np.stack([tensor_values([one, *part]) for part in parts], axis=1)

    def evaluate(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the surrogate at points of shape (points, n) and (points, m)."""
        one = np.ones((len(xi), 1))
        hermite = [hermite_values(self.random_order, x) for x in xi.T]
        psi = tensor_values([one, *hermite])
        return np.einsum("pi,pj,ijs->ps", self.chebyshev(eta), psi, self.coefficients)

    def moments(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return μ(η) and σ(η), each of shape (points, series), Eqs. (15) and (18)."""
        phi = self.chebyshev(eta)
        M, N, series = self.coefficients.shape
        terms = (phi @ self.weighted.reshape(M, -1)).reshape(-1, N, series)
        random = terms[:, 1:]
        return terms[:, 0], np.sqrt(np.einsum("pjs,pjs->ps", random, random))

    def truncation(self) -> np.ndarray:
        """Return the size of the terms of highest order in some variable, shape (series,).

        With |T_i| ≤ 1 it bounds their part in mean and standard deviation, and is of the order of
        the first terms left out where the series converges. Zero orders are not counted.
        """
        shape = (self.interval_order + 1,) * self.interval_dimension
        shape += (self.random_order + 1,) * self.random_dimension
        index = np.indices(shape).reshape(len(shape), -1)
        orders = np.array(shape)[:, None] - 1
        highest = np.any((index == orders) & (orders > 0), axis=0)
        size = np.abs(self.weighted)
        return size.reshape(highest.size, -1)[highest].sum(axis=0)
