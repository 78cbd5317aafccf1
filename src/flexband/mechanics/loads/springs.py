"""Springs, dampers and actuators between two points, along their distance or their angle."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from flexband.arguments import frozen
from flexband.errors import InputError, check_angle, check_finite, check_non_negative
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.kernels.forms import moves, subtract
from flexband.mechanics.loads.load import Entries, InTime, LoadModel, SpringEntry, in_time


@frozen()
class Spring:
    """A translational spring, damper and actuator between two points.

    It pulls with the force k (ℓ − ℓ₀) + k₃ (ℓ − ℓ₀)³ + d ℓ̇ + f(t) along its line.

    Parameters
    ----------
    first, second : the points that it joins.
    stiffness : k [N/m].
    rest_length : ℓ₀ [m], or None for a spring that is relaxed at the start, after assembly.
    cubic : k₃ [N/m³].
    damping : d [N s/m].
    pull : f [N], positive if it draws the points together.

    Raises
    ------
    InputError
        If the stiffness, rest length or damping is negative, or a number is not finite.
    """

    first: PointName
    second: PointName
    stiffness: ArrayLike = 0.0
    rest_length: ArrayLike | None = None
    cubic: ArrayLike = 0.0
    damping: ArrayLike = 0.0
    pull: InTime = 0.0

    def __post_init__(self) -> None:
        check_non_negative("Spring stiffness [N/m]", self.stiffness)
        if self.rest_length is not None:
            check_non_negative("Spring rest_length [m]", self.rest_length)
        check_finite("Spring cubic [N/m³]", self.cubic)
        check_non_negative("Spring damping [N s/m]", self.damping)
        in_time("Spring pull [N]", self.pull)

    @property
    def points(self) -> Sequence[PointName]:
        """Both points."""
        return [self.first, self.second]

    def enters(self, model: LoadModel) -> Entries:
        """Return a spring along r_first − r_second."""
        apart = subtract(model.frame(self.first).position, model.frame(self.second).position)
        pull = in_time("pull", self.pull)
        numbers = (self.stiffness, self.rest_length, self.cubic, self.damping, pull)
        return Entries(springs=[SpringEntry([apart], *numbers)])


@frozen()
class TorsionSpring:
    """A spring, damper and actuator that turns two bodies, or a body and the ground.

    It exerts the moment −(k (φ − φ₀) + k₃ (φ − φ₀)³ + d φ̇) + T(t) on the first body and the
    opposite moment on the second, where φ is the angle of the first less that of the second. On a
    beam it acts on the section.

    Parameters
    ----------
    first, second : points of the bodies.
    stiffness : k [N m/rad].
    rest_angle : φ₀ [rad], or None for a spring that is relaxed at the start, after assembly. It is
        counted from the full turn nearest to φ at the start; later turns are counted.
    cubic : k₃ [N m/rad³].
    damping : d [N m s/rad]; alone it is the viscous friction of a pin.
    torque : T [N m], a motor between the two.

    Raises
    ------
    InputError
        If the stiffness or damping is negative, or a number is not finite.
    """

    first: PointName
    second: PointName
    stiffness: ArrayLike = 0.0
    rest_angle: ArrayLike | None = None
    cubic: ArrayLike = 0.0
    damping: ArrayLike = 0.0
    torque: InTime = 0.0

    def __post_init__(self) -> None:
        check_non_negative("TorsionSpring stiffness [N m/rad]", self.stiffness)
        check_non_negative("TorsionSpring damping [N m s/rad]", self.damping)
        check_finite("TorsionSpring cubic [N m/rad³]", self.cubic)
        if self.rest_angle is not None:
            check_angle("TorsionSpring rest_angle", self.rest_angle, turns=4.0)
        in_time("TorsionSpring torque [N m]", self.torque)

    @property
    def points(self) -> Sequence[PointName]:
        """Both points."""
        return [self.first, self.second]

    def enters(self, model: LoadModel) -> Entries:
        """Return a spring along the angle between the normals of the two sections."""
        normals = [model.frame(point).normal for point in self.points]
        if not any(map(moves, normals)):
            raise InputError("a TorsionSpring must join a body that rotates")
        pull = -in_time("torque", self.torque)
        numbers = (self.stiffness, self.rest_angle, self.cubic, self.damping, pull)
        return Entries(springs=[SpringEntry(normals, *numbers)])
