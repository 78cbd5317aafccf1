"""Which polynomials in η the smooth moments need: those whose coefficients can matter.

The smooth moments are E[P] and Cov[P, Q] of products P, Q of parts and of e^{iφ̃}, where φ̃ are the
terms of a phase that have some ξ. Coefficients of products are estimated from the sizes of those of
the factors: T_a T_b = (T_{a+b} + T_{|a−b|}) / 2 in every variable of both. So are those of the
average of e^{iφ̃}, as if φ̃ were normal: E|x|^k ≤ k! / k!! for x ~ N(0, 1).
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.sequences import interval_sequence
from flexband.uncertainty.phases.options import MOMENTS
from flexband.uncertainty.phases.terms import PartTerms


class Sizes(NamedTuple):
    """Sizes of coefficients: orders (terms, m), and a size for each."""

    orders: np.ndarray
    size: np.ndarray

    @staticmethod
    def of(index: np.ndarray, size: np.ndarray) -> Sizes:
        """Return the sum of what has the same orders, without what is zero."""
        index, size = index[size > 0], size[size > 0]
        order, first = _grouped(index)
        return Sizes(
            index[order[first]], np.add.reduceat(size[order], first) if len(first) else size
        )

    def plus(self, other: Sizes) -> Sizes:
        """Return the sums of sizes of the same orders."""
        return Sizes.of(*map(np.concatenate, zip(self, other, strict=True)))

    def times(self, other: Sizes) -> Sizes:
        """Return the sizes of the largest coefficients of a product."""
        both = (self.orders > 0).astype(float) @ (other.orders > 0).T.astype(float)
        size = self.size[:, None] * other.size * 0.5**both
        where = np.nonzero(size > 1e-3 * MOMENTS.negligible_term * size.max(initial=0.0))
        index = self.orders[where[0]] + other.orders[where[1]]
        return Sizes.of(index, size[where]).largest(2 * MOMENTS.max_terms)

    def largest(self, count: int) -> Sizes:
        chosen = np.argsort(-self.size, kind="stable")[:count]
        return Sizes(self.orders[chosen], self.size[chosen])


def _grouped(orders: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return an order of the rows in which equal ones follow each other, and where these start."""
    number = orders @ _weights(orders.shape[1])  # another one for each of the different orders
    order = np.argsort(number, kind="stable")
    number = number[order]
    return order, np.flatnonzero(np.append(len(number) > 0, number[1:] != number[:-1]))


@cache
def _weights(count: int) -> np.ndarray:
    """Return random weights with which sums of few orders differ, (count,)."""
    return np.random.default_rng(0).integers(1, 2**62, count)


def moment_orders(terms: PartTerms) -> np.ndarray:
    """Return orders of the polynomials for smooth moments, (polynomials, m), with all lower ones.

    Those of the expansion of the parts are among them, since phases are among the smooth moments.
    """
    m = terms.interval_dimension
    interval_index = terms.expansion.interval_index
    value, fluctuation, mixed, turned = _sizes(terms)
    turn = _of_exponential(mixed)
    mean = value.times(turn)
    fluctuation = fluctuation.plus(value.times(turned))
    variance = fluctuation.times(fluctuation).times(turn)
    varying = mean.size[mean.orders.any(axis=1)].sum() + fluctuation.size.sum()
    parts = [
        Sizes(mean.orders, mean.size / (varying or 1.0)),
        Sizes(variance.orders, variance.size / (variance.size.sum() or 1.0)),
    ]
    needed = Sizes(*map(np.concatenate, zip(*parts, strict=True)))
    needed = needed.orders[needed.size > MOMENTS.negligible_term]
    share = (needed / np.maximum(needed.max(axis=0, initial=0), 1)).sum(axis=1)
    part = 1.0
    while True:
        chosen = needed[share <= part * m]
        orders = closed(np.concatenate([np.zeros((1, m), int), interval_index, chosen]))
        if len(orders) <= MOMENTS.max_terms or not len(chosen):
            return orders
        part *= 0.9


def _sizes(terms: PartTerms) -> tuple[Sizes, Sizes, Sizes, Sizes]:
    """Return sizes of the outputs' parts, of those with ξ, and of the phases' with ξ, times 2.

    The third has the terms that also have η; without turning parts it is empty, and so is the last.
    """
    index, columns = terms.expansion.index[:, : terms.interval_dimension], terms.columns
    random = np.any(terms.random_orders > 0, axis=1)
    rms = np.abs(terms.coefficients) * np.sqrt(terms.expansion.norms)[terms.expansion.j, None]
    phase = random * rms[:, :, columns.phases].max(axis=(0, 2), initial=0.0)
    blocks = rms[:, :, columns.phase :].reshape(*rms.shape[:2], columns.carriers, columns.block)
    outputs = rms[:, :, : columns.outputs] + sum(
        blocks[:, :, :, first : first + columns.outputs].sum(axis=2)
        for first in (columns.real - columns.phase, columns.imag - columns.phase)
    )
    largest = outputs.sum(axis=1).max(axis=0)
    size = (outputs / np.where(largest > 0, largest, 1.0)).max(axis=(0, 2))
    phase = 0.0 * phase if terms.saturated else 2 * phase
    weights = (size, size * random, phase * index.any(axis=1), phase)
    value, fluctuation, mixed, turned = (
        Sizes.of(index, weight).largest(2 * MOMENTS.max_terms) for weight in weights
    )
    return value, fluctuation, mixed, turned


def _of_exponential(mixed: Sizes) -> Sizes:
    """Return sizes of the coefficients of E e^{iφ̃}."""
    unit = Sizes(np.zeros((1, mixed.orders.shape[1]), int), np.ones(1))
    total, power, before = unit, unit, 1.0
    factor = 1.0  # k!!
    for k in range(1, MOMENTS.max_powers):
        power = power.times(mixed)
        factor, before = k * before if k > 1 else 1.0, factor
        if not power.size.max(initial=0.0) > MOMENTS.negligible_term * factor:
            break
        total = total.plus(Sizes(power.orders, power.size / factor))
    return total


def closed(index: np.ndarray) -> np.ndarray:
    """Return orders together with all lower ones."""
    for v in range(index.shape[1]):
        steps = (index - k * (np.arange(index.shape[1]) == v) for k in range(index[:, v].max() + 1))
        lower = np.concatenate(list(steps))
        lower = lower[lower[:, v] >= 0]
        order, first = _grouped(lower)
        index = lower[order[first]]
    return index[np.lexsort(index.T[::-1])] if index.shape[1] else index[:1]


def smooth_moments(terms: PartTerms) -> tuple[HybridExpansion, np.ndarray]:
    """Return polynomials in η, and their coefficients in the table of smooth moments.

    The expansion has the polynomials only, of shape (times, terms, width) are the coefficients.
    """
    polynomials, eta, inverse = moment_polynomials(terms)
    table = terms.table(eta)
    for at_one_time in table:  # in place: the tables of all threads take more than the runs
        at_one_time[:] = inverse @ at_one_time
    return polynomials, table


def moment_polynomials(terms: PartTerms) -> tuple[HybridExpansion, np.ndarray, np.ndarray]:
    """Return the polynomials in η of smooth moments, and how values give their coefficients.

    They are an expansion that has the polynomials only; the points η, shape (terms, m), of the
    values; and the matrix from values to coefficients.
    """
    index = moment_orders(terms)
    eta = interval_sequence(int(index.max(initial=0)) + 1)[index]
    polynomials = HybridExpansion((), index, np.zeros((len(index), 0)))
    return polynomials, eta, np.linalg.inv(polynomials.chebyshev(eta)[:, polynomials.i])
