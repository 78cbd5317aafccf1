"""Sparse LDLᵀ of the saddle-point matrix [A, Φ_qᵀ; Φ_q, 0] in tiles of 2 × 2, on lanes.

A product of tiles is eight multiply-adds on eight numbers that are read once. The pattern of the
matrix is fixed by the mechanism, so the order of elimination and the list of products are computed
once, and the numeric factorization does not pivot. A tile below the diagonal holds V = L D until
its row is the next to be eliminated, and L from then on.

It is stable without pivoting because a multiplier is eliminated only after its coordinates. Its
pivot is then −Φ_q A⁻¹ Φ_qᵀ, which vanishes only if a constraint is redundant or the Jacobian loses
rank. Such a constraint is left out: its multiplier is not unique, and if the constraints do not
contradict each other, the remaining ones imply it.
"""

from __future__ import annotations

import numpy as np

from flexband.mechanics.kernels.lanes import (
    add_to,
    compiled,
    less,
    load,
    load_each,
    load_rows,
    magnitude,
    plus,
    splat,
    store_each,
    store_rows,
    times,
    where,
)
from flexband.mechanics.kernels.pattern import Pattern


def to_dense(pattern: Pattern, matrix: np.ndarray) -> np.ndarray:
    """Return the matrix before its factorization, shape (WIDTH, unknowns, unknowns)."""
    pairs = np.stack([pattern.first, pattern.second], axis=1)
    row = pattern.row
    column = np.repeat(np.arange(pattern.columns), np.diff(pattern.start))
    tiles = matrix[: 4 * len(row)].T.reshape(-1, len(row), 2, 2)
    flipped = tiles.transpose(0, 1, 3, 2)
    dense = np.zeros((matrix.shape[1], pattern.unknowns + 1, pattern.unknowns + 1))
    dense[:, pairs[column][:, :, None], pairs[row][:, None]] = flipped
    dense[:, pairs[row][:, :, None], pairs[column][:, None]] = tiles
    upper = (pairs[:, 0], pairs[:, 1])  # of a tile on the diagonal only the lower part is set
    dense[:, *upper] = dense[:, *upper[::-1]]
    return dense[:, 1:, 1:]


@compiled
def factorize(pattern, matrix, smallest, x):
    """Replace `matrix`, an array of lanes, by L below the diagonal and D⁻¹ on it, and `x` by L⁻¹x.

    The pivot of a multiplier counts as zero below `smallest`, a lane, times the sum of the
    magnitudes of its terms. A solution has zero for such a multiplier, as if it had no constraint.
    Returns how many there are as a lane.
    """
    redundant, unity, below = splat(0.0), splat(1.0), pattern.below
    for k in range(pattern.columns):
        diagonal, first, multiplier = pattern.start[k], pattern.first[k], pattern.is_multiplier[k]
        # Subtract the products with the rows before from the pivot's tile and x.
        a, _, b, d = load_rows(matrix, 4 * diagonal, 4)
        x0, x1 = load_rows(x, first, 2)
        size_a, size_d = magnitude(a), magnitude(d)
        for p in range(below.start[k], below.start[k + 1]):
            v00, v01, v10, v11 = load_rows(matrix, 4 * below.tile[p], 4)
            i00, i01, _, i11 = load_rows(matrix, 4 * below.pivot[p], 4)
            y0, y1 = load_rows(x, below.column[p], 2)
            l00, l01 = v00 * i00 + v01 * i01, v00 * i01 + v01 * i11
            l10, l11 = v10 * i00 + v11 * i01, v10 * i01 + v11 * i11
            store_rows(matrix, 4 * below.tile[p], (l00, l01, l10, l11))
            x0 = x0 - l00 * y0 - l01 * y1
            x1 = x1 - l10 * y0 - l11 * y1
            part_a, part_d = v00 * l00 + v01 * l01, v10 * l10 + v11 * l11
            a -= part_a
            b = b - v10 * l00 - v11 * l01
            d -= part_d
            if multiplier:
                size_a += magnitude(part_a)
                size_d += magnitude(part_d)
        store_rows(x, first, (x0, x1))
        # Invert the tile; what is left out has the inverse 0.
        inverse_a = 1.0 / a
        if multiplier:
            sound = less(smallest * size_a, magnitude(a))
            inverse_a = where(sound, inverse_a, splat(0.0))
            redundant += where(sound, splat(0.0), unity)
        ratio = b * inverse_a
        d -= ratio * b
        inverse_d = 1.0 / d
        if multiplier:
            sound = less(smallest * (size_d + magnitude(ratio * b)), magnitude(d))
            inverse_d = where(sound, inverse_d, splat(0.0))
            redundant += where(sound, splat(0.0), unity)
        i01 = -ratio * inverse_d
        store_rows(matrix, 4 * diagonal, (inverse_a - ratio * i01, i01, i01, inverse_d))
        # Subtract the products from the tiles below.
        for tile in range(diagonal + 1, pattern.start[k + 1]):
            c00, c01, c10, c11 = load_rows(matrix, 4 * tile, 4)
            for p in range(pattern.product_start[tile], pattern.product_start[tile + 1]):
                v00, v01, v10, v11 = load_rows(matrix, 4 * pattern.product_v[p], 4)
                l00, l01, l10, l11 = load_rows(matrix, 4 * pattern.product_l[p], 4)
                c00 = c00 - v00 * l00 - v01 * l01
                c01 = c01 - v00 * l10 - v01 * l11
                c10 = c10 - v10 * l00 - v11 * l01
                c11 = c11 - v10 * l10 - v11 * l11
            store_rows(matrix, 4 * tile, (c00, c01, c10, c11))
    return redundant


