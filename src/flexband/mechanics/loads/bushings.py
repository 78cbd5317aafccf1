"""Bushings: elastic bearings between two bodies, in two directions and in rotation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_instance, check_non_negative
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.loads.characteristic import Characteristic, read_table
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
    rest : d₀ [m, m, rad].
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
            for table in _three("Bushing tables", self.tables, "tables or None"):
                check_instance("Bushing table", table, Characteristic | None)

    @property
    def rest_turn(self) -> ArrayLike:
        return self.rest[2]

    def _numbers(self) -> list[ArrayLike]:
        """Return K and D by rows, and d₀."""
        rest = _three("Bushing rest", self.rest)
        for name, number in zip(NAMES, rest, strict=True):
            check_finite(f"Bushing rest {name}", number)
        stiffness = _matrix("Bushing stiffness", self.stiffness)
        return [*stiffness, *_matrix("Bushing damping", self.damping), *rest]

    def enters(self, model: LoadModel) -> Entries:
        parameters: list[InTime] = [*self._numbers()]
        for table in self.tables or ():
            parameters += table.parameters if table else [0, 0, 0.0]
        return ForceLaw(self.points, bushing, parameters, within=[(0, 1)]).enters(model)


def bushing(t, x, v, p, force):
    """Fill in the forces of a `Bushing`."""
    d = (x[2, 0] - p[18], x[2, 1] - p[19], x[2, 2] - p[20])
    at = 21
    for i in range(3):
        for j in range(3):
            force[2, i] -= p[3 * i + j] * d[j] + p[9 + 3 * i + j] * v[2, j]
        if at < len(p):
            resisting, at = read_table(p, at, d[i], v[2, i])
            force[2, i] -= resisting


def _three(name: str, value: ArrayLike | Sequence, what: str = "numbers") -> list:
    """Return three entries; raise `InputError` if there are not so many."""
    entries = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(entries, list | tuple) or len(entries) != 3:
        raise InputError(f"{name} must be three {what}, of x, y and angle; got {value_text(value)}")
    return list(entries)


def _matrix(name: str, value: ArrayLike | Sequence) -> list:
    """Return a matrix by rows, from its three rows or its diagonal."""
    rows = _three(name, value)
    if all(isinstance(row, list | tuple) for row in rows):  # arrays are numbers of samples
        rows = [_three(name, row) for row in rows]
    else:
        rows = [[rows[i] if i == j else 0.0 for j in range(3)] for i in range(3)]
    for i, of in enumerate(NAMES):
        check_non_negative(f"{name} of {of}", rows[i][i])
        for j in range(i):
            lower = check_finite(name, rows[i][j])
            upper = check_finite(name, rows[j][i])
            if not np.allclose(lower, upper, rtol=1e-12, atol=0.0):
                raise InputError(f"{name} must be symmetric; got {lower} and {upper}")
    return [entry for row in rows for entry in row]
