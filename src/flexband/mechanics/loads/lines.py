"""Lines between points of a force law: further rows of what it reads and fills.

The row of a line between the points i and j is (ℓ, 0, φ): their distance, and the angle of i less
that of j, with turns counted. Its forces do work on these: F on ℓ, so that it pushes the points
apart, and M on φ, which turns i, and j the other way.
"""

from __future__ import annotations

import numpy as np

from flexband.compilation.machine_code import compiled
from flexband.errors import InputError, shown


def check_lines(between: object, points: int) -> None:
    """Raise `InputError` if these are not pairs of numbers of points."""
    allowed = f"a list of pairs of different numbers of points, 0 to {points - 1}"
    if not isinstance(between, list | tuple):
        raise InputError(f"ForceLaw between must be {allowed}; got {shown(between)}")
    for pair in between:
        if (
            not isinstance(pair, list | tuple)
            or len(pair) != 2
            or any(type(k) is not int or not 0 <= k < points for k in pair)
            or pair[0] == pair[1]
        ):
            raise InputError(f"ForceLaw between must be {allowed}; got {shown(pair)}")


@compiled
def add_lines(pairs, points, x, v):
    """Add the rows of lines to x and v, behind those of points."""
    for n in range(len(pairs)):
        i, j, row = pairs[n, 0], pairs[n, 1], points + n
        dx, dy = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1]
        du, dv = v[i, 0] - v[j, 0], v[i, 1] - v[j, 1]
        length = np.sqrt(dx * dx + dy * dy)
        x[row, 0], x[row, 1], x[row, 2] = length, 0.0, x[i, 2] - x[j, 2]
        v[row, 0], v[row, 1] = (dx * du + dy * dv) / max(length, 1e-300), 0.0
        v[row, 2] = v[i, 2] - v[j, 2]


@compiled
def pass_on(pairs, points, x, force):
    """Add the forces of lines to those of their points."""
    for n in range(len(pairs)):
        i, j, row = pairs[n, 0], pairs[n, 1], points + n
        push = force[row, 0] / max(x[row, 0], 1e-300)
        for axis in range(2):
            along = push * (x[i, axis] - x[j, axis])
            force[i, axis] += along
            force[j, axis] -= along
        force[i, 2] += force[row, 2]
        force[j, 2] -= force[row, 2]
