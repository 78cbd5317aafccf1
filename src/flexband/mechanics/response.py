"""A mechanism's motion as a plain function of its parameters."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr

from flexband.basics.checks import check_function, check_instance, check_numbers, check_positive
from flexband.basics.progress import listener
from flexband.basics.response import Description, Response
from flexband.basics.warning import warn, without_warnings
from flexband.basics.words import number_of
from flexband.errors import AssemblyError, InputError, ResolutionWarning, RunError
from flexband.mechanics.bodies.properties import Property
from flexband.mechanics.branches import Branch
from flexband.mechanics.engine.generalized_alpha import GeneralizedAlpha
from flexband.mechanics.engine.threads import thread_count
from flexband.mechanics.linearization.mobility import free_bodies, instantaneous
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.model.parts import name_errors
from flexband.mechanics.simulate import TimeGrid, simulate_system, whole_steps
from flexband.mechanics.starts import check_multiple, start_of
from flexband.remarks.remark import Remark, RemarkKind

Argument = Property
"""An argument of a builder: numbers of shape (n,), or a function of position."""


FINEST_TOLERANCE = 2e-13
"""Of a step, that refinements of a response have."""


@dataclass(frozen=True)
class MechanismResponse(Response):
    """A response whose arguments are those of a function that builds a mechanism."""

    builder: Callable[..., Mechanism]
    nominal_branch: Branch | None = field(default=None, kw_only=True, compare=False, repr=False)

    refines = True

    @property
    def __wrapped__(self) -> Callable[..., Mechanism]:
        """The function that reads the arguments."""
        return self.builder

    @property
    def __signature__(self) -> inspect.Signature:
        return inspect.signature(self.builder)

    def built(self, values: Mapping[str, Argument]) -> Mechanism:
        """Return the mechanism of values; raise `InputError` if the builder returns none."""
        mechanism = self.builder(**values)
        if not isinstance(mechanism, Mechanism):
            raise InputError(f"the builder must return a Mechanism; got {mechanism!r}")
        if self.nominal_branch is None:
            return mechanism
        return self.nominal_branch.lead(self.builder, mechanism, values)

    def on_branch_of(self, **nominal: Argument) -> MechanismResponse:
        """Return the response whose bodies' angles are on the turns that nominal values lead to."""
        return replace(self, nominal_branch=Branch.from_builder(self.builder, nominal))

    @property
    def branch(self) -> str:
        """Where bodies' angles are at the nominal values, if that is far from 0."""
        return str(self.nominal_branch or "")

    def free_bodies(self, **values: Argument) -> list[str]:
        return free_bodies(self.built(values))

    def components(self, mechanism: Mechanism) -> tuple[list[str], list[str]]:
        """Return the vector or tensor of each output, by sensor and unit, and all tensors."""
        return [], []

    @staticmethod
    def with_inputs(
        error: RunError, values: Mapping[str, Argument], difference: str = ""
    ) -> RunError:
        """Return the error with the inputs of the first five of the failed runs."""
        lines = [str(error), f"inputs of the failed runs{difference}:"]
        for s in list(error.failures)[:5]:
            inputs = ", ".join(_format_input(name, v, s) for name, v in values.items())
            lines.append(f"sample {s}: {inputs}")
        results = None if error.results is None else begun(error.results)
        return type(error)("\n".join(lines), error.failures, results)


class SensorResponse(MechanismResponse):
    """A response whose outputs are those of the mechanism's sensors."""

    def instantaneous(self, **values: Argument) -> list[str]:
        """Return the positions, angles and lengths, if the motion is prescribed."""
        return instantaneous(self.built(values))

    def components(self, mechanism: Mechanism) -> tuple[list[str], list[str]]:
        quantities = []
        tensors = []
        for name, sensor in mechanism.sensors.items():
            units = [unit for _, unit in mechanism.model.outputs[name]]
            quantities += [f"{name} [{unit}]" for unit in units]
            tensors += [f"{name} [{unit}]" for unit in dict.fromkeys(units) if sensor.tensor]
        return quantities, tensors


