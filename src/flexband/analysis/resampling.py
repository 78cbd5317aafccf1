"""A response over one of its own outputs instead of time, such as the angle of a crank."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.analysis.quantities import output_of
from flexband.basics.arguments import arguments_checked
from flexband.basics.checks import check_finite, check_function, check_instance
from flexband.basics.response import (
    Description,
    Response,
    ResponseFunction,
    WrappingResponse,
    as_response,
)
from flexband.basics.rounding import Units
from flexband.basics.warning import warn
from flexband.basics.words import value_text
from flexband.errors import InputError, ResolutionWarning, RunError
from flexband.requirements.units import factor


@arguments_checked
class OverOutput(WrappingResponse):
    """A response over one of its outputs instead of time, such as the angle of a crank.

    Each run is interpolated where the output passes the given values. The last dim of the result
    has the name of the output, which is not among the other outputs. Bands, charts and the `during`
    of requirements are then over the angle. A range of values chooses a turn, and
    ``Peak(period=360)`` makes one number of each.

    Parameters
    ----------
    response : of `dynamic_response`, or any function that returns a DataArray with dims (sample,
        output, time).
    output : name of the one that takes the place of time.
    values : increasing numbers, shape (values,): ``np.linspace(360, 720, 361)`` is the second turn.
    unit : of the values, such as "deg"; by default that of the output.

    Raises
    ------
    InputError
        If values do not increase, or the response is run elsewhere; when it is called, if there is
        no such output over time, or the unit does not fit it. A run whose output turns back between
        the values, or does not reach them, fails by name.

    Notes
    -----
    Cubic polynomials of time go through four times around each value, so that the error falls with
    the fourth power of the output step. A warning names an output with an error above 1e-4 of its
    range.

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
    >>> motion = fb.dynamic_response(crank, duration=1.0, step=0.01)
    >>> response = fb.analysis.OverOutput(motion, "crank angle", [0, 60, 180], unit="deg")
    >>> response(speed=np.array([4.0, 5.0])).sel(output="pin_X").round(4).values
    array([[ 0.2,  0.1, -0.2],
           [ 0.2,  0.1, -0.2]])
    """

    def __init__(
        self, response: ResponseFunction, output: str, values: ArrayLike, *, unit: str | None = None
    ) -> None:
        check_function("response", response)
        check_instance("output", output, str, "the name of an output")
        numbers = check_finite("values", values, rank=None)
        if numbers.ndim != 1 or len(numbers) < 2 or np.any(np.diff(numbers) <= 0):
            raise InputError(
                f"values must be two numbers or more that increase; got {value_text(values)}"
            )
        if unit is not None:
            check_instance("unit", unit, str, "a unit, such as 'deg'")
        super().__init__(response)
        if self.elsewhere:
            raise InputError("response must be one that flexband calls; got one run elsewhere")
        self.refines = as_response(response).refines
        self.output = output
        self.values = numbers
        self.unit = unit
        self.identity = "over output", response, output, numbers, unit
        self.__wrapped__ = response  # which has the arguments

    def description(self, **values: Any) -> Description:
        description = super().description(**values)
        refinements = description.refinements
        names = [name for name in description.quantities if name.rpartition(" [")[0] != self.output]
        return description._replace(
            refinements=lambda: {k: self._of(r, self.values) for k, r in refinements().items()},
            quantities=names,
        )

    def at_more_times(self, parts: int = 16, /, **values: Any) -> Response:
        """Return the response at more values, each step between two divided into parts."""
        steps = np.linspace(self.values[:-1], self.values[1:], parts, endpoint=False, axis=-1)
        fine_grid = np.append(steps.ravel(), self.values[-1])
        return self._of(super().at_more_times(**values) or as_response(self.function), fine_grid)

    def _of(self, response: Response, values: np.ndarray) -> OverOutput:
        return OverOutput(response.original, self.output, values, unit=self.unit)

    def course(self, **values: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the times, and the output at them in the first run, in the unit of the values."""
        motion = self._motion(self.function(**values))
        return motion.times, motion.axis[0] / motion.scale

    def __call__(self, **values: Any) -> xr.DataArray:
        """Return the other outputs, dims (sample, output, …), the last dim named as the output."""
        failures: dict[int, tuple[float, str]] = {}
        messages: list[str] = []
        try:
            series = self.function(**values)
        except RunError as error:
            if error.results is None:
                raise
            series = error.results
            failures = dict(error.failures)
            messages = [str(error)]
        # Locate the values in each run; decreasing outputs are treated with the other sign.
        motion = self._motion(series)
        axis = motion.axis
        others = motion.others
        times = motion.times
        scale = motion.scale
        unit = motion.unit
        sign = np.where(axis[:, -1:] < axis[:, :1], -1.0, 1.0)
        axis = sign * axis
        targets = sign * scale * self.values
        after = np.ones(targets.shape, dtype=int)
        for k in sorted(set(range(len(axis))) - failures.keys()):
            after[k], last, reason = _passages(axis[k], targets[k])
            if reason:
                spans = sign[k] * axis[k, [0, -1]] / scale, self.values[[0, -1]]
                output_range, target_range = ("{:.6g} to {:.6g}".format(*span) for span in spans)
                text = (
                    f"{self.output} {reason}: it goes from {output_range}, "
                    f"not over {target_range} {unit}"
                )
                failures[k] = float(times[last]), text
                messages.append(f"sample {k} at {times[last]:g} s: {text}")
        # Interpolate the runs that reach all values.
        complete_runs = np.setdiff1d(np.arange(len(axis)), list(failures))
        runs = (
            times,
            axis[complete_runs],
            others.values[complete_runs],
            targets[complete_runs],
            after[complete_runs],
        )
        data = np.full((*others.shape[:2], len(self.values)), np.nan)
        data[complete_runs] = _interpolate(*runs)
        coords = {k: c for k, c in others.coords.items() if others.dims[-1] not in c.dims}
        attrs = {"units": unit} if unit else {}
        coords[self.output] = xr.DataArray(self.values, dims=self.output, attrs=attrs)
        result = xr.DataArray(data, coords, (*others.dims[:2], self.output), attrs=others.attrs)
        if failures:
            raise RunError("\n".join(messages), failures, result)
        self._warn_of_few_times(result, _interpolate(*runs, stride=2))
        return result

    def _motion(self, series: Any) -> _Courses:
        """Return what a response has returned, divided into its parts."""
        dims = series.dims if isinstance(series, xr.DataArray) else ()
        if dims[:2] != ("sample", "output") or len(dims) != 3 or min(series.shape[1:]) < 2:
            raise InputError(
                "response must return a DataArray with dims (sample, output, time) and two outputs "
                f"or more; got {value_text(dict(series.sizes) if dims else series)}"
            )
        if series.shape[2] < 7:
            raise InputError(f"response must have at least 7 times; got {series.shape[2]}")
        axis = output_of(series, self.output)
        others = series.isel(output=series["output"].values != self.output)
        times = series[dims[2]].values if dims[2] in series.coords else np.arange(series.shape[2])
        unit = str(axis["unit"].values) if "unit" in axis.coords else ""
        scale = factor("unit", self.unit, unit) if self.unit and unit else 1.0
        return _Courses(axis.values, others, times.astype(float), scale, self.unit or unit)

    def _warn_of_few_times(
        self,
        result: xr.DataArray,
        coarse: np.ndarray,
        tolerance: float = 1e-4,
        constant_share: float = 1e-6,
    ) -> None:
        """Warn of errors: those of every second time, `coarse`, are 16 times as large.

        An output is constant if it varies by less than `constant_share` of the largest one of its
        unit.
        """
        values = result.values
        units = Units.along(result, ("output",))
        errors = np.abs(values - coarse).max(axis=(0, 2)) / 15
        ranges = np.maximum(
            np.ptp(values, axis=2).max(axis=0),
            units.least_variation(np.abs(values).max(axis=(0, 2)), constant_share),
        )
        shares = np.divide(errors, ranges, out=np.zeros_like(errors), where=ranges > 0)
        worst = int(shares.argmax())
        if shares[worst] > tolerance:
            warn(
                f"{result['output'].values[worst]} over {self.output} is interpolated with an "
                f"error of about {100 * shares[worst]:.2g} % of its range; take a shorter "
                "output_step",
                ResolutionWarning,
            )


