"""Families of orthogonal polynomials: one for each kind of standard random variable ξ.

A family is orthogonal with respect to the density of its variable, so E[P_j P_k] = γ_j δ_jk.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import factorial
from typing import Protocol

import numpy as np
from numpy.polynomial import hermite_e, legendre
from scipy.special import erf

from flexband.uncertainty.expansions.points.sequences import normal_sequence, uniform_sequence


class Family(Protocol):
    """The polynomials P_0 = 1, P_1, … of a standard random variable, and points for it.

    Those of variables that are not normal are at most one, or exceed it hardly ever.

    Another family is a frozen dataclass with these functions. An `Input` names its family.
    """

    @property
    def name(self) -> str:
        """Its name, for files."""
        ...

    @property
    def highest(self) -> int:
        """The highest order that an adaptive method uses."""
        ...

    @property
    def has_finite_bounds(self) -> bool:
        """Whether ξ has finite bounds."""
        ...

    @property
    def last_order(self) -> float:
        """The order of the last polynomial; infinite unless ξ has finitely many values."""
        ...

    def values(self, order: int, x: np.ndarray) -> np.ndarray:
        """Return P_0 … P_order at x, shape (*x.shape, order + 1)."""
        ...

    def norms(self, order: int) -> np.ndarray:
        """Return γ_j = E[P_j²], j = 0 … order, as in Eq. (15)."""
        ...

    def gauss(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the roots of P_count, and the weights with which they give expectations."""
        ...

    def sequence(self, count: int) -> np.ndarray:
        """Return the first nested points, of which the first q + 1 serve an order q, (count,)."""
        ...

    def of_normal(self, x: np.ndarray) -> np.ndarray:
        """Return the increasing function of a standard normal x that is distributed like ξ."""
        ...


@dataclass(frozen=True)
class Hermite:
    """He_j of a standard normal variable; nested points up to order 8 are within 4.2 std."""

    name: str = "Hermite"
    highest: int = 8
    has_finite_bounds: bool = False
    last_order: float = math.inf

    def values(self, order: int, x: np.ndarray) -> np.ndarray:
        return hermite_e.hermevander(x, order)

    def norms(self, order: int) -> np.ndarray:
        return np.array([float(factorial(j)) for j in range(order + 1)])

    def gauss(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        return _hermite_gauss(count)

    def sequence(self, count: int) -> np.ndarray:
        return normal_sequence(count)

    def of_normal(self, x: np.ndarray) -> np.ndarray:
        return x


@cache
def _hermite_gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    x, w = hermite_e.hermegauss(count)
    rule = x, w / w.sum()
    for array in rule:
        array.setflags(write=False)
    return rule


@dataclass(frozen=True)
class Legendre:
    """P_j of a variable that is uniform on [−1, 1]."""

    name: str = "Legendre"
    highest: int = 20
    has_finite_bounds: bool = True
    last_order: float = math.inf

    def values(self, order: int, x: np.ndarray) -> np.ndarray:
        return legendre.legvander(x, order)

    def norms(self, order: int) -> np.ndarray:
        return 1 / (2 * np.arange(order + 1.0) + 1)

    def gauss(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        x, w = legendre.leggauss(count)
        return x, w / w.sum()

    def sequence(self, count: int) -> np.ndarray:
        return uniform_sequence(count)

    def of_normal(self, x: np.ndarray) -> np.ndarray:
        return erf(x / np.sqrt(2))


HERMITE = Hermite()
LEGENDRE = Legendre()


def existing_terms(index: np.ndarray, families: Sequence[Family]) -> np.ndarray:
    """Return which terms of orders (terms, m + n), η first, have polynomials in every ξ."""
    last = np.array([family.last_order for family in families])
    return np.all(index[:, index.shape[1] - len(last) :] <= last, axis=1)


def mean_squares(index: np.ndarray, families: Sequence[Family]) -> np.ndarray:
    """Return E[Ψ²] of products of the orders `index`, shape (terms, n), shape (terms,)."""
    columns = zip(families, index.T, strict=True)
    norms = [family.norms(int(k.max()))[k] for family, k in columns]
    return np.stack([np.ones(len(index)), *norms]).prod(axis=0)


def transform(family: Family, order: int) -> np.ndarray:
    """Return the matrix from values at the `order + 1` Gauss points to coefficients."""
    nodes, weights = family.gauss(order + 1)
    return (family.values(order, nodes) * weights[:, None]).T / family.norms(order)[:, None]
