"""Which polynomials in η the smooth moments need: those whose coefficients can matter.

The smooth moments are E[P] and Cov[P, Q] of products P, Q of parts and of e^{iφ̃}, where φ̃ are the
terms of a phase that have some ξ. Coefficients of products are estimated from the sizes of those of
the factors: T_a T_b = (T_{a+b} + T_{|a−b|}) / 2 in every variable of both. So are those of the
average of e^{iφ̃}, as if φ̃ were normal: E|x|^k ≤ k! / k!! for x ~ N(0, 1).

This is done for all blocks of times at once: the orders of terms are the same in all of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.points.sequences import interval_sequence
from flexband.uncertainty.phases.phase_options import MOMENTS
from flexband.uncertainty.phases.terms import PartTerms


class Sizes(NamedTuple):
    """Sizes of coefficients: orders (terms, m), and a size of each in every block of times."""

    orders: np.ndarray
    size: np.ndarray  # (terms, blocks)

    @staticmethod
    def from_index(index: np.ndarray, columns: Iterable[np.ndarray]) -> Sizes:
        """Return the sum of what has the same orders, without what is zero in all blocks.

        There is a column for each block, one at a time, since all together may take much memory.
        """
        order, first = _group_rows(index)
        size = np.stack([np.add.reduceat(column[order], first) for column in columns], axis=1)
        orders = index[order[first]]
        there = size.any(axis=1)
        return Sizes(orders[there], size[there])

    def plus(self, other: Sizes) -> Sizes:
        """Return the sums of sizes of the same orders."""
        index, size = map(np.concatenate, zip(self, other, strict=True))
        return Sizes.from_index(index, size.T)

    def times(self, other: Sizes) -> Sizes:
        """Return the sizes of the largest coefficients of a product."""
        shared_variables = (self.orders > 0).astype(float) @ (other.orders > 0).T.astype(float)
        half = 0.5**shared_variables
        matter = np.zeros(shared_variables.shape, bool)
        columns = list(zip(self.size.T, other.size.T, strict=True))
        for a, b in columns:
            size = a[:, None] * b * half
            matter |= size > 1e-3 * MOMENTS.negligible_term * size.max(initial=0.0)
        first, second = np.nonzero(matter)
        index = self.orders[first] + other.orders[second]
        factor = half[matter]
        sizes = (a[first] * b[second] * factor for a, b in columns)
        return Sizes.from_index(index, sizes).largest(2 * MOMENTS.max_terms)

    def largest(self, count: int) -> Sizes:
        """Return those that are the largest, relative to the largest one of a block."""
        if len(self.size) <= count:
            return self
        part = self.size / np.maximum(self.size.max(axis=0), 1e-300)
        rows = np.argsort(-part.max(axis=1), kind="stable")[:count]
        return Sizes(self.orders[rows], self.size[rows])


def _group_rows(orders: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return an order of the rows in which equal ones follow each other, and where these start."""
    number = orders @ _weights(orders.shape[1])  # another one for each of the different orders
    order = np.argsort(number, kind="stable")
    number = number[order]
    return order, np.flatnonzero(np.append(len(number) > 0, number[1:] != number[:-1]))


@cache
def _weights(count: int) -> np.ndarray:
    """Return random weights with which sums of few orders differ, (count,)."""
    return np.random.default_rng(0).integers(1, 2**62, count)


def moment_orders(blocks: Sequence[PartTerms]) -> list[np.ndarray]:
    """Return orders of the polynomials for smooth moments of each block of times.

    They have the shape (polynomials, m), with all lower orders. Those of the expansion of the parts
    are among them, since phases are among the smooth moments.
    """
    terms = blocks[0]
    index = terms.expansion.index[:, : terms.interval_dimension]
    sizes = np.stack([_sizes(block) for block in blocks], axis=2)
    value, fluctuation, mixed, phase_change = (
        Sizes.from_index(index, size.T).largest(2 * MOMENTS.max_terms) for size in sizes
    )
    turn = _of_exponential(mixed)
    mean = value.times(turn)
    fluctuation = fluctuation.plus(value.times(phase_change))
    variance = fluctuation.times(fluctuation).times(turn)
    varying = mean.size[mean.orders.any(axis=1)].sum(axis=0) + fluctuation.size.sum(axis=0)
    scattering = variance.size.sum(axis=0)
    # Keep what is not negligible relative to the variation.
    parts = [
        mean.size / np.where(varying > 0, varying, 1.0),
        variance.size / np.where(scattering > 0, scattering, 1.0),
    ]
    orders = np.concatenate([mean.orders, variance.orders])
    part = np.concatenate(parts).T
    interval_index = terms.expansion.interval_index
    masks = part > MOMENTS.negligible_term
    return [_with_lower(interval_index, orders[mask]) for mask in masks]


