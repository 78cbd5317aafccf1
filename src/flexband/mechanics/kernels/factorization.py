"""Sparse LDLᵀ of the saddle-point matrix [A, Φ_qᵀ; Φ_q, 0] in tiles of 2 × 2, on lanes.

Coordinates come as vectors of the plane, so non-zeros come in tiles, and a product of tiles is
eight multiply-adds on eight numbers that are read once. Multipliers are tiled as well, those of
one joint together; where one is left over its tile is filled up with an unknown that is coupled
to nothing and has the pivot 1.

The pattern is fixed by the mechanism, so the ordering and the list of products are found once; the
numbers follow without pivoting. Only V = L D and D⁻¹ are kept, so that they stay in the
processor's fastest cache. That is safe because a multiplier is eliminated only after its
coordinates: then its pivot is −Φ_q A⁻¹ Φ_qᵀ, and it vanishes only where a constraint is
redundant or the Jacobian loses rank. Such a constraint is left out: its multiplier is not unique,
and where the constraints do not contradict each other the rest implies it.
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from flexband.mechanics.kernels.lanes import compiled, filled, less, load, magnitude, store, where

SINGULAR = 1e-12
"""A multiplier's pivot below this part of what it is the sum of counts as zero."""

NONE = 0
"""Instead of an unknown, which fills up a tile."""


class Pattern(NamedTuple):
    """The symbolic phase: where the numbers are and which tiles to multiply.

    Tile k < tiles is on the diagonal, of the k-th eliminated pair of unknowns; later tiles are
    those below the diagonal, column by column in order of elimination. The four numbers of tile t,
    row after row, are rows 4t, … of the matrix array; one more takes what belongs to no unknown.
    """

    unknowns: int
    rows: int  # of the matrix array
    tiles: int  # on the diagonal
    longest_row: int
    filled_up: np.ndarray  # rows of the matrix that are 1
    first: np.ndarray  # k -> unknown
    second: np.ndarray  # k -> unknown, or NONE
    is_multiplier: np.ndarray  # k -> whether
    column_start: np.ndarray  # k -> first tile of the column
    entry_row: np.ndarray  # tile − tiles -> k of its row
    row_start: np.ndarray  # k -> first tile of the row in the two arrays below
    row_tile: np.ndarray
    row_column: np.ndarray  # k of the column
    product_start: np.ndarray  # tile − tiles -> first of its products V Wᵀ, W = V D⁻¹
    product_v: np.ndarray  # tile in the row of the entry
    product_w: np.ndarray  # place in the row of the pivot


Slots = dict[tuple[int, int], int]
"""(i, j), i ≤ j -> row of the matrix array."""


def analyse(
    pairs: Sequence[tuple[int, int]], coordinates: int, couples: Iterable[tuple[int, int]]
) -> tuple[Pattern, Slots]:
    """Order the pairs of unknowns by minimum degree and list the products.

    Parameters
    ----------
    pairs : all unknowns 1, 2, …, in pairs; `NONE` is the second where one is left over.
    coordinates : the number of coordinates; later unknowns are multipliers.
    couples : the non-zeros (i, j) of the matrix, in either triangle.

    Returns
    -------
    The pattern, and the row of the matrix array of every number of a tile.
    """
    pair_of = {i: p for p, pair in enumerate(pairs) for i in pair if i != NONE}
    neighbours: dict[int, set[int]] = {p: set() for p in range(len(pairs))}
    for i, j in couples:
        if pair_of[i] != pair_of[j]:
            neighbours[pair_of[i]].add(pair_of[j])
            neighbours[pair_of[j]].add(pair_of[i])
    multipliers = {p for p, pair in enumerate(pairs) if pair[0] > coordinates}
    order, columns = _minimum_degree(neighbours, multipliers)
    place = {pair: k for k, pair in enumerate(order)}

    tiles = [(k, k) for k in range(len(order))]
    for k, column in enumerate(columns):
        tiles += [(row, k) for row in sorted(place[pair] for pair in column)]
    below = range(len(order), len(tiles))
    rows = defaultdict(list)  # k -> its tiles and their columns
    for t in below:
        rows[tiles[t][0]].append((t, tiles[t][1]))

    product_start, product_v, product_w = [0], [], []
    for t in below:
        row, column = tiles[t]
        own = {c: tile for tile, c in rows[row]}
        for w, (_, c) in enumerate(rows[column]):
            if c in own:
                product_v.append(own[c])
                product_w.append(w)
        product_start.append(len(product_v))

    row_entries = [entry for k in range(len(order)) for entry in rows[k]]
    pattern = Pattern(
        unknowns=len(pair_of),
        rows=4 * len(tiles) + 1,
        tiles=len(order),
        longest_row=max((len(entries) for entries in rows.values()), default=0),
        filled_up=_indices([4 * k + 3 for k, p in enumerate(order) if pairs[p][1] == NONE]),
        first=_indices([pairs[p][0] for p in order]),
        second=_indices([pairs[p][1] for p in order]),
        is_multiplier=np.array([p in multipliers for p in order], dtype=bool),
        column_start=_indices(np.cumsum([len(order)] + [len(column) for column in columns])),
        entry_row=_indices([tiles[t][0] for t in below]),
        row_start=_indices(np.cumsum([0] + [len(rows[k]) for k in range(len(order))])),
        row_tile=_indices([t for t, _ in row_entries]),
        row_column=_indices([c for _, c in row_entries]),
        product_start=_indices(product_start),
        product_v=_indices(product_v),
        product_w=_indices(product_w),
    )
    slots = {}
    for t, (row, column) in enumerate(tiles):
        for a, i in enumerate(pairs[order[row]]):
            for b, j in enumerate(pairs[order[column]]):
                if NONE not in (i, j) and (row != column or a >= b):
                    slots[min(i, j), max(i, j)] = 4 * t + 2 * a + b
    return pattern, slots


