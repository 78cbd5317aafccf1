"""A response over one of its own outputs instead of time, such as the angle of a crank."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.analysis.quantities import chosen
from flexband.analysis.requirements.units import factor
from flexband.errors import (
    InputError,
    ResolutionWarning,
    RunError,
    check_finite,
    check_function,
    check_instance,
    shown,
    warn,
)
from flexband.response import FunctionResponse, Response, ResponseFunction, as_response
from flexband.rounding import Units


class OverOutput(FunctionResponse):
    """``response(**values)``: the other outputs where one of them has given values.

    Attributes
    ----------
    function, output, values, unit : as in `over_output`.
    """

    def __init__(
        self, function: ResponseFunction, output: str, values: np.ndarray, unit: str | None
    ) -> None:
        super().__init__(function)
        self.output, self.values, self.unit = output, values, unit

    @property
    def __wrapped__(self) -> ResponseFunction:
        """What has the arguments."""
        return self.function

    @property
    def identity(self) -> tuple[object, ...]:
        """What the outputs depend on."""
        return "over output", self.function, self.output, self.values, self.unit

    @property
    def original(self) -> ResponseFunction:
        return self

    @property
    def source(self) -> Response:
        return as_response(self.function).source

    def refinements(self, **values: Any) -> Mapping[str, Response]:
        finer = super().refinements(**values)
        return {name: self._of(response, self.values) for name, response in finer.items()}

    def at_more_times(self, parts: int = 16) -> Response:
        """Return the response at more values, each step between two divided into parts."""
        steps = np.linspace(self.values[:-1], self.values[1:], parts, endpoint=False, axis=-1)
        more = np.append(steps.ravel(), self.values[-1])
        return self._of(super().at_more_times() or as_response(self.function), more)

    def quantities(self, **values: Any) -> list[str]:
        names = super().quantities(**values)
        return [name for name in names if name.rpartition(" [")[0] != self.output]

    def course(self, **values: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return times and what the output is at them in the first run, in the unit of values."""
        axis, _, times, unit = self._parts(self.function(**values))
        return times, axis[0] / (factor("unit", self.unit, unit) if self.unit and unit else 1.0)

    def _of(self, response: Response, values: np.ndarray) -> OverOutput:
        return OverOutput(response.original, self.output, values, self.unit)

    def __call__(self, **values: Any) -> xr.DataArray:
        """Return the other outputs, dims (sample, output, …), the last dim named as the output.

        Raises
        ------
        InputError
            If the response has no such output over time, or its unit is another one.
        RunError
            If a run fails, or the output does not pass each value just once.
        """
        failures: dict[int, tuple[float, str]] = {}
        messages: list[str] = []
        try:
            series = self.function(**values)
        except RunError as error:
            if error.results is None:
                raise
            series, failures, messages = error.results, dict(error.failures), [str(error)]
        axis, others, times, unit = self._parts(series)
        scale = factor("unit", self.unit, unit) if self.unit and unit else 1.0
        unit = self.unit or unit
        sign = np.where(axis[:, -1:] < axis[:, :1], -1.0, 1.0)
        axis, targets = sign * axis, sign * scale * self.values
        after = np.ones(targets.shape, dtype=int)
        for k in sorted(set(range(len(axis))) - failures.keys()):
            after[k], wrong, reason = _passages(axis[k], targets[k])
            if reason:
                spans = sign[k] * axis[k, [0, -1]] / scale, self.values[[0, -1]]
                has, asked = ("{:.6g} to {:.6g}".format(*span) for span in spans)
                text = f"{self.output} {reason}: it goes from {has}, not over {asked} {unit}"
                failures[k] = float(times[wrong]), text
                messages.append(f"sample {k} at {times[wrong]:g} s: {text}")
        good = np.setdiff1d(np.arange(len(axis)), list(failures))
        runs = times, axis[good], others.values[good], targets[good], after[good]
        data = np.full((*others.shape[:2], len(self.values)), np.nan)
        data[good] = _interpolated(*runs)
        coords = {k: c for k, c in others.coords.items() if others.dims[-1] not in c.dims}
        attrs = {"units": unit} if unit else {}
        coords[self.output] = xr.DataArray(self.values, dims=self.output, attrs=attrs)
        result = xr.DataArray(data, coords, (*others.dims[:2], self.output), attrs=others.attrs)
        if failures:
            raise RunError("\n".join(messages), failures, result)
        self._warn_of_few_times(result, _interpolated(*runs, stride=2))
        return result

    def _parts(self, series: Any) -> tuple[np.ndarray, xr.DataArray, np.ndarray, str]:
        """Return the output over time, the other outputs, the times and the unit of the output."""
        dims = series.dims if isinstance(series, xr.DataArray) else ()
        if dims[:2] != ("sample", "output") or len(dims) != 3 or series.shape[2] < 7:
            raise InputError(
                "response must return a DataArray with dims (sample, output, time) and at least "
                f"seven times; got {shown(dict(series.sizes) if dims else series)}"
            )
        axis = chosen(series, self.output)
        others = series.isel(output=series["output"].values != self.output)
        if not others.sizes["output"]:
            raise InputError(f"response must have other outputs than {self.output!r}; got none")
        times = series[dims[2]].values if dims[2] in series.coords else np.arange(series.shape[2])
        unit = str(axis["unit"].values) if "unit" in axis.coords else ""
        return axis.values, others, times.astype(float), unit

    def _warn_of_few_times(
        self, result: xr.DataArray, coarse: np.ndarray, tolerance: float = 1e-4, least: float = 1e-6
    ) -> None:
        """Warn of an error of interpolation above a part of an output's range.

        Every second time has 16 times the error. An output that varies by less than `least` of the
        largest one of its unit counts as constant.
        """
        values = result.values
        errors = np.abs(values - coarse).max(axis=(0, 2)) / 15
        units, size = Units.along(result, ("output",)), np.abs(values).max(axis=(0, 2))
        ranges = np.ptp(values, axis=2).max(axis=0)
        ranges = np.maximum(ranges, units.least_variation(size, least))
        shares = np.divide(errors, ranges, out=np.zeros_like(errors), where=ranges > 0)
        worst = int(shares.argmax())
        if shares[worst] > tolerance:
            warn(
                f"{result['output'].values[worst]} over {self.output} is interpolated with an "
                f"error of about {100 * shares[worst]:.2g} % of its range; take a shorter "
                "output_step",
                ResolutionWarning,
            )