@dataclass(frozen=True)
class DynamicResponse(SensorResponse):
    """``response(**values)``: build the mechanism for all samples at once and simulate it.

    Each step between two outputs is divided into `step_parts`, each element into `element_parts`.
    Where samples choose their steps, these are `chosen_parts` times shorter.
    """

    duration: float
    output_step: float
    integrator: GeneralizedAlpha = field(default_factory=GeneralizedAlpha)
    threads: int | None = None
    step_parts: int = 1
    element_parts: int = 1
    chosen_parts: int = 1
    given_step: bool = True
    start: str = "assembled"
    period: float | None = None
    ramp_time: float = 0.0
    base_response: DynamicResponse | None = None
    """The response that this is a refinement of."""

    @property
    def step(self) -> float:
        """Step of the integrator [s]."""
        return self.output_step / self.step_parts

    def refined(self, step_parts: int = 2, element_parts: int = 2) -> DynamicResponse:
        """Return the response with each step and each element divided, at the same times.

        Only the discretization differs: the builder is called as before, and the points of flexible
        members, joints, loads and sensors stay where they are. What was warned of before is not
        warned of again. A member that the builder itself divides into bodies is not refined.
        Where samples choose their steps, the tolerance of a step falls with the third power of its
        parts, since that is the order of a step's error.
        """
        return replace(
            self,
            step_parts=step_parts * self.step_parts,
            element_parts=element_parts * self.element_parts,
            chosen_parts=step_parts * self.chosen_parts,
            base_response=self.base_response or self,
        )

    def description(self, **values: Argument) -> Description:
        """Return what it says about itself.

        Its discretization is the step [s] and the number of elements of each flexible member. Half
        the step is finer, and so are twice the elements. Where samples choose their steps, up to
        that one, an eighth of their tolerance goes with half the step. Contacts and friction are
        its impacts.
        """
        mechanism = self.built(values)
        # What can be refined, and what is left to the method.
        elements = elements_of(mechanism, self.element_parts)
        limits = self._integrator(mechanism).step_limits(mechanism.model.state, self.step)
        refinements = {"step": self.refined(element_parts=1)}
        if elements:
            refinements["elements"] = self.refined(step_parts=1)
        open_step = not self.given_step
        open_mesh = bool(mechanism.without_elements)
        left_out = ["step"] * open_step + ["elements"] * open_mesh
        default_tolerance = limits and self.given_step and self.integrator.step_tolerance is None
        numbers = {"step": self.step} | elements
        if limits:
            numbers["step tolerance"] = limits.tolerance
        return Description(
            left_out,
            ["step"] if default_tolerance else [],
            numbers,
            refinements.copy,
            *self.components(mechanism),
            impacts=bool(mechanism.model.contact_laws or mechanism.model.frictions),
        )

    def at_more_times(
        self,
        max_parts: int = 64,
        max_times: int = 2**15,
        adaptive_parts: int = 8,
        /,
        **values: Argument,
    ) -> DynamicResponse | None:
        """Return the response at its steps between the times of outputs too; None without such.

        Of more than `max_parts` steps from one time to the next, or `max_times` in all, every
        second, third … is taken, if their number can be divided. Where samples choose their steps,
        which the values of a call tell, these are `adaptive_parts` times as many times.
        """
        count = min(max_parts, int(max_times * self.output_step / self.duration))
        part_count = min(adaptive_parts, count)
        limits = self.integrator.step_limits
        if values and part_count > 1 and limits(self.built(values).model.state, self.step):
            step_parts = (
                self.step_parts
                if self.step_parts < part_count
                else -(-self.step_parts // part_count)
            )
            return self._divide_step(part_count, step_parts)
        if self.step_parts == 1:
            return None
        parts = [k for k in range(2, self.step_parts + 1) if self.step_parts % k == 0]
        part_count = max((k for k in parts if k <= count), default=parts[0])
        return self._divide_step(part_count, self.step_parts // part_count)

    def _divide_step(self, parts: int, step_parts: int) -> DynamicResponse:
        step = self.output_step / parts
        return replace(
            self, output_step=step, step_parts=step_parts, base_response=self.base_response or self
        )

    def started_softly(self, duration: float) -> DynamicResponse | None:
        """Return the response from a rest, with a time that reaches its pace after a duration [s].

        The outputs have the times of the given motion; from half the duration on, functions of time
        have the given values. None where the motion is periodic from its start on.
        """
        if self.start == "periodic":
            return None
        return replace(
            self, start="static", ramp_time=duration, base_response=self.base_response or self
        )

    @property
    def identity(self) -> tuple[object, ...]:
        """What the motion depends on: all but the number of threads."""
        parts = self.step_parts, self.element_parts, self.given_step
        start = () if self.start == "assembled" else (self.start, self.period, self.ramp_time)
        parts = (*parts, self.chosen_parts) if self.chosen_parts > 1 else parts
        return self.builder, self.duration, self.output_step, self.integrator, *parts, *start

    def __call__(self, **values: Argument) -> xr.DataArray:
        """Return the sensors' outputs, dims (sample, output, time).

        Parameters
        ----------
        values : the builder's arguments: arrays of shape (n,), or functions of position.

        Raises
        ------
        InputError
            As `simulate` does, and if the builder does not return a mechanism.
        AssemblyError, SimulationError
            As `simulate` does; the message gives the inputs of the failed runs. Without a given
            step, runs that diverge are not completed with half of it: the step is too long.
        """
        # Build and simulate all samples.
        arrays = {name: v for name, v in values.items() if not callable(v)}
        samples = samples_of(arrays)
        with without_warnings(when=self.base_response is not None):
            if not self.given_step:
                warn(f"the step is left out: {self.step:g} s is used", ResolutionWarning)
            mechanism = self.built(values)
            if self.element_parts > 1:
                mechanism = mechanism.refined(self.element_parts)
            try:
                motion, _ = simulate_system(
                    mechanism,
                    TimeGrid(self.duration + self.ramp_time / 2, self.output_step, self.step_parts),
                    start=self.start,
                    period=self.period,
                    ramp_time=self.ramp_time,
                    integrator=self._integrator(mechanism),
                    threads=self.threads,
                    progress=listener().advance,
                    complete=self.given_step,
                )
            except AssemblyError as error:
                raise self.with_inputs(error, values) from None
            except RunError as error:
                raise self.with_inputs(error, values, self._difference()) from None
        # Warn of runs whose step's error is not seen.
        if "halved_step" in motion.attrs:
            halved_samples = motion.attrs["halved_step"]
            text = (
                f"diverged with steps of {self.step:g} s and had to be completed with half of it; "
                "estimates of the step's error do not see their error: take a shorter step"
            )
            warn(
                f"{len(halved_samples)} of {number_of(samples, 'run')} {text}",
                remarks=[
                    Remark(RemarkKind.HALVED_STEP, f"a run {text}", size=1.0, sample=k)
                    for k in halved_samples
                ],
            )
        # Leave out the time that the slow start takes.
        if self.ramp_time:
            later = motion.isel(time=slice(round(self.ramp_time / 2 / self.output_step), None))
            motion = later.assign_coords(time=later["time"] - self.ramp_time / 2)
        if "sample" not in motion.dims:  # no parameter differs between the samples
            motion = motion.expand_dims(sample=samples)
        return begun(motion)

    def _integrator(self, mechanism: Mechanism) -> GeneralizedAlpha:
        """Return the integrator with the tolerance of the steps that samples choose."""
        limits = self.integrator.step_limits(mechanism.model.state, self.step)
        if limits is None or self.chosen_parts == 1:
            return self.integrator
        tolerance = max(limits.tolerance / self.chosen_parts**3, FINEST_TOLERANCE)
        return replace(self.integrator, step_tolerance=tolerance)

    def _difference(self) -> str:
        """Return in words what is finer than in the response that this is a refinement of."""
        if self.base_response is None:
            return ""
        parts = round(self.base_response.step / self.step), self.element_parts
        words = zip(("steps", "elements"), parts, strict=True)
        text = " and ".join(f"{n} times finer {name}" for name, n in words if n > 1)
        return f" with {text}" if text else ""


def elements_of(mechanism: Mechanism, parts: int) -> dict[str, int]:
    """Return how many elements flexible members have if each of theirs is divided into parts."""
    bodies = {
        name: name_errors(f"body {name!r}", mechanism.bodies[name].refine_mesh, parts)
        for name in mechanism.elements
    }
    return {f"elements of {name}": body.elements for name, body in bodies.items()}


def samples_of(values: Mapping[str, Argument]) -> int:
    """Return the number of samples of arguments, whose last axis is that of the samples."""
    arrays = (np.asarray(v) for v in values.values() if not callable(v))
    return max((array.shape[-1] for array in arrays if array.ndim), default=1)


def begun(motion: xr.DataArray) -> xr.DataArray:
    """Return a motion in which what a sensor does not know yet is what it tells first.

    That is the first value in a window before it begins, and an instant before it comes. An instant
    that does not come is the end of the run.
    """
    finite_mask = np.isfinite(motion.values)
    if finite_mask.all() or "time" not in motion.dims:
        return motion
    first = finite_mask.argmax(axis=-1)[..., None]
    never = ~finite_mask.any(axis=-1, keepdims=True)
    instants = (motion["unit"] == "s").broadcast_like(motion).values
    values = np.take_along_axis(motion.values, first, axis=-1)
    values = np.where(instants & never, motion["time"].values[-1], values)
    early = never | (np.arange(motion.sizes["time"]) < first)
    return motion.copy(data=np.where(early, values, motion.values))


def dynamic_response(
    builder: Callable[..., Mechanism],
    *,
    duration: float,
    step: float | None = None,
    output_step: float | None = None,
    start: str = "assembled",
    period: float | None = None,
    integrator: GeneralizedAlpha | None = None,
    threads: int | None = None,
) -> DynamicResponse:
    """Return the motion of ``builder(**values)`` as a function of the values.

    Its outputs are finite at all times: before the window of a sensor begins, they have the first
    value in it, and an instant of `contact.Contacts` that does not come is the end of the run.

    Parameters
    ----------
    builder : function that returns a `Mechanism`. It is called once per batch of n runs, with one
        array of shape (n,) per input; a random field is passed as a function of position.
    duration : simulated time [s].
    step : of the integrator [s]. Without it, `AdaptivePCCI` chooses it, and the number of
        elements of members without one, so that its tolerance holds for the total error of the
        bands; other methods require a step. A call of the response itself then takes steps of
        `output_step`, and warns of that.
    output_step : time between two outputs [s], a multiple of `step`. By default each step is one,
        or there are 500 if `step` is left out.
    start, period : as in `simulate`; the period is a whole multiple of `output_step`. A vibration
        that the given start excites is not there after a "static" or a "periodic" one.
    integrator, threads : as in `simulate`.

    Raises
    ------
    InputError
        If the builder is not a function or a number is out of its range.

    Examples
    --------
    >>> def cart(mass):
    ...     return fb.Mechanism(
    ...         bodies={"cart": fb.PointMass(mass=mass, position=(1.1, 0.0))},
    ...         joints={"rail": fb.Slot("cart", (0.0, 0.0), axis=(1.0, 0.0))},
    ...         loads={"spring": fb.Spring("cart", (0.0, 0.0), stiffness=100.0, rest_length=1.0)},
    ...         sensors={"cart": fb.Position("cart")},
    ...     )
    ...
    >>> response = fb.dynamic_response(cart, duration=0.314, step=1e-3)
    >>> motions = response(mass=np.array([1.0, 4.0]))  # half a period and a quarter
    >>> motions.sel(output="cart_X").values[:, -1].round(3)
    array([0.9, 1. ])
    """
    check_function("builder", builder, " that returns a Mechanism")
    optional = (("step [s]", step), ("output_step [s]", output_step))
    step_options = [(name, value) for name, value in optional if value is not None]
    for name, value in [("duration [s]", duration), *step_options]:
        check_positive(name, check_numbers(name, value))
    duration = float(duration)
    step, output_step = (None if value is None else float(value) for value in (step, output_step))
    if integrator is not None:
        check_instance("integrator", integrator, GeneralizedAlpha)
    thread_count(threads)
    interval = output_step or step or duration / 500
    whole_steps(duration, interval, name="output_step" if output_step else "step")
    parts = check_multiple("output_step [s]", interval, "step", step or interval)
    start_of(start, period, interval, "output_step" if output_step else "step")
    return DynamicResponse(
        builder,
        duration,
        interval,
        integrator or GeneralizedAlpha(),
        threads,
        parts,
        given_step=step is not None,
        start=start,
        period=None if period is None else float(period),
    )


def _format_input(name: str, value: Argument, sample: int) -> str:
    """Return "name = value" of one sample; a function of position is evaluated at 0."""
    if callable(value):
        try:
            at_start = np.atleast_1d(np.asarray(value(np.zeros(1)))).ravel()
        except InputError:  # 0 is not where it is used
            return f"{name} = a function"
        return f"{name}(0) = {at_start[min(sample, len(at_start) - 1)]:.9g}"
    array = np.atleast_1d(np.asarray(value))
    numbers = np.atleast_1d(array[..., min(sample, array.shape[-1] - 1)])
    return f"{name} = {', '.join(f'{number:.9g}' for number in numbers)}"
