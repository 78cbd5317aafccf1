"""A mechanism's motion as a plain function of its parameters."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

from flexband.errors import (
    InputError,
    RunError,
    function,
    instance,
    numbers,
    positive,
    whole,
    without_warnings,
)
from flexband.mechanics.engine.generalized_alpha import GeneralizedAlpha
from flexband.mechanics.mechanism import Mechanism
from flexband.mechanics.simulate import simulate


@dataclass(frozen=True)
class DynamicResponse:
    """``response(**values)``: build the mechanism for all samples at once and simulate it.

    Each step and each element is divided into `refinement` parts.
    """

    builder: Callable[..., Mechanism]
    duration: float
    step: float
    integrator: GeneralizedAlpha = field(default_factory=GeneralizedAlpha)
    threads: int | None = None
    refinement: int = 1

    def refined(self) -> DynamicResponse:
        """Return the response on half the step and twice the elements, at the same times.

        Only the discretization differs: the builder is called as before, and the points of flexible
        members, joints, loads and sensors stay where they are. What was warned of before is not
        warned of again. Bodies in which a builder divides a member itself are not refined.
        """
        return replace(self, refinement=2 * self.refinement)

    @property
    def __wrapped__(self) -> Callable[..., Mechanism]:
        """The function that reads the arguments."""
        return self.builder

    @property
    def __signature__(self) -> inspect.Signature:
        return inspect.signature(self.builder)

    def __call__(self, **values: Any) -> xr.DataArray:
        """Return the sensors' outputs, dims (sample, output, time).

        Parameters
        ----------
        values : the builder's arguments: arrays of shape (n,), or functions of position.

        Raises
        ------
        InputError
            As `simulate` does, and if the builder does not return a mechanism.
        AssemblyError, SimulationError
            As `simulate` does; the message gives the inputs of the failed runs.
        """
        arrays = {name: v for name, v in values.items() if not callable(v)}
        samples = max((np.size(v) for v in arrays.values()), default=1)
        with without_warnings(when=self.refinement > 1):
            mechanism = self.builder(**values)
            if not isinstance(mechanism, Mechanism):
                raise InputError(f"the builder must return a Mechanism; got {mechanism!r}")
            try:
                motion = simulate(
                    mechanism.refined(self.refinement),
                    duration=self.duration,
                    step=self.step,
                    substeps=self.refinement,
                    integrator=self.integrator,
                    threads=self.threads,
                )
            except RunError as error:
                finer = f" with {self.refinement} times finer steps and elements"
                about = f"inputs of the failed runs{finer if self.refinement > 1 else ''}:"
                lines = [
                    f"sample {s}: " + ", ".join(_shown(name, v, s) for name, v in values.items())
                    for s in list(error.failures)[:5]
                ]
                text = "\n".join([str(error), about, *lines])
                raise type(error)(text, error.failures) from None
        if "sample" not in motion.dims:  # no parameter differs between the samples
            motion = motion.expand_dims(sample=samples)
        return motion


def dynamic_response(
    builder: Callable[..., Mechanism],
    *,
    duration: float,
    step: float,
    integrator: GeneralizedAlpha | None = None,
    threads: int | None = None,
) -> DynamicResponse:
    """Return the motion of ``builder(**values)`` as a function of the values.

    Parameters
    ----------
    builder : function that returns a `Mechanism`. It is called once per batch of n runs, with one
        array of shape (n,) per input; a random field is passed as a function of position.
    duration, step : simulated time and step [s].
    integrator, threads : as in `simulate`.

    Raises
    ------
    InputError
        If the builder is no function or a number is out of its range.
    """
    function("builder", builder, " that returns a Mechanism")
    for name, value in (("duration [s]", duration), ("step [s]", step)):
        positive(name, numbers(name, value))
    if integrator is not None:
        instance("integrator", integrator, GeneralizedAlpha)
    if threads is not None:
        whole("threads", threads, 1)
    return DynamicResponse(builder, duration, step, integrator or GeneralizedAlpha(), threads)


def _shown(name: str, value: Any, sample: int) -> str:
    """Return "name = value" of one sample; a function of position is evaluated at 0."""
    if callable(value):
        at_start = np.atleast_1d(np.asarray(value(np.zeros(1)))).ravel()
        return f"{name}(0) = {at_start[min(sample, len(at_start) - 1)]:.9g}"
    array = np.atleast_1d(np.asarray(value))
    return f"{name} = {array[min(sample, len(array) - 1)]:.9g}"
