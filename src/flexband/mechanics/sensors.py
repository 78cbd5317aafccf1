"""Sensors: named outputs with units, from quadratic forms of the state z.

The engine evaluates a sensor's rows at every step; `derive` turns them into outputs, a block at a
time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError, known
from flexband.mechanics.forms import Form, Frame, subtract
from flexband.mechanics.joints import Joint, PointName
from flexband.mechanics.loads import Spring

Pick = Callable[[ArrayLike], np.ndarray]
"""Takes a parameter, a number or one a sample, to its values for the lanes of a block."""


class Model(Protocol):
    """What a sensor may ask of the mechanism."""

    def frame(self, point: PointName) -> Frame:
        """Return the frame of a point."""
        ...

    def velocity(self, point: PointName) -> Frame:
        """Return the rates of a point's frame."""
        ...

    def acceleration(self, point: PointName) -> Frame:
        """Return the second rates of a point's frame."""
        ...

    def joint(self, name: str) -> tuple[Joint, Sequence[Form]]:
        """Return a joint and its multipliers."""
        ...

    def spring(self, name: str) -> Spring:
        """Return a spring."""
        ...

    def kinetic_energy(self) -> Form:
        """Return ½ vᵀ M v."""
        ...


class Sensor(Protocol):
    """What assembly asks of a sensor."""

    def outputs(self) -> list[tuple[str, str]]:
        """Return what follows the sensor's name, and the unit, for each output."""
        ...

    def rows(self, model: Model) -> Sequence[Form]:
        """Return the forms to evaluate."""
        ...

    def derive(self, rows: np.ndarray, pick: Pick) -> np.ndarray:
        """Return the outputs (outputs, times, lanes) from the rows' values."""
        ...


class _Plain:
    """A sensor whose rows are its outputs."""

    def derive(self, rows: np.ndarray, pick: Pick) -> np.ndarray:
        """Return the rows."""
        return rows


@dataclass(frozen=True)
class Position(_Plain):
    """The position of a point in global axes [m]: outputs "_X" and "_Y"."""

    point: PointName

    def outputs(self) -> list[tuple[str, str]]:
        """Return X and Y in metres."""
        return [("_X", "m"), ("_Y", "m")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return r of the point."""
        return model.frame(self.point).position


@dataclass(frozen=True)
class Velocity(_Plain):
    """The velocity of a point in global axes [m/s]: outputs "_X" and "_Y"."""

    point: PointName

    def outputs(self) -> list[tuple[str, str]]:
        """Return X and Y in metres a second."""
        return [("_X", "m/s"), ("_Y", "m/s")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return ṙ of the point."""
        return model.velocity(self.point).position


@dataclass(frozen=True)
class Acceleration(_Plain):
    """The acceleration of a point in global axes [m/s²]: outputs "_X" and "_Y"."""

    point: PointName

    def outputs(self) -> list[tuple[str, str]]:
        """Return X and Y in metres a second squared."""
        return [("_X", "m/s²"), ("_Y", "m/s²")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return r̈ of the point."""
        return model.acceleration(self.point).position


@dataclass(frozen=True)
class Angle:
    """The angle from the X axis to the normal of the section at a point [rad], turns counted.

    On a rigid body that is the angle of its x axis.
    """

    point: PointName

    def outputs(self) -> list[tuple[str, str]]:
        """Return one output in radians."""
        return [("", "rad")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return the normal."""
        return model.frame(self.point).normal

    def derive(self, rows: np.ndarray, pick: Pick) -> np.ndarray:
        """Return its angle, continuous in time."""
        return np.unwrap(np.arctan2(rows[1], rows[0]), axis=0)[None]


@dataclass(frozen=True)
class AngularVelocity:
    """The rate of turn of the section at a point [rad/s]."""

    point: PointName

    def outputs(self) -> list[tuple[str, str]]:
        """Return one output in radians a second."""
        return [("", "rad/s")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return the normal and its rate."""
        return [*model.frame(self.point).normal, *model.velocity(self.point).normal]

    def derive(self, rows: np.ndarray, pick: Pick) -> np.ndarray:
        """Return n × ṅ / n · n."""
        x, y, vx, vy = rows
        return ((x * vy - y * vx) / (x * x + y * y))[None]


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

    def derive(self, rows: np.ndarray, pick: Pick) -> np.ndarray:
        """Return the force, turned into the body's axes where asked for."""
        if self.axes == "global":
            return rows
        fx, fy, nx, ny = rows
        size = np.hypot(nx, ny)
        return np.stack([(fx * nx + fy * ny) / size, (fy * nx - fx * ny) / size])


@dataclass(frozen=True)
class ReactionMoment(_Plain):
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
class KineticEnergy(_Plain):
    """The kinetic energy of all bodies [J]."""

    def outputs(self) -> list[tuple[str, str]]:
        """Return one output in joules."""
        return [("", "J")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return ½ vᵀ M v."""
        return [model.kinetic_energy()]


@dataclass(frozen=True)
class Deflection:
    """How far a point of a beam or cable is to the left of the chord from start to end [m].

    Parameters
    ----------
    body : name of the beam or cable.
    place : the point of it, "middle" or the part of the length from the start.
    """

    body: str
    place: str = "middle"

    def outputs(self) -> list[tuple[str, str]]:
        """Return one output in metres."""
        return [("", "m")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return the positions of start, point and end."""
        names = ("start", self.place, "end")
        return [form for name in names for form in model.frame(f"{self.body}.{name}").position]

    def derive(self, rows: np.ndarray, pick: Pick) -> np.ndarray:
        """Return the distance from the chord, positive to the left of its direction."""
        ax, ay, x, y, bx, by = rows
        chord_x, chord_y = bx - ax, by - ay
        return ((chord_x * (y - ay) - chord_y * (x - ax)) / np.hypot(chord_x, chord_y))[None]


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
        first, second = spring.first, spring.second
        apart = subtract(model.frame(first).position, model.frame(second).position)
        rate = subtract(model.velocity(first).position, model.velocity(second).position)
        number, function = spring.actuator
        pull = Form.constant(number) * (Form.function(function) if function else 1.0)
        rest = 0.0 if spring.rest_length is None else spring.rest_length
        relaxed = 1.0 if spring.rest_length is None else 0.0
        numbers = (spring.stiffness, rest, relaxed, spring.cubic, spring.damping)
        return [*apart, *rate, *map(Form.constant, numbers), pull]

    def derive(self, rows: np.ndarray, pick: Pick) -> np.ndarray:
        """Return k x + k₃ x³ + d ℓ̇ + f and ℓ."""
        x, y, vx, vy, stiffness, rest, relaxed, cubic, damping, pull = rows
        length = np.hypot(x, y)
        stretch = length - rest - relaxed * length[:1]
        with np.errstate(invalid="ignore", divide="ignore"):
            rate = np.where(length > 0, (x * vx + y * vy) / length, 0.0)
        return np.stack(
            [stretch * (stiffness + cubic * stretch**2) + damping * rate + pull, length]
        )
