"""Sensors of what another sensor does between the times of a result: its extremes and integral.

The engine updates them at every step that it takes, however short.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flexband.arguments import frozen
from flexband.errors import InputError, check_instance, check_numbers
from flexband.mechanics.kernels.extremes import KINDS
from flexband.mechanics.kernels.forms import Form
from flexband.mechanics.sensors.motion import Sensor, SensorModel
from flexband.words import with_article


class OverSteps(Sensor):
    """What the engine makes of the outputs of a sensor at every step, `kind`, in a window of time.

    At each time of the result it is that of the window up to this time: NaN before the window
    begins, and the same from its end on.
    """

    sensor: Sensor
    window: Any
    kind: int
    in_equilibrium = False

    def __post_init__(self) -> None:
        name = type(self).__name__
        check_instance(f"{name} sensor", self.sensor, Sensor)
        if isinstance(self.sensor, OverSteps) or self.sensor.derives:
            raise InputError(
                f"{name} sensor must have outputs that are forms of the state, as those of "
                f"positions, velocities, forces and energies are; got {type(self.sensor).__name__}"
            )
        check_window(name, self.fixed)

    @property
    def fixed(self) -> tuple[float, float] | None:
        """The window [s], if it does not move."""
        return self.window

    @property
    def times(self) -> tuple[float, float]:
        """The first and the last time of the window [s]."""
        return (0.0, 1e300) if self.fixed is None else self.fixed

    def outputs(self) -> list[tuple[str, str]]:
        return self.sensor.outputs()

    def watched(self, model: SensorModel) -> Sequence[tuple[Form, int]]:
        """Return the forms of which the engine makes something at every step, and what of each."""
        return [(form, self.kind) for form in self.sensor.rows(model)]

    def rows(self, model: SensorModel) -> Sequence[Form]:
        return model.over_steps(self)


def check_window(name: str, window: tuple[float, float] | None) -> None:
    """Raise `InputError` if these are not two increasing times."""
    if window is not None:
        first, last = check_numbers(f"{name} window [s]", window, 2)
        if not 0 <= first < last:
            raise InputError(
                f"{name} window [s] must be two increasing times from 0 on; got "
                f"({first:g}, {last:g})"
            )


def refuse_over_steps(sensors: Mapping[str, Sensor]) -> None:
    """Raise `InputError` for sensors that only a simulation has."""
    for name, sensor in sensors.items():
        if not sensor.in_equilibrium:
            kind = type(sensor).__name__
            raise InputError(
                f"sensor {name!r}: {with_article(kind)} is over the steps of a simulation"
            )


@frozen()
class Largest(OverSteps):
    """The largest value of each output of a sensor, at any step in a window of time.

    Parameters
    ----------
    sensor : one whose outputs are not derived from others, such as a `Reaction` in global axes.
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
class Smallest(OverSteps):
    """The smallest value of each output of a sensor; parameters are those of `Largest`."""

    sensor: Sensor
    window: tuple[float, float] | None = None
    kind = KINDS.smallest


@frozen()
class Integral(OverSteps):
    """The integral over time of each output of a sensor, by the trapezoidal rule over all steps.

    Parameters are those of `Largest`. The integral of a power is a work, that of a force an
    impulse.
    """

    sensor: Sensor
    window: tuple[float, float] | None = None
    kind = KINDS.integral

    def outputs(self) -> list[tuple[str, str]]:
        return [(suffix, f"{unit} s") for suffix, unit in self.sensor.outputs()]
