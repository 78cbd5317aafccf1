"""The terms of an expansion as compiled loops read them, for several series side by side.

Every term is Φ_i Ψ_j, and each Φ_i contains few of the interval variables. Loops over indices cost
more than the arithmetic, so they serve several series at once: the last dimension of arrays is
that of lanes, and no operation mixes them.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from flexband.compilation.functions import compiled


class ExpansionTerms(NamedTuple):
    """The terms of an expansion in the order of Φ_i."""

    first: np.ndarray  # number of the first term of each Φ_i, (M + 1,)
    group: np.ndarray  # j of each term, (terms,)
    first_factor: np.ndarray  # number of the first factor of each Φ_i, (M + 1,)
    # of each factor T_order(η_variable)
    variable: np.ndarray
    order: np.ndarray
    first_owner: np.ndarray  # where the Φ_i that contain each variable start, (m + 1,)
    # these Φ_i, and their orders in the variable
    owner: np.ndarray
    owner_order: np.ndarray
    # the terms in the order of j, and where those of each Ψ_j start
    of_group: np.ndarray
    first_of_group: np.ndarray
    depends: np.ndarray  # whether the terms of each Ψ_j contain a variable, (m, N)
    # the number of the other variable of a disc, −1 of variables in [−1, 1], (m,)
    partner: np.ndarray

    @staticmethod
    def from_index(
        index: np.ndarray, i: np.ndarray, j: np.ndarray, discs: Sequence[int]
    ) -> ExpansionTerms:
        """Return the terms Φ_i Ψ_j, i increasing, with the orders of Φ in each variable, (M, m)."""
        partner = np.full(index.shape[1], -1)
        for first in discs:
            partner[first : first + 2] = first + 1, first
        row, variable = np.nonzero(index)
        column, owner = np.nonzero(index.T)
        by_group = np.argsort(j, kind="stable")
        depends = np.zeros((index.shape[1], j.max(initial=0) + 1), dtype=bool)
        term, term_variable = np.nonzero(index[i])
        depends[term_variable, j[term]] = True
        parts = (
            np.searchsorted(i, np.arange(len(index) + 1)),
            j,
            np.searchsorted(row, np.arange(len(index) + 1)),
            variable,
            index[row, variable],
            np.searchsorted(column, np.arange(index.shape[1] + 1)),
            owner,
            index[owner, column],
            by_group,
            np.searchsorted(j[by_group], np.arange(depends.shape[1] + 1)),
            depends,
            partner,
        )
        return ExpansionTerms(*map(np.ascontiguousarray, parts))


@compiled
def fill(array, value):
    numbers = array.flat
    for k in range(array.size):
        numbers[k] = value


@compiled
def copy(into, values):
    """Copy an array of one dimension into another one."""
    for k in range(len(into)):
        into[k] = values[k]


@partial(compiled, fastmath={"contract"})
def multiply(a, b, product):
    """Fill the product of two matrices; each is contiguous in its rows, or a transpose of such."""
    for i in range(len(product)):
        row = product[i]
        fill(row, 0.0)
        for k in range(0, len(b) - 3, 4):  # four at a time load and store less
            f0 = a[i, k]
            f1 = a[i, k + 1]
            f2 = a[i, k + 2]
            f3 = a[i, k + 3]
            b0 = b[k]
            b1 = b[k + 1]
            b2 = b[k + 2]
            b3 = b[k + 3]
            for j in range(len(row)):
                row[j] += f0 * b0[j] + f1 * b1[j] + f2 * b2[j] + f3 * b3[j]
        for k in range(len(b) - len(b) % 4, len(b)):
            factor = a[i, k]
            other = b[k]
            for j in range(len(row)):
                row[j] += factor * other[j]


@compiled
def sum_of(values):
    sum_of_values = values[0]
    for k in range(1, len(values)):
        sum_of_values += values[k]
    return sum_of_values


@compiled
def inner(a, b):
    """Return Σ_k a_k b_k."""
    sum_of_products = a[0] * b[0]
    for k in range(1, len(a)):
        sum_of_products += a[k] * b[k]
    return sum_of_products


@compiled
def largest(values, first, end):
    """Return the largest of the values from `first` on and before `end`, 0 at least."""
    maximum = 0
    for k in range(first, end):
        maximum = max(maximum, values[k])
    return maximum


@compiled
def chebyshev_powers(eta, powers):
    """Fill T_k, T_k′ and T_k″ of every variable, (3, orders, m, lanes), at η, (m, lanes)."""
    orders, m, lanes = powers.shape[1:]
    T, D, S = powers
    for a in range(m):
        for n in range(lanes):
            T[0, a, n] = 1.0
            D[0, a, n] = 0.0
            S[0, a, n] = 0.0
            if orders > 1:
                T[1, a, n] = eta[a, n]
                D[1, a, n] = 1.0
                S[1, a, n] = 0.0
        for k in range(2, orders):
            for n in range(lanes):
                x = 2 * eta[a, n]
                T[k, a, n] = x * T[k - 1, a, n] - T[k - 2, a, n]
                D[k, a, n] = 2 * T[k - 1, a, n] + x * D[k - 1, a, n] - D[k - 2, a, n]
                S[k, a, n] = 4 * D[k - 1, a, n] + x * S[k - 1, a, n] - S[k - 2, a, n]


@compiled
def product(terms, i, without, powers, phi):
    """Fill Φ_i without its factors of one variable, (lanes,)."""
    lanes = len(phi)
    for n in range(lanes):
        phi[n] = 1.0
    for f in range(terms.first_factor[i], terms.first_factor[i + 1]):
        a = terms.variable[f]
        k = terms.order[f]
        if a != without:
            for n in range(lanes):
                phi[n] *= powers[0, k, a, n]


@compiled
def aim(sums, c, sign, value):
    """Fill sign (μ + c σ), (lanes,), from the sum of the terms of each Ψ_j, (groups, lanes)."""
    groups, lanes = sums.shape
    for n in range(lanes):
        value[n] = 0.0
    for j in range(1, groups):
        for n in range(lanes):
            value[n] += sums[j, n] * sums[j, n]
    for n in range(lanes):
        value[n] = sign * (sums[0, n] + c * np.sqrt(value[n]))