class _Courses(NamedTuple):
    """Runs whose outputs are wanted over one of them."""

    axis: np.ndarray  # this output, (samples, times)
    others: xr.DataArray  # the other ones, dims (sample, output, time)
    times: np.ndarray  # [s]
    scale: float  # of the unit in which values of the axis are given, in that of the response
    unit: str  # in which they are given


def _passages(series: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, int, str]:
    """Return by which time each target is passed; if this fails, the last good time, and why."""
    slack = 1e-9 * np.ptp(targets)  # a start at rest may tremble by rounding errors
    highest = np.maximum.accumulate(series)
    lowest_later = np.minimum.accumulate(series[::-1])[::-1]
    first, last = (np.searchsorted(bound, targets - slack) for bound in (highest, lowest_later))
    if targets.min() < series[0] - slack or first.max() == len(series):
        return first, len(series) - 1, "does not reach all values"
    reversals = np.flatnonzero((highest - series)[first.min() : last.max() + 1] > slack)
    if reversals.size:
        return first, first.min() + reversals[0] - 1, "turns back"
    return np.maximum(first, 1), 0, ""


def _interpolate(
    times: np.ndarray,
    axis: np.ndarray,
    others: np.ndarray,
    targets: np.ndarray,
    after: np.ndarray,
    stride: int = 1,
) -> np.ndarray:
    """Return outputs, shape (runs, outputs, times), where the axis has its targets, (runs, values).

    `after` numbers the time after each target, `stride` leads to the next of its four times.
    """
    start = np.clip(after - 2 * stride, 0, len(times) - 1 - 3 * stride)
    nodes = start + stride * np.arange(4)[:, None, None]
    x = times[nodes]
    run = np.arange(len(axis))[:, None]
    place = _cubic(x, axis[run, nodes])
    low = times[after - 1]
    high = times[after]
    for _ in range(40):  # bisection, to 1e-12 of the step
        middle = (low + high) / 2
        before = place(middle) < targets
        low = np.where(before, middle, low)
        high = np.where(before, high, middle)
    series = [_cubic(x, others[:, k][run, nodes])(high) for k in range(others.shape[1])]
    return np.stack(series, axis=1)


def _cubic(x: np.ndarray, y: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Return the polynomials through four points along the first axis, in Newton's form."""
    c = [y[0]]
    for order in (1, 2, 3):
        y = (y[1:] - y[:-1]) / (x[order:] - x[:-order])
        c.append(y[0])
    return lambda at: c[0] + (at - x[0]) * (c[1] + (at - x[1]) * (c[2] + (at - x[2]) * c[3]))
