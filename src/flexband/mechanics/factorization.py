"""Sparse LDLᵀ of the saddle-point matrix [A, Φ_qᵀ; Φ_q, 0], on lanes.

The pattern is fixed by the mechanism, so the ordering and the list of multiply-adds are found
once; the numbers follow without pivoting. Only V = L D and D⁻¹ are kept, so that they stay in the
processor's fastest cache. That is safe because a multiplier is eliminated only
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
    longest_row: int
    order: np.ndarray  # k -> unknown
    column_start: np.ndarray  # k -> first slot of the column
    entry_row: np.ndarray  # slot − size -> unknown of its row
    row_start: np.ndarray  # k -> first entry of the row in the three arrays below
    row_slot: np.ndarray
    row_column: np.ndarray  # k of the column
    row_unknown: np.ndarray  # unknown of the column
    product_start: np.ndarray  # slot − size -> first of its products V W, W = V D⁻¹
    product_v: np.ndarray  # slot in the row of the entry
    product_w: np.ndarray  # place in the row of the pivot


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

    product_start, product_v, product_w = [0], [], []
    for k, column in enumerate(columns):
        pivot_row = [c for c, _ in rows[order[k]]]
        for i in sorted(column, key=place.__getitem__):
            own = dict(rows[i])
            for w, c in enumerate(pivot_row):
                if c in own:
                    product_v.append(own[c])
                    product_w.append(w)
            product_start.append(len(product_v))

    row_entries = [entry for i in order for entry in rows[i]]
    pattern = Pattern(
        size=size,
        slots=len(slot),
        multipliers=multipliers,
        longest_row=max(len(entries) for entries in rows.values()) if rows else 0,
        order=_indices(order),
        column_start=_indices(column_start),
        entry_row=_indices(entry_row),
        row_start=_indices(np.cumsum([0] + [len(rows[i]) for i in order])),
        row_slot=_indices([s for _, s in row_entries]),
        row_column=_indices([place[c] for c, _ in row_entries]),
        row_unknown=_indices([c for c, _ in row_entries]),
        product_start=_indices(product_start),
        product_v=_indices(product_v),
        product_w=_indices(product_w),
    )
    return pattern, slot


def _indices(values) -> np.ndarray:
    return np.array(values, dtype=np.int32)


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
def factorize(pattern, matrix, inverse_pivots, row):
    """Factor `matrix` in place into V = L D below the pivots; arrays of lanes, `row` work space.

    Returns a mask: the number of a multiplier whose pivot vanishes, 0 where none does.
    """
    singular = filled(0.0)
    first_multiplier = pattern.size - pattern.multipliers + 1
    for k in range(pattern.size):
        pivot = load(matrix, k)
        size = magnitude(pivot)
        begin = pattern.row_start[k]
        for p in range(begin, pattern.row_start[k + 1]):
            v = load(matrix, pattern.row_slot[p])
            w = v * load(inverse_pivots, pattern.row_column[p])
            store(row, p - begin, w)
            pivot -= v * w
            size += magnitude(v * w)
        if pattern.order[k] >= first_multiplier:
            sound = less(SINGULAR * size, magnitude(pivot))
            singular = where(sound, singular, filled(float(pattern.order[k])))
        store(inverse_pivots, k, 1.0 / pivot)
        for entry in range(pattern.column_start[k], pattern.column_start[k + 1]):
            value = load(matrix, entry)
            first = pattern.product_start[entry - pattern.size]
            for p in range(first, pattern.product_start[entry - pattern.size + 1]):
                value -= load(matrix, pattern.product_v[p]) * load(row, pattern.product_w[p])
            store(matrix, entry, value)
    return singular


@compiled
def solve(pattern, matrix, inverse_pivots, x):
    """Replace the right-hand side `x`, rows numbered by unknown, by the solution."""
    for k in range(pattern.size):
        value = load(x, pattern.order[k])
        for p in range(pattern.row_start[k], pattern.row_start[k + 1]):
            value -= load(matrix, pattern.row_slot[p]) * load(x, pattern.row_unknown[p])
        store(x, pattern.order[k], value * load(inverse_pivots, k))  # D⁻¹ L⁻¹ of the right side
    for k in range(pattern.size - 1, -1, -1):
        known = filled(0.0)
        for entry in range(pattern.column_start[k], pattern.column_start[k + 1]):
            known += load(matrix, entry) * load(x, pattern.entry_row[entry - pattern.size])
        value = load(x, pattern.order[k])
        store(x, pattern.order[k], value - load(inverse_pivots, k) * known)
