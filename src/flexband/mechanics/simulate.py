"""Simulate a mechanism: all samples at once, eight in a lane, blocks of lanes over threads."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.errors import (
    AssemblyError,
    InputError,
    SimulationError,
    numbers,
    positive,
    whole,
)
from flexband.lanes import WIDTH
from flexband.mechanics.assembly import System, assemble
from flexband.mechanics.equations import Values, Work
from flexband.mechanics.generalized_alpha import DIVERGED, GeneralizedAlpha, march
from flexband.mechanics.initial import NOT_ASSEMBLED, SINGULAR_START, start
from flexband.mechanics.mechanism import Mechanism
from flexband.mechanics.packing import pack

WRONG_BRANCH = 5.0

Progress = Callable[[int, int], object]
"""Told now and then how many runs are done, and of how many."""


def simulate(
    mechanism: Mechanism,
    *,
    duration: float,
    step: float,
    integrator: GeneralizedAlpha | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> xr.DataArray:
    """Simulate the motion of a mechanism.

    Parameters
    ----------
    duration, step : simulated time and step [s]; the step divides the duration.
    integrator : numerics; ``GeneralizedAlpha()`` where None.
    threads : number of threads; one a core where None. Results do not depend on it.
    progress : called as ``progress(done, total)`` when runs are finished.

    Returns
    -------
    The outputs of the sensors, dims (output, time), with a first dim "sample" where a parameter
    is an array of more than one value. Coordinates: "output" (name), "unit", "time" [s].

    Raises
    ------
    InputError
        Where a number is out of its range or numbers of samples do not fit.
    AssemblyError
        Where the constraints cannot be met at the start or do not determine their multipliers.
    SimulationError
        Where a sample diverges; no numbers are returned then.
    """
    integrator = integrator or GeneralizedAlpha()
    times = _times(duration, step)
    system = assemble(mechanism)
    packed = pack(system, times)
    method, tolerance = integrator.coefficients(float(step)), float(integrator.tolerance)
    outputs = np.empty((system.samples, len(system.outputs), len(times)))
    failures = np.zeros((system.samples, 4))

    def run(block: int) -> int:
        series, failure = _march(system, method, tolerance, packed(block), len(times))
        first = block * WIDTH
        count = min(WIDTH, system.samples - first)
        rows = series.transpose(1, 0, 2)
        derived = _derive(system, rows, block)
        outputs[first : first + count] = derived.transpose(2, 0, 1)[:count]
        conditions = series[:, system.sensed - len(system.conditions) :]
        failures[first : first + count] = _with_branches(conditions, failure).T[:count]
        return count

    _compile(system, method, tolerance, packed(0))
    _in_parallel(run, -(-system.samples // WIDTH), system.samples, threads, progress)
    _raise_failures(failures, system, times)
    result = xr.DataArray(
        outputs,
        dims=("sample", "output", "time"),
        coords={
            "output": system.outputs,
            "unit": ("output", system.units),
            "time": ("time", times, {"units": "s"}),
        },
    )
    return result if system.samples > 1 else result.isel(sample=0)


def _times(duration: float, step: float) -> np.ndarray:
    """Return the times of the steps [s], zero included."""
    given = (("duration [s]", duration), ("step [s]", step))
    length, one = (float(positive(name, numbers(name, value))) for name, value in given)
    ratio = length / one
    steps = round(ratio)
    if steps < 1 or abs(ratio - steps) > 1e-6 * ratio:
        raise InputError(
            f"duration [s] must be a whole number of steps; got {duration:g} with step {step:g}"
        )
    digits = 12 + max(0, int(np.ceil(-np.log10(step))))
    return np.array([round(k * float(step), digits) for k in range(steps + 1)])


def _march(system: System, method, tolerance: float, values: Values, times: int):
    """Run one block; return its outputs (times, outputs, WIDTH) and failures (4, WIDTH).

    The conditions of the joints follow the outputs of the sensors.
    """
    series = np.zeros((times, system.sensed, WIDTH))
    failure = np.zeros((4, WIDTH))
    work = Work.of(system.structure)
    start(system.structure, values, work, failure)
    march(system.structure, method, tolerance, values, work, series, failure)
    return series, failure


def _derive(system: System, rows: np.ndarray, block: int) -> np.ndarray:
    """Return the outputs (outputs, times, WIDTH) from the rows that the engine has evaluated."""

    def pick(parameter: ArrayLike) -> np.ndarray:
        values = np.atleast_1d(np.asarray(parameter, dtype=float))
        sample = np.arange(block * WIDTH, (block + 1) * WIDTH)
        return values[np.minimum(sample, len(values) - 1)]

    parts = [sensor.derive(rows[place], pick) for sensor, place in system.sensors]
    return np.concatenate([rows[:0], *parts])


def _in_parallel(
    run: Callable[[int], int],
    blocks: int,
    samples: int,
    threads: int | None,
    progress: Progress | None,
) -> None:
    """Run all blocks; Ctrl-C drops those not yet begun."""
    workers = available_cores() if threads is None else whole("threads", threads, 1)
    done = 0
    with ThreadPoolExecutor(min(workers, blocks)) as pool:
        futures = [pool.submit(run, block) for block in range(blocks)]
        try:
            for future in as_completed(futures):
                done += future.result()
                if progress is not None:
                    progress(done, samples)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def available_cores() -> int:
    """Return the number of processors that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _with_branches(conditions: np.ndarray, failure: np.ndarray) -> np.ndarray:
    """Return the failures, with those of joints that were held the wrong way round.

    `conditions`, shape (times, conditions, WIDTH), must be positive up to a run's failure.
    """
    failure = failure.copy()
    times, rows, lanes = np.nonzero(conditions < 0)
    for time, row, lane in zip(times[::-1], rows[::-1], lanes[::-1], strict=True):
        if failure[0, lane] in (0, WRONG_BRANCH) or time < failure[1, lane]:
            failure[:3, lane] = WRONG_BRANCH, time, row
    return failure


