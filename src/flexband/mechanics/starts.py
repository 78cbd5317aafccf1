"""How a motion starts: from the assembled guess, from rest, or on a periodic motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from flexband.errors import InputError, check_numbers, check_option, check_positive
from flexband.mechanics.assembly.mechanism import Mechanism
from flexband.mechanics.assembly.structure import Values
from flexband.mechanics.assembly.system import System, assemble
from flexband.mechanics.continued_start import continued, state_of
from flexband.mechanics.engine.batch import Begun, Run, Start, begin, hold
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.linearization.block_equilibria import block_equilibria
from flexband.mechanics.periodic_start import PeriodicStart
from flexband.mechanics.time_functions.ramps import slowed


@dataclass(frozen=True)
class StaticStart(Start):
    """The stable equilibrium at time zero, from which bodies move with their velocities."""

    def of_blocks(self, run: Run) -> Callable[[int, Values], Begun]:
        """Return what begins a block."""
        state = run.system.structure.state

        def begin_block(number: int, values: Values) -> Begun:
            count = min(WIDTH, len(run.samples) - number * WIDTH)
            work, failure = begin(run.system, values)
            assembled = work.z.copy()
            rest = block_equilibria(run.system, values, 1, count)
            z, failed = work.z.copy(), np.where(failure[0] > 0, failure, rest.failure)
            for lane in range(WIDTH):
                balance = rest.balances[min(lane, count - 1)]
                failed[:, lane] = failed[:, min(lane, count - 1)]
                if not failed[0, lane]:
                    z[:, lane] = balance.z
                    if not balance.stable:
                        failed[:3, lane] = FAILURE.unstable, 0.0, -1.0
            angles = slice(state.angle, state.velocity)
            work.z[angles] = z[angles]  # turns are counted on the way
            failure = hold(run.system, values, work, z, velocities=False)
            return Begun(work, np.where(failed[0] > 0, failed, failure), assembled)

        return begin_block


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


def started(
    mechanism: Mechanism,
    start: str | xr.DataArray,
    period: float | None,
    step: float,
    slow: float,
) -> tuple[System, Start]:
    """Return the system of a mechanism and how its runs start, with functions slowed for a time."""
    if isinstance(start, xr.DataArray):
        state = state_of(start, period)
        return continued(assemble(mechanism), state)
    begins, system = start_of(start, period, step, "step"), assemble(mechanism)
    if start in ("static", "periodic") and mechanism.at_rest() is not mechanism:
        raise InputError(f"start={start!r} is not for a mechanism with joints that switch")
    if slow:
        system = replace(system, functions=slowed(system.functions, slow))
    return system, begins
