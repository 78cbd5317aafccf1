"""Static equilibrium of a mechanism: all samples at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from flexband.errors import InputError, check_instance, check_integer, check_numbers, warn
from flexband.mechanics.assembly.mechanism import Mechanism
from flexband.mechanics.assembly.packing import pack
from flexband.mechanics.assembly.rounding import rounding_errors
from flexband.mechanics.assembly.structure import Values
from flexband.mechanics.assembly.system import System, assemble
from flexband.mechanics.engine.batch import begin, derive, run
from flexband.mechanics.engine.corrections import corrections, report
from flexband.mechanics.engine.entries import SENSE, SETTLE, statics
from flexband.mechanics.engine.failures import raise_failures
from flexband.mechanics.engine.redundancy import dependent, require_inertia, warn_of_shared
from flexband.mechanics.engine.static_solver import STATIC
from flexband.mechanics.engine.straining import Members, warn_of_large_strains
from flexband.mechanics.engine.threads import in_parallel, while_compiling
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.lanes import WIDTH
from flexband.mechanics.linearization.balance import Balance, find_rest
from flexband.mechanics.linearization.linearize import Equations, Spin
from flexband.mechanics.linearization.load_path import raised, snap_throughs
from flexband.rounding import rounding_attributes
from flexband.words import number_of

MAX_STEPS = 100_000
LONGEST_TIME = 1e9
"""Time [s] at which functions can still be differentiated."""

UNSTABLE = (
    "the equilibrium of {} of {} is not stable: the smallest disturbance makes the mechanism leave "
    "it, as a column above its buckling load"
)


def equilibrium(
    mechanism: Mechanism, *, steps: int = 1, time: float = 0.0, threads: int | None = None
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
    threads : number of threads, or None for one per core.

    Returns
    -------
    The outputs of the sensors, dim (output,), with a first dim "sample" if a parameter is an
    array of more than one value. Coordinates: "output" (name), "unit", and "stable", whether no
    small motion about the equilibrium grows. If constraints are redundant there,
    ``attrs["not_unique"]`` lists the joints that share forces; those of least norm are given.
    What assembly changes in the given start is stated in the attributes and warned of as by
    `simulate`.

    Raises
    ------
    InputError
        If a number is out of its range or numbers of samples do not fit.
    AssemblyError
        If the constraints cannot be met, no equilibrium is found for a sample, or a snap-through
        is on the way to it.
    """
    check_instance("mechanism", mechanism, Mechanism)
    steps = check_integer("steps", steps, 1, MAX_STEPS)
    if threads is not None:
        check_integer("threads", threads, 1)
    at = float(check_numbers("time [s]", time))
    if abs(at) > LONGEST_TIME:
        raise InputError(f"time [s] must be at most {LONGEST_TIME:g}; got {at:g}")
    system = assemble(mechanism)
    packed = pack(system, np.array([at, at + 1.0]))
    outputs = np.empty((system.samples, len(system.outputs)))
    failures = np.zeros((system.samples, 4))
    stable = np.zeros(system.samples, dtype=bool)
    redundant: dict[int, np.ndarray] = {}
    blocks = -(-system.samples // WIDTH)
    firsts = np.empty((system.structure.state.rows, system.samples))
    states = np.zeros((1, 1 + system.structure.state.coordinates, system.samples))
    at_rest = Spin(0.0, np.zeros(system.structure.state.coordinates))

    def settle(block: int) -> int:
        samples = np.arange(system.samples)[block * WIDTH : (block + 1) * WIDTH]
        rows, failure, balances, start = rest(
            system, packed(block), steps, [at_rest] * len(samples)
        )
        firsts[:, samples] = start[:, : len(samples)]
        started = np.where(failure[0] > 0, np.nan, start)
        require_inertia(system, packed(block), started[:, : len(samples)], samples)
        with np.errstate(all="ignore" if failure[0].any() else None):
            outputs[samples] = derive(system, rows.transpose(1, 0, 2))[:, -1].T[: len(samples)]
        failures[samples] = failure.T[: len(samples)]
        for sample, balance in zip(samples, balances, strict=True):
            if failures[sample, 0] == 0:
                stable[sample] = balance.stable
                states[0, :, sample] = balance.z[: len(states[0])]
                if balance.redundant:
                    redundant[sample] = balance.z
        return len(samples)

    if not statics.signatures:
        while_compiling(lambda: rest(system, packed(0), 1, [at_rest]))
    in_parallel(settle, blocks, system.samples, threads)
    raise_failures(failures, system, np.zeros(1))
    if not stable.all():
        warn(UNSTABLE.format(np.sum(~stable), number_of(len(stable), "sample")))
    strains = Members(system).largest(states, np.arange(system.samples))
    warn_of_large_strains(system, strains, failures[:, 0] > 0)
    result = xr.DataArray(
        outputs,
        dims=("sample", "output"),
        coords={
            "output": system.outputs,
            "unit": ("output", system.units, rounding_attributes(rounding_errors(system))),
            "stable": ("sample", stable),
        },
        attrs=report(system, corrections(system, firsts, np.arange(system.samples))),
    )
    if redundant:
        sample = min(redundant)
        _, joints = dependent(system, redundant[sample], sample)
        result.attrs["not_unique"] = warn_of_shared(system, joints)
    return result if system.samples > 1 else result.isel(sample=0)


def rest(
    system: System, values: Values, steps: int, spins: Sequence[Spin]
) -> tuple[np.ndarray, np.ndarray, list[Balance], np.ndarray]:
    """Find the equilibria of the first samples of one block, each in its own steady rotation.

    Returns the sensors' rows on the way to the equilibria, (states, rows, WIDTH), failures
    (4, WIDTH), the balance of each sample, and the state at the start, (rows, WIDTH).
    """
    work, failure = begin(system, values)
    state = system.structure.state
    work.z[state.multiplier : state.angle] = 0.0
    start, failed, on_way = work.z.copy(), failure.copy(), []
    if not any(spin.rate for spin in spins):
        snap_throughs(system, values, start, failed)
        for k in range(1, steps + 1):
            rows = np.full((STATIC.iterations + 1, system.sensed, WIDTH), np.nan)
            run(SETTLE, system, raised(values, k / steps), work, rows, failure)
            on_way.append(rows[~np.isnan(rows).all(axis=(1, 2))])
    balances: list[Balance] = []
    for lane, spin in enumerate(spins):
        if failed[0, lane]:
            balances.append(Balance(Equations(system, values, lane), start[:, lane], spin))
            continue
        z = work.z[:, lane] if np.isfinite(work.z[:, lane]).all() else start[:, lane]
        for k in range(1, steps if spin.rate else 1):
            equations = Equations(system, raised(values, k / steps), lane)
            z = find_rest(equations, z, spin.raised(k / steps), z)[0].z
        first = z if spin.rate else start[:, lane]
        balance, settled = find_rest(Equations(system, values, lane), z, spin, first)
        balances.append(balance)
        failed[0, lane] = 0.0 if settled else FAILURE.not_settled
        failed[2, lane] = -1.0 if settled else balance.weakest
        balance.equations.residual(balance.z)
        if balance.equations.failure[0, 0]:
            failed[:, lane] = balance.equations.failure[:, 0]
        work.z[:, lane] = balance.z
    rows = np.zeros((1, system.sensed, WIDTH))
    run(SENSE, system, values, work, rows, failed)
    for condition in range(len(system.conditions)):
        wrong = rows[0, system.sensed - len(system.conditions) + condition] < 0
        failed[:3, wrong & (failed[0] == 0)] = [[FAILURE.wrong_branch], [0.0], [condition]]
    return np.concatenate([*on_way, rows]), failed, balances, start
