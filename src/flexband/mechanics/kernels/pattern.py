"""The symbolic phase of the sparse LDLᵀ: elimination order, non-zero tiles and products of tiles.

The matrix is [A, Φ_qᵀ; Φ_q, 0]. Coordinates are components of plane vectors, so non-zeros come in
tiles of 2 × 2. Multipliers are paired as well, those of one joint together; a multiplier that is
left over shares its tile with an empty place of pivot 1. A multiplier is eliminated only after
all coordinates that its constraint depends on.
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

NONE = 0
"""Stands for an unknown in the empty place of a tile.

There the kernels multiply the row after the pair's first unknown by zeros and write it back.
"""


class Rows(NamedTuple):
    """Rows of tiles below the diagonal, in order of elimination."""

    first: np.ndarray  # unknown of each row
    start: np.ndarray  # of each row in the three arrays below
    tile: np.ndarray
    pivot: np.ndarray  # tile on the diagonal of the tile's column
    column: np.ndarray  # first unknown of the tile's column


class Pattern(NamedTuple):
    """The storage of the matrix, and the products of tiles that its factorization computes.

    Tiles are stored column by column in order of elimination, k = 0, 1, …, that on the diagonal
    first. The four entries of tile t, row by row, are rows 4t to 4t + 3 of the matrix array. The
    last row of the array receives entries that belong to no unknown.
    """

    unknowns: int
    rows: int  # of the matrix array
    columns: int
    filled_up: np.ndarray  # rows of the matrix array that hold the pivot 1 of an empty place
    first: np.ndarray  # k -> unknown
    second: np.ndarray  # k -> unknown, or NONE
    is_multiplier: np.ndarray  # k -> whether its unknowns are multipliers
    start: np.ndarray  # k -> first tile of the column
    row: np.ndarray  # tile -> k of its row
    unknown: np.ndarray  # tile -> first unknown of its row
    below: Rows  # all of them
    reached: Rows  # those that a right-hand side of the multipliers alone reaches
    product_start: np.ndarray  # tile -> first of its products V Lᵀ
    product_v: np.ndarray  # tile in the row of the entry
    product_l: np.ndarray  # tile in the row of the pivot


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
    # Order the pairs of unknowns.
    pair_of = {i: p for p, pair in enumerate(pairs) for i in pair if i != NONE}
    neighbours: dict[int, set[int]] = {p: set() for p in range(len(pairs))}
    for i, j in couples:
        if pair_of[i] != pair_of[j]:
            neighbours[pair_of[i]].add(pair_of[j])
            neighbours[pair_of[j]].add(pair_of[i])
    multipliers = {p for p, pair in enumerate(pairs) if pair[0] > coordinates}
    order, columns = _minimum_degree(neighbours, multipliers)
    place = {pair: k for k, pair in enumerate(order)}

    # List the tiles of each column and row of L.
    tiles = []
    start = [0]
    for k, column in enumerate(columns):
        tiles += [(k, k), *((row, k) for row in sorted(place[pair] for pair in column))]
        start.append(len(tiles))
    rows: list[list[tuple[int, int]]] = [[] for _ in order]  # k -> its tiles and their columns
    for t, (row, column) in enumerate(tiles):
        if row != column:
            rows[row].append((t, column))

    # List the products that each tile is reduced by.
    product_start = [0]
    product_v = []
    product_l = []
    for row, column in tiles:
        tile_in = {c: tile for tile, c in rows[row]} if row != column else {}
        for tile, c in rows[column]:
            if c in tile_in:
                product_v.append(tile_in[c])
                product_l.append(tile)
        product_start.append(len(product_v))

    first = [pairs[p][0] for p in order]

    def index_rows(rows: Mapping[int, list[tuple[int, int]]]) -> Rows:
        inner = [entry for row in rows.values() for entry in row]
        return Rows(
            first=_indices([first[k] for k in rows]),
            start=_indices(np.cumsum([0] + [len(row) for row in rows.values()])),
            tile=_indices([t for t, _ in inner]),
            pivot=_indices([start[c] for _, c in inner]),
            column=_indices([first[c] for _, c in inner]),
        )

    pattern = Pattern(
        unknowns=len(pair_of),
        rows=4 * len(tiles) + 1,
        columns=len(order),
        filled_up=_indices([4 * start[k] + 3 for k, p in enumerate(order) if pairs[p][1] == NONE]),
        first=_indices(first),
        second=_indices([pairs[p][1] for p in order]),
        is_multiplier=np.array([p in multipliers for p in order], dtype=bool),
        start=_indices(start),
        row=_indices([row for row, _ in tiles]),
        unknown=_indices([first[row] for row, _ in tiles]),
        below=index_rows(dict(enumerate(rows))),
        reached=index_rows(_reached_rows([pair in multipliers for pair in order], rows)),
        product_start=_indices(product_start),
        product_v=_indices(product_v),
        product_l=_indices(product_l),
    )
    # Find the row of every entry.
    slots = {}
    for t, (row, column) in enumerate(tiles):
        for a, i in enumerate(pairs[order[row]]):
            for b, j in enumerate(pairs[order[column]]):
                if NONE not in (i, j) and (row != column or a >= b):
                    slots[min(i, j), max(i, j)] = 4 * t + 2 * a + b
    return pattern, slots


def _reached_rows(
    is_multiplier: list[bool], rows: Sequence[list[tuple[int, int]]]
) -> dict[int, list[tuple[int, int]]]:
    """Return the rows that depend on the multipliers' right-hand side, without other columns."""
    row_entries = {}
    for k, multiplier in enumerate(is_multiplier):
        entries = [(t, c) for t, c in rows[k] if c in row_entries]
        if entries or multiplier:
            row_entries[k] = entries
    return row_entries


def _indices(values) -> np.ndarray:
    return np.array(values, dtype=np.int32)


def _minimum_degree(
    neighbours: dict[int, set[int]], multipliers: set[int]
) -> tuple[list[int], list[set[int]]]:
    """Eliminate by minimum degree, multipliers only after the coordinates of their constraint.

    Returns the order, and for each node the remaining nodes that its elimination couples.
    """
    # Multipliers wait for the coordinates of their constraint.
    waiting = {i: neighbours[i] - multipliers for i in multipliers}
    heap = [(len(n), i) for i, n in neighbours.items() if not waiting.get(i)]
    heapq.heapify(heap)
    constrained = defaultdict(list)
    for i, coordinates in waiting.items():
        for j in coordinates:
            constrained[j].append(i)
    order = []
    columns = []
    done = set()
    while heap:
        degree, i = heapq.heappop(heap)
        if i in done or degree != len(neighbours[i]):
            continue  # outdated: it was pushed again with its new degree
        # Eliminate the node: its neighbours become coupled.
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
