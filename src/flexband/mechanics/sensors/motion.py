"""Sensors: named outputs with units, from quadratic forms of the state z, and those of motion.

The engine evaluates a sensor's rows at every step; `derive` computes the outputs from them, one
block of samples at a time.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from flexband.basics.arguments import frozen
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.joints.joint import Joint, PointName
from flexband.mechanics.kernels.forms import Form, Frame, Polar, cross, section_normal
from flexband.mechanics.kernels.state import State
from flexband.mechanics.loads.load import Entries


class ContactRows(NamedTuple):
    """The gap of a contact, its rate, mode, normal force and loss, and whether it is an angle."""

    gap: Form
    rate: Form
    mode: Form
    force: Form
    loss: Form
    angular: bool


class FrictionRows(NamedTuple):
    """The multiplier of a friction, its sliding speed, and whether it is against a rotation."""

    multiplier: Form
    speed: Form
    angular: bool


class SensorModel(Protocol):
    """The members of a mechanism's `model` that sensors use; they are documented there."""

    @property
    def dimension(self) -> int: ...
    @property
    def joints(self) -> Mapping[str, Joint]: ...
    @cached_property
    def state(self) -> State: ...
    @cached_property
    def entries(self) -> dict[str, Entries]: ...
    @cached_property
    def mass(self) -> dict[tuple[int, int], np.ndarray]: ...
    @cached_property
    def polars(self) -> dict[int, list[Polar]]: ...
    def frame(self, point: PointName) -> Frame: ...
    def angle(self, point: PointName) -> Form: ...
    def velocity(self, point: PointName) -> Frame: ...
    def acceleration(self, point: PointName) -> Frame: ...
    def member(self, name: str) -> tuple[CentreLine, int]: ...
    def joint(self, name: str) -> tuple[Joint, Sequence[Form]]: ...
    def works_of_impulses(self, part: str) -> list[Form]: ...
    def spring(self, name: str, *, torsion: bool) -> tuple[Form, Form]: ...
    def law_state(self, load: str, name: str) -> Form: ...
    def contacts(self, part: str) -> list[ContactRows]: ...
    def frictions_of(self, part: str) -> list[FrictionRows]: ...
    def switching_losses(self, joint: str) -> list[Form]: ...
    def over_steps(self, sensor: Any) -> list[Form]: ...
    def generalized_force(self, part: str) -> list[tuple[Form, Form]]: ...


class Sensor(ABC):
    """Named outputs that are computed from the state.

    A new kind of sensor is a subclass with `units` or `outputs`, with `rows` and, if its rows are
    not its outputs, `derive`.
    """

    units: ClassVar[Sequence[tuple[str, str]]]
    """What follows the sensor's name in the name of each output, and the unit of the output."""

    tensor: ClassVar[bool] = False
    """Whether the outputs are the components of a tensor, which mean something together only."""

    in_equilibrium: ClassVar[bool] = True
    """Whether the outputs exist without a motion, in statics and modes, which leave out others."""

    in_place: ClassVar[str] = ""
    """What sensor of extremes or integrals over steps serves where this one `derives`."""

    impulsive: ClassVar[bool] = False
    """Whether the outputs are forces of joints, which an impulse makes infinite for an instant."""

    @property
    def turning_points(self) -> Sequence[PointName]:
        """The points whose angles it reads, with `SensorModel.angle`."""
        return ()

    def outputs(self, model: SensorModel) -> list[tuple[str, str]]:
        """Return `units`; those of subclasses may depend on their parameters and on the model."""
        return list(self.units)

    @abstractmethod
    def rows(self, model: SensorModel) -> Sequence[Form]:
        """Return the forms to evaluate at every step."""

    def derives(self, model: SensorModel) -> bool:
        """Return whether the outputs are not the rows themselves."""
        return type(self).derive is not Sensor.derive

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        """Return the outputs (outputs, times, lanes) from the values of the rows."""
        return rows


class VectorSensor(Sensor):
    """A vector in global axes: outputs "_X" and "_Y", as many as the model has components."""

    unit: ClassVar[str]

    def outputs(self, model: SensorModel) -> list[tuple[str, str]]:
        return [(f"_{axis}", self.unit) for axis in "XYZ"[: model.dimension]]


@frozen()
class Position(VectorSensor):
    """The position of a point in global axes [m]: outputs "_X" and "_Y"."""

    point: PointName
    unit = "m"

    def rows(self, model: SensorModel) -> Sequence[Form]:
        return model.frame(self.point).position


@frozen()
class Velocity(VectorSensor):
    """The velocity of a point in global axes [m/s]: outputs "_X" and "_Y"."""

    point: PointName
    unit = "m/s"

    def rows(self, model: SensorModel) -> Sequence[Form]:
        return model.velocity(self.point).position


@frozen()
class Acceleration(VectorSensor):
    """The acceleration of a point in global axes [m/s²]: outputs "_X" and "_Y"."""

    point: PointName
    unit = "m/s²"

    def rows(self, model: SensorModel) -> Sequence[Form]:
        return model.acceleration(self.point).position


@frozen()
class Angle(Sensor):
    """The angle from the X axis to the normal of the section at a point [rad], with turns counted.

    On a rigid body this is the angle of its x axis. At the start it is the one nearest to the angle
    that the body is given, and then the engine counts turns at every step.
    """

    point: PointName
    units = (("", "rad"),)

    @property
    def turning_points(self) -> Sequence[PointName]:
        return [self.point] if isinstance(self.point, str) else []

    def rows(self, model: SensorModel) -> Sequence[Form]:
        model.frame(self.point)  # refuses what is no point
        return [model.angle(point) for point in self.turning_points] or [Form.constant(0.0)]


@frozen()
class AngularVelocity(Sensor):
    """The angular velocity of the section at a point [rad/s]."""

    point: PointName
    units = (("", "rad/s"),)

    in_place = "that of the Velocity of points beside it"

    def rows(self, model: SensorModel) -> Sequence[Form]:
        normal, rate = map(section_normal, (model.frame(self.point), model.velocity(self.point)))
        return [*normal, *rate] if self.derives(model) else [cross(normal, rate)]

    def derives(self, model: SensorModel) -> bool:
        return not model.frame(self.point).rigid

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:  # n × ṅ / n · n
        if len(rows) == 1:  # of a rigid body
            return rows
        x, y, vx, vy = rows
        with np.errstate(invalid="ignore"):  # zeros after a failure
            return ((x * vy - y * vx) / (x * x + y * y))[None]


@frozen()
class Deflection(Sensor):
    """The distance of a point of a beam or cable from the chord between its ends [m].

    It is positive to the left of the direction from start to end.

    Parameters
    ----------
    body : name of the beam or cable.
    place : a point of it, such as "middle", or the fraction of the length from the start, "0.25".
    """

    body: str
    place: str = "middle"
    units = (("", "m"),)
    in_place = "that of the Position of the point"

    def rows(self, model: SensorModel) -> Sequence[Form]:
        names = ("start", self.place, "end")
        return [form for name in names for form in model.frame(f"{self.body}.{name}").position]

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        ax, ay, x, y, bx, by = rows
        chord_x = bx - ax
        chord_y = by - ay
        return ((chord_x * (y - ay) - chord_y * (x - ax)) / np.hypot(chord_x, chord_y))[None]
