"""Sensors: named outputs with units, written as quadratic forms of the state z."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from flexband.mechanics.forms import Form, Vector
from flexband.mechanics.joints import Joint, PointName, Resolve

FindJoint = Callable[[str], tuple[Joint, Sequence[Form]]]
"""Finds a joint and its multipliers by its name."""


class Sensor(Protocol):
    """What assembly asks of a sensor; it has an X and a Y component."""

    @property
    def unit(self) -> str:
        """Unit of both components."""
        ...

    def components(self, frame: Resolve, joint: FindJoint) -> Vector:
        """Return the two components as forms of the state."""
        ...


@dataclass(frozen=True)
class Position:
    """The position of a point in global axes [m]."""

    point: PointName

    @property
    def unit(self) -> str:
        """The metre."""
        return "m"

    def components(self, frame: Resolve, joint: FindJoint) -> Vector:
        """Return r of the point."""
        return frame(self.point).position


@dataclass(frozen=True)
class Reaction:
    """The force that a joint exerts on its first body, in global axes [N]."""

    joint: str

    @property
    def unit(self) -> str:
        """The newton."""
        return "N"

    def components(self, frame: Resolve, joint: FindJoint) -> Vector:
        """Return the joint's force."""
        found, multipliers = joint(self.joint)
        return found.force(frame, multipliers)