def _passages(series: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, int, str]:
    """Return by which time each target is passed, or at which time this fails and why.

    Parameters
    ----------
    series, targets : shape (times,) and (values,); the series increases from its start to its end.
    """
    slack = 1e-9 * np.ptp(targets)  # a start at rest may tremble by rounding errors
    highest, lowest_later = np.maximum.accumulate(series), np.minimum.accumulate(series[::-1])[::-1]
    first, last = (np.searchsorted(bound, targets - slack) for bound in (highest, lowest_later))
    if targets.min() < series[0] - slack or first.max() == len(series):
        return first, len(series) - 1, "does not reach all values"
    back = np.flatnonzero((highest - series)[first.min() : last.max() + 1] > slack)
    if back.size:
        return first, first.min() + back[0] - 1, "turns back"
    return np.maximum(first, 1), 0, ""


def _interpolated(
    times: np.ndarray,
    axis: np.ndarray,
    others: np.ndarray,
    targets: np.ndarray,
    after: np.ndarray,
    stride: int = 1,
) -> np.ndarray:
    """Return outputs where another one has its targets, shape (runs, outputs, values).

    Cubic polynomials of time go through four times around each target. That of the axis tells when
    it has the target.

    Parameters
    ----------
    axis, others : shape (runs, times) and (runs, outputs, times).
    targets, after : values of the axis, and numbers of the times that follow, (runs, values).
    stride : from one of the four times to the next.
    """
    start = np.clip(after - 2 * stride, 0, len(times) - 1 - 3 * stride)
    nodes = start + stride * np.arange(4)[:, None, None]
    x, run = times[nodes], np.arange(len(axis))[:, None]
    at = _root(x, _coefficients(x, axis[run, nodes]), targets, times[after - 1], times[after])
    series = [others[:, k][run, nodes] for k in range(others.shape[1])]
    return np.stack([_polynomial(x, _coefficients(x, y), at)[0] for y in series], axis=1)


