"""Sensors of averages over a window of time, from integrals over all steps of the engine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_numbers
from flexband.errors import InputError
from flexband.mechanics.kernels.forms import Form
from flexband.mechanics.kernels.running_extremes import KINDS
from flexband.mechanics.sensors.motion import Sensor, SensorModel
from flexband.mechanics.sensors.sensor_extremes import OfSensor


@frozen()
class Average(OfSensor):
    """The mean over a window of time of each output of a sensor, at every step that is taken.

    A force that vibrates at frequencies which no affordable step resolves has a mean that
    converges: over a window of many periods, the vibration cancels.

    Parameters
    ----------
    sensor : as of a `Largest`.
    window : length of a moving window [s], a whole number of steps of the result: the mean over the
        last `window` seconds, or over all time so far where this is less, and at the start the
        value itself. Or first and last time [s] of a fixed window within the run: its mean, which
        is the same at all times of the result.

    Raises
    ------
    InputError
        If the sensor is another one, or the window is neither a positive length nor two increasing
        times; in `simulate`, if its length is no whole number of steps, or it ends after the run.
    """

    sensor: Sensor
    window: float | tuple[float, float]
    kind = KINDS.integral

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.fixed_window is None:
            length = float(check_numbers("Average window [s]", self.window))
            if not length > 0:
                raise InputError(f"Average window [s] must be above 0; got {length:g}")

    @property
    def fixed_window(self) -> tuple[float, float] | None:
        window = self.window
        return None if np.ndim(window) == 0 else window  # pyright: ignore[reportReturnType]

    @property
    def length(self) -> float | None:
        """The length of a moving window [s]."""
        return None if self.fixed_window is not None else float(np.asarray(self.window))

    def rows(self, model: SensorModel) -> Sequence[Form]:
        return [*super().rows(model), *self.sensor.rows(model), Form.function(np.positive)]

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        *signals, time = rows
        integrals, values = np.split(np.array(signals), 2)
        averages = np.empty_like(integrals)
        for lane, t in enumerate(time.T):
            integral = integrals[..., lane]
            value = values[..., lane]
            if self.length is None:
                first, last = self.times
                end = int(np.argmax(t))  # rows of a sample that failed are zero after it
                averages[..., lane] = integral[:, end : end + 1] / (last - first)
                continue
            # A window that moves: the change of the integral over its length.
            begin = np.maximum(t - self.length, t[0])
            before = np.array([np.interp(begin, t, series) for series in integral])
            mean = (integral - before) / np.where(t > t[0], t - begin, 1.0)
            averages[..., lane] = np.where(t > t[0], mean, value)
        return averages


def refuse_windows(sensors: Mapping[str, Sensor], begin: float, end: float, step: float) -> None:
    """Raise `InputError` for averages over windows that the times of a result do not show."""
    for name, sensor in sensors.items():
        if not isinstance(sensor, Average):
            continue
        length, (first, last) = sensor.length, sensor.times
        if length is None and not begin <= first < last <= end * (1 + 1e-12):
            raise InputError(
                f"sensor {name!r}: the window of an Average must be within the run from {begin:g} "
                f"to {end:g} s; got {first:g} to {last:g} s"
            )
        if length is not None and abs(length / step - round(length / step)) > 1e-6:
            raise InputError(
                f"sensor {name!r}: a moving window of an Average must be a whole number of steps "
                f"of the result, {step:g} s; got {length:g} s"
            )
