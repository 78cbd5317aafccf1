"""Static equilibrium of a mechanism: all samples at once."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.errors import numbers, whole
from flexband.mechanics.assembly.packing import pack
from flexband.mechanics.assembly.structure import Values, Work
from flexband.mechanics.assembly.system import System, assemble
from flexband.mechanics.engine.batch import begin, derive, run
from flexband.mechanics.engine.entries import SETTLE
from flexband.mechanics.engine.failures import raise_failures
from flexband.mechanics.engine.threads import in_parallel, while_compiling
from flexband.mechanics.kernels.lanes import WIDTH
from flexband.mechanics.mechanism import Mechanism


def equilibrium(
    mechanism: Mechanism, *, steps: int = 1, time: float = 0.0, threads: int | None = None
) -> xr.DataArray:
    """Compute a static equilibrium of a mechanism under its loads.

    The search starts from the assembled guess. If there are several equilibria it finds one of
    them, which may be unstable.

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
    array of more than one value. Coordinates: "output" (name), "unit".

    Raises
    ------
    InputError
        If a number is out of its range or numbers of samples do not fit.
    AssemblyError
        If the constraints cannot be met or no equilibrium is found for a sample.
    """
    whole("steps", steps, 1)
    at = float(numbers("time [s]", time))
    system = assemble(mechanism)
    packed = pack(system, np.array([at, at + 1.0]))
    outputs = np.empty((system.samples, len(system.outputs)))
    failures = np.zeros((system.samples, 4))

    def settle(block: int) -> int:
        here = slice(block * WIDTH, (block + 1) * WIDTH)
        own = np.arange(system.samples)[here]
        rows, failure, _ = rest(system, packed(block), steps)
        outputs[here] = derive(system, rows[:, None])[:, 0].T[: len(own)]
        failures[here] = failure.T[: len(own)]
        return len(own)

    while_compiling(lambda: rest(system, packed(0), 1))
    in_parallel(settle, -(-system.samples // WIDTH), system.samples, threads)
    raise_failures(failures, system, np.zeros(1))
    result = xr.DataArray(
        outputs,
        dims=("sample", "output"),
        coords={"output": system.outputs, "unit": ("output", system.units)},
    )
    return result if system.samples > 1 else result.isel(sample=0)


def rest(system: System, values: Values, steps: int) -> tuple[np.ndarray, np.ndarray, Work]:
    """Find the equilibrium of one block; return sensor rows (rows, WIDTH), failures and state."""
    work, failure = begin(system, values)
    rows = np.zeros((system.sensed, WIDTH))
    state = system.structure.state
    work.z[state.multiplier : state.angle] = 0.0
    for k in range(1, steps + 1):
        part = k / steps
        raised = values._replace(weight=part * values.weight, forces=part * values.forces)
        run(SETTLE, system, raised, work, rows[None], failure)
    return rows, failure, work
