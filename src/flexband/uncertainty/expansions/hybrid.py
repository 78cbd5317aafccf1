"""The hybrid expansion of a response in Chebyshev and orthogonal polynomials, Eq. (11)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce

import numpy as np

from flexband.errors import InputError
from flexband.uncertainty.expansions.families import Family, mean_squares, transform
from flexband.uncertainty.expansions.polynomials import chebyshev_values


def tensor_points(nodes: Sequence[np.ndarray]) -> np.ndarray:
    """Return the tensor product of nodes, one array per variable, shape (Π count, variables)."""
    points = np.zeros((1, 0))
    for coordinates in nodes:
        points = np.column_stack(
            [np.repeat(points, len(coordinates), axis=0), np.tile(coordinates, len(points))]
        )
    return points


def tensor_values(values: list[np.ndarray]) -> np.ndarray:
    """Return products of one-dimensional values: (points, count) each to (points, Π count)."""

    def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return (a[:, :, None] * b[:, None, :]).reshape(len(a), a.shape[1] * b.shape[1])

    return reduce(product, values)


def tensor_index(orders: Sequence[int]) -> np.ndarray:
    """Return the order in each variable of all products up to these, (Π (order+1), variables)."""
    return tensor_points([np.arange(k + 1) for k in orders]).astype(int)


def term_values(values: Iterable[np.ndarray], index: np.ndarray, points: int) -> np.ndarray:
    """Return the products Π_v values[v][:, index[:, v]], shape (points, terms)."""
    factors = (factors[:, k] for factors, k in zip(values, index.T, strict=True))
    return reduce(np.multiply, factors, np.ones((points, 1)))


def transform_tensor(values: np.ndarray, matrices: Sequence[np.ndarray]) -> np.ndarray:
    """Apply one matrix per factor to values (Π columns, series) on a tensor product."""
    before = 1
    for matrix in matrices:
        blocks = values.reshape(before, matrix.shape[1], -1)
        if before == 1 or len(matrix) != matrix.shape[1]:
            values = matrix @ blocks
        else:  # in place, since it may take as much memory as all runs
            for part in blocks:
                part[:] = matrix @ part
        before *= len(matrix)
    return values.reshape(before, -1)


def map_in_place(
    values: np.ndarray, function: Callable[[np.ndarray], np.ndarray], at_once: int = 4096
) -> np.ndarray:
    """Replace the columns of values by a function of them, `at_once` columns at a time."""
    for first in range(0, values.shape[1], at_once):
        columns = values[:, first : first + at_once]
        columns[:] = function(columns)
    return values


@dataclass(frozen=True)
class HybridExpansion:
    """The surrogate Σ β_ij Φ_i(η) Ψ_j(ξ) of a response, Eq. (11), of some of the products."""

    families: tuple[Family, ...]  # the polynomials of each random variable
    # orders of each term Φ_i Ψ_j in each variable, η first, shape (terms, variables); the first
    # term is the constant
    index: np.ndarray
    coefficients: np.ndarray  # β, shape (terms, series). All outputs and times are series.
    # numbers of the first η of each pair that is in a disc, see `discs`
    discs: tuple[int, ...] = ()

    @cached_property
    def _interval(self) -> tuple[np.ndarray, np.ndarray]:
        return _products(self.index[:, : self.interval_dimension])

    @cached_property
    def _random(self) -> tuple[np.ndarray, np.ndarray]:
        return _products(self.index[:, self.interval_dimension :])

    @property
    def interval_index(self) -> np.ndarray:
        """The order of every Chebyshev polynomial in Φ_i, shape (M, m); Φ_0 = 1."""
        return self._interval[0]

    @property
    def random_index(self) -> np.ndarray:
        """The order of the polynomial of each random variable in Ψ_j, shape (N, n); Ψ_0 = 1."""
        return self._random[0]

    @property
    def i(self) -> np.ndarray:
        """The number of Φ_i of each term."""
        return self._interval[1]

    @property
    def j(self) -> np.ndarray:
        """The number of Ψ_j of each term."""
        return self._random[1]

    @cached_property
    def orders(self) -> tuple[int, ...]:
        """The highest order in each variable, η first."""
        return tuple(self.index.max(axis=0, initial=0).tolist())

    @property
    def random_orders(self) -> tuple[int, ...]:
        """The highest order k of every random variable."""
        return self.orders[self.interval_dimension :]

    @property
    def interval_orders(self) -> tuple[int, ...]:
        """The highest order q of every interval variable."""
        return self.orders[: self.interval_dimension]

    def highest(self) -> np.ndarray:
        """Return which terms are of the highest order in a variable, (variables, terms)."""
        return ((self.index == self.orders) & (self.index > 0)).T

    @property
    def interval_dimension(self) -> int:
        """Number m of variables η."""
        return self.index.shape[1] - len(self.families)

    @staticmethod
    def design(
        families: Sequence[Family],
        random_orders: Sequence[int],
        interval_nodes: Sequence[np.ndarray],
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return ξ, (runs, n), roots of degree k + 1, Eq. (13), and η, (runs, m); ξ first."""
        variables = zip(families, random_orders, strict=True)
        xi = tensor_points([family.gauss(k + 1)[0] for family, k in variables])
        eta = tensor_points(interval_nodes)
        return np.tile(xi, (len(eta), 1)), np.repeat(eta, len(xi), axis=0)

    @staticmethod
    def fit(
        values: np.ndarray,
        families: Sequence[Family],
        random_orders: Sequence[int],
        interval_nodes: Sequence[np.ndarray],
        *,
        overwrite: bool = False,
    ) -> HybridExpansion:
        """Return the expansion through the values, shape (runs, series), of `design`.

        There are as many points as terms, so the least squares of Eq. (12) interpolate, and the
        inverse is a product of small matrices, one per variable. `overwrite` puts coefficients into
        `values`.
        """
        transforms = [
            *(np.linalg.inv(chebyshev_values(len(x) - 1, x)) for x in interval_nodes),
            *map(transform, families, random_orders),
        ]
        index = tensor_index([*(len(x) - 1 for x in interval_nodes), *random_orders])
        if overwrite:
            values = map_in_place(values, lambda columns: transform_tensor(columns, transforms))
        else:
            values = transform_tensor(values, transforms)
        return HybridExpansion(tuple(families), index, values)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the arrays that a file keeps, with the families by name."""
        names = np.array([family.name for family in self.families], dtype=str)
        arrays = {"families": names, "index": self.index, "coefficients": self.coefficients}
        return arrays | ({"discs": np.array(self.discs)} if self.discs else {})

    @staticmethod
    def of_arrays(
        inputs: Sequence[Family], families: np.ndarray, discs: Iterable[int] = (), **arrays
    ) -> HybridExpansion:
        """Return the expansion of `arrays`; the families must be those of its inputs."""
        if families.tolist() != [family.name for family in inputs]:
            raise InputError(
                f"families of an expansion must be those of its inputs; got {families}"
            )
        return HybridExpansion(tuple(inputs), **arrays, discs=tuple(map(int, discs)))

    def __add__(self, other: HybridExpansion) -> HybridExpansion:
        """Return the sum of two expansions of the same variables and series."""
        joint_index = np.concatenate([self.index, other.index])
        index, which = np.unique(joint_index, axis=0, return_inverse=True)
        coefficients = np.zeros((len(index), self.coefficients.shape[1]))
        rows = np.split(which.ravel(), [len(self.index)])
        for row, terms in zip(rows, (self.coefficients, other.coefficients), strict=True):
            coefficients[row] += terms
        discs = self.discs or other.discs
        return replace(self, index=index, coefficients=coefficients, discs=discs)

    def __mul__(self, factor: float | np.ndarray) -> HybridExpansion:
        """Return the expansion of the series times a factor, or times one factor each."""
        return replace(self, coefficients=factor * self.coefficients)

    def to_hybrid(self) -> HybridExpansion:
        """Return the expansion itself, which has its coefficients."""
        return self

    def of_rows(self, rows: int, which: np.ndarray, times: slice | np.ndarray) -> HybridExpansion:
        """Return the expansion of some rows, increasing, and times of its series (rows, times)."""
        coefficients = self.coefficients.reshape(len(self.index), rows, -1)[..., times]
        coefficients = coefficients if len(which) == rows else coefficients[:, which]
        return replace(self, coefficients=coefficients.reshape(len(coefficients), -1))

    def embed_rows(self, rows: int, total_rows: int, places: np.ndarray) -> HybridExpansion:
        """Return an expansion of `total_rows` rows: this one's at `places`, zero elsewhere."""
        series = self.coefficients.reshape(len(self.index), rows, -1)
        coefficients = np.zeros((len(series), total_rows, series.shape[2]))
        coefficients[:, places] = series
        return replace(self, coefficients=coefficients.reshape(len(coefficients), -1))

    def constant(self, values: np.ndarray | float) -> HybridExpansion:
        """Return the expansion of constant series."""
        series = np.broadcast_to(values, (1, self.coefficients.shape[1])).astype(float)
        return replace(self, index=self.index[:1], coefficients=series)

    @property
    def norms(self) -> np.ndarray:
        """γ_j of Eq. (15), products over the random variables."""
        return mean_squares(self.random_index, self.families)

    @property
    def orthonormal_coefficients(self) -> np.ndarray:
        """The coefficients of orthonormal Ψ_j, times √γ_j: σ² is a sum of their squares."""
        return self.coefficients * np.sqrt(self.norms)[self.j, None]

    def chebyshev(self, eta: np.ndarray) -> np.ndarray:
        """Return Φ_i at η of shape (points, m), shape (points, M)."""
        values = map(chebyshev_values, self.interval_orders, eta.T)
        return term_values(values, self.interval_index, len(eta))

    def orthogonal(self, xi: np.ndarray) -> np.ndarray:
        """Return Ψ_j at ξ of shape (points, n), shape (points, N)."""
        variables = zip(self.families, self.random_orders, xi.T, strict=True)
        values = (family.values(k, x) for family, k, x in variables)
        return term_values(values, self.random_index, len(xi))

    def terms(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return Φ_i Ψ_j at points of shape (points, n) and (points or 1, m), (points, terms)."""
        return self.chebyshev(eta)[:, self.i] * self.orthogonal(xi)[:, self.j]

    def evaluate(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the surrogate at points of shape (points, n) and (points or 1, m)."""
        # The threads of the linear algebra library would wait busily for more work, for longer than
        # so few multiplications take, on cores that others can use.
        if len(xi) * self.coefficients.size < 2**24:
            return self.evaluate_in_thread(xi, eta)
        return self.terms(xi, eta) @ self.coefficients

    def evaluate_in_thread(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return what `evaluate` does, in this thread alone, so that several can work at once."""
        terms = self.terms(xi, eta)
        coefficients = self.coefficients
        values = np.empty((len(terms), coefficients.shape[1]))
        height = 32  # libraries leave products of up to 2¹⁸ multiplications to one thread
        width = max(1, 2**18 // (height * len(coefficients)))
        block_end = len(terms) // height * height
        blocks = terms[:block_end].reshape(-1, height, terms.shape[1])
        for first in range(0, values.shape[1], width):
            columns = slice(first, first + width)
            factors = coefficients[:, columns]
            part = values[:, columns]
            shape = len(blocks), height, factors.shape[1]
            np.matmul(blocks, factors, out=part[:block_end].reshape(shape))
            part[block_end:] = terms[block_end:] @ factors
        return values

    def moments(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return μ(η) and σ(η), each of shape (points, series), Eqs. (15) and (18)."""
        phi = self.chebyshev(eta)[:, self.i]
        factors = np.empty((len(self.random_index), len(phi), self.coefficients.shape[1]))
        for j, factor in enumerate(factors):
            mask = self.j == j
            factor[:] = phi[:, mask] @ self.coefficients[mask]
        return factors[0], np.sqrt(np.einsum("j,jps,jps->ps", self.norms[1:], *[factors[1:]] * 2))

    def truncation(self) -> np.ndarray:
        """Return the size of the terms of highest order in some variable, shape (series,).

        Since |T_i| ≤ 1, it bounds their contribution to mean and standard deviation. Zero orders do
        not count.
        """
        return self.size_of(np.asarray(self.highest().any(axis=0)))

    def size_of(self, which: np.ndarray) -> np.ndarray:
        """Return the sum of the sizes of some terms, shape (series,)."""
        weight = np.sqrt(self.norms)[self.j[which], None]
        count = self.coefficients.shape[1]
        parts = np.array_split(self.coefficients, max(1, count // 1024), axis=1)
        return np.concatenate([np.abs(part[which] * weight).sum(axis=0) for part in parts])


def _products(index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the different rows of an index, in order, and the number of each row."""
    with_zero = np.pad(index, ((0, 0), (0, 1)))  # so that there is at least one variable
    rows, which = np.unique(with_zero, axis=0, return_inverse=True)
    return rows[:, :-1], which.ravel()
