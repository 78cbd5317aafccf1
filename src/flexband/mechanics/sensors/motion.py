"""Sensors: named outputs with units, from quadratic forms of the state z.

The engine evaluates a sensor's rows at every step; `derive` turns them into outputs, a block at a
time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flexband.mechanics.bodies.beam import Beam
from flexband.mechanics.bodies.cable import Cable
from flexband.mechanics.forms import Form, Frame, GeneralizedForce
from flexband.mechanics.joints.joints import Joint, PointName
from flexband.mechanics.loads.loads import Load, Spring


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

    def elastic_energy(self) -> Form:
        """Return the energy of beams, cables and springs."""
        ...

    def generalized_force(self, part: str) -> GeneralizedForce:
        """Return the generalized force of a joint, a drive, or a load that is a form."""
        ...

    def potential_energy(self) -> Form:
        """Return −∫ρ g · r dV."""
        ...

    def load(self, name: str) -> Load | None:
        """Return a load, None where there is none of the name."""
        ...

    def torsion_springs(self) -> list[str]:
        """Return the names of the torsion springs."""
        ...

    def member(self, name: str) -> tuple[Beam | Cable, int]:
        """Return a beam or cable and where in z its coordinates start."""
        ...


class Sensor(Protocol):
    """What assembly asks of a sensor."""

    def outputs(self) -> list[tuple[str, str]]:
        """Return what follows the sensor's name, and the unit, for each output."""
        ...

    def rows(self, model: Model) -> Sequence[Form]:
        """Return the forms to evaluate."""
        ...

    def derive(self, rows: np.ndarray, model: Model) -> np.ndarray:
        """Return the outputs (outputs, times, lanes) from the rows' values."""
        ...


class Plain:
    """A sensor whose rows are its outputs."""

    def derive(self, rows: np.ndarray, model: Model) -> np.ndarray:
        """Return the rows."""
        return rows


@dataclass(frozen=True)
class Position(Plain):
    """The position of a point in global axes [m]: outputs "_X" and "_Y"."""

    point: PointName

    def outputs(self) -> list[tuple[str, str]]:
        """Return X and Y in metres."""
        return [("_X", "m"), ("_Y", "m")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return r of the point."""
        return model.frame(self.point).position


@dataclass(frozen=True)
class Velocity(Plain):
    """The velocity of a point in global axes [m/s]: outputs "_X" and "_Y"."""

    point: PointName

    def outputs(self) -> list[tuple[str, str]]:
        """Return X and Y in metres a second."""
        return [("_X", "m/s"), ("_Y", "m/s")]

    def rows(self, model: Model) -> Sequence[Form]:
        """Return ṙ of the point."""
        return model.velocity(self.point).position


@dataclass(frozen=True)
class Acceleration(Plain):
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

    def derive(self, rows: np.ndarray, model: Model) -> np.ndarray:
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

    def derive(self, rows: np.ndarray, model: Model) -> np.ndarray:
        """Return n × ṅ / n · n."""
        x, y, vx, vy = rows
        with np.errstate(invalid="ignore"):  # zeros after a failure
            return ((x * vy - y * vx) / (x * x + y * y))[None]


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

    def derive(self, rows: np.ndarray, model: Model) -> np.ndarray:
        """Return the distance from the chord, positive to the left of its direction."""
        ax, ay, x, y, bx, by = rows
        chord_x, chord_y = bx - ax, by - ay
        return ((chord_x * (y - ay) - chord_y * (x - ax)) / np.hypot(chord_x, chord_y))[None]
