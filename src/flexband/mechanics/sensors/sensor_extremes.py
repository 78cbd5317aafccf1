"""Sensors of what another sensor does between the times of a result: its extremes and integral.

The engine updates them at every step that it takes, however short.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_instance, check_numbers
from flexband.basics.words import with_article
from flexband.errors import InputError
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.kernels.forms import Form
from flexband.mechanics.kernels.running_extremes import KINDS
from flexband.mechanics.sensors.motion import Sensor, SensorModel


class OverSteps(Sensor):
    """What the engine makes of forms of the state at every step, in a window of time.

    At each time of the result it is that of the window up to this time: NaN before the window
    begins, and the same from its end on.
    """

    window: Any
    in_equilibrium = False

    @property
    def fixed_window(self) -> tuple[float, float] | None:
        """The window [s], if it does not move."""
        return self.window

    @property
    def times(self) -> tuple[float, float]:
        """The first and the last time of the window [s]."""
        return (0.0, 1e300) if self.fixed_window is None else self.fixed_window

    @abstractmethod
    def step_forms(self, model: SensorModel) -> Sequence[tuple[Form, int]]:
        """Return the forms that the engine evaluates at every step, and what it takes of each."""

    def rows(self, model: SensorModel) -> Sequence[Form]:
        return model.over_steps(self)


class OfSensor(OverSteps):
    """What the engine makes of the outputs of a sensor, `kind`."""

    sensor: Sensor
    kind: int

    def __post_init__(self) -> None:
        name = type(self).__name__
        check_instance(f"{name} sensor", self.sensor, Sensor)
        if isinstance(self.sensor, OverSteps):
            kind = type(self.sensor).__name__
            raise InputError(f"{name} sensor must be one of the state itself; got {kind}")
        check_window(name, self.fixed_window)

    @property
    def turning_points(self) -> Sequence[PointName]:
        return self.sensor.turning_points

    def outputs(self, model: SensorModel) -> list[tuple[str, str]]:
        return self.sensor.outputs(model)

    def step_forms(self, model: SensorModel) -> Sequence[tuple[Form, int]]:
        if self.sensor.derives(model):
            kind = type(self.sensor).__name__
            default = "its values at the times of the result"
            raise InputError(
                f"{with_article(type(self).__name__)} cannot follow this {kind} at every step, "
                f"since it is computed from several numbers; {self.sensor.in_place or default} "
                "serves in its place"
            )
        return [(form, self.kind) for form in self.sensor.rows(model)]


def check_window(name: str, window: tuple[float, float] | None) -> None:
    """Raise `InputError` if these are not two increasing times."""
    if window is not None:
        first, last = check_numbers(f"{name} window [s]", window, 2)
        if not 0 <= first < last:
            raise InputError(
                f"{name} window [s] must be two increasing times from 0 on; got "
                f"({first:g}, {last:g})"
            )


@frozen()
class Largest(OfSensor):
    """The largest value of each output of a sensor, at any step in a window of time.

    Parameters
    ----------
    sensor : the other sensor. Of those that are computed from several numbers, such as strains and
        section forces, there is none; the message says what serves in their place.
    window : first and last time [s], or None for the whole run.

    Raises
    ------
    InputError
        If the sensor is another one, or the window does not have two increasing times.
    """

    sensor: Sensor
    window: tuple[float, float] | None = None
    kind = KINDS.largest


@frozen()
class Smallest(OfSensor):
    """The smallest value of each output of a sensor; parameters are those of `Largest`."""

    sensor: Sensor
    window: tuple[float, float] | None = None
    kind = KINDS.smallest


@frozen()
class Integral(OfSensor):
    """The integral over time of each output of a sensor, by the trapezoidal rule over all steps.

    Parameters are those of `Largest`. The integral of a power is a work, that of a force an
    impulse.
    """

    sensor: Sensor
    window: tuple[float, float] | None = None
    kind = KINDS.integral

    def outputs(self, model: SensorModel) -> list[tuple[str, str]]:
        return [(suffix, f"{unit} s") for suffix, unit in self.sensor.outputs(model)]
