"""Static equilibrium of a mechanism: all samples at once."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.errors import numbers, whole
from flexband.mechanics.assembly.packing import pack
from flexband.mechanics.assembly.structure import Values, Work
from flexband.mechanics.assembly.system import System, assemble
from flexband.mechanics.engine.batch import begin, compiling, derive, in_parallel, run
from flexband.mechanics.engine.entries import SETTLE
from flexband.mechanics.engine.failures import raise_failures
from flexband.mechanics.kernels.lanes import WIDTH
from flexband.mechanics.mechanism import Mechanism


def equilibrium(
    mechanism: Mechanism, *, steps: int = 1, time: float = 0.0, threads: int | None = None
) -> xr.DataArray:
    """Find where a mechanism rests under its loads.

    It starts from the assembled guess. Where the loads leave a mechanism several places to rest,
    it finds one of them; an unstable one is possible.

    Parameters
    ----------
    steps : gravity, forces, moments and distributed loads are raised in so many equal steps, each
        from the rest under the one before. Springs and drives act in full.
    time : when functions of time are looked at [s].
    threads : number of threads; one a core where None.

    Returns
    -------
    The outputs of the sensors, dim (output,), with a first dim "sample" where a parameter is an
    array of more than one value. Coordinates: "output" (name), "unit".

    Raises
    ------
    InputError
        Where a number is out of its range or numbers of samples do not fit.
    AssemblyError
        Where the constraints cannot be met or a sample does not come to rest.
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

    with compiling():
        rest(system, packed(0), 1)
    in_parallel(settle, -(-system.samples // WIDTH), system.samples, threads, None)
    raise_failures(failures, system, np.zeros(1))
    result = xr.DataArray(
        outputs,
        dims=("sample", "output"),
        coords={"output": system.outputs, "unit": ("output", system.units)},
    )
    return result if system.samples > 1 else result.isel(sample=0)


def rest(system: System, values: Values, steps: int) -> tuple[np.ndarray, np.ndarray, Work]:
    """Bring one block to rest; return the sensors' rows (rows, WIDTH), failures and the state."""
    work, failure = begin(system, values)
    rows = np.zeros((system.sensed, WIDTH))
    state = system.structure.state
    work.z[state.multiplier : state.angle] = 0.0
    for k in range(1, steps + 1):
        part = k / steps
        raised = values._replace(weight=part * values.weight, forces=part * values.forces)
        run(SETTLE, system, raised, work, rows[None], failure)
    return rows, failure, work