def _indices(values) -> np.ndarray:
    return np.array(values, dtype=np.int32)


def _minimum_degree(
    neighbours: dict[int, set[int]], multipliers: set[int]
) -> tuple[list[int], list[set[int]]]:
    """Eliminate by minimum degree, multipliers only after their own coordinates.

    Returns the order and, for each, those left that its elimination couples.
    """
    waiting = {i: neighbours[i] - multipliers for i in multipliers}
    heap = [(len(n), i) for i, n in neighbours.items() if not waiting.get(i)]
    heapq.heapify(heap)
    constrained = defaultdict(list)
    for i, own in waiting.items():
        for j in own:
            constrained[j].append(i)
    order, columns, done = [], [], set()
    while heap:
        degree, i = heapq.heappop(heap)
        if i in done or degree != len(neighbours[i]):
            continue  # out of date: it was entered again with its new degree
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
            if not waiting.get(j):
                heapq.heappush(heap, (len(neighbours[j]), j))
    return order, columns


def to_dense(pattern: Pattern, matrix: np.ndarray) -> np.ndarray:
    """Return a matrix that is not factored as (WIDTH, unknowns, unknowns), rows by unknown."""
    pairs = np.stack([pattern.first, pattern.second], axis=1)
    dense = np.zeros((matrix.shape[1], pattern.unknowns + 1, pattern.unknowns + 1))
    for k in range(pattern.tiles):
        below = range(pattern.column_start[k], pattern.column_start[k + 1])
        for t, row in [(k, k), *((t, pattern.entry_row[t - pattern.tiles]) for t in below)]:
            tile = matrix[4 * t : 4 * t + 4].T.reshape(-1, 2, 2)
            if row == k:
                tile = np.tril(tile) + np.tril(tile, -1).transpose(0, 2, 1)
            dense[:, pairs[row][:, None], pairs[k]] = tile
            dense[:, pairs[k][:, None], pairs[row]] = tile.transpose(0, 2, 1)
    return dense[:, 1:, 1:]


@compiled
def _tile(array, t):
    """Return the four numbers of a tile, row after row."""
    row = 4 * t
    return load(array, row), load(array, row + 1), load(array, row + 2), load(array, row + 3)


@compiled
def _set_tile(array, t, a, b, c, d):
    row = 4 * t
    store(array, row, a)
    store(array, row + 1, b)
    store(array, row + 2, c)
    store(array, row + 3, d)


