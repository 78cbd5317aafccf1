"""How a motion starts: from the assembled guess, from rest, or on a periodic motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from flexband.basics.checks import check_numbers, check_option, check_positive
from flexband.errors import InputError
from flexband.mechanics.assembly.packing import AT_START, pack
from flexband.mechanics.assembly.structure import Values
from flexband.mechanics.assembly.system import System, assemble
from flexband.mechanics.continued_start import continue_from, state_of
from flexband.mechanics.engine.batch import BlockStart, Run, Start, begin, hold
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.kernels.laws.states import rows_of_states
from flexband.mechanics.kernels.state import State
from flexband.mechanics.linearization.block_equilibria import block_equilibria
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.model.springs_at_start import warn_of_stretched_joints, warn_of_windings
from flexband.mechanics.periodic_start import PeriodicStart
from flexband.mechanics.time_functions.ramps import slow_functions


@dataclass(frozen=True)
class StaticStart(Start):
    """The stable equilibrium at time zero, from which bodies move with their velocities.

    Joints that switch are as at the start.
    """

    def of_blocks(self, run: Run) -> Callable[[int, Values], BlockStart]:
        """Return what begins a block."""
        mechanism = run.system.mechanism
        system = run.system
        state = system.structure.state
        samples = run.samples
        # Joints that switch do not do so at rest: equilibria are those of another system.
        values_of = None
        if mechanism.switches:
            system = replace(assemble(mechanism.at_rest()), samples=run.system.samples)
            values_of = pack(system, AT_START, samples)
        rest_rows = [_kept_rows(layout.structure.state) for layout in (run.system, system)]

        def begin_block(number: int, values: Values) -> BlockStart:
            count = min(WIDTH, len(samples) - number * WIDTH)
            work, failure = begin(run.system, values)
            assembled_z = work.z.copy()
            rest = block_equilibria(system, values_of(number) if values_of else values, 1, count)
            z = work.z.copy()
            rest_failure = np.where(failure[0] > 0, failure, rest.failure)
            if values_of:
                rest_failure[2] = -1.0  # constraints have other numbers
            # Take over the equilibrium of each lane, if it is stable.
            for lane in range(WIDTH):
                balance = rest.balances[min(lane, count - 1)]
                rest_failure[:, lane] = rest_failure[:, min(lane, count - 1)]
                if not rest_failure[0, lane]:
                    z[rest_rows[0], lane] = balance.z[rest_rows[1]]
                    if not values_of:  # turns are counted on the way
                        work.z[state.angle : state.velocity, lane] = balance.z[
                            state.angle : state.velocity
                        ]
                    if not balance.stable:
                        rest_failure[:3, lane] = FAILURE.unstable, 0.0, -1.0
            failure = hold(run.system, values, work, z, velocities=False)
            return BlockStart(
                work, np.where(rest_failure[0] > 0, rest_failure, failure), assembled_z
            )

        return begin_block


def _kept_rows(state: State) -> np.ndarray:
    """Return the rows of z that a motion takes from a rest: places, and states of laws."""
    laws = rows_of_states.py_func(state)
    return np.concatenate([np.arange(1, state.multiplier), laws.y + np.arange(laws.states)])


def start_of(name: str, period: float | None, step: float, step_name: str) -> Start:
    """Return how runs start; raise `InputError` if it is none, or the period does not fit."""
    if isinstance(name, xr.DataArray):
        raise InputError(
            "start of a response must be 'assembled', 'static' or 'periodic'; for a motion that "
            "goes on, write a function that calls simulate twice and returns what is wanted"
        )
    check_option("start", name, ["assembled", "static", "periodic"])
    if (period is None) == (name == "periodic"):
        needs = "requires a period [s]" if period is None else "is required by a period"
        raise InputError(f"start='periodic' {needs}; got start={name!r} and period={period!r}")
    if period is None:
        return StaticStart() if name == "static" else Start()
    length = float(check_positive("period [s]", check_numbers("period [s]", period)))
    check_multiple("period [s]", length, step_name, step)
    return PeriodicStart(length)


def check_multiple(name: str, length: float, step_name: str, step: float) -> int:
    """Return how many steps [s] make up a length [s]; raise `InputError` if that is not whole."""
    ratio = length / step
    count = round(ratio)
    if count < 1 or abs(ratio - count) > 1e-6 * ratio:
        raise InputError(
            f"{name} must be a whole multiple of {step_name}; got {length:g} with {step_name} "
            f"{step:g}"
        )
    return count


def start_runs(
    mechanism: Mechanism,
    start: str | xr.DataArray,
    period: float | None,
    step: float,
    ramp_time: float,
) -> tuple[System, Start]:
    """Return the system of a mechanism and how its runs start, with functions slowed for a time."""
    if isinstance(start, xr.DataArray):
        state = state_of(start, period)
        return continue_from(assemble(mechanism), state)
    begins = start_of(start, period, step, "step")
    system = assemble(mechanism)
    if start == "periodic" and mechanism.switches:
        raise InputError("start='periodic' is not for a mechanism with joints that switch")
    if ramp_time:
        system = replace(system, functions=slow_functions(system.functions, ramp_time))
    return system, begins


def warn_of_springs(system: System, start: object) -> None:
    """Warn of springs that begin wound up and, in an assembled start, of stretched joints."""
    warn_of_windings(system.model)
    if isinstance(start, str) and start == "assembled":
        size = float(np.max(1 / system.values.inverse_scale[1]))
        warn_of_stretched_joints(system.model, size)