def _coefficients(x: np.ndarray, y: np.ndarray) -> list[np.ndarray]:
    """Return the divided differences of values at places along the first axis."""
    coefficients = [y[0]]
    for order in range(1, len(x)):
        y = (y[1:] - y[:-1]) / (x[order:] - x[:-order])
        coefficients.append(y[0])
    return coefficients


def _polynomial(
    x: np.ndarray, coefficients: list[np.ndarray], at: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return values and derivatives of polynomials in Newton's form."""
    value, slope = coefficients[-1], np.zeros_like(at)
    for node, coefficient in zip(x[-2::-1], coefficients[-2::-1], strict=True):
        slope = slope * (at - node) + value
        value = value * (at - node) + coefficient
    return value, slope


def _root(
    x: np.ndarray, coefficients: list[np.ndarray], target: np.ndarray, low: Any, high: Any
) -> np.ndarray:
    """Return where polynomials have their targets between two places, by Newton's method.

    Steps that leave the interval are replaced by bisection. A place that is found stays, so that it
    does not depend on the others.
    """
    most, tolerance = 100, 1e-10 * (high - low)
    at = (low + high) / 2
    for _ in range(most):
        value, slope = _polynomial(x, coefficients, at)
        low, high = np.where(value < target, at, low), np.where(value < target, high, at)
        new = at + np.divide(target - value, slope, out=np.full_like(at, np.inf), where=slope > 0)
        new = np.where((new >= low) & (new <= high), new, (low + high) / 2)
        done = np.abs(new - at) <= tolerance
        at = np.where(done, at, new)
        if done.all():
            break
    return at


def over_output(
    response: ResponseFunction, output: str, values: ArrayLike, *, unit: str | None = None
) -> OverOutput:
    """Return a response over one of its outputs instead of time, such as the angle of a crank.

    Each run is interpolated where its output passes the given values; the last dim of the result
    has the name of the output, which is left out of the others. Bands, charts, tables and the
    `during` of requirements are then over the angle. A range of values chooses a turn, and
    ``Peak(of, period=360)`` makes one number of each.

    Parameters
    ----------
    response : of `dynamic_response`, or any function that returns a DataArray with dims (sample,
        output, time).
    output : name of the one that takes the place of time. It passes each value once.
    values : increasing numbers, shape (values,): ``np.linspace(360, 720, 361)`` is the second turn.
    unit : of the values, such as "deg"; by default that of the output.

    Raises
    ------
    InputError
        If values do not increase or the response has no such output; when it is called, if the unit
        does not fit. A run whose output turns back, or does not reach the values, fails by name.

    Notes
    -----
    Cubic polynomials through four times around each value: the error falls with the fourth power of
    the time between two outputs. If it exceeds about 1e-4 of an output's range, a warning says so.

    Examples
    --------
    >>> def crank(speed):
    ...     return fb.Mechanism(
    ...         bodies={"crank": fb.RigidBody(mass=1.0, inertia=1.0, points={"pin": (0.2, 0.0)})},
    ...         joints={
    ...             "shaft": fb.Revolute("crank", (0.0, 0.0)),
    ...             "motor": fb.PrescribedRotation("crank", lambda t: speed * t),
    ...         },
    ...         sensors={"crank angle": fb.Angle("crank"), "pin": fb.Position("crank.pin")},
    ...     )
    ...
    >>> response = fb.dynamic_response(crank, duration=1.0, step=0.01)
    >>> over = fb.analysis.over_output(response, "crank angle", [0, 60, 180], unit="deg")
    >>> over(speed=np.array([4.0, 5.0])).sel(output="pin_X").round(4).values  # at all speeds
    array([[ 0.2,  0.1, -0.2],
           [ 0.2,  0.1, -0.2]])
    """
    check_function("response", response)
    check_instance("output", output, str, "the name of an output")
    numbers = check_finite("values", values, rank=None)
    if numbers.ndim != 1 or len(numbers) < 2 or np.any(np.diff(numbers) <= 0):
        raise InputError(f"values must be two numbers or more that increase; got {shown(values)}")
    if as_response(response).elsewhere:
        raise InputError("response must be one that flexband calls; got one that is run elsewhere")
    if unit is not None:
        check_instance("unit", unit, str, "a unit, such as 'deg'")
    return OverOutput(response, output, numbers, unit)
