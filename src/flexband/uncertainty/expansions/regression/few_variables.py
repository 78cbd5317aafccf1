"""Which few of many variables matter: those whose polynomials explain most of the runs.

If a response depends on a few of many variables, regression has far more terms to choose from than
runs, and a product of two variables that do nothing alone is one of thousands. A few variables
have few terms: four have 35 up to the order three. So sets of variables are compared, each with all
of its terms: pairs first, and then the best sets with one more variable each.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, product
from typing import NamedTuple

import numpy as np


class SetSearchOptions(NamedTuple):
    """How many sets of variables are compared."""

    max_variables: int = 40  # of which pairs are compared
    beam: int = 40  # best sets that get one more variable
    sizes: tuple[int, ...] = (2, 3, 4, 5)
    orders: tuple[int, ...] = (3, 2)  # total orders of the terms of a set, the first that is few
    spare: int = 5  # runs beyond the terms of a set
    max_series: int = 8  # that are explained
    at_once: int = 200_000  # values of terms


def sets_of_variables(
    index: np.ndarray,
    values: np.ndarray,
    y: np.ndarray,
    *,
    options: SetSearchOptions = SetSearchOptions(),
) -> Iterator[np.ndarray]:
    """Yield the best sets of two, three, … variables, by number.

    Parameters
    ----------
    index, values : orders of candidates, (candidates, variables), and their values, (runs, …).
    y : series to be explained, (runs, series), in the order of increasing energy.
    """
    runs = len(y)
    count = index.shape[1]
    if count > options.max_variables:
        return
    y = y[:, -options.max_series :]
    alone = {
        order: np.stack([_values(index, values, v, order) for v in range(count)], axis=1)
        for order in range(1, max(options.orders) + 1)
    }
    best = np.array(list(combinations(range(count), 2)), dtype=int).reshape(-1, 2)
    for size in options.sizes:
        if size > 2:
            larger = {
                tuple(sorted((*s, v))) for s in best.tolist() for v in range(count) if v not in s
            }
            best = np.array(sorted(larger), dtype=int).reshape(-1, size)
        terms = next(
            (t for t in map(_orders, options.orders, [size] * 2) if len(t) + options.spare < runs),
            None,
        )
        if terms is None or not len(best):
            return
        at_once = max(1, options.at_once // (runs * (len(terms) + 1)))
        residuals = [
            _rest(alone, best[k : k + at_once], terms, y) for k in range(0, len(best), at_once)
        ]
        best = best[np.argsort(np.concatenate(residuals), kind="stable")[: options.beam]]
        yield best[0]


def _orders(highest: int, variables: int) -> np.ndarray:
    """Return the orders of all terms but the constant, (terms, variables)."""
    orders = np.array(list(product(range(highest + 1), repeat=variables)))
    return orders[(orders.sum(axis=1) > 0) & (orders.sum(axis=1) <= highest)]


def _values(index: np.ndarray, values: np.ndarray, variable: int, order: int) -> np.ndarray:
    """Return the polynomial of one variable, of the highest order up to the given one, (runs,)."""
    alone = (np.count_nonzero(index, axis=1) == 1) & (index[:, variable] > 0)
    usable = np.flatnonzero(alone & (index[:, variable] <= order))
    return values[:, usable[np.argmax(index[usable, variable])]]


def _rest(
    alone: dict[int, np.ndarray], sets: np.ndarray, terms: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """Return what all terms of each set leave of the series, (sets,)."""
    A = np.ones((len(sets), len(y), len(terms) + 1))
    for column, orders in enumerate(terms, start=1):
        for variable, order in enumerate(orders.tolist()):
            if order:
                A[:, :, column] *= alone[order][:, sets[:, variable]].T
    Q = np.linalg.qr(A)[0]
    residual = y - Q @ (np.swapaxes(Q, 1, 2) @ y)
    return np.sum(residual**2, axis=(1, 2))
