"""Loads by a law: a function of time, positions, velocities and parameters, compiled.

The engine calls the law through its address, so no law needs the engine to be compiled anew.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numba import cfunc, njit
from numba.core.errors import NumbaError
from numba.np.numpy_support import carray
from numpy.typing import ArrayLike

from flexband.errors import InputError, finite, non_negative
from flexband.mechanics.joints.joints import PointName
from flexband.mechanics.kernels.lanes import WIDTH
from flexband.mechanics.kernels.laws import AXES
from flexband.mechanics.loads.loads import InTime, in_time

Law = Callable[..., None]
"""``law(t, x, v, p, force)``: time [s], positions and velocities of the points, the parameters.

Rows of `x` are (X, Y, θ), turns counted, rows of `v` their rates, shape (points, 3). It fills the
rows of `force`, (F_X, F_Y, M): force [N] on each point and moment [N m] on its body.
"""

RELAXED = 1e300  # angle at rest of a torsion spring that is relaxed at the start


@dataclass(frozen=True)
class ForceLaw:
    """Forces and moments on points by a law of the user's own.

    Parameters
    ----------
    points : where the forces act; ground points may be among them, as places to look at.
    law : ``law(t, x, v, p, force)``, a Python function that Numba can compile, or one compiled
        already. It is told time [s], positions and velocities of the points as arrays
        of shape (points, 3) with rows (X, Y, θ), and parameters of shape (parameters,); it fills
        `force`, zeros of shape (points, 3), with rows (F_X, F_Y, M). On a beam θ and M are those of
        the section. Define it outside the builder of a study: each new function is compiled.
        Compiled code does not check indices.
    parameters : numbers, arrays of shape (n,), or functions of the time [s].

    Raises
    ------
    InputError
        Where there is no point, a parameter is neither finite nor a function of time, or the law
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

    def force_law(self) -> ForceLaw:
        """Return itself."""
        return self


@lru_cache
def compiled_law(law: Law, points: int, parameters: int) -> Any:
    """Return a law as a C function of the memory that `law_forces` fills, for all lanes.

    Rows of the memory: t, then p, x, v and force, point by point.

    Raises
    ------
    InputError
        Where it does not compile.
    """
    one = law if hasattr(law, "py_func") else njit(error_model="numpy")(law)
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
class TorsionSpring:
    """A spring, damper and actuator that turns two bodies, or a body and the ground.

    It exerts −(k (φ − φ₀) + k₃ (φ − φ₀)³ + d φ̇) + T(t) on the first body, and the opposite on the
    second, φ being the first's angle less the second's. On a beam it acts on the section.

    Parameters
    ----------
    first, second : points of the bodies.
    stiffness : k [N m/rad].
    rest_angle : φ₀ [rad], or None for a spring that is relaxed at the start, once the mechanism is
        assembled. φ starts between −π and π; then its turns are counted.
    cubic : k₃ [N m/rad³].
    damping : d [N m s/rad]; alone it is the viscous friction of a pin.
    torque : T [N m], a motor between the two.

    Raises
    ------
    InputError
        Where stiffness or damping is negative or a number is not finite.
    """

    first: PointName
    second: PointName
    stiffness: ArrayLike = 0.0
    rest_angle: ArrayLike | None = None
    cubic: ArrayLike = 0.0
    damping: ArrayLike = 0.0
    torque: InTime = 0.0

    def __post_init__(self) -> None:
        non_negative("TorsionSpring stiffness [N m/rad]", self.stiffness)
        non_negative("TorsionSpring damping [N m s/rad]", self.damping)
        finite("TorsionSpring cubic [N m/rad³]", self.cubic)
        if self.rest_angle is not None:
            finite("TorsionSpring rest_angle [rad]", self.rest_angle)
        in_time("TorsionSpring torque [N m]", self.torque)

    def force_law(self) -> ForceLaw:
        """Return the law, whose last parameter is the angle at rest."""
        rest = RELAXED if self.rest_angle is None else self.rest_angle
        numbers = (self.stiffness, self.cubic, self.damping, self.torque, rest)
        return ForceLaw((self.first, self.second), twist, numbers)


@dataclass(frozen=True)
class ViscousFriction:
    """Friction in proportion to how fast two points pass each other, as in a guide [N s/m].

    The force on the first is −d (ṙ_first − ṙ_second), on the second the opposite. For the friction
    of a pin, which turns, take a `TorsionSpring` with damping alone.

    Raises
    ------
    InputError
        Where the damping is negative.
    """

    first: PointName
    second: PointName
    damping: ArrayLike

    def __post_init__(self) -> None:
        non_negative("ViscousFriction damping [N s/m]", self.damping)

    def force_law(self) -> ForceLaw:
        """Return the law."""
        return ForceLaw((self.first, self.second), drag, (self.damping,))


def twist(t, x, v, p, force):
    """Fill in the moments of a `TorsionSpring`."""
    angle = x[0, 2] - x[1, 2] - p[4]
    moment = angle * (p[0] + p[1] * angle * angle) + p[2] * (v[0, 2] - v[1, 2]) - p[3]
    force[0, 2] = -moment
    force[1, 2] = moment


def drag(t, x, v, p, force):
    """Fill in the forces of a `ViscousFriction`."""
    for axis in range(2):
        force[0, axis] = -p[0] * (v[0, axis] - v[1, axis])
        force[1, axis] = -force[0, axis]
