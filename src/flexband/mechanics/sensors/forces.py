"""Sensors of forces: of joints, drives and springs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexband.errors import InputError, known
from flexband.mechanics.forms import Form
from flexband.mechanics.sensors.motion import Model, Sensor


@dataclass(frozen=True)
class Reaction(Sensor):
    """The force that a joint exerts on its first body [N]: outputs "_X" and "_Y".

    Parameters
    ----------
    joint : its name.
    axes : "global", or "body" for the axes of the joint's first point. The outputs are then "_x"
        and "_y".

    Raises
    ------
    InputError
        If `axes` is neither of these.
    """

    joint: str
    axes: str = "global"

    def __post_init__(self) -> None:
        known("axes", self.axes, ["global", "body"])

    def outputs(self) -> list[tuple[str, str]]:
        return [("_X", "N"), ("_Y", "N")] if self.axes == "global" else [("_x", "N"), ("_y", "N")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return the joint's force, followed by the normal at its first point for `axes` "body".

        Raises
        ------
        InputError
            If the joint exerts no force.
        """
        joint, multipliers = model.joint(self.joint)
        force = joint.force(model.frame, multipliers)
        if force is None:
            raise InputError(f"joint {self.joint!r} exerts a moment and no force")
        return force if self.axes == "global" else [*force, *model.frame(joint.first).normal]

    def derive(self, rows: np.ndarray, model: Model) -> np.ndarray:
        """Return the components of the force in the chosen axes."""
        if self.axes == "global":
            return rows
        fx, fy, nx, ny = rows
        size = np.hypot(nx, ny)
        return np.stack([(fx * nx + fy * ny) / size, (fy * nx - fx * ny) / size])


@dataclass(frozen=True)
class ReactionMoment(Sensor):
    """The moment that a joint or drive exerts on its first body [N m]."""

    joint: str

    def outputs(self) -> list[tuple[str, str]]:
        return [("", "N m")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return the joint's moment.

        Raises
        ------
        InputError
            If the joint exerts no moment.
        """
        joint, multipliers = model.joint(self.joint)
        moment = joint.moment(multipliers)
        if moment is None:
            raise InputError(f"joint {self.joint!r} exerts no moment")
        return [moment]


@dataclass(frozen=True)
class SpringForce(Sensor):
    """The tension of a `Spring` [N] and its length [m]: outputs "_F" and "_l"."""

    spring: str

    def outputs(self) -> list[tuple[str, str]]:
        return [("_F", "N"), ("_l", "m")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return T = k x + k₃ x³ + d ℓ̇ + f, and ℓ.

        Raises
        ------
        InputError
            If the mechanism has no such spring.
        """
        return model.spring(self.spring, torsion=False)


@dataclass(frozen=True)
class SpringMoment(Sensor):
    """The moment of a `TorsionSpring` on its first body [N m], and φ [rad]: "_M" and "_angle"."""

    spring: str

    def outputs(self) -> list[tuple[str, str]]:
        return [("_M", "N m"), ("_angle", "rad")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return −(k (φ − φ₀) + k₃ (φ − φ₀)³ + d φ̇) + T, and φ.

        Raises
        ------
        InputError
            If the mechanism has no such torsion spring.
        """
        tension, angle = model.spring(self.spring, torsion=True)
        return [-tension, angle]