@compiled
def factorize(pattern, matrix, inverse_pivots, row):
    """Factor `matrix` in place into V = L D below the pivots; arrays of lanes, `row` work space.

    A multiplier whose pivot vanishes is set to zero by `solve`, as if its constraint were not
    there. Returns the number of such a multiplier, 0 where there is none.
    """
    redundant = filled(0.0)
    for k in range(pattern.tiles):
        a, _, b, d = _tile(matrix, k)
        size_a, size_d = magnitude(a), magnitude(d)
        begin = pattern.row_start[k]
        for p in range(begin, pattern.row_start[k + 1]):
            v00, v01, v10, v11 = _tile(matrix, pattern.row_tile[p])
            i00, i01, _, i11 = _tile(inverse_pivots, pattern.row_column[p])
            w00, w01 = v00 * i00 + v01 * i01, v00 * i01 + v01 * i11
            w10, w11 = v10 * i00 + v11 * i01, v10 * i01 + v11 * i11
            _set_tile(row, p - begin, w00, w01, w10, w11)
            part_a, part_d = v00 * w00 + v01 * w01, v10 * w10 + v11 * w11
            a -= part_a
            b -= v10 * w00 + v11 * w01
            d -= part_d
            size_a += magnitude(part_a)
            size_d += magnitude(part_d)
        inverse_a = 1.0 / a
        if pattern.is_multiplier[k]:
            sound = less(SINGULAR * size_a, magnitude(a))
            inverse_a = where(sound, inverse_a, filled(0.0))
            redundant = where(sound, redundant, filled(float(pattern.first[k])))
        ratio = b * inverse_a
        d -= ratio * b
        size_d += magnitude(ratio * b)
        inverse_d = 1.0 / d
        if pattern.is_multiplier[k]:
            sound = less(SINGULAR * size_d, magnitude(d))
            inverse_d = where(sound, inverse_d, filled(0.0))
            redundant = where(sound, redundant, filled(float(pattern.second[k])))
        i01 = -ratio * inverse_d
        _set_tile(inverse_pivots, k, inverse_a - ratio * i01, i01, i01, inverse_d)
        for tile in range(pattern.column_start[k], pattern.column_start[k + 1]):
            c00, c01, c10, c11 = _tile(matrix, tile)
            products = tile - pattern.tiles
            for p in range(pattern.product_start[products], pattern.product_start[products + 1]):
                v00, v01, v10, v11 = _tile(matrix, pattern.product_v[p])
                w00, w01, w10, w11 = _tile(row, pattern.product_w[p])
                c00 = c00 - v00 * w00 - v01 * w01
                c01 = c01 - v00 * w10 - v01 * w11
                c10 = c10 - v10 * w00 - v11 * w01
                c11 = c11 - v10 * w10 - v11 * w11
            _set_tile(matrix, tile, c00, c01, c10, c11)
    return redundant


@compiled
def solve(pattern, matrix, inverse_pivots, x):
    """Replace the right-hand side `x`, rows numbered by unknown, by the solution."""
    for k in range(pattern.tiles):
        first, second = pattern.first[k], pattern.second[k]
        a, b = load(x, first), load(x, second)
        for p in range(pattern.row_start[k], pattern.row_start[k + 1]):
            column = pattern.row_column[p]
            v00, v01, v10, v11 = _tile(matrix, pattern.row_tile[p])
            y0, y1 = load(x, pattern.first[column]), load(x, pattern.second[column])
            a -= v00 * y0 + v01 * y1
            b -= v10 * y0 + v11 * y1
        i00, i01, _, i11 = _tile(inverse_pivots, k)
        store(x, second, i01 * a + i11 * b)  # D⁻¹ L⁻¹ of the right side
        store(x, first, i00 * a + i01 * b)
    for k in range(pattern.tiles - 1, -1, -1):
        a, b = filled(0.0), filled(0.0)
        for tile in range(pattern.column_start[k], pattern.column_start[k + 1]):
            entry = pattern.entry_row[tile - pattern.tiles]
            v00, v01, v10, v11 = _tile(matrix, tile)
            y0, y1 = load(x, pattern.first[entry]), load(x, pattern.second[entry])
            a += v00 * y0 + v10 * y1
            b += v01 * y0 + v11 * y1
        first, second = pattern.first[k], pattern.second[k]
        i00, i01, _, i11 = _tile(inverse_pivots, k)
        store(x, second, load(x, second) - i01 * a - i11 * b)
        store(x, first, load(x, first) - i00 * a - i01 * b)