@compiled
def forward(rows, matrix, sides):
    """Replace each of the right-hand sides x, a tuple of arrays, by L⁻¹x."""
    for n in range(len(rows.first)):
        first = rows.first[n]
        a = load_each(sides, first)
        b = load_each(sides, first + 1)
        for p in range(rows.start[n], rows.start[n + 1]):
            l00, l01, l10, l11 = load_rows(matrix, 4 * rows.tile[p], 4)
            column = rows.column[p]
            y0 = load_each(sides, column)
            y1 = load_each(sides, column + 1)
            a = plus(plus(a, -l00, y0), -l01, y1)
            b = plus(plus(b, -l10, y0), -l11, y1)
        store_each(sides, first, a)
        store_each(sides, first + 1, b)


@compiled
def backward(pattern, matrix, sides):
    """Replace each of the right-hand sides x, a tuple of arrays, by L⁻ᵀD⁻¹x."""
    for k in range(pattern.columns - 1, -1, -1):
        first = pattern.first[k]
        y0 = load_each(sides, first)
        y1 = load_each(sides, first + 1)
        i00, i01, _, i11 = load_rows(matrix, 4 * pattern.start[k], 4)
        a = plus(times(i00, y0), i01, y1)
        b = plus(times(i01, y0), i11, y1)
        for tile in range(pattern.start[k + 1] - 1, pattern.start[k], -1):
            l00, l01, l10, l11 = load_rows(matrix, 4 * tile, 4)
            row = pattern.unknown[tile]
            x0 = load_each(sides, row)
            x1 = load_each(sides, row + 1)
            a = plus(plus(a, -l00, x0), -l10, x1)
            b = plus(plus(b, -l01, x0), -l11, x1)
        store_each(sides, first, a)
        store_each(sides, first + 1, b)


@compiled
def solve(pattern, rows, matrix, sides):
    """Replace each of the right-hand sides, a tuple of arrays, by its solution.

    Unknown i is in row i, and there is one row more, see `pattern.NONE`. `rows` is `pattern.below`,
    or `pattern.reached` if only the multipliers' rows are not zero. Two sides at once take less
    time than one after the other.
    """
    forward(rows, matrix, sides)
    backward(pattern, matrix, sides)


@compiled
def soften_multipliers(pattern, matrix, part):
    """Replace the zeros on the multipliers' diagonal by −`part` Σ Φ_ki² / M_ii, if A is M."""
    for k in range(pattern.columns):
        if not pattern.is_multiplier[k]:
            diagonal = pattern.start[k]
            first = part / load(matrix, 4 * diagonal)
            second = part / load(matrix, 4 * diagonal + 3)
            for tile in range(diagonal + 1, pattern.start[k + 1]):
                if pattern.is_multiplier[pattern.row[tile]]:
                    entry = 4 * pattern.start[pattern.row[tile]]
                    v00, v01, v10, v11 = load_rows(matrix, 4 * tile, 4)
                    add_to(matrix, entry, -(v00 * v00 * first + v01 * v01 * second))
                    add_to(matrix, entry + 3, -(v10 * v10 * first + v11 * v11 * second))
