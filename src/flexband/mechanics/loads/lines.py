"""Lines between points of a force law: further rows of what it reads and fills.

The row of a line between the points i and j is (ℓ, 0, φ): their distance, and the angle of i less
that of j, with turns counted. Its forces do work on these: F on ℓ, so that it pushes the points
apart, and M on φ, which turns i, and j the other way. The row of a place of i within the body of j
is (x, y, φ) in the axes of that body, and its forces are along these axes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.basics.words import value_text
from flexband.compilation.functions import compiled
from flexband.errors import InputError


def check_lines(name: str, lines: Sequence[tuple[int, int]], points: int) -> None:
    """Raise `InputError` if these are not pairs of numbers of points."""
    requirement = f"a list of pairs of different numbers of points, 0 to {points - 1}"
    if not isinstance(lines, list | tuple):
        raise InputError(f"ForceLaw {name} must be {requirement}; got {value_text(lines)}")
    for pair in lines:
        if (
            not isinstance(pair, list | tuple)
            or len(pair) != 2
            or any(type(k) is not int or not 0 <= k < points for k in pair)
            or pair[0] == pair[1]
        ):
            raise InputError(f"ForceLaw {name} must be {requirement}; got {value_text(pair)}")


@compiled
def add_lines(lines, points, x, v):
    """Add the rows of lines to x and v, behind those of points."""
    for n in range(len(lines)):
        i = lines[n, 0]
        j = lines[n, 1]
        row = points + n
        dx = x[i, 0] - x[j, 0]
        dy = x[i, 1] - x[j, 1]
        du = v[i, 0] - v[j, 0]
        dv = v[i, 1] - v[j, 1]
        x[row, 2] = x[i, 2] - x[j, 2]
        v[row, 2] = v[i, 2] - v[j, 2]
        # In the axes of the second body, or along the line itself.
        if lines[n, 2]:
            c = np.cos(x[j, 2])
            s = np.sin(x[j, 2])
            w = v[j, 2]
            x[row, 0] = c * dx + s * dy
            x[row, 1] = c * dy - s * dx
            v[row, 0] = c * du + s * dv + w * x[row, 1]
            v[row, 1] = c * dv - s * du - w * x[row, 0]
        else:
            x[row, 0] = np.sqrt(dx * dx + dy * dy)
            x[row, 1] = 0.0
            v[row, 0] = (dx * du + dy * dv) / max(x[row, 0], 1e-300)
            v[row, 1] = 0.0


@compiled
def pass_on(lines, points, x, force):
    """Add the forces of lines to those of their points."""
    for n in range(len(lines)):
        i = lines[n, 0]
        j = lines[n, 1]
        row = points + n
        dx = x[i, 0] - x[j, 0]
        dy = x[i, 1] - x[j, 1]
        # The force in global axes; in those of the second body it turns that one as well.
        if lines[n, 2]:
            c = np.cos(x[j, 2])
            s = np.sin(x[j, 2])
            fx = c * force[row, 0] - s * force[row, 1]
            fy = s * force[row, 0] + c * force[row, 1]
            force[j, 2] -= dx * fy - dy * fx
        else:
            push = force[row, 0] / max(x[row, 0], 1e-300)
            fx = push * dx
            fy = push * dy
        force[i, 0] += fx
        force[i, 1] += fy
        force[i, 2] += force[row, 2]
        force[j, 0] -= fx
        force[j, 1] -= fy
        force[j, 2] -= force[row, 2]
