"""Downward closed sets of orders: which terms a sparse expansion has, and which come next."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

Orders = tuple[int, ...]
"""The order of a term in each variable, interval variables first."""


def first_terms(interval: int, random: int, count: int) -> np.ndarray:
    """Return the terms to begin with, shape (terms, variables).

    The constant, the first order in every variable, the second in random variables, the second in
    interval variables, then products of two variables, as far as `count` reaches.
    """
    d = interval + random
    one = np.eye(d, dtype=int)
    pairs = [one[a] + one[b] for b in range(d) for a in range(b)]
    second = 2 * np.concatenate([one[interval:], one[:interval]])
    index = np.concatenate([0 * one[:1], one, second, np.reshape(pairs, (-1, d)).astype(int)])
    return index[:count]


class TermSizes:
    """How large the terms of some parts are, and how large further ones are expected to be.

    A term counts as at least as large as any higher one, since what is even in a variable has no
    odd terms. With the rate r_v = max_k (a_k/a_0)^{1/k} of the orders k of a variable alone, where
    a_0 is one or more and r_v at most one, a term ν is expected to be

        a_ν = min_v max(a_{ν − e_v} r_v, a_{ν − 2 e_v} r_v²)   over the variables v it contains:

    the product of the decays where variables do not interact, what its lower terms tell otherwise.

    Parameters
    ----------
    index : orders of the known terms, a downward closed set, shape (terms, variables).
    sizes : theirs, in parts of the response's size, shape (parts, terms).
    """

    def __init__(self, index: np.ndarray, sizes: np.ndarray):
        self.sizes: dict[Orders, np.ndarray] = dict(
            zip(map(tuple, index.tolist()), sizes.T, strict=True)
        )
        for nu in sorted(self.sizes, key=sum, reverse=True):
            for v, k in enumerate(nu):
                if k:
                    lower = _moved(nu, v, -1)
                    self.sizes[lower] = np.maximum(self.sizes[lower], self.sizes[nu])
        constant = np.maximum(self.sizes[(0,) * index.shape[1]], 1.0)
        self.rates = np.zeros((index.shape[1], len(sizes)))
        for nu, size in self.sizes.items():
            if np.count_nonzero(nu) == 1:
                v = int(np.flatnonzero(nu)[0])
                rate = np.minimum(size / constant, 1.0) ** (1 / nu[v])
                self.rates[v] = np.maximum(self.rates[v], rate)

    def expected(self, nu: Orders) -> np.ndarray:
        """Return the size expected of a term whose lower ones are known, shape (parts,)."""
        found = np.full(self.rates.shape[1], np.inf)
        for v, k in enumerate(nu):
            if k:
                own = self.sizes[_moved(nu, v, -1)] * self.rates[v]
                if k > 1:
                    own = np.maximum(own, self.sizes[_moved(nu, v, -2)] * self.rates[v] ** 2)
                found = np.minimum(found, own)
        return found

    def total(self, index: np.ndarray) -> np.ndarray:
        """Return the sum of the sizes expected of further terms, each after those before it.

        Shape (parts,).
        """
        total = np.zeros(self.rates.shape[1])
        for nu in map(tuple, index.tolist()):
            self.sizes[nu] = self.expected(nu)
            total += self.sizes[nu]
        return total

    def next_terms(self, count: int, highest: np.ndarray) -> np.ndarray:
        """Return the further terms that are expected to be largest, shape (count, variables).

        Their lower terms are among the known or come before them. There are fewer where all terms
        up to the highest order of every variable are known.
        """
        known = self.sizes.copy()
        waiting = {nu: self._sum(nu) for mu in known for nu in self._above(mu, highest)}
        chosen: list[Orders] = []
        while waiting and len(chosen) < count:
            best = max(waiting, key=lambda nu: (waiting[nu], nu))
            del waiting[best]
            chosen.append(best)
            self.sizes[best] = self.expected(best)
            waiting |= {nu: self._sum(nu) for nu in self._above(best, highest)}
        self.sizes = known
        return np.array(chosen, dtype=int).reshape(len(chosen), len(self.rates))

    def _sum(self, nu: Orders) -> float:
        return float(self.expected(nu).sum())

    def _above(self, mu: Orders, highest: np.ndarray) -> Iterator[Orders]:
        """Yield the terms one order above μ whose lower ones are all there."""
        for v in range(len(mu)):
            nu = _moved(mu, v, 1)
            lower = (_moved(nu, w, -1) for w, k in enumerate(nu) if k)
            if nu[v] <= highest[v] and nu not in self.sizes and all(k in self.sizes for k in lower):
                yield nu


def _moved(nu: Orders, v: int, step: int) -> Orders:
    return (*nu[:v], nu[v] + step, *nu[v + 1 :])
