"""Force laws: compiled functions of time, positions, velocities and parameters.

The engine calls a law through its address, so it need not be compiled again for a new law.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numba import cfunc, njit
from numba.core.dispatcher import Dispatcher
from numba.core.errors import NumbaError
from numba.np.numpy_support import carray
from numpy.typing import ArrayLike

from flexband.errors import InputError, non_negative
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.kernels.lanes import WIDTH
from flexband.mechanics.kernels.laws import AXES
from flexband.mechanics.loads.load import Entries, InTime, LawEntry, Model, in_time

Law = Callable[..., None]
"""``law(t, x, v, p, force)``: time [s], positions and velocities of the points, the parameters.

Rows of `x` are (X, Y, θ), turns counted, rows of `v` their rates, shape (points, 3). It fills the
rows of `force`, (F_X, F_Y, M): force [N] on each point and moment [N m] on its body.
"""


@dataclass(frozen=True)
class ForceLaw:
    """Forces and moments on points by a user's function.

    Parameters
    ----------
    points : where the forces act. Points of the ground are allowed, so that the law can read them.
    law : ``law(t, x, v, p, force)``, a Python function that Numba can compile, or a compiled one.
        It receives the time [s], the positions and velocities of the points as arrays of shape
        (points, 3) with rows (X, Y, θ), and the parameters, shape (parameters,). It fills `force`,
        zeros of shape (points, 3), with rows (F_X, F_Y, M). On a beam, θ and M belong to the
        section. Define the function outside the builder of a study, since each new function is
        compiled. Compiled code does not check indices.
    parameters : numbers, arrays of shape (n,), or functions of the time [s].

    Raises
    ------
    InputError
        If there is no point, a parameter is neither finite nor a function of time, or the law
        does not compile.
    """

    points: Sequence[PointName]
    law: Law
    parameters: Sequence[InTime] = ()

    def __post_init__(self) -> None:
        if isinstance(self.points, str) or not len(self.points):
            raise InputError(f"ForceLaw points must be a list of points; got {self.points!r}")
        for k, value in enumerate(self.parameters):
            in_time(f"ForceLaw parameter {k}", value)
        if not callable(self.law):
            raise InputError(f"ForceLaw law must be a function; got {self.law!r}")
        compiled_law(self.law, len(self.points), len(self.parameters))

    def enters(self, model: Model) -> Entries:
        """Return the law."""
        frames = [model.frame(point) for point in self.points]
        function = compiled_law(self.law, len(frames), len(self.parameters))
        return Entries(laws=[LawEntry(frames, function, self.parameters)])


@lru_cache
def compiled_law(law: Law, points: int, parameters: int) -> Any:
    """Return a law as a C function of the memory that `kernels.laws` describes, for all lanes.

    Raises
    ------
    InputError
        If it does not compile.
    """
    one = law if isinstance(law, Dispatcher) else njit(error_model="numpy")(law)
    size = points * AXES
    start_x = 1 + parameters
    start_v, start_force, rows = start_x + size, start_x + 2 * size, start_x + 3 * size

    def every_lane(memory):
        lanes = carray(memory, (rows, WIDTH))
        p = np.empty(parameters)
        x, v, force = np.empty((points, 3)), np.empty((points, 3)), np.empty((points, 3))
        for lane in range(WIDTH):
            for k in range(parameters):
                p[k] = lanes[1 + k, lane]
            for k in range(size):
                x.flat[k] = lanes[start_x + k, lane]
                v.flat[k] = lanes[start_v + k, lane]
                force.flat[k] = 0.0
            one(lanes[0, lane], x, v, p, force)
            for k in range(size):
                lanes[start_force + k, lane] = force.flat[k]

    try:
        return cfunc("void(CPointer(float64))", error_model="numpy")(every_lane)
    except NumbaError as error:
        raise InputError(f"the law {law!r} does not compile: {error}") from None


@dataclass(frozen=True)
class ViscousFriction:
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
        non_negative("ViscousFriction damping [N s/m]", self.damping)

    @property
    def points(self) -> Sequence[PointName]:
        """Both points."""
        return [self.first, self.second]

    def enters(self, model: Model) -> Entries:
        """Return the law."""
        return ForceLaw(self.points, drag, (self.damping,)).enters(model)


def drag(t, x, v, p, force):
    """Fill in the forces of a `ViscousFriction`."""
    for axis in range(2):
        force[0, axis] = -p[0] * (v[0, axis] - v[1, axis])
        force[1, axis] = -force[0, axis]
