"""Sparse LDLᵀ of the saddle-point matrix [A, Φ_qᵀ; Φ_q, 0], on lanes.

The pattern is fixed by the mechanism, so the ordering and the list of multiply-adds are found
once; the numbers follow without pivoting. That is safe because a multiplier is eliminated only
after its coordinates: then its pivot is −Φ_q A⁻¹ Φ_qᵀ, and it vanishes only where a constraint is
redundant or the Jacobian loses rank. `factorize` watches for that.
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from flexband.lanes import compiled, filled, less, load, magnitude, store, where

SINGULAR = 1e-12
"""A multiplier's pivot below this part of what it is the sum of counts as zero."""


class Pattern(NamedTuple):
    """The symbolic phase: where the numbers are and which of them to multiply.

    Slots are rows of the matrix array: slot k < size is the pivot of the k-th eliminated unknown,
    later slots are the entries below the diagonal, column by column in order of elimination. One
    more slot takes what belongs to no unknown.
    """

    size: int
    slots: int
    multipliers: int  # the last so many unknowns
    order: np.ndarray  # k -> unknown
    column_start: np.ndarray  # k -> first slot of the column
    entry_row: np.ndarray  # slot − size -> unknown of its row
    row_start: np.ndarray  # k -> first entry of the row in the two arrays below
    row_slot: np.ndarray
    row_column: np.ndarray  # unknown of the column
    product_start: np.ndarray  # slot -> first of its products L V
    product_l: np.ndarray
    product_v: np.ndarray


def analyse(
    size: int, multipliers: int, pairs: Iterable[tuple[int, int]]
) -> tuple[Pattern, dict[tuple[int, int], int]]:
    """Order the unknowns 1 … size by minimum degree and list the multiply-adds.

    Parameters
    ----------
    size : number of unknowns, the multipliers last.
    multipliers : number of multipliers.
    pairs : the non-zeros (i, j) of the matrix, in either triangle.

    Returns
    -------
    The pattern, and the slot of every entry (i, j), i ≤ j, of the factor.
    """
    neighbours: dict[int, set[int]] = {i: set() for i in range(1, size + 1)}
    for i, j in pairs:
        if i != j:
            neighbours[i].add(j)
            neighbours[j].add(i)
    order, columns = _minimum_degree(neighbours, size - multipliers)
    place = {unknown: k for k, unknown in enumerate(order)}

    slot = {(i, i): k for k, i in enumerate(order)}
    entry_row, column_start, rows = [], [size], defaultdict(list)
    for k, column in enumerate(columns):
        for i in sorted(column, key=place.__getitem__):
            slot[min(i, order[k]), max(i, order[k])] = size + len(entry_row)
            rows[i].append((order[k], size + len(entry_row)))
            entry_row.append(i)
        column_start.append(size + len(entry_row))

    product_start, product_l, product_v = [0], [], []
    row_of = {i: dict(entries) for i, entries in rows.items()}
    targets = [(i, i) for i in order]
    targets += [
        (i, order[k]) for k, c in enumerate(columns) for i in sorted(c, key=place.__getitem__)
    ]
    for i, j in targets:
        row_i, row_j = row_of.get(i, {}), row_of.get(j, {})
        for column in row_j:
            if column in row_i:
                product_l.append(row_i[column])
                product_v.append(row_j[column])
        product_start.append(len(product_l))

    row_entries = [entry for i in order for entry in rows[i]]
    counts = np.cumsum([0] + [len(rows[i]) for i in order])
    pattern = Pattern(
        size,
        len(slot),
        multipliers,
        np.array(order, dtype=np.int64),
        np.array(column_start, dtype=np.int64),
        np.array(entry_row, dtype=np.int64),
        counts.astype(np.int64),
        np.array([s for _, s in row_entries], dtype=np.int64),
        np.array([c for c, _ in row_entries], dtype=np.int64),
        np.array(product_start, dtype=np.int64),
        np.array(product_l, dtype=np.int64),
        np.array(product_v, dtype=np.int64),
    )
    return pattern, slot


def _minimum_degree(
    neighbours: dict[int, set[int]], coordinates: int
) -> tuple[list[int], list[set[int]]]:
    """Eliminate by minimum degree, a multiplier only after its own coordinates.

    Returns the order and, for each, the unknowns left that its elimination couples.
    """
    waiting = {i: {j for j in n if j <= coordinates} for i, n in neighbours.items()}
    heap = [(len(n), i) for i, n in neighbours.items() if i <= coordinates or not waiting[i]]
    heapq.heapify(heap)
    constrained = defaultdict(list)
    for i, own in waiting.items():
        if i > coordinates:
            for j in own:
                constrained[j].append(i)
    order, columns, done = [], [], set()
    while heap:
        degree, i = heapq.heappop(heap)
        if i in done or degree != len(neighbours[i]):
            continue  # out of date: the unknown was entered again with its new degree
        done.add(i)
        order.append(i)
        clique = neighbours.pop(i)
        columns.append(clique)
        for j in clique:
            neighbours[j] |= clique
            neighbours[j] -= {i, j}
        for j in constrained[i]:
            waiting[j].discard(i)
        for j in clique:
            if j <= coordinates or not waiting[j]:
                heapq.heappush(heap, (len(neighbours[j]), j))
    return order, columns


@compiled
def factorize(pattern, matrix, factor, inverse_pivots):
    """Factor `matrix` in place into V = L D, with L in `factor`; arrays of lanes.

    Returns a mask: the number of a multiplier whose pivot vanishes, 0 where none does.
    """
    singular = filled(0.0)
    first_multiplier = pattern.size - pattern.multipliers + 1
    for k in range(pattern.size):
        pivot = load(matrix, k)
        if pattern.order[k] >= first_multiplier:
            size = magnitude(pivot)
            for p in range(pattern.product_start[k], pattern.product_start[k + 1]):
                product = load(factor, pattern.product_l[p]) * load(matrix, pattern.product_v[p])
                pivot -= product
                size += magnitude(product)
            sound = less(SINGULAR * size, magnitude(pivot))
            singular = where(sound, singular, filled(float(pattern.order[k])))
        else:
            for p in range(pattern.product_start[k], pattern.product_start[k + 1]):
                pivot -= load(factor, pattern.product_l[p]) * load(matrix, pattern.product_v[p])
        inverse = 1.0 / pivot
        store(inverse_pivots, k, inverse)
        for entry in range(pattern.column_start[k], pattern.column_start[k + 1]):
            value = load(matrix, entry)
            for p in range(pattern.product_start[entry], pattern.product_start[entry + 1]):
                value -= load(factor, pattern.product_l[p]) * load(matrix, pattern.product_v[p])
            store(matrix, entry, value)
            store(factor, entry, value * inverse)
    return singular


@compiled
def solve(pattern, factor, inverse_pivots, x):
    """Replace the right-hand side `x`, rows numbered by unknown, by the solution."""
    for k in range(pattern.size):
        value = load(x, pattern.order[k])
        for p in range(pattern.row_start[k], pattern.row_start[k + 1]):
            value -= load(factor, pattern.row_slot[p]) * load(x, pattern.row_column[p])
        store(x, pattern.order[k], value)
    for k in range(pattern.size - 1, -1, -1):
        value = load(x, pattern.order[k]) * load(inverse_pivots, k)
        for entry in range(pattern.column_start[k], pattern.column_start[k + 1]):
            value -= load(factor, entry) * load(x, pattern.entry_row[entry - pattern.size])
        store(x, pattern.order[k], value)
