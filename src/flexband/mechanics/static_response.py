"""What a mechanism does at rest, as plain functions of its parameters."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from flexband.basics.checks import check_function
from flexband.basics.response import Description
from flexband.basics.words import number_of
from flexband.errors import InputError, RunError
from flexband.mechanics.engine.threads import thread_count
from flexband.mechanics.equilibrium import check_steps, check_time, equilibrium
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.response import (
    Argument,
    MechanismResponse,
    SensorResponse,
    elements_of,
    samples_of,
)


@dataclass(frozen=True)
class AtRest(MechanismResponse, ABC):
    """``response(**values)`` of a mechanism at rest; a subclass says what is computed.

    The loads are applied in `steps`. Each element of a flexible member is divided into
    `element_parts`.
    """

    steps: int = 1
    element_parts: int = 1

    @abstractmethod
    def outputs(self, mechanism: Mechanism, values: Mapping[str, Argument]) -> xr.DataArray:
        """Return the outputs, first dim "sample" unless no parameter is an array."""

    def description(self, **values: Argument) -> Description:
        """Return what it says about itself; its discretization is the elements alone."""
        mechanism = self.built(values)
        parts = self.element_parts
        numbers = elements_of(mechanism, parts)
        refinements = {"elements": replace(self, element_parts=2 * parts)} if numbers else {}
        left_out = ["elements"] * bool(mechanism.without_elements)
        return Description(left_out, [], numbers, refinements.copy, *self.components(mechanism))

    def __call__(self, **values: Argument) -> xr.DataArray:
        """Return the outputs, dims (sample, output).

        Raises
        ------
        InputError
            If the builder does not return a mechanism, or it cannot be computed.
        AssemblyError
            If the constraints cannot be met or no equilibrium is found for a sample; the message
            gives the inputs of failed runs.
        """
        samples = samples_of(values)
        try:
            outputs = self.outputs(self.mechanism(values), values)
        except RunError as error:
            raise self.with_inputs(error, values) from None
        if "sample" not in outputs.dims:
            outputs = outputs.expand_dims(sample=samples)
        return outputs

    def mechanism(self, values: Mapping[str, Argument]) -> Mechanism:
        """Return the mechanism of values, with its elements divided."""
        mechanism = self.built(values)
        return mechanism.refined(self.element_parts) if self.element_parts > 1 else mechanism


@dataclass(frozen=True)
class StaticResponse(AtRest, SensorResponse):
    """The outputs of the sensors in equilibrium at a `time` [s]."""

    time: float = 0.0
    threads: int | None = None

    @property
    def identity(self) -> tuple[object, ...]:
        """What the equilibrium depends on: all but the number of threads."""
        return "static", self.builder, self.steps, self.element_parts, self.time

    def outputs(self, mechanism: Mechanism, values: Mapping[str, Argument]) -> xr.DataArray:
        """Return the outputs of the sensors."""
        mechanism.check_sensors()
        outputs = equilibrium(mechanism, steps=self.steps, time=self.time, threads=self.threads)
        unstable = int(np.sum(~np.atleast_1d(outputs["stable"].values)))
        if unstable:
            raise InputError(
                f"the equilibrium of {unstable} of {number_of(outputs['stable'].size, 'run')} is "
                "not stable, so that bands would mix different ones; start nearer to the stable one"
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

    Examples
    --------
    >>> def pendulum(force):
    ...     return fb.Mechanism(
    ...         bodies={"bob": fb.PointMass(mass=1.0, position=(0.0, -1.0))},
    ...         joints={"rod": fb.Distance("bob", (0.0, 0.0), length=1.0)},
    ...         loads={"gravity": fb.Gravity(), "wind": fb.Force("bob", x=force)},
    ...         sensors={"rod": fb.Reaction("rod")},
    ...     )
    ...
    >>> inputs = {"force": fb.Interval(1.0, 2.0)}
    >>> bands = fb.propagate(fb.static_response(pendulum), inputs, fb.ImprovedPCCI(0, 2))
    >>> bands["mean"].sel(output="rod_X").values.round(4)  # [N]
    array([-2., -1.])
    """
    check_function("builder", builder, " that returns a Mechanism")
    steps = check_steps(steps)
    at = check_time(time)
    thread_count(threads)
    return StaticResponse(builder, steps, time=at, threads=threads)
