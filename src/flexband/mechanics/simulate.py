"""Simulate a mechanism: all samples at once."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr

from flexband.basics.checks import (
    check_affordable,
    check_flag,
    check_function,
    check_instance,
    check_integer,
    check_numbers,
    check_positive,
)
from flexband.basics.progress import Progress, ProgressListener, add_listener, listener
from flexband.basics.warning import warn
from flexband.errors import ResolutionWarning, RunError
from flexband.mechanics.assembly.packing import check_memory
from flexband.mechanics.assembly.rounding import attributes_of_units
from flexband.mechanics.continued_start import end_state
from flexband.mechanics.engine.batch import Batch, run_samples
from flexband.mechanics.engine.failures import raise_failures
from flexband.mechanics.engine.generalized_alpha import GeneralizedAlpha
from flexband.mechanics.engine.reachability import find_out_of_reach
from flexband.mechanics.engine.redundancy import (
    joints_that_share,
    refuse_shared_friction,
    warn_of_shared,
    warn_of_unresolved,
)
from flexband.mechanics.engine.step_check import (
    remark_on_few_steps,
    warn_of_large_steps,
)
from flexband.mechanics.engine.straining import warn_of_large_strains
from flexband.mechanics.engine.threads import interruptible, thread_count
from flexband.mechanics.impulses import impulses_text, keep_impulses
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.sensors.averages import refuse_windows
from flexband.mechanics.starts import check_multiple, start_runs, warn_of_springs

if TYPE_CHECKING:
    from flexband.mechanics.assembly.system import System


def simulate(
    mechanism: Mechanism,
    *,
    duration: float,
    step: float,
    substeps: int = 1,
    start: str | xr.DataArray = "assembled",
    period: float | None = None,
    keep_state: bool = False,
    integrator: GeneralizedAlpha | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> xr.DataArray:
    """Simulate the motion of a mechanism.

    Parameters
    ----------
    duration, step : simulated time and step [s]; the duration is a whole multiple of the step.
    substeps : number of equal parts in which each step is integrated. The result has the times of
        whole steps, so that motions with different substeps can be compared.
    start : "assembled", as bodies are given, with members as little deformed as joints allow;
        "static", the stable equilibrium at time zero, from which bodies move with their velocities;
        or "periodic", the state to which the motion returns after a period. Or the result of
        another simulation that has kept its state: the motion goes on where that one ended, at its
        time. Or that of `equilibrium`: bodies rest there, and move with the velocities that they
        are given, as when a support is released. Bodies have the same names and meshes, while
        joints, loads and sensors may be others. Joints that are new must fit the bodies where they
        are. Velocities that they do not allow change at once, as in a plastic impact.
    period : that of a periodic start [s], a whole multiple of the step, in which all functions of
        time repeat themselves.
    keep_state : whether the result can be the start of another simulation. Its state is
        ``attrs["state"]``, which has to be deleted before the result is written to a file.
    integrator : parameters of the integrator, or None for ``GeneralizedAlpha()``.
    threads : number of threads, or None for one per core. Results do not depend on it.
    progress : called as ``progress(done, total)`` when runs are finished.

    Returns
    -------
    The outputs of the sensors, dims (output, time), with a first dim "sample" if a parameter is an
    array of more than one value. Coordinates: "output" (name), "unit", "time" [s]. If constraints
    are redundant, ``attrs["not_unique"]`` lists the joints that share forces: their multipliers and
    reactions are one choice of many, while the motion is unique. ``attrs["impulses"]`` has the
    impulses of joints where the speed of a prescribed motion jumps. ``attrs["halved_step"]`` lists
    samples that diverged and were completed with half the step. ``attrs["assembly"]`` says what
    assembly changed in the given start, with the ``largest_turn`` [rad] and ``largest_move`` [m];
    large turns, changes of given velocities and loops that closed in another branch are warned of.
    A motion that goes on has the kinetic energy [J] that each sample lost in the plastic impact in
    ``attrs["lost_energy"]``; where a drive is new, it may be negative.
    If an output vibrates with so few steps per period that more than 4 % of its variation is wrong,
    ``attrs["few_steps"]`` and a warning say so.

    Raises
    ------
    InputError
        If a number is out of its range, numbers of samples do not fit, there are no sensors, a
        function of time does not repeat itself after the period, or a motion cannot go on since a
        body is not in it or has another mesh.
    AssemblyError
        If the constraints cannot be met at the start or do not determine their multipliers, a joint
        is open where a motion goes on, if there is no stable equilibrium to start from, or no
        periodic motion that disturbances approach: the map of a state to that one period later has
        a spectral radius above 0.98.
    SimulationError
        If a sample diverges or a force law fails, also with half the step. Its attribute `results`
        has the outputs, NaN for the samples that failed.

    Examples
    --------
    >>> bob = fb.PointMass(mass=1.0, position=(1.0, 0.0))
    >>> pendulum = fb.Mechanism(
    ...     bodies={"bob": bob},
    ...     joints={"rod": fb.Distance("bob", (0.0, 0.0), length=1.0)},
    ...     loads={"gravity": fb.Gravity()},
    ...     sensors={"bob": fb.Velocity("bob")},
    ... )
    >>> motion = fb.simulate(pendulum, duration=0.5, step=1e-3)
    >>> motion.dims, motion.shape
    (('output', 'time'), (2, 501))
    >>> float(motion.sel(output="bob_Y", time=0.1).round(2))  # −gt [m/s]
    -0.98

    A ball that flies on when its rod breaks:

    >>> swing = fb.simulate(pendulum, duration=0.5, step=1e-3, keep_state=True)
    >>> free = fb.Mechanism(bodies={"bob": bob}, sensors={"bob": fb.Velocity("bob")})
    >>> flight = fb.simulate(free, duration=0.2, step=1e-3, start=swing)
    >>> bool((flight[:, 0] == swing[:, -1]).all()), float(flight.time[-1])
    (True, 0.7)
    """
    with nullcontext() if listener().shows_stages else add_listener(_Printed()):
        motion, system = simulate_system(
            mechanism,
            TimeGrid(duration, step, substeps),
            start=start,
            period=period,
            keep_state=keep_state,
            integrator=integrator,
            threads=threads,
            progress=progress,
        )
    integrator = GeneralizedAlpha() if integrator is None else integrator
    if integrator.step_limits(system.structure.state, step) is None:
        remark = remark_on_few_steps(motion, system.functions, step / substeps, integrator)
        if remark:
            motion.attrs["few_steps"] = remark.text
            warn(remark.text, ResolutionWarning, [remark])
    return motion


class TimeGrid(NamedTuple):
    """Times of a simulation."""

    duration: float  # [s], a whole multiple of the step
    step: float  # [s]
    substeps: int = 1
    """Equal parts in which each step is integrated."""
    begin: float = 0.0
    """First time [s]."""

    def times(self) -> np.ndarray:
        """Return the times of all substeps [s], including the first one."""
        duration, step, substeps, begin = self
        digits = 14 - int(np.ceil(np.log10(float(begin + duration))))  # 0.415 is so for any step
        count = whole_steps(duration, step, substeps) * substeps + 1
        return np.round(begin + np.arange(count) * (float(step) / substeps), digits)


def simulate_system(
    mechanism: Mechanism,
    grid: TimeGrid,
    *,
    start: str | xr.DataArray = "assembled",
    period: float | None = None,
    ramp_time: float = 0.0,
    keep_state: bool = False,
    integrator: GeneralizedAlpha | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    complete: bool = True,
) -> tuple[xr.DataArray, System]:
    """Return the motion as `simulate` does, but for its look for few steps, and the system.

    Functions of time reach their pace after a `ramp_time` [s]. If it is not `complete`, samples
    that diverge are not completed with half the step, but fail.
    """
    # Check the arguments.
    check_instance("mechanism", mechanism, Mechanism)
    integrator = GeneralizedAlpha() if integrator is None else integrator
    check_instance("integrator", integrator, GeneralizedAlpha)
    threads = thread_count(threads)
    if progress is not None:
        check_function("progress", progress)
    check_flag("keep_state", keep_state)
    substeps = check_integer("substeps", grid.substeps, 1, 1_000_000)
    count = whole_steps(grid.duration, grid.step, substeps) * substeps + 1
    # Assemble, and say how runs start.
    system, begins = start_runs(mechanism, start, period, float(grid.step), ramp_time)
    grid = grid._replace(begin=system.first_time)
    check_sensors(mechanism, grid)
    warn_of_springs(system, start)
    limits = integrator.step_limits(system.structure.state, grid.step)
    check_memory(system, count, threads, substeps, polynomials=limits is not None)
    # Run all samples.
    times = grid.times()
    run = partial(
        run_samples, system, integrator=integrator, start=begins, keep=keep_state, threads=threads
    )
    batch = run(times=times, stride=substeps, progress=progress)
    # Complete samples that diverge with half the step.
    retry_samples = np.flatnonzero(
        np.isin(batch.failures[:, 0], (FAILURE.diverged, FAILURE.contradicted, FAILURE.law_failed))
    )
    complete = complete and not limits
    if len(retry_samples) and complete:
        halves = grid._replace(substeps=2 * substeps)
        retry_batch = run(
            times=halves.times(), samples=retry_samples, stride=halves.substeps, attempts=2
        )
        _replace_samples(batch, retry_batch, retry_samples, system, halves, integrator)
    # Label the outputs.
    result = xr.DataArray(
        batch.outputs,
        dims=("sample", "output", "time"),
        coords={
            "output": system.outputs,
            "unit": ("output", system.units, attributes_of_units(system, grid.step / substeps)),
            "time": ("time", grid._replace(substeps=1).times(), {"units": "s"}),
        },
    )
    try:
        raise_failures(batch.failures, system, times, halved=complete, folds=batch.strains)
    except RunError as error:
        batch.outputs[list(error.failures)] = np.nan
        error.results = result
        raise
    # Warn of what may spoil the result, and note it in the attributes.
    if not limits:
        warn_of_large_steps(batch.turn_statistics, system, times, integrator)
    warn_of_unresolved(system, batch.unresolved, times)
    warn_of_large_strains(system, batch.strains, batch.failures[:, 0] > 0, batch.snapshot_times)
    if batch.impulses:
        result.attrs["impulses"] = impulses_text(system, batch.impulses)
        keep_impulses(system, batch.impulses)
    result.attrs |= begins.attributes(system, batch.corrections)
    if keep_state:
        end = float(times[-1])
        result.attrs["state"] = end_state(system, batch, end, integrator.spectral_radius)
    if len(retry_samples) and complete:  # all are completed
        result.attrs["halved_step"] = retry_samples.tolist()
    if batch.starts:
        sample = min(batch.starts)
        joints = joints_that_share(system, batch.starts[sample], sample)
        refuse_shared_friction(system, joints)
        result.attrs["not_unique"] = warn_of_shared(system, joints)
    return result if system.samples > 1 else result.isel(sample=0), system


def _replace_samples(
    batch: Batch,
    retry_batch: Batch,
    retry_samples: np.ndarray,
    system: System,
    halves: TimeGrid,
    integrator: GeneralizedAlpha,
) -> None:
    """Replace `retry_samples` by their results with half the step."""
    times = halves.times()
    interruptible(
        lambda: find_out_of_reach(system, times, integrator, retry_samples, retry_batch.failures)
    )
    retry_batch.failures[:, 1] = np.ceil(retry_batch.failures[:, 1] / 2)
    kept_impulses = [impulse for impulse in batch.impulses if impulse.sample not in retry_samples]
    batch.impulses[:] = kept_impulses + retry_batch.impulses
    batch.outputs[retry_samples] = retry_batch.outputs
    batch.failures[retry_samples] = retry_batch.failures
    batch.turn_statistics[retry_samples] = retry_batch.turn_statistics
    batch.unresolved[retry_samples] = np.ceil(retry_batch.unresolved / 2)
    batch.strains.place(retry_samples, retry_batch.strains)
    if retry_batch.ends.size:
        batch.ends[:, retry_samples] = retry_batch.ends


def check_sensors(mechanism: Mechanism, grid: TimeGrid) -> None:
    """Raise `InputError` if there are no sensors, or averages are over other times."""
    mechanism.check_sensors()
    refuse_windows(mechanism.sensors, grid.begin, grid.begin + grid.duration, grid.step)


class _Printed(ProgressListener):
    """Prints the messages of a call that nobody shows the progress of."""

    def warn(self, message: str) -> None:
        """Print a message."""
        print(f"flexband: {message}", file=sys.stderr, flush=True)


def whole_steps(duration: float, step: float, substeps: int = 1, name: str = "step") -> int:
    """Return the number of steps; raise `InputError` if it is not whole, or cannot be afforded."""
    length, size = (
        float(check_positive(label, check_numbers(label, value)))
        for label, value in (("duration [s]", duration), (f"{name} [s]", step))
    )
    count = length / size * substeps
    check_affordable(
        f"duration [s] {length:g} with {name} {size:g}, {count:.3g} steps,", 5.0 * count
    )
    return check_multiple("duration [s]", length, name, size)
