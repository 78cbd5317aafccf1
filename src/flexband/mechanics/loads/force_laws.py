"""Force laws: compiled functions of time, positions, velocities and parameters.

The engine calls a law through its address, so it need not be compiled again for a new law.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.arguments import frozen
from flexband.errors import InputError, check_function, check_non_negative, shown
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.loads.compiled_laws import Law, compiled_law
from flexband.mechanics.loads.load import Entries, InTime, LawEntry, LoadModel, PairLoad, in_time


@frozen()
class ForceLaw:
    """Forces and moments on points by a user's function.

    Parameters
    ----------
    points : where the forces act. Points of the ground are allowed, so that the law can read them.
    law : ``law(t, x, v, p, force)``, a Python function that Numba can compile, or a compiled one.
        It receives the time [s], the positions and velocities of the points as arrays of shape
        (points, 3) with rows (X, Y, θ), and the parameters, shape (parameters,). It fills `force`,
        zeros of shape (points, 3), with rows (F_X, F_Y, M). On a beam, θ and M belong to the
        section. It is compiled anew when its code, or a number that it reads from outside, is
        new. A sample in which it raises an error, or forces are not finite, fails.
    parameters : numbers, arrays of shape (n,), or functions of the time [s].

    Raises
    ------
    InputError
        If there is no point, a parameter is neither finite nor a function of time, or the law
        does not compile, returns a value or calls itself.
    """

    points: Sequence[PointName]
    law: Law
    parameters: Sequence[InTime] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.points, list | tuple) or not self.points:
            raise InputError(f"ForceLaw points must be a list of points; got {shown(self.points)}")
        if not isinstance(self.parameters, list | tuple | np.ndarray) or not np.iterable(
            self.parameters
        ):
            given = shown(self.parameters)
            raise InputError(f"ForceLaw parameters must be a list of numbers; got {given}")
        for k, value in enumerate(self.parameters):
            in_time(f"ForceLaw parameter {k}", value)
        check_function("ForceLaw law", self.law)
        compiled_law(self.law, len(self.points), len(self.parameters))

    def enters(self, model: LoadModel) -> Entries:
        """Return the law."""
        frames = [model.frame(point) for point in self.points]
        return Entries(laws=[LawEntry(frames, self.law, self.parameters)])


@frozen()
class ViscousFriction(PairLoad):
    """Friction in proportion to the relative velocity of two points, as in a guide.

    The force on the first is −d (ṙ_first − ṙ_second), on the second the opposite, with the damping
    d [N s/m]. The friction of a pin, which rotates, is a `TorsionSpring` with damping alone.

    Raises
    ------
    InputError
        If the damping is negative.
    """

    first: PointName
    second: PointName
    damping: ArrayLike

    def __post_init__(self) -> None:
        check_non_negative("ViscousFriction damping [N s/m]", self.damping)

    def enters(self, model: LoadModel) -> Entries:
        """Return the law."""
        return ForceLaw(self.points, drag, (self.damping,)).enters(model)


def drag(t, x, v, p, force):
    """Fill in the forces of a `ViscousFriction`."""
    for axis in range(2):
        force[0, axis] = -p[0] * (v[0, axis] - v[1, axis])
        force[1, axis] = -force[0, axis]
