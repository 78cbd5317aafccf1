"""Downward closed sets of orders: the terms of a sparse expansion, and those to add next."""

from __future__ import annotations

import itertools
import math
from collections.abc import Container, Iterator

import numpy as np

from flexband.basics.words import number_of
from flexband.errors import InputError

Orders = tuple[int, ...]
"""The order of a term in each variable, interval variables first."""

ROUNDING_DIGITS = 12
"""Sizes of terms, relative to the response, are rounded to so many digits after the point."""


def first_terms(interval: int, random: int, count: int) -> np.ndarray:
    """Return the first terms of a sparse expansion, shape (terms, variables).

    These are the constant, order 1 in every variable, order 2 in random variables, order 2 in
    interval variables, then products of two variables.
    """
    d = interval + random
    unit = np.eye(d, dtype=int)
    pairs = [unit[a] + unit[b] for b in range(d) for a in range(b)]
    second = 2 * np.concatenate([unit[interval:], unit[:interval]])
    index = np.concatenate([0 * unit[:1], unit, second, np.reshape(pairs, (-1, d)).astype(int)])
    return index[:count]


def bounded_terms(dimension: int, order: int, q_norm: float, max_terms: int) -> np.ndarray:
    """Return the terms ν with Σ ν_v^q ≤ p^q, 0 < q ≤ 1, the constant first, at most `max_terms`."""
    sizes = [(k, (k / order) ** q_norm) for k in range(1, order + 1)]

    def extend_term(orders: Orders, remaining: float) -> Iterator[Orders]:
        """Yield these orders of the variables of a term, and those with further variables."""
        yield orders
        if len(orders) < dimension:
            for k, size in itertools.takewhile(lambda pair: pair[1] <= remaining, sizes):
                yield from extend_term((*orders, k), remaining - size)

    # Count the terms before they are made.
    order_tuples = []
    terms = 0
    for orders in extend_term((), 1 + 1e-9):
        order_tuples.append(orders)
        terms += math.comb(dimension, len(orders))
        if terms > max_terms:
            raise InputError(
                f"order {order} with q_norm {q_norm:g} has more than "
                f"{number_of(max_terms, 'term')} in {number_of(dimension, 'variable')}; "
                "choose a lower order or a smaller q_norm"
            )
    # Assign the orders to all combinations of variables.
    index = []
    for orders in sorted(order_tuples, key=lambda orders: (sum(orders), len(orders), orders)):
        combinations = list(itertools.combinations(range(dimension), len(orders)))
        rows = np.zeros((len(combinations), dimension), dtype=int)
        np.put_along_axis(rows, np.array(combinations, dtype=int), np.array([orders], int), axis=1)
        index.append(rows)
    return np.concatenate(index)


def lower_terms(nu: Orders) -> Iterator[Orders]:
    """Yield all terms that divide a term, the constant first and the term itself last."""
    yield from itertools.product(*(range(k + 1) for k in nu))


def above(terms: set[Orders]) -> set[Orders]:
    """Return the terms one order above a downward closed set that would leave it so."""
    neighbours = {_move(mu, v, 1) for mu in terms for v in range(len(mu))} - terms
    return {nu for nu in neighbours if _is_next(nu, terms)}


def _is_next(nu: Orders, terms: Container[Orders]) -> bool:
    return all(_move(nu, v, -1) in terms for v, k in enumerate(nu) if k)


class TermSizes:
    """The sizes of known terms of some parts, and the expected sizes of further terms.

    The orders of the known ones, `index`, (terms, variables), are a downward closed set; their
    `sizes` are relative to the response, (parts, terms). A term counts as at least as large as any
    higher term, since an even function has no odd terms. With the rate r_v = max_k (a_k/a_0)^{1/k}
    of the terms of order k in variable v alone, where a_0 is at least one and r_v at most one, the
    expected size of a term ν is

        a_ν = min_v max(a_{ν − e_v} r_v, a_{ν − 2 e_v} r_v²)   over the variables v it contains.

    If variables do not interact, this is the product of their decays. Sizes count up to rounding:
    of equal terms those of the lowest total order come first.
    """

    def __init__(self, index: np.ndarray, sizes: np.ndarray):
        self.sizes: dict[Orders, np.ndarray] = dict(
            zip(map(tuple, index.tolist()), sizes.T.round(ROUNDING_DIGITS), strict=True)
        )
        for nu in sorted(self.sizes, key=sum, reverse=True):
            for v, k in enumerate(nu):
                if k:
                    below = _move(nu, v, -1)
                    self.sizes[below] = np.maximum(self.sizes[below], self.sizes[nu])
        constant = np.maximum(self.sizes[(0,) * index.shape[1]], 1.0)
        self.rates = np.zeros((index.shape[1], len(sizes)))
        for nu, size in self.sizes.items():
            if np.count_nonzero(nu) == 1:
                v = int(np.flatnonzero(nu)[0])
                rate = np.minimum(size / constant, 1.0) ** (1 / nu[v])
                self.rates[v] = np.maximum(self.rates[v], rate)

    def estimate_size(self, nu: Orders) -> np.ndarray:
        """Estimate the size of a term from those of its lower terms, shape (parts,)."""
        size = np.full(self.rates.shape[1], np.inf)
        for v, k in enumerate(nu):
            if k:
                estimate = self.sizes[_move(nu, v, -1)] * self.rates[v]
                if k > 1:
                    estimate = np.maximum(
                        estimate, self.sizes[_move(nu, v, -2)] * self.rates[v] ** 2
                    )
                size = np.minimum(size, estimate)
        return size

    def total(self, index: np.ndarray) -> np.ndarray:
        """Return the sum of the expected sizes of further terms, lower ones first, (parts,)."""
        total = np.zeros(self.rates.shape[1])
        for nu in map(tuple, index.tolist()):
            self.sizes[nu] = self.estimate_size(nu)
            total += self.sizes[nu]
        return total

    def next_terms(self, count: int, highest: np.ndarray) -> np.ndarray:
        """Return further terms of the largest expected sizes, as far as there are, lower first."""
        old_sizes = self.sizes.copy()
        candidates = {nu: self._sum(nu) for mu in old_sizes for nu in self._above(mu, highest)}
        new_terms: list[Orders] = []
        while candidates and len(new_terms) < count:
            best = max(candidates, key=lambda nu: (candidates[nu], -sum(nu), nu))
            del candidates[best]
            new_terms.append(best)
            self.sizes[best] = self.estimate_size(best)
            candidates |= {nu: self._sum(nu) for nu in self._above(best, highest)}
        self.sizes = old_sizes
        return np.array(new_terms, dtype=int).reshape(len(new_terms), len(self.rates))

    def _sum(self, nu: Orders) -> float:
        return round(float(self.estimate_size(nu).sum()), ROUNDING_DIGITS)

    def _above(self, mu: Orders, highest: np.ndarray) -> Iterator[Orders]:
        """Yield the terms one order above μ whose lower terms are all known."""
        for v in range(len(mu)):
            nu = _move(mu, v, 1)
            if nu[v] <= highest[v] and nu not in self.sizes and _is_next(nu, self.sizes):
                yield nu


def _move(nu: Orders, v: int, step: int) -> Orders:
    return (*nu[:v], nu[v] + step, *nu[v + 1 :])