def _compile(system: System, method, tolerance: float, values: Values) -> None:
    """Compile the engine or load it from the cache on disk; say so where it takes long."""
    if march.signatures:
        return
    with _notice("flexband: compiling the engine (once on this machine, about 12 s) ...", 2.0):
        _march(system, method, tolerance, values, times=1)


@contextmanager
def _notice(text: str, seconds: float):
    """Print a line to the screen where the body takes longer than this."""
    timer = threading.Timer(seconds, lambda: print(text, file=sys.stderr, flush=True))
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _raise_failures(failures: np.ndarray, system: System, times: np.ndarray) -> None:
    """Raise the error that says which samples failed, when and why."""
    code, number, row, _ = failures.T
    failed = np.flatnonzero(code)
    if not len(failed):
        return
    found = {}
    for sample in failed:
        names = system.conditions if code[sample] == WRONG_BRANCH else system.constraints
        where = names[int(row[sample])] if row[sample] >= 0 else ""
        reason = {
            NOT_ASSEMBLED: f"the constraints cannot be met, worst is {where}",
            SINGULAR_START: "constraints contradict each other, or the guess is where their "
            f"Jacobian loses rank; worst is {where}",
            WRONG_BRANCH: f"joint {where!r} holds its body the wrong way round; start the body "
            "within 90° of the angle asked for",
            DIVERGED: "Newton's method diverged",
        }.get(code[sample], f"constraints contradict each other, worst is {where}")
        found[int(sample)] = (float(times[int(number[sample])]), reason)
    lines = [f"sample {s}, t = {t:g} s: {reason}" for s, (t, reason) in list(found.items())[:5]]
    more = f"\n... and {len(found) - 5} more" if len(found) > 5 else ""
    text = f"{len(found)} of {len(failures)} runs failed\n" + "\n".join(lines) + more
    if not np.any(number[failed]):
        raise AssemblyError(text, found)
    raise SimulationError(text, found)
