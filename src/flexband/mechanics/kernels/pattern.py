"""The symbolic phase of the sparse LDLᵀ: elimination order, non-zero tiles and products of tiles.

The matrix is [A, Φ_qᵀ; Φ_q, 0]. Coordinates are components of plane vectors, so non-zeros come in
tiles of 2 × 2. Multipliers are paired as well, those of one joint together; a multiplier that is
left over shares its tile with an empty place of pivot 1. A multiplier is eliminated only after
all coordinates that its constraint depends on.
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

NONE = 0
"""Stands for an unknown in the empty place of a tile."""


class Pattern(NamedTuple):
    """The storage of the matrix, and the products of tiles that its factorization computes.

    Tile k < tiles is on the diagonal, that of the k-th eliminated pair of unknowns. The other tiles
    are below the diagonal, column by column in order of elimination. The four entries of tile t,
    row by row, are rows 4t to 4t + 3 of the matrix array. The last row of the array receives
    entries that belong to no unknown.
    """

    unknowns: int
    rows: int  # of the matrix array
    tiles: int  # on the diagonal
    longest_row: int
    filled_up: np.ndarray  # rows of the matrix array that hold the pivot 1 of an empty place
    first: np.ndarray  # k -> unknown
    second: np.ndarray  # k -> unknown, or NONE
    is_multiplier: np.ndarray  # k -> whether its unknowns are multipliers
    column_start: np.ndarray  # k -> first tile of the column
    entry_row: np.ndarray  # tile − tiles -> k of its row
    row_start: np.ndarray  # k -> first tile of the row in the two arrays below
    row_tile: np.ndarray
    row_column: np.ndarray  # k of the column
    reached: np.ndarray  # tiles whose unknowns depend on the multipliers' right-hand side alone
    reached_start: np.ndarray  # their rows, as above, without the columns that do not
    reached_tile: np.ndarray
    reached_column: np.ndarray
    product_start: np.ndarray  # tile − tiles -> first of its products V Wᵀ, W = V D⁻¹
    product_v: np.ndarray  # tile in the row of the entry
    product_w: np.ndarray  # place in the row of the pivot


Slots = dict[tuple[int, int], int]
"""(i, j), i ≤ j -> row of the matrix array."""


def analyse(
    pairs: Sequence[tuple[int, int]], coordinates: int, couples: Iterable[tuple[int, int]]
) -> tuple[Pattern, Slots]:
    """Order the pairs of unknowns by minimum degree and list the products of tiles.

    Parameters
    ----------
    pairs : all unknowns 1, 2, … in pairs; the second one is `NONE` if one is left over.
    coordinates : number of coordinates; the unknowns after them are multipliers.
    couples : non-zeros (i, j) of the matrix, in either triangle.

    Returns
    -------
    The pattern, and the row of the matrix array of every entry.
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
        tile_in = {c: tile for tile, c in rows[row]}
        for w, (_, c) in enumerate(rows[column]):
            if c in tile_in:
                product_v.append(tile_in[c])
                product_w.append(w)
        product_start.append(len(product_v))

    row_entries = [entry for k in range(len(order)) for entry in rows[k]]
    among = _reached([pair in multipliers for pair in order], rows)
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
        reached=_indices(list(among)),
        reached_start=_indices(np.cumsum([0] + [len(own) for own in among.values()])),
        reached_tile=_indices([t for own in among.values() for t, _ in own]),
        reached_column=_indices([c for own in among.values() for _, c in own]),
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


def _reached(is_multiplier: list[bool], rows: dict) -> dict[int, list[tuple[int, int]]]:
    """Return the tiles that depend on the multipliers' right-hand side, and why, see `Pattern`."""
    among = {}
    for k, multiplier in enumerate(is_multiplier):
        own = [(t, c) for t, c in rows[k] if c in among]
        if own or multiplier:
            among[k] = own
    return among


def _indices(values) -> np.ndarray:
    return np.array(values, dtype=np.int32)


def _minimum_degree(
    neighbours: dict[int, set[int]], multipliers: set[int]
) -> tuple[list[int], list[set[int]]]:
    """Eliminate by minimum degree, multipliers only after the coordinates of their constraint.

    Returns the order, and for each node the remaining nodes that its elimination couples.
    """
    waiting = {i: neighbours[i] - multipliers for i in multipliers}
    level = dict.fromkeys(neighbours, 0)
    heap = [(len(n), 0, i) for i, n in neighbours.items() if not waiting.get(i)]
    heapq.heapify(heap)
    constrained = defaultdict(list)
    for i, coordinates in waiting.items():
        for j in coordinates:
            constrained[j].append(i)
    order, columns, done = [], [], set()
    while heap:
        degree, _, i = heapq.heappop(heap)
        if i in done or degree != len(neighbours[i]):
            continue  # outdated: it was pushed again with its new degree
        done.add(i)
        order.append(i)
        clique = neighbours.pop(i)
        columns.append(clique)
        for j in clique:
            level[j] = max(level[j], level[i] + 1)
            neighbours[j] |= clique
            neighbours[j] -= {i, j}
        for j in constrained[i]:
            waiting[j].discard(i)
        for j in clique:
            if not waiting.get(j):
                heapq.heappush(heap, (len(neighbours[j]), level[j], j))
    return order, columns
