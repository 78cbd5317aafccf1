"""Static equilibrium of a mechanism: all samples at once."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.basics.checks import check_flag, check_instance, check_integer, check_numbers
from flexband.basics.warning import warn
from flexband.basics.words import number_of
from flexband.errors import InputError
from flexband.mechanics.assembly.packing import pack
from flexband.mechanics.assembly.rounding import attributes_of_units
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.continued_start import rest_state
from flexband.mechanics.engine.batch import derive
from flexband.mechanics.engine.corrections import corrections, report
from flexband.mechanics.engine.entries import statics
from flexband.mechanics.engine.failures import raise_failures
from flexband.mechanics.engine.redundancy import dependent, require_inertia, warn_of_shared
from flexband.mechanics.engine.straining import Members, warn_of_large_strains
from flexband.mechanics.engine.threads import in_parallel, thread_count, while_compiling
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.linearization.block_equilibria import block_equilibria
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.model.springs_at_start import warn_of_windings


def equilibrium(
    mechanism: Mechanism,
    *,
    steps: int = 1,
    time: float = 0.0,
    keep_state: bool = False,
    threads: int | None = None,
) -> xr.DataArray:
    """Compute a static equilibrium of a mechanism under its loads.

    The search starts from the assembled guess, and angles count turns on the way from there. If
    there are several equilibria it finds one of them, if possible a stable one; the result says
    whether it is, and a warning if it is not. Where the loads cannot be raised without a
    snap-through, the equilibrium is refused: prescribe the travel instead of the force, by
    `PrescribedTravel`, to follow it.

    Parameters
    ----------
    steps : number of equal steps in which gravity, forces, moments and distributed loads are
        applied, each starting from the equilibrium of the one before. Springs and drives act in
        full.
    time : the time [s] at which functions of time are evaluated.
    keep_state : whether the result can be the `start` of a simulation: of a mechanism that is
        released with the velocities that its bodies are given. As in `simulate`, the state is
        ``attrs["state"]``.
    threads : number of threads, or None for one per core.

    Returns
    -------
    The outputs of the sensors, dim (output,), with a first dim "sample" if a parameter is an
    array of more than one value. Coordinates: "output" (name), "unit", and "stable", whether no
    small motion about the equilibrium grows. If constraints are redundant there,
    ``attrs["not_unique"]`` lists the joints that share forces; those of least norm are given.
    What assembly changes in the given start is stated in the attributes and warned of as by
    `simulate`. Sensors of a motion, such as `Work` and extremes, are left out, and listed in
    ``attrs["left_out"]``.

    Raises
    ------
    InputError
        If a number is out of its range or numbers of samples do not fit.
    AssemblyError
        If the constraints cannot be met, no equilibrium is found for a sample, or a snap-through
        is on the way to it.

    Examples
    --------
    >>> scale = fb.Mechanism(
    ...     bodies={"pan": fb.PointMass(mass=2.0, position=(0.0, -1.0))},
    ...     joints={"guide": fb.Slot("pan", (0.0, 0.0), axis=(0.0, 1.0))},
    ...     loads={"gravity": fb.Gravity(), "spring": fb.Spring("pan", (0.0, 0.0), 1e3, 1.0)},
    ...     sensors={"spring": fb.SpringForce("spring")},
    ... )
    >>> fb.equilibrium(scale).values.round(4)  # tension [N] and length [m]
    array([19.62  ,  1.0196])
    """
    check_instance("mechanism", mechanism, Mechanism)
    check_flag("keep_state", keep_state)
    warn_of_windings(mechanism.model)
    left_out = mechanism.left_out_at_rest()
    mechanism = mechanism.at_rest()
    steps, at, threads = check_steps(steps), check_time(time), thread_count(threads)
    system = assemble(mechanism)
    values_of = pack(system, np.array([at, at + 1.0]))
    # Results, by sample.
    outputs = np.empty((system.samples, len(system.outputs)))
    failures = np.zeros((system.samples, 4))
    stable = np.zeros(system.samples, dtype=bool)
    redundant: set[int] = set()
    blocks = -(-system.samples // WIDTH)
    firsts = np.empty((system.structure.state.rows, system.samples))
    rests = np.zeros((system.structure.state.rows, system.samples))
    spring_rests = np.zeros((len(system.structure.springs.f), system.samples))

    def settle(block: int) -> int:
        samples = np.arange(system.samples)[block * WIDTH : (block + 1) * WIDTH]
        values = values_of(block)
        rows, failure, balances, start = block_equilibria(system, values, steps, len(samples))
        firsts[:, samples] = start[:, : len(samples)]
        start_states = np.where(failure[0] > 0, np.nan, start)
        require_inertia(system, values, start_states[:, : len(samples)], samples)
        with np.errstate(all="ignore" if failure[0].any() else None):
            outputs[samples] = derive(system, rows.transpose(1, 0, 2))[:, -1].T[: len(samples)]
        failures[samples] = failure.T[: len(samples)]
        spring_rests[:, samples] = values.springs.rest[:, : len(samples)]
        for sample, balance in zip(samples, balances, strict=True):
            if failures[sample, 0] == 0:
                stable[sample] = balance.stable
                rests[:, sample] = balance.z
                if balance.redundant:
                    redundant.add(int(sample))
        return len(samples)

    # Solve all blocks; the first one compiles if need be.
    if not statics.codes:
        while_compiling(lambda: block_equilibria(system, values_of(0), 1, samples=1))
    in_parallel(settle, blocks, system.samples, threads)
    raise_failures(failures, system, np.zeros(1))
    # Warn of what may make the result useless.
    _warn_of_unstable(stable)
    strains = Members(system).largest(rests[None], np.arange(system.samples))
    warn_of_large_strains(system, strains, failures[:, 0] > 0)
    # Label the outputs, with attributes on what is special.
    result = xr.DataArray(
        outputs,
        dims=("sample", "output"),
        coords={
            "output": system.outputs,
            "unit": ("output", system.units, attributes_of_units(system)),
            "stable": ("sample", stable),
        },
        attrs=left_out | report(system, corrections(system, firsts, np.arange(system.samples))),
    )
    if keep_state:
        result.attrs["state"] = rest_state(system, rests, spring_rests, at)
    result.attrs |= _without_friction(mechanism)
    if redundant:
        sample = min(redundant)
        _, joints = dependent(system, rests[:, sample], sample)
        result.attrs["not_unique"] = warn_of_shared(system, joints)
    return result if system.samples > 1 else result.isel(sample=0)


def _warn_of_unstable(stable: np.ndarray) -> None:
    """Warn of samples whose equilibrium is not stable."""
    if not stable.all():
        warn(
            f"the equilibrium of {np.sum(~stable)} of {number_of(len(stable), 'sample')} is not "
            "stable: the smallest disturbance makes the mechanism leave it, as a column above its "
            "buckling load"
        )


def _without_friction(mechanism: Mechanism) -> dict[str, list[str]]:
    """Return the attribute that lists parts whose friction is left out, and warn of it."""
    friction_parts = list(dict.fromkeys(name for name, _ in mechanism.model.frictions))
    if not friction_parts:
        return {}
    warn(
        f"friction of {' and '.join(map(repr, friction_parts))} is left out of the equilibrium: "
        "what sticks can carry any force up to its limit, so there are many equilibria"
    )
    return {"without_friction": friction_parts}


def check_steps(steps: int) -> int:
    """Return the number of steps in which loads are applied; raise `InputError` if it is none."""
    return check_integer("steps", steps, 1, 100_000)


def check_time(time: float) -> float:
    """Return a time [s] at which functions can still be differentiated, or raise `InputError`."""
    at = float(check_numbers("time [s]", time))
    latest = 1e9
    if abs(at) > latest:
        raise InputError(f"time [s] must be at most {latest:g}; got {at:g}")
    return at
