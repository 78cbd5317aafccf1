"""What a mechanism does at rest, as plain functions of its parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import xarray as xr

from flexband.errors import InputError, RunError, check_function, check_integer, check_numbers
from flexband.mechanics.assembly.mechanism import Mechanism
from flexband.mechanics.assembly.parts import check_sensors
from flexband.mechanics.equilibrium import LONGEST_TIME, MAX_STEPS, equilibrium
from flexband.mechanics.response import MechanismResponse, quantities_of, shown_inputs, tensors_of
from flexband.words import number_of


@dataclass(frozen=True)
class AtRest(MechanismResponse):
    """``response(**values)`` of a mechanism at rest; a subclass says what is computed.

    Each element of a flexible member is divided into `element_parts`.
    """

    steps: int = 1
    element_parts: int = 1

    def outputs(self, mechanism: Mechanism, values: Mapping[str, Any]) -> xr.DataArray:
        """Return the outputs, first dim "sample" unless no parameter is an array."""
        raise NotImplementedError

    def refinements(self, **values: Any) -> dict[str, Self]:
        """Return the response on twice the elements, if there are flexible members."""
        finer = replace(self, element_parts=2 * self.element_parts)
        return {"elements": finer} if self.mechanism(values).elements else {}

    def left_out(self, **values: Any) -> list[str]:
        """Return "elements" if their number is not given, so that a study chooses it."""
        return ["elements"] * bool(self.built(values).without_elements)

    def discretization(self, **values: Any) -> dict[str, float]:
        """Return the number of elements of every flexible member."""
        return {f"elements of {name}": n for name, n in self.mechanism(values).elements.items()}

    def __call__(self, **values: Any) -> xr.DataArray:
        """Return the outputs, dims (sample, output).

        Raises
        ------
        InputError
            If the builder does not return a mechanism, or it cannot be computed.
        AssemblyError
            If the constraints cannot be met or no equilibrium is found for a sample; the message
            gives the inputs of failed runs.
        """
        samples = max((np.size(v) for v in values.values() if not callable(v)), default=1)
        try:
            outputs = self.outputs(self.mechanism(values), values)
        except RunError as error:
            lines = [
                str(error),
                "inputs of the failed runs:",
                *shown_inputs(values, error.failures),
            ]
            raise type(error)("\n".join(lines), error.failures, error.results) from None
        if "sample" not in outputs.dims:
            outputs = outputs.expand_dims(sample=samples)
        return outputs

    def mechanism(self, values: Mapping[str, Any]) -> Mechanism:
        """Return the mechanism of values, with its elements divided."""
        mechanism = self.built(values)
        return mechanism.refined(self.element_parts) if self.element_parts > 1 else mechanism


@dataclass(frozen=True)
class StaticResponse(AtRest):
    """The outputs of the sensors in equilibrium."""

    time: float = 0.0
    threads: int | None = None

    @property
    def identity(self) -> tuple[object, ...]:
        """What the equilibrium depends on: all but the number of threads."""
        return "static", self.builder, self.steps, self.element_parts, self.time

    def quantities(self, **values: Any) -> list[str]:
        """Return of which vector or tensor each output is a component: its sensor and unit."""
        return quantities_of(self.built(values))

    def tensors(self, **values: Any) -> list[str]:
        """Return which of the `quantities` are tensors."""
        return tensors_of(self.built(values))

    def outputs(self, mechanism: Mechanism, values: Mapping[str, Any]) -> xr.DataArray:
        """Return the outputs of the sensors."""
        check_sensors(mechanism.sensors)
        outputs = equilibrium(mechanism, steps=self.steps, time=self.time, threads=self.threads)
        unstable = int(np.sum(~np.atleast_1d(outputs["stable"].values)))
        if unstable:
            raise InputError(
                f"the equilibrium of {unstable} of {number_of(outputs['stable'].size, 'run')} is "
                "not stable, so "
                "that bands would mix different ones; start nearer to the stable one"
            )
        return outputs.drop_vars("stable").drop_attrs(deep=False)


def static_response(
    builder: Callable[..., Mechanism],
    *,
    steps: int = 1,
    time: float = 0.0,
    threads: int | None = None,
) -> StaticResponse:
    """Return the static equilibrium of ``builder(**values)`` as a function of the values.

    The response has the outputs of the mechanism's sensors: positions, angles, forces of springs,
    reactions. Every run must find a stable equilibrium; one that is not stable is refused.

    Parameters
    ----------
    builder : as in `dynamic_response`.
    steps, time, threads : as in `equilibrium`.

    Raises
    ------
    InputError
        If the builder is no function or a number is out of its range; when it is called, if the
        mechanism has no sensors.
    """
    check_function("builder", builder, " that returns a Mechanism")
    steps = check_integer("steps", steps, 1, MAX_STEPS)
    at = float(check_numbers("time [s]", time))
    if abs(at) > LONGEST_TIME:
        raise InputError(f"time [s] must be at most {LONGEST_TIME:g}; got {at:g}")
    if threads is not None:
        check_integer("threads", threads, 1)
    return StaticResponse(builder, steps, time=at, threads=threads)
