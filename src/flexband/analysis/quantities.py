"""Quantities that are made of outputs: functions of a response, which `derived` bounds.

A quantity takes a response, dims ("sample", …, time), and returns what is made of each sample. The
last dimension counts as time, whatever its name is. Any function that does so is a quantity too.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from flexband.analysis.peaks import TimeAxis, least_between
from flexband.basics.arguments import frozen
from flexband.basics.checks import check_numbers, check_positive
from flexband.basics.rounding import unit_of_variable
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.requirements.corridors import ALWAYS, Window
from flexband.uncertainty.surrogates.axes import axes_of

Quantity = Callable[[xr.DataArray], xr.DataArray]


@frozen()
class Magnitude:
    """The magnitude of a vector, √(x² + y²), at every time.

    Parameters
    ----------
    outputs : names of its components.

    Raises
    ------
    InputError
        If fewer than two different names are given.
    """

    outputs: tuple[str, ...]

    def __init__(self, *outputs: str):
        if len(set(map(str, outputs))) < max(2, len(outputs)):
            raise InputError(
                f"outputs must be two different names or more; got {value_text(outputs)}"
            )
        object.__setattr__(self, "outputs", tuple(_check_output(output) for output in outputs))

    def __call__(self, response: xr.DataArray) -> xr.DataArray:
        parts = [output_of(response, output) for output in self.outputs]
        units = {str(part["unit"].values) for part in parts if "unit" in part.coords}
        if len(units) > 1:
            raise InputError(f"components of a vector must have one unit; got {', '.join(units)}")
        squares = [(part**2).drop_vars(("output",), errors="ignore") for part in parts]
        return (sum(squares[1:], squares[0]) ** 0.5).transpose(*parts[0].dims)


@dataclass(frozen=True)
class _OverTime(ABC):
    """A quantity of the times of an output.

    Parameters
    ----------
    of : name of an output, or a quantity such as `Magnitude`; by default each output.
    period : length of a turn, in the unit of the last dimension: 360 over an angle in degrees. One
        number of each whole turn is returned, with a last dim "turn" that counts from 1.

    Raises
    ------
    InputError
        If `of` is neither a name nor a function, or a period is not positive.
    """

    of: str | Quantity | None = None
    period: float | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.of is not None and not callable(self.of):
            _check_output(self.of)
        if self.period is not None:
            check_positive("period", check_numbers("period", self.period))

    def __call__(self, response: xr.DataArray) -> xr.DataArray:
        output, times = self.series(response)
        if self.period is None:
            return self.of_series(output, times)
        turns = int((times[-1] - times[0]) / self.period + 1e-9)
        windows = [(times[0] + k * self.period, self.period) for k in range(turns)]
        slack = 1e-9 * self.period
        windows = [(first - slack, first + length + slack) for first, length in windows]
        inside = [(times >= first) & (times <= last) for first, last in windows]
        if not inside or min(map(np.count_nonzero, inside)) < 3:
            raise InputError(
                f"period must be at most {np.ptp(times):g}, the length of {output.dims[-1]}, and "
                f"have three times or more; got {self.period:g}"
            )
        parts = [self.of_window(output, times, window) for window in windows]
        if len({part.shape for part in parts}) > 1:  # of spectra
            raise InputError(f"period must be a whole number of steps; got {self.period:g}")
        turn = xr.DataArray(np.arange(1.0, len(parts) + 1), dims="turn", name="turn")
        numbers = xr.concat(parts, turn, coords="minimal", compat="override", join="override")
        return numbers.transpose(..., "turn")

    def of_window(self, output: xr.DataArray, times: np.ndarray, window: Window) -> xr.DataArray:
        """Return it of an output between two times."""
        inside = (times >= window[0]) & (times <= window[1])
        return self.of_series(output[..., inside], times[inside])

    @abstractmethod
    def of_series(self, output: xr.DataArray, times: np.ndarray) -> xr.DataArray:
        """Return it of an output, whose last dim are the times."""

    def series(self, response: xr.DataArray) -> tuple[xr.DataArray, np.ndarray]:
        """Return the output, its last dim being time, and the times."""
        if callable(self.of):
            output = self.of(response)
        else:
            output = response if self.of is None else output_of(response, self.of)
        last = axes_of(output).time
        if last is None or output.shape[-1] < 3:
            raise InputError(
                f"{type(self).__name__} requires at least three times; got {output.dims}"
            )
        times = output[last].values if last in output.coords else np.arange(output.shape[-1])
        if times.dtype.kind not in "iuf" or (np.diff(times) <= 0).any():
            raise InputError(f"{last} must be increasing numbers for {type(self).__name__}")
        return output, times.astype(float)


class _Extreme(_OverTime):
    """A quantity of the largest value in a window."""

    def of_series(self, output: xr.DataArray, times: np.ndarray) -> xr.DataArray:
        return self.of_window(output, times, ALWAYS)


@frozen()
class Peak(_Extreme):
    """The largest value over time; between times, that of a cubic through the nearest four.

    Examples
    --------
    >>> import xarray as xr
    >>> pulse = xr.DataArray([[0.0, 3.0, 4.0, 3.0]], {"time": np.arange(4.0)}, ("sample", "time"))
    >>> fb.analysis.Peak()(pulse).values, fb.analysis.PeakTime()(pulse).values
    (array([4.]), array([2.]))
    """

    def of_window(self, output: xr.DataArray, times: np.ndarray, window: Window) -> xr.DataArray:
        return _peak(output, times, window)[0]


@frozen()
class Trough(_Extreme):
    """The smallest value over time; between times, that of a cubic through the nearest four."""

    def of_window(self, output: xr.DataArray, times: np.ndarray, window: Window) -> xr.DataArray:
        return -_peak(-output, times, window)[0]


@frozen()
class PeakTime(_Extreme):
    """The time of the largest value; between times, that of a cubic through the nearest four."""

    def of_window(self, output: xr.DataArray, times: np.ndarray, window: Window) -> xr.DataArray:
        peak_times = _peak(output, times, window)[1].drop_vars("unit", errors="ignore")
        unit = _unit_of_last(output)
        return peak_times.assign_coords(unit=unit) if unit else peak_times


@frozen()
class Final(_OverTime):
    """The value at the last time: what a sensor such as `sensors.Largest` makes of all steps."""

    def of_series(self, output: xr.DataArray, times: np.ndarray) -> xr.DataArray:
        return output.isel({output.dims[-1]: -1}, drop=True)


@frozen()
class RootMeanSquare(_OverTime):
    """The root of the mean square over time; the square is linear from each time to the next."""

    def of_series(self, output: xr.DataArray, times: np.ndarray) -> xr.DataArray:
        steps = np.diff(times)
        weights = np.concatenate([steps, [0.0]]) + np.concatenate([[0.0], steps])
        frame = output.isel({output.dims[-1]: 0}, drop=True)
        return frame.copy(data=np.sqrt(output.values**2 @ (weights / weights.sum())))


@frozen()
class Spectrum(_OverTime):
    """The amplitudes of the discrete Fourier transform, up to half the sampling rate.

    A sine with a whole number of periods in the time has its amplitude at its frequency. The first
    amplitude is the size of the mean. Times must be equidistant.
    """

    def of_series(self, output: xr.DataArray, times: np.ndarray) -> xr.DataArray:
        """Return the amplitudes, with a last dim "frequency"."""
        steps = np.diff(times)
        if np.ptp(steps) > 1e-6 * steps.max():
            raise InputError(
                f"a Spectrum needs equidistant times; got steps from {steps.min():g} to "
                f"{steps.max():g}"
            )
        count = output.shape[-1]
        sizes = np.abs(np.fft.rfft(output.values, axis=-1)) / count
        sizes[..., 1 : (count + 1) // 2] *= 2
        coords = {k: c for k, c in output.coords.items() if output.dims[-1] not in c.dims}
        unit = _unit_of_last(output)
        frequency = np.fft.rfftfreq(count, steps.mean())
        frequency_unit = {"s": "Hz", "": "1"}.get(unit, f"1/{unit}")
        coords["frequency"] = xr.DataArray(
            frequency, dims="frequency", attrs={"units": frequency_unit}
        )
        return xr.DataArray(sizes, dims=(*output.dims[:-1], "frequency"), coords=coords)


def made_of(response: xr.DataArray, quantity: Quantity) -> xr.DataArray:
    """Return a quantity of every sample, dims ("sample", …); raise `InputError` if it is none."""
    values = quantity(response)
    if not isinstance(values, xr.DataArray):
        values = xr.DataArray(np.asarray(values))
        if values.ndim and "sample" not in values.dims:
            values = values.rename({values.dims[0]: "sample"})
    if values.dims[:1] != ("sample",) or len(values) != len(response):
        raise InputError(
            f"quantity must return one number or array per sample, first dim 'sample'; got "
            f"dims {values.dims} and shape {values.shape}"
        )
    if values.dtype.kind not in "biuf" or not np.isfinite(values.values).all():
        raise InputError(f"quantity must return finite numbers; got {value_text(values.values)}")
    return values.astype(float)


def output_of(response: xr.DataArray, output: str) -> xr.DataArray:
    """Return one output of a response; raise `InputError` if it has none of this name."""
    names = [str(k) for k in response["output"].values] if "output" in response.coords else []
    if not names:
        raise InputError(
            f"the response names no outputs; got {output!r}. If it has one only, leave the name "
            'out; name several by the labels of a dim "output" of a DataArray'
        )
    if output not in names:
        raise InputError(f"output must be one of {', '.join(names)}; got {output!r}")
    return response.isel(output=names.index(output))


def _unit_of_last(output: xr.DataArray) -> str:
    return unit_of_variable(output[output.dims[-1]])


def _check_output(output: str) -> str:
    if not isinstance(output, str) or not output:
        raise InputError(f"an output must be given by its name; got {value_text(output)}")
    return output


def _peak(
    output: xr.DataArray, times: np.ndarray, window: Window
) -> tuple[xr.DataArray, xr.DataArray]:
    """Return the largest values of an output in a window, and their times."""
    minima = least_between(-output.values, TimeAxis(times, window))
    where = minima.estimate.argmin(axis=-1)[..., None]
    frame = output.isel({output.dims[-1]: 0}, drop=True)
    top, at = (
        np.take_along_axis(array, where, axis=-1)[..., 0]
        for array in (-minima.estimate, minima.place)
    )
    return frame.copy(data=top), frame.copy(data=np.clip(at, times[0], times[-1]))
