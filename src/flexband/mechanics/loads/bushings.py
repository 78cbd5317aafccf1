"""Bushings: elastic bearings between two bodies, in two directions and in rotation."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.arguments import frozen
from flexband.errors import InputError, check_finite, check_instance, check_non_negative, shown
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.loads.characteristic import Characteristic
from flexband.mechanics.loads.force_laws import ForceLaw
from flexband.mechanics.loads.load import Entries, InTime, LoadModel, PairLoad

NAMES = ("x", "y", "angle")


@frozen()
class Bushing(PairLoad):
    """An elastic bearing, as of rubber, that holds two points of two bodies together.

    With d = (x, y, φ), the place of the first point in the axes of the second body and the angle
    between the bodies, it exerts −K (d − d₀) − D ḋ on the first body at its point, and the opposite
    on the second body there. On a flexible member the axes are those of the section.

    Parameters
    ----------
    first, second : the points.
    stiffness : (k_x, k_y, k_φ) in N/m, N/m and N m/rad, or the matrix K, three rows of three, which
        must be symmetric. Each number may be an array of shape (n,).
    damping : the same of D, in N s/m and N m s/rad.
    rest : d₀ [m, m, rad]. φ counts from the full turn nearest to its rest.
    tables : None, or three entries for x, y and φ, each None or a `Characteristic` of an additional
        force that resists d − d₀ and ḋ.

    Raises
    ------
    InputError
        If these are not three numbers or three rows of three, one is not finite, a stiffness or
        damping on the diagonal is negative, or a matrix is not symmetric.

    Examples
    --------
    >>> wheel = fb.Mechanism(
    ...     bodies={"wheel": fb.RigidBody(mass=2.0, inertia=0.1)},
    ...     loads={
    ...         "gravity": fb.Gravity(),
    ...         "rubber": fb.loads.Bushing("wheel", (0.0, 0.0), stiffness=(1e4, 1e5, 50.0)),
    ...     },
    ...     sensors={"wheel": fb.Position("wheel")},
    ... )
    >>> fb.equilibrium(wheel).values.round(6)  # −m g/k_y [m]
    array([ 0.      , -0.000196])
    """

    first: PointName
    second: PointName
    stiffness: ArrayLike | Sequence
    damping: ArrayLike | Sequence = (0.0, 0.0, 0.0)
    rest: Sequence[ArrayLike] = (0.0, 0.0, 0.0)
    tables: Sequence[Characteristic | None] | None = None

    def __post_init__(self) -> None:
        self._numbers()
        if self.tables is not None:
            allowed = "three of None and Characteristic"
            check_instance("Bushing tables", self.tables, Sequence, allowed)
            if len(self.tables) != len(NAMES):
                raise InputError(f"Bushing tables must be {allowed}; got {len(self.tables)}")
            for table in self.tables:
                if table is not None:
                    check_instance("Bushing tables", table, Characteristic, allowed)

    def _numbers(self) -> list[ArrayLike]:
        """Return K and D by rows, and d₀."""
        rest = _three("Bushing rest", self.rest)
        for name, number in zip(NAMES, rest, strict=True):
            check_finite(f"Bushing rest {name}", number)
        matrices = [
            _matrix(f"Bushing {name}", rows)
            for name, rows in (("stiffness", self.stiffness), ("damping", self.damping))
        ]
        return [*matrices[0], *matrices[1], *rest]

    def enters(self, model: LoadModel) -> Entries:
        parameters: list[InTime] = [*self._numbers()]
        for table in self.tables or ():
            rows, places, speeds = table.rows if table else ([], 0, 0)
            factor = table.factor if table else 0.0
            parameters += [places, speeds, factor, *(np.squeeze(row) for row in rows)]
        return ForceLaw(self.points, bushing, parameters).enters(model)


def bushing(t, x, v, p, force):
    """Fill in the forces of a `Bushing`."""
    c, s, w = math.cos(x[1, 2]), math.sin(x[1, 2]), v[1, 2]
    X, Y, U, V = x[0, 0] - x[1, 0], x[0, 1] - x[1, 1], v[0, 0] - v[1, 0], v[0, 1] - v[1, 1]
    along, across, turn = c * X + s * Y, c * Y - s * X, x[0, 2] - x[1, 2] - p[20]
    turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
    d = (along - p[18], across - p[19], turn)
    u = (c * U + s * V + w * across, c * V - s * U - w * along, v[0, 2] - w)
    at = 21
    for i in range(3):
        f = 0.0
        for j in range(3):
            f -= p[3 * i + j] * d[j] + p[9 + 3 * i + j] * u[j]
        if at < len(p):  # a table, as in `kernels.springs`
            places, speeds, factor = int(p[at]), int(p[at + 1]), p[at + 2]
            first, second = at + 3, at + 3 + places
            at = second + speeds + places * speeds
            for k in range(places):
                a = 1.0 if k == 0 else d[i] - p[first + k - 1]
                a = max(a, 0.0) if k > 1 else a
                for m in range(speeds):
                    b = 1.0 if m == 0 else u[i] - p[second + m - 1]
                    b = max(b, 0.0) if m > 1 else b
                    f -= factor * p[second + speeds + k * speeds + m] * a * b
        force[0, i] = f
    along, across = force[0, 0], force[0, 1]
    force[0, 0], force[0, 1] = c * along - s * across, s * along + c * across
    force[1, 0], force[1, 1] = -force[0, 0], -force[0, 1]
    force[1, 2] = -force[0, 2] - (X * force[0, 1] - Y * force[0, 0])


def _three(name: str, given: ArrayLike | Sequence) -> list:
    """Return three entries; raise `InputError` if there are not so many."""
    if not isinstance(given, list | tuple | np.ndarray) or np.shape(given)[:1] != (3,):
        raise InputError(f"{name} must be three numbers, of x, y and angle; got {shown(given)}")
    return list(given)


def _matrix(name: str, given: ArrayLike | Sequence) -> list:
    """Return a matrix by rows, from its three rows or its diagonal."""
    rows = _three(name, given)
    if all(isinstance(row, list | tuple) for row in rows) or np.shape(given) == (3, 3):
        matrix = [entry for row in rows for entry in _three(name, row)]
    else:
        matrix = [rows[i] if i == j else 0.0 for i in range(3) for j in range(3)]
    for i, of in enumerate(NAMES):
        check_non_negative(f"{name} of {of}", matrix[4 * i])
        for j in range(i):
            lower, upper = (check_finite(name, matrix[k]) for k in (3 * i + j, 3 * j + i))
            if not np.array_equal(lower, upper):
                raise InputError(f"{name} must be symmetric; got {lower} and {upper}")
    return matrix
