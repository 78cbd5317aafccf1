"""Gears and racks: bodies that roll on each other without slipping.

The rows of these joints keep the values that they have at the start, so the bodies may be put
together at any angle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_positive
from flexband.errors import InputError
from flexband.mechanics.contact.friction import Coulomb, FrictionEntry
from flexband.mechanics.contact.geometry.geometry import Travel
from flexband.mechanics.joints.joint import (
    Held,
    HoldingJoint,
    PairJoint,
    PointName,
    Resolve,
    check_axis,
    straight,
)
from flexband.mechanics.kernels.forms import Form, angle, dot, scale, section_normal, subtract
from flexband.mechanics.kernels.relation_forms import along, turn


@frozen()
class Gear(PairJoint, HoldingJoint):
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
    efficiency : power that leaves the mesh over that which enters it, whichever gear drives.

    Raises
    ------
    InputError
        If a radius is zero, or if their sum is: such gears turn together. If the efficiency is not
        more than 0 and at most 1.

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
    efficiency: ArrayLike = 1.0

    holds_start = True

    def __post_init__(self) -> None:
        first = check_finite("Gear first_radius [m]", self.first_radius)
        second = check_finite("Gear second_radius [m]", self.second_radius)
        if np.any(first == 0) or np.any(second == 0) or np.any(first + second == 0):
            raise InputError(
                "Gear radii must not be zero, nor their sum; "
                f"got {self.first_radius} and {self.second_radius}"
            )
        check_efficiency("Gear", self.efficiency)

    @property
    def radii(self) -> tuple[np.ndarray, np.ndarray]:
        """Both radii [m]."""
        first = np.asarray(self.first_radius, dtype=float)
        return first, np.asarray(self.second_radius, dtype=float)

    def held(self, frame: Resolve) -> list[Held]:
        """Return r₁ θ₁ + r₂ θ₂ − (r₁ + r₂) θ; the force is along the tangent of the circles."""
        (r1, r2), first, second = self.radii, frame(self.first), frame(self.second)
        turns = angle(section_normal(first)) * r1 + angle(section_normal(second)) * r2
        x, y = centres = subtract(second.position, first.position)
        tangent = scale(1 / (r1 + r2), (-y, x))
        return [Held(turns - angle(centres) * (r1 + r2), tangent, moment=r1)]

    def frictions(self, frame: Resolve) -> list[FrictionEntry]:
        """Return the loss of the mesh, on the mean of both travels along the pitch line."""
        (r1, r2), first, second = self.radii, frame(self.first), frame(self.second)
        turn = angle(section_normal(first)) * r1 - angle(section_normal(second)) * r2
        centres = angle(subtract(second.position, first.position)) * (r1 - r2)
        return mesh_loss(self.efficiency, turn - centres)


@frozen()
class Rack(PairJoint, HoldingJoint):
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
    efficiency : as in `Gear`.

    Raises
    ------
    InputError
        If the radius is zero, the axis has no length or the efficiency is out of its range and,
        when the mechanism is made, if the rack is on a flexible member.
    """

    first: PointName
    second: PointName
    radius: ArrayLike
    axis: tuple[float, float] = (1.0, 0.0)
    efficiency: ArrayLike = 1.0

    holds_start = True

    def __post_init__(self) -> None:
        if np.any(check_finite("Rack radius [m]", self.radius) == 0):
            raise InputError(f"Rack radius [m] must not be zero; got {self.radius}")
        check_axis("Rack axis", self.axis)
        check_efficiency("Rack", self.efficiency)

    def _travels(self, frame: Resolve) -> tuple[Form, Form]:
        """Return x and r θ."""
        pinion = frame(self.first)
        rack = straight("Rack", frame(self.second))
        travel = dot(along(rack, self.axis), subtract(pinion.position, rack.position))
        return travel, turn(pinion, rack) * np.asarray(self.radius, dtype=float)

    def held(self, frame: Resolve) -> list[Held]:
        """Return x + r θ; the force is along the axis."""
        travel, turn = self._travels(frame)
        return [Held(travel + turn, along(frame(self.second), self.axis), moment=self.radius)]

    def frictions(self, frame: Resolve) -> list[FrictionEntry]:
        """Return the loss of the mesh, on the mean of x and −r θ."""
        travel, turn = self._travels(frame)
        return mesh_loss(self.efficiency, travel - turn)


def check_efficiency(name: str, efficiency: ArrayLike) -> None:
    """Raise `InputError` if an efficiency is not more than 0 and at most 1."""
    numbers = check_positive(f"{name} efficiency", efficiency)
    if np.any(numbers > 1):
        raise InputError(f"{name} efficiency must be at most 1; got {np.max(numbers):g}")


def mesh_loss(efficiency: ArrayLike, twice: Form) -> list[FrictionEntry]:
    """Return the friction of a mesh along half of a travel, none if the efficiency is 1.

    With the force λ of the teeth it is κ |λ|, half of it on each side, where the efficiency is
    (1 − κ/2)/(1 + κ/2).
    """
    numbers = np.asarray(efficiency, dtype=float)
    if np.all(numbers == 1.0):
        return []
    law = Coulomb(kinetic=2.0 * (1.0 - numbers) / (1.0 + numbers))
    return [FrictionEntry(Travel(twice * 0.5), law, lambda m: [(m[0], Form({}))])]
