"""Joints: rows of at most quadratic constraints Φ(q, t) = 0, Eq. (26)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.arguments import frozen
from flexband.errors import check_angle, check_flag, check_positive
from flexband.mechanics.joints.joint import (
    Couple,
    PairJoint,
    PointName,
    Resolve,
    along,
    check_axis,
    couple,
    straight,
)
from flexband.mechanics.kernels.forms import (
    Form,
    Frame,
    Vector,
    cross,
    dot,
    scale,
    subtract,
    turned,
)


class AlignedJoint(PairJoint):
    """A joint whose bodies keep the angle between their sections."""

    angle: ArrayLike

    def _normals(self, frame: Resolve) -> tuple[Vector, Vector]:
        return turned(frame(self.second).normal, self.angle), frame(self.first).normal

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return the cosine of the angle between the sections."""
        return [dot(*self._normals(frame))]


class LineJoint(PairJoint):
    """A joint whose first point stays on a straight line through the second one."""

    axis: tuple[float, float]

    def _normal(self, line: Frame) -> Vector:
        return along(line, (-self.axis[1], self.axis[0]))

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return n · (r_first − r_second), with n across the line."""
        line = straight(type(self).__name__, frame(self.second))
        return [dot(self._normal(line), subtract(frame(self.first).position, line.position))]

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ n."""
        return scale(-multipliers[0], self._normal(frame(self.second)))


@frozen()
class Revolute(PairJoint):
    """A pin: the two points coincide."""

    first: PointName
    second: PointName

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return r_first − r_second."""
        return list(subtract(frame(self.first).position, frame(self.second).position))

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ."""
        return -multipliers[0], -multipliers[1]


@frozen()
class Weld(AlignedJoint):
    """A clamp: the points coincide, and the sections there keep the angle between them.

    Parameters
    ----------
    first, second : the points.
    angle : from the normal of the second section (the x axis of a rigid body) to the normal of the
        first one [rad].
    axis : whether the axes of the two bodies keep their angle as well, and not only the sections.
        This is the built-in end of the literature on these elements: it forbids shear there, which
        matters on coarse meshes only. At least one of the points must belong to a beam.

    Raises
    ------
    InputError
        If the angle is not finite.
    """

    first: PointName
    second: PointName
    angle: ArrayLike = 0.0
    axis: bool = False

    def __post_init__(self) -> None:
        check_angle("Weld angle", self.angle)
        check_flag("Weld axis", self.axis)

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return r_first − r_second, the sine of the angle between the sections, and with `axis`
        that of the angle between the axes.
        """  # noqa: D205
        first, second = frame(self.first), frame(self.second)
        rows = [*subtract(first.position, second.position), cross(*self._normals(frame))]
        return [*rows, cross(turned(second.x, self.angle), first.x)] if self.axis else rows

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ of the positions."""
        return -multipliers[0], -multipliers[1]

    def moments(self, frame: Resolve, multipliers: Sequence[Form]) -> list[Couple]:
        """Return the moments of the angle between the sections, and of that between the axes."""
        first, second = frame(self.first), frame(self.second)
        couples = [couple(multipliers[2], (first, first.normal), (second, second.normal))]
        if self.axis:
            couples.append(couple(multipliers[3], (first, first.x), (second, second.x)))
        return couples


@frozen()
class Prismatic(LineJoint, AlignedJoint):
    """A slide: the first point stays on a line, and its body does not rotate against the other.

    Parameters
    ----------
    first : the point that slides.
    second : a point of the line, on a rigid body or the ground.
    axis : direction of the line in the axes of the second body; any length but zero.
    angle : from the axes of the second body to those of the first [rad].

    Raises
    ------
    InputError
        If the axis has no length or a number is not finite and, when the mechanism is made, if the
        line is on a flexible member.
    """

    first: PointName
    second: PointName
    axis: tuple[float, float] = (1.0, 0.0)
    angle: ArrayLike = 0.0

    def __post_init__(self) -> None:
        check_axis("Prismatic axis", self.axis)
        check_angle("Prismatic angle", self.angle)

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return n · (r_first − r_second) and the sine of the angle between the bodies."""
        return [*super().constraints(frame), cross(*self._normals(frame))]

    def moments(self, frame: Resolve, multipliers: Sequence[Form]) -> list[Couple]:
        """Return −λ of the angle, times the length of the slider's normal."""
        slider = frame(self.first)
        return [couple(multipliers[1], (slider, slider.normal))]


@frozen()
class Slot(LineJoint):
    """A pin in a straight slot: the first point stays on a line, its body may rotate.

    Parameters
    ----------
    first : the pin.
    second : a point of the slot's line, on a rigid body or the ground.
    axis : direction of the line in the axes of the second body; any length but zero.

    Raises
    ------
    InputError
        If the axis has no length and, when the mechanism is made, if the line is on a flexible
        member.
    """

    first: PointName
    second: PointName
    axis: tuple[float, float] = (1.0, 0.0)

    def __post_init__(self) -> None:
        check_axis("Slot axis", self.axis)


@frozen()
class Distance(PairJoint):
    """A rigid rod without mass between two points.

    Parameters
    ----------
    first, second : the points.
    length : of the rod [m].

    Raises
    ------
    InputError
        If the length is not positive.
    """

    first: PointName
    second: PointName
    length: ArrayLike

    def __post_init__(self) -> None:
        check_positive("Distance length [m]", self.length)

    def rods(self, frame: Resolve) -> list[Vector]:
        """Return d = r_first − r_second."""
        return [subtract(frame(self.first).position, frame(self.second).position)]

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return (d · d − ℓ²)/2ℓ with d = r_first − r_second; λ is then the force in the rod."""
        (apart,) = self.rods(frame)
        length = np.asarray(self.length, dtype=float)
        return [dot(apart, apart) * (0.5 / length) - Form.constant(0.5 * length)]

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ d/ℓ."""
        (apart,) = self.rods(frame)
        return scale(-multipliers[0] * (1 / np.asarray(self.length, dtype=float)), apart)
