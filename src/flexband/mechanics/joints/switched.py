"""Joints that switch: a latch, a gripper, a release. They use the rows of friction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flexband.arguments import frozen
from flexband.errors import (
    InputError,
    check_function,
    check_instance,
    check_option,
    check_positive,
    returned,
    shown,
)
from flexband.mechanics.contact.friction import Coulomb, FrictionEntry
from flexband.mechanics.contact.geometry.travel import Travel
from flexband.mechanics.joints.joint import Joint, PointName, Resolve, along, straight
from flexband.mechanics.joints.joints import Distance, Prismatic, Revolute, Slot, Weld
from flexband.mechanics.kernels.forms import (
    Form,
    TimeFunction,
    Vector,
    add,
    angle,
    dot,
    scale,
    subtract,
)


@dataclass(frozen=True)
class _Numbers:
    """A function of time that is true or false, as one of numbers."""

    function: TimeFunction

    def __call__(self, time: float) -> np.ndarray:
        return np.asarray(self.function(time), dtype=float)


@frozen()
class Switched(Joint):
    """A joint that is active only part of the time.

    Becoming active is a plastic impact; `sensors.SwitchingLoss` is the energy that it takes. With
    such a joint every sample chooses its steps, see `GeneralizedAlpha`.

    Parameters
    ----------
    joint : a `Revolute`, `Prismatic`, `Slot`, `Weld` or `Distance`, of a fixed length,
        without clearance, friction and offset.
    active : function of the time [s] that is more than 0.5 while the joint is active, such as
        ``lambda t: t > 0.2``; or the names of a `ForceLaw` and of one of its events: the joint is
        active while the gap of this event is negative.
    where : "present" to hold the bodies where they are when the joint becomes active, "given" to
        hold the place that the joint states.
    tolerance : how far the bodies may then be from the given place, along each direction [m] and in
        angle [rad]; a sample that is farther fails. The distance is kept, not corrected.

    Raises
    ------
    InputError
        If the joint is none of these, or another argument is not allowed.

    Examples
    --------
    >>> wagons = fb.Mechanism(
    ...     bodies={
    ...         "a": fb.PointMass(mass=3.0, velocity=(2.0, 0.0)),
    ...         "b": fb.PointMass(mass=1.0, position=(1.0, 0.0)),
    ...     },
    ...     joints={
    ...         "rail a": fb.Slot("a", (0.0, 0.0)),
    ...         "rail b": fb.Slot("b", (0.0, 0.0)),
    ...         "hook": fb.contact.Switched(fb.Distance("a", "b", 1.0), lambda t: t > 0.2),
    ...     },
    ...     sensors={"v": fb.Velocity("b"), "lost": fb.sensors.SwitchingLoss("hook")},
    ... )
    >>> motion = fb.simulate(wagons, duration=0.3, step=0.1)
    >>> motion.sel(output=["v_X", "lost"]).values[:, -1].round(6)  # m/s, J
    array([1.5, 1.5])
    """

    joint: Revolute | Prismatic | Slot | Weld | Distance
    active: TimeFunction | tuple[str, str]
    where: str = "present"
    tolerance: ArrayLike = 1e-3

    def __post_init__(self) -> None:
        allowed = (Revolute, Prismatic, Slot, Weld, Distance)
        kinds = ", ".join(kind.__name__ for kind in allowed)
        check_instance("Switched joint", self.joint, allowed, f"one of {kinds}")
        extras = vars(self.joint)
        if any(extras.get(name) is not None for name in ("clearance", "friction")):
            raise InputError("the joint of a Switched must have neither clearance nor friction")
        offset = extras.get("offset", 0.0)
        if any(map(np.any, offset if isinstance(offset, tuple) else [offset])):
            raise InputError(f"the joint of a Switched must have no offset; got {shown(offset)}")
        if callable(extras.get("length")) or extras.get("axis") is True:
            raise InputError("the joint of a Switched must have a fixed length and axis=False")
        if isinstance(self.active, tuple):
            if len(self.active) != 2 or not all(isinstance(name, str) for name in self.active):
                raise InputError(
                    "Switched active must be a function of time, or the names of a load and its "
                    f"event; got {shown(self.active)}"
                )
        else:
            check_function("Switched active", self.active, " of time")
            returned(_Numbers(self.active), 0.0, "Switched active")
            if np.asarray(self.active(0.0)).dtype == bool:
                object.__setattr__(self, "active", _Numbers(self.active))
        check_option("where", self.where, ["present", "given"])
        check_positive("Switched tolerance [m]", self.tolerance)

    @property
    def first(self) -> PointName:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.joint.first

    @property
    def points(self) -> Sequence[PointName]:
        return self.joint.points

    @property
    def _holds_angle(self) -> bool:
        return isinstance(self.joint, Weld | Prismatic)

    def _rows(self, frame: Resolve) -> list[Form]:
        """Return what the joint holds, rows that keep any value; an angle is the last one."""
        joint = self.joint
        if isinstance(joint, Distance):
            return joint.constraints(frame)
        first, second = (frame(point) for point in joint.points)
        directions = [second.normal, second.direction(0.0, 1.0)]
        if isinstance(joint, Slot | Prismatic):
            x, y = joint.axis
            directions = [along(straight("Switched", second), (-y, x))]
        apart = subtract(first.position, second.position)
        rows = [dot(direction, apart) for direction in directions]
        if isinstance(joint, Weld | Prismatic):
            rows.append(angle(first.normal) - angle(second.normal) - joint.angle)
        return rows

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return none: the rows are those of friction."""
        self._rows(frame)
        return []

    def frictions(self, frame: Resolve) -> list[FrictionEntry]:
        """Return the rows, each as what sticks while the joint is active."""
        law = Coulomb(kinetic=0.0, static=self.tolerance if self.where == "given" else 1e30)
        entries = [
            FrictionEntry(Travel(row), law, lambda forces: [], active=self.active)
            for row in self._rows(frame)
        ]
        if self._holds_angle:
            entries[-1] = entries[-1]._replace(angular=True)
        return entries

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ along each direction, zero if there are no rows."""
        if not multipliers:
            return Form({}), Form({})
        if not isinstance(self.joint, Revolute | Weld):
            return self.joint.force(frame, multipliers)
        second = frame(self.joint.second)
        along_x = scale(-multipliers[0], second.normal)
        return add(along_x, scale(-multipliers[1], second.direction(0.0, 1.0)))

    def moment(self, multipliers: Sequence[Form]) -> Form | None:
        """Return −λ of the angle."""
        if not self._holds_angle:
            return None
        return -multipliers[-1] if multipliers else Form({})

    def at_rest(self) -> Joint:
        if isinstance(self.active, tuple):
            raise InputError("statics and modes need a Switched active that is a function of time")
        active = np.unique(np.asarray(returned(self.active, 0.0), dtype=float) > 0.5)
        if len(active) > 1:
            raise InputError("a Switched must be active at the start in all samples or in none")
        return (_Active if active[0] else _Inactive)(**vars(self))


class _Inactive(Switched):
    """A joint that stays inactive."""

    def at_rest(self) -> Joint:
        return self

    def frictions(self, frame: Resolve) -> list[FrictionEntry]:
        return []


class _Active(_Inactive):
    """A joint that stays active."""

    holds_start = True

    def constraints(self, frame: Resolve) -> list[Form]:
        return self._rows(frame)