def _with_lower(interval_index: np.ndarray, relevant_orders: np.ndarray) -> np.ndarray:
    """Return orders with all lower ones; of the relevant ones, no more than is affordable."""
    m = interval_index.shape[1]
    share = (relevant_orders / np.maximum(relevant_orders.max(axis=0, initial=0), 1)).sum(axis=1)
    part = 1.0
    while True:
        selection = relevant_orders[share <= part * m]
        orders = with_lower_orders(
            np.concatenate([np.zeros((1, m), int), interval_index, selection])
        )
        if len(orders) <= MOMENTS.max_terms or not len(selection):
            return orders
        part *= 0.9


def _sizes(terms: PartTerms) -> np.ndarray:
    """Return sizes of the outputs' parts, of those with ξ, and of the phases' with ξ, times 2.

    Of the four rows, the third has the terms that also have η; without turning parts it is zero,
    and so is the last.
    """
    index = terms.expansion.index[:, : terms.interval_dimension]
    columns = terms.columns
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
    phase = 0.0 * phase if terms.averages_vanish else 2 * phase
    return np.stack([size, size * random, phase * index.any(axis=1), phase])


def _of_exponential(mixed: Sizes) -> Sizes:
    """Return sizes of the coefficients of E e^{iφ̃}."""
    unit = Sizes(np.zeros((1, mixed.orders.shape[1]), int), np.ones((1, mixed.size.shape[1])))
    total = unit
    power = unit
    before = 1.0
    factor = 1.0  # k!!
    for k in range(1, MOMENTS.max_powers):
        power = power.times(mixed)
        factor, before = k * before if k > 1 else 1.0, factor
        if not power.size.max(initial=0.0) > MOMENTS.negligible_term * factor:
            break
        total = total.plus(Sizes(power.orders, power.size / factor))
    return total


def with_lower_orders(index: np.ndarray) -> np.ndarray:
    """Return orders together with all lower ones."""
    for v in range(index.shape[1]):
        steps = (index - k * (np.arange(index.shape[1]) == v) for k in range(index[:, v].max() + 1))
        lower = np.concatenate(list(steps))
        lower = lower[lower[:, v] >= 0]
        order, first = _group_rows(lower)
        index = lower[order[first]]
    return index[np.lexsort(index.T[::-1])] if index.shape[1] else index[:1]


class MomentPolynomials(NamedTuple):
    """Polynomials in η of smooth moments, and how values of these give the coefficients."""

    expansion: HybridExpansion  # which has the polynomials only
    eta: np.ndarray  # points of the values, (terms, m)
    inverse: np.ndarray  # from values to coefficients

    @staticmethod
    def from_index(index: np.ndarray) -> MomentPolynomials:
        """Return the polynomials of these orders, (terms, m)."""
        eta = interval_sequence(int(index.max(initial=0)) + 1)[index]
        expansion = HybridExpansion((), index, np.zeros((len(index), 0)))
        inverse = np.linalg.inv(expansion.chebyshev(eta)[:, expansion.i])
        return MomentPolynomials(expansion, eta, inverse)

    def coefficients(self, terms: PartTerms, at_once: int = 4) -> np.ndarray:
        """Return the coefficients of smooth moments, (times, terms, width)."""
        table = terms.table(self.eta)
        for first in range(0, len(table), at_once):  # tables of all threads exceed the runs
            times = slice(first, first + at_once)
            table[times] = self.inverse @ table[times]
        return table
