"""Drives: joints that prescribe a motion in time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_function
from flexband.errors import InputError
from flexband.mechanics.joints.joint import (
    Couple,
    Held,
    HoldingJoint,
    PairJoint,
    PointName,
    Resolve,
    check_axis,
    couple,
    held_turn,
)
from flexband.mechanics.joints.joints import AlignedJoint
from flexband.mechanics.kernels.forms import (
    Composed,
    Form,
    Frame,
    TimeFunction,
    constant_vector,
    dot,
    length,
    moves,
    section_normal,
    subtract,
)
from flexband.mechanics.kernels.relation_forms import alignment, along

GROUND = (0.0, 0.0)


@frozen()
class PrescribedRotation(AlignedJoint):
    """A drive of the angle between two bodies, such as two links of an arm, or to the X axis.

    Parameters
    ----------
    first : a point of the driven body. The angle is that of the normal of its section (the x axis
        of a rigid body).
    second : a point of the body from which the angle counts, and which takes the opposite moment.
        It may be left out, as in ``PrescribedRotation(first, angle)``, for the ground.
    angle : function of the time [s] that returns radians, a number or an array of shape (n,), with
        any number of turns. The angle at the start must be within 90° of it.

    Raises
    ------
    InputError
        If the angle is not a function.

    Examples
    --------
    >>> def bar(**start):
    ...     return fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=7800.0, **start)
    ...
    >>> arm = fb.Mechanism(
    ...     bodies={"upper": bar(), "lower": bar()},
    ...     joints={
    ...         "shoulder": fb.Revolute("upper.start", (0.0, 0.0)),
    ...         "elbow": fb.Revolute("lower.start", "upper.end"),
    ...         "motor 1": fb.PrescribedRotation("upper", lambda t: 2 * np.pi * t),
    ...         "motor 2": fb.PrescribedRotation("lower", "upper", lambda t: 2 * np.pi * t),
    ...     },
    ...     sensors={"hand": fb.Position("lower.end"), "turn": fb.Angle("lower")},
    ... )
    >>> fb.simulate(arm, duration=0.25, step=1e-3).values[:, -1].round(4)  # 90° and 180°
    array([-0.2   ,  0.2   ,  3.1416])
    """

    first: PointName
    second: Any = GROUND
    angle: Any = None

    def __post_init__(self) -> None:
        if self.angle is None:
            object.__setattr__(self, "angle", self.second)
            object.__setattr__(self, "second", GROUND)
        check_function("PrescribedRotation angle", self.angle, " of time")

    def _sections(self, frame: Resolve) -> tuple[Frame, Frame]:
        for point in self.points:
            if isinstance(point, str) and not moves(frame(point).y):
                raise InputError(
                    f"PrescribedRotation must have bodies that rotate; {point!r} is a point mass"
                )
        return frame(self.first), frame(self.second)

    def _misalignment(self, frame: Resolve) -> tuple[Form, Form]:
        name = "PrescribedRotation angle [rad]"
        c, s = (Form.function(Composed(outer, self.angle, name)) for outer in (np.cos, np.sin))
        return alignment(*self._sections(frame), c, s)

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return the sine of the angle from the prescribed direction to the first normal."""
        return [self._misalignment(frame)[0]]

    def held(self, frame: Resolve) -> list[Held]:
        return [held_turn(*self._sections(frame), Form.function(self.angle))]

    def moments(self, frame: Resolve, multipliers: Sequence[Form]) -> list[Couple]:
        """Return −λ, times the lengths of both normals."""
        ends = [frame(point) for point in self.points]
        return [couple(multipliers[0], *((end, section_normal(end)) for end in ends))]


@frozen()
class PrescribedTravel(PairJoint, HoldingJoint):
    """A drive: the position of a point along a line.

    Parameters
    ----------
    first : the driven point.
    second : the origin of the line.
    travel : function of the time [s] that returns metres, a number or an array of shape (n,).
    axis : direction of the line in the axes of the second body; any length but zero. On a flexible
        member these are the normal of the section and the perpendicular to its left.

    Raises
    ------
    InputError
        If the travel is not a function or the axis has no length.
    """

    first: PointName
    second: PointName
    travel: TimeFunction
    axis: tuple[float, float] = (1.0, 0.0)

    def __post_init__(self) -> None:
        check_function("PrescribedTravel travel", self.travel, " of time")
        check_axis("PrescribedTravel axis", self.axis)

    def held(self, frame: Resolve) -> list[Held]:
        """Return n · (r_first − r_second) less the travel times |n|, with n along the axis."""
        second = frame(self.second)
        travel = Form.function(self.travel)
        axis = along(second, self.axis)
        size = Form.constant(1.0) if second.rigid else length(axis)
        separation = subtract(frame(self.first).position, second.position)
        return [Held(dot(axis, separation) - travel * size, axis)]


@frozen()
class PrescribedPath(HoldingJoint):
    """A drive: the position of a point in global axes.

    Parameters
    ----------
    first : the driven point.
    x, y : functions of the time [s] that return metres, a number or an array of shape (n,).

    Raises
    ------
    InputError
        If x or y is not a function.
    """

    first: PointName
    x: TimeFunction
    y: TimeFunction

    def __post_init__(self) -> None:
        check_function("PrescribedPath x", self.x, " of time")
        check_function("PrescribedPath y", self.y, " of time")

    def held(self, frame: Resolve) -> list[Held]:
        """Return r − (x, y)."""
        path = Form.function(self.x), Form.function(self.y)
        rows = subtract(frame(self.first).position, path)
        axes = constant_vector((1.0, 0.0)), constant_vector((0.0, 1.0))
        return [Held(row, axis) for row, axis in zip(rows, axes, strict=True)]
