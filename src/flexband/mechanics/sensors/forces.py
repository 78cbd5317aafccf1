"""Sensors of forces: of joints, drives and springs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexband.errors import InputError, known
from flexband.mechanics.forms import Form
from flexband.mechanics.loads.force_laws import TorsionSpring
from flexband.mechanics.loads.loads import in_time
from flexband.mechanics.sensors.motion import Model, Plain


@dataclass(frozen=True)
class Reaction:
    """The force that a joint exerts on its first body [N]: outputs "_X" and "_Y".

    Parameters
    ----------
    joint : its name.
    axes : "global", or "body" for the axes of the joint's first point: outputs "_x" and "_y".

    Raises
    ------
    InputError
        Where the axes are neither.
    """

    joint: str
    axes: str = "global"

    def __post_init__(self) -> None:
        known("axes", self.axes, ["global", "body"])

    def outputs(self) -> list[tuple[str, str]]:
        """Return two components in newtons."""
        return [("_X", "N"), ("_Y", "N")] if self.axes == "global" else [("_x", "N"), ("_y", "N")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return the joint's force, and the point's axes where they are asked for.

        Raises
        ------
        InputError
            Where the joint exerts no force.
        """
        joint, multipliers = model.joint(self.joint)
        force = joint.force(model.frame, multipliers)
        if force is None:
            raise InputError(f"joint {self.joint!r} exerts a moment and no force")
        return force if self.axes == "global" else [*force, *model.frame(joint.first).normal]

    def derive(self, rows: np.ndarray, model: Model) -> np.ndarray:
        """Return the force, turned into the body's axes where asked for."""
        if self.axes == "global":
            return rows
        fx, fy, nx, ny = rows
        size = np.hypot(nx, ny)
        return np.stack([(fx * nx + fy * ny) / size, (fy * nx - fx * ny) / size])


@dataclass(frozen=True)
class ReactionMoment(Plain):
    """The moment that a joint or drive exerts on its first body [N m]."""

    joint: str

    def outputs(self) -> list[tuple[str, str]]:
        """Return one output in newton metres."""
        return [("", "N m")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return the joint's moment.

        Raises
        ------
        InputError
            Where the joint exerts no moment.
        """
        joint, multipliers = model.joint(self.joint)
        moment = joint.moment(multipliers)
        if moment is None:
            raise InputError(f"joint {self.joint!r} exerts no moment")
        return [moment]


@dataclass(frozen=True)
class SpringForce:
    """What a spring, damper and actuator pulls with [N], and its length [m]: outputs "_F" and "_l".

    The length at rest of a spring that is relaxed at the start is its length there.
    """

    spring: str

    def outputs(self) -> list[tuple[str, str]]:
        """Return the force in newtons and the length in metres."""
        return [("_F", "N"), ("_l", "m")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return the spring's vector, its rate, its numbers and its pull."""
        spring = model.spring(self.spring)
        apart, rate = spring.separation(model.frame), spring.separation(model.velocity)
        number, function = spring.actuator
        pull = Form.constant(number) * (Form.function(function) if function else 1.0)
        rest = 0.0 if spring.rest_length is None else spring.rest_length
        relaxed = 1.0 if spring.rest_length is None else 0.0
        numbers = (spring.stiffness, rest, relaxed, spring.cubic, spring.damping)
        return [*apart, *rate, *map(Form.constant, numbers), pull]

    def derive(self, rows: np.ndarray, model: Model) -> np.ndarray:
        """Return k x + k₃ x³ + d ℓ̇ + f and ℓ."""
        x, y, vx, vy, stiffness, rest, relaxed, cubic, damping, pull = rows
        length = np.hypot(x, y)
        stretch = length - rest - relaxed * length[:1]
        with np.errstate(invalid="ignore", divide="ignore"):
            rate = np.where(length > 0, (x * vx + y * vy) / length, 0.0)
        return np.stack(
            [stretch * (stiffness + cubic * stretch**2) + damping * rate + pull, length]
        )


@dataclass(frozen=True)
class SpringMoment:
    """The moment of a `TorsionSpring` on its first body [N m], and φ [rad]: outputs "_M", "_angle".

    The angle at rest of a spring that is relaxed at the start is φ there.
    """

    spring: str

    def outputs(self) -> list[tuple[str, str]]:
        """Return the moment in newton metres and the angle in radians."""
        return [("_M", "N m"), ("_angle", "rad")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return both normals, their rates, the spring's numbers and its torque.

        Raises
        ------
        InputError
            Where the mechanism has no such torsion spring.
        """
        spring = model.load(self.spring)
        if not isinstance(spring, TorsionSpring):
            raise InputError(f"load {self.spring!r} is no TorsionSpring")
        points = (spring.first, spring.second)
        rest = 0.0 if spring.rest_angle is None else spring.rest_angle
        relaxed = 1.0 if spring.rest_angle is None else 0.0
        numbers = (spring.stiffness, rest, relaxed, spring.cubic, spring.damping)
        return [
            *(form for point in points for form in model.frame(point).normal),
            *(form for point in points for form in model.velocity(point).normal),
            *map(Form.constant, numbers),
            in_time("torque", spring.torque),
        ]

    def derive(self, rows: np.ndarray, model: Model) -> np.ndarray:
        """Return −(k (φ − φ₀) + k₃ (φ − φ₀)³ + d φ̇) + T and φ."""
        first, second = (self._angle(rows[k : k + 2], rows[k + 4 : k + 6]) for k in (0, 2))
        twist, rate = first[0] - second[0], first[1] - second[1]
        stiffness, _, _, cubic, damping, torque = rows[8:]
        away = self.away(rows)
        moment = away * (stiffness + cubic * away**2) + damping * rate - torque
        return np.stack([-moment, twist])

    def away(self, rows: np.ndarray) -> np.ndarray:
        """Return φ − φ₀, φ₀ counted from the turn where the spring starts."""
        twist = self._angle(rows[:2], rows[4:6])[0] - self._angle(rows[2:4], rows[6:8])[0]
        turns = 2 * np.pi * np.round(twist[:1] / (2 * np.pi))
        rest, relaxed = rows[9:11]
        return twist - np.where(relaxed > 0, twist[:1], rest + turns)

    @staticmethod
    def _angle(normal: np.ndarray, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the angle of a normal, continuous in time, and its rate."""
        (x, y), (u, v) = normal, moved
        with np.errstate(invalid="ignore"):  # zeros after a failure
            return np.unwrap(np.arctan2(y, x), axis=0), (x * v - y * u) / (x * x + y * y)
