"""Gears and racks: bodies that roll on each other without slipping.

The rows of these joints keep the values that they have at the start, so the bodies may be put
together at any angle.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.arguments import frozen
from flexband.errors import InputError, check_finite
from flexband.mechanics.joints.joint import (
    PairJoint,
    PointName,
    Resolve,
    along,
    check_axis,
    straight,
)
from flexband.mechanics.kernels.forms import Form, Vector, angle, dot, scale, subtract


@frozen()
class Gear(PairJoint):
    """Two gears in mesh: they roll on each other without slipping.

    With the angles θ₁ and θ₂ of the gears and θ of the line of centres, the change of
    r₁ θ₁ + r₂ θ₂ since the start equals that of (r₁ + r₂) θ. The centres may move: on a turning arm
    the gears are planets. Other joints must keep the centres r₁ + r₂ apart. The reaction is the
    force that the second gear exerts on the teeth of the first one, along the common tangent; the
    pressure angle is zero.

    Parameters
    ----------
    first, second : the centres of the gears, points of the bodies that turn.
    first_radius, second_radius : of the pitch circles [m]; negative for a ring gear, whose teeth
        are inside.

    Raises
    ------
    InputError
        If a radius is zero, or if their sum is: such gears turn together.

    Examples
    --------
    >>> def disc(radius, x):
    ...     return fb.RigidBody.disc(radius=radius, width=0.01, density=7800.0, position=(x, 0.0))
    ...
    >>> train = fb.Mechanism(
    ...     bodies={"wheel": disc(0.2, 0.0), "pinion": disc(0.1, 0.3)},
    ...     joints={
    ...         "axle": fb.Revolute("wheel", (0.0, 0.0)),
    ...         "shaft": fb.Revolute("pinion", (0.3, 0.0)),
    ...         "mesh": fb.Gear("wheel", "pinion", first_radius=0.2, second_radius=0.1),
    ...         "motor": fb.PrescribedRotation("wheel", lambda t: 3 * t),
    ...     },
    ...     sensors={"pinion": fb.Angle("pinion")},
    ... )
    >>> fb.simulate(train, duration=0.5, step=0.05).values[0, -1:].round(4)  # [rad]
    array([-3.])
    """

    first: PointName
    second: PointName
    first_radius: ArrayLike
    second_radius: ArrayLike

    holds_start = True

    def __post_init__(self) -> None:
        radii = [
            check_finite(f"Gear {name} [m]", getattr(self, name))
            for name in ("first_radius", "second_radius")
        ]
        if np.any(radii[0] == 0) or np.any(radii[1] == 0) or np.any(radii[0] + radii[1] == 0):
            raise InputError(
                "Gear radii must not be zero, nor their sum; "
                f"got {self.first_radius} and {self.second_radius}"
            )

    @property
    def radii(self) -> tuple[np.ndarray, np.ndarray]:
        """Both radii [m]."""
        first = np.asarray(self.first_radius, dtype=float)
        return first, np.asarray(self.second_radius, dtype=float)

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return r₁ θ₁ + r₂ θ₂ − (r₁ + r₂) θ."""
        (r1, r2), first, second = self.radii, frame(self.first), frame(self.second)
        centres = subtract(second.position, first.position)
        return [angle(first.normal) * r1 + angle(second.normal) * r2 - angle(centres) * (r1 + r2)]

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ along the tangent, the line of centres turned by 90°."""
        r1, r2 = self.radii
        centres = subtract(frame(self.second).position, frame(self.first).position)
        return scale(multipliers[0] * (-1 / (r1 + r2)), (-centres[1], centres[0]))

    def moment(self, multipliers: Sequence[Form]) -> Form:
        """Return −λ r₁ about the first gear's centre."""
        return -multipliers[0] * self.radii[0]


@frozen()
class Rack(PairJoint):
    """A pinion on a rack: it rolls along a line of another body without slipping.

    With the travel x of the pinion along the axis and its angle θ, both relative to the rack,
    x + r θ keeps its value: the rack is to the right of the direction of the axis. Other joints
    must keep the centre of the pinion at its distance from the rack.

    Parameters
    ----------
    first : the centre of the pinion.
    second : a point of the rack, on a rigid body or the ground.
    radius : of the pitch circle [m]; negative for a rack to the left of the axis.
    axis : along the rack, in the axes of its body; any length but zero.

    Raises
    ------
    InputError
        If the radius is zero or the axis has no length and, when the mechanism is made, if the rack
        is on a flexible member.
    """

    first: PointName
    second: PointName
    radius: ArrayLike
    axis: tuple[float, float] = (1.0, 0.0)

    holds_start = True

    def __post_init__(self) -> None:
        if np.any(check_finite("Rack radius [m]", self.radius) == 0):
            raise InputError(f"Rack radius [m] must not be zero; got {self.radius}")
        check_axis("Rack axis", self.axis)

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return x + r θ."""
        pinion, rack = frame(self.first), straight("Rack", frame(self.second))
        r = np.asarray(self.radius, dtype=float)
        travel = dot(along(rack, self.axis), subtract(pinion.position, rack.position))
        return [travel + angle(pinion.normal) * r - angle(rack.normal) * r]

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ along the axis."""
        return scale(-multipliers[0], along(frame(self.second), self.axis))

    def moment(self, multipliers: Sequence[Form]) -> Form:
        """Return −λ r about the pinion's centre."""
        return -multipliers[0] * np.asarray(self.radius, dtype=float)
