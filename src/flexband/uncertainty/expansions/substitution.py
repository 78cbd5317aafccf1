"""Expansions in other variables: on a part of an interval, with less scatter, at a point.

A polynomial in x is one of the same order in x′ if x = c + r x′, so nothing is fitted again:
P_k(c + r x′) = Σ_j M_kj P_j(x′). A term that is a product takes the matrices of its variables one
after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.sparse import csr_array, eye_array

from flexband.errors import InputError
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.polynomials import chebyshev_values, chebyshev_zeros


@dataclass(frozen=True)
class Substitution:
    """What a standard variable is replaced by."""

    # gives M_kj, (order + 1, new orders + 1), for the order in the old variable
    matrix: Callable[[int], np.ndarray]
    remains: bool = True  # whether there is a new variable; if not, the old one is fixed
    # gives the mean square that M misses of each P_k, (order + 1,); None if nothing
    missed: Callable[[int], np.ndarray] | None = None


def interval_part(center: float, radius: float) -> Substitution:
    """Return η = center + radius η′."""

    def matrix(order: int) -> np.ndarray:
        x = chebyshev_zeros(order)
        old = chebyshev_values(order, center + radius * x)
        return np.linalg.solve(chebyshev_values(order, x), old).T

    return Substitution(matrix)


def fixed_interval(eta: float) -> Substitution:
    """Return η at a value."""
    return Substitution(lambda order: chebyshev_values(order, np.array([eta])).T, remains=False)


def fixed_random(family: Family, xi: float) -> Substitution:
    """Return ξ at a value."""
    return Substitution(lambda order: family.values(order, np.array([xi])).T, remains=False)


def random_part(
    old: Family,
    new: Family,
    function: Callable[[np.ndarray], np.ndarray],
    *,
    more_orders: int = 12,
    precision: float = 1e-9,
) -> Substitution:
    """Return ξ as a function of ξ′, whose polynomials are those of another family.

    Up to `more_orders` are added until the part `precision` of a mean square is missed at most.
    """

    @cache
    def project_polynomials(order: int) -> tuple[np.ndarray, np.ndarray]:
        matrix = missed = np.ones((1, 1))
        for new_order in range(order, order + more_orders + 1):
            x, weights = new.gauss(order + new_order + 2)
            values = old.values(order, function(x))
            new_values = new.values(new_order, x)
            norms = new.norms(new_order)
            matrix = (values * weights[:, None]).T @ new_values / norms
            square = weights @ values**2
            missed = square - matrix**2 @ norms
            if order == 0 or np.all(missed <= precision * square):
                break
        return matrix, np.maximum(missed, 0.0)

    return Substitution(
        lambda k: project_polynomials(k)[0], missed=lambda k: project_polynomials(k)[1]
    )


def substitute(
    expansion: HybridExpansion,
    substitutions: Mapping[int, Substitution],
    families: Sequence[Family],
) -> HybridExpansion:
    """Return an expansion in other variables, η first; refuse functions that are too curved."""
    for variable, substitution in substitutions.items():
        if substitution.missed is not None:
            _check_missed(expansion, substitution.missed, expansion.index[:, variable])
    index = expansion.index
    transform = eye_array(len(expansion.index), format="csr")
    for variable, substitution in substitutions.items():
        orders = index[:, variable]
        matrix = substitution.matrix(int(orders.max(initial=0)))
        size = np.abs(matrix)
        matrix = np.where(size > 1e-14 * size.max(), matrix, 0.0)  # the others are rounding
        term, order = np.nonzero(matrix[orders])
        new = index[term]
        new[:, variable] = order
        index, which = np.unique(
            np.concatenate([np.zeros_like(index[:1]), new]), axis=0, return_inverse=True
        )
        entries = matrix[orders[term], order], (which.ravel()[1:], term)
        transform = csr_array(entries, shape=(len(index), len(orders))) @ transform
    variables = [
        v for v in range(index.shape[1]) if v not in substitutions or substitutions[v].remains
    ]
    discs = tuple(variables.index(first) for first in expansion.discs if first in variables)
    coefficients = transform @ expansion.coefficients
    return HybridExpansion(tuple(families), index[:, variables], coefficients, discs)


def _check_missed(
    expansion: HybridExpansion,
    missed: Callable[[int], np.ndarray],
    orders: np.ndarray,
    largest_miss: float = 1e-3,
) -> None:
    """Raise `InputError` if terms miss more than a part of a series' root mean square."""
    square = expansion.coefficients**2
    part = missed(int(orders.max(initial=0)))[orders] @ square
    if np.any(part > largest_miss**2 * square.sum(axis=0)):
        raise InputError(
            "the new distribution is too different from the old one for the polynomials of the "
            "surrogate: run a study of the new inputs"
        )
