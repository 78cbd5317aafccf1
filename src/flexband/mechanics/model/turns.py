"""Which turn an angle is on at the start: that on which its body is drawn.

The direction of a section tells its angle but for whole turns. These are counted from the angle
that the body is given: of all angles that fit the assembled direction, the nearest one.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from flexband.mechanics.bodies.body import Body
from flexband.mechanics.kernels.forms import Vector


def drawn_angle(
    vector: Vector,
    bodies: Mapping[str, Body],
    first_coordinates: Mapping[str, int],
    branches: Mapping[str, ArrayLike],
) -> ArrayLike:
    """Return the angle [rad] near which that of a linear vector is at the start.

    It is that of the sections of one body which it depends on, the mean of several. `branches` has
    angles of first sections in place of the given ones. The angle of a vector between bodies, which
    none of them is given, is near 0.
    """
    rows = {n for form in vector for i, j, _ in form.terms for n in (i, j) if n > 0}
    for name, body in bodies.items():
        first = first_coordinates[name]
        if rows and all(first <= row < first + body.size for row in rows):
            angles = [np.asarray(angle, dtype=float) for angle in body.angles()]
            sections = sorted({(row - first) // body.per_node for row in rows})
            shift = branches[name] - angles[0] if name in branches else 0.0
            return sum(angles[n] for n in sections) / len(sections) + shift
    return 0.0


def nearest(angle: ArrayLike, reference: ArrayLike) -> np.ndarray:
    """Return an angle [rad] on the turn that is nearest to a reference."""
    turns = np.round(np.subtract(reference, angle) / (2 * np.pi))
    return np.add(angle, 2 * np.pi * turns)
