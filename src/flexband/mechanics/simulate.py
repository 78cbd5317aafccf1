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

from flexband.errors import AssemblyError, InputError, SimulationError, positive, whole
from flexband.lanes import WIDTH
from flexband.mechanics.assembly import System, assemble, pack
from flexband.mechanics.equations import Values, Work
from flexband.mechanics.generalized_alpha import DIVERGED, GeneralizedAlpha, march
from flexband.mechanics.initial import NOT_ASSEMBLED, SINGULAR_START
from flexband.mechanics.mechanism import Mechanism

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
    times = _times(duration, step)
    system = assemble(mechanism)
    blocks = pack(system, times)
    method = (integrator or GeneralizedAlpha()).coefficients(float(step))
    tolerance = float((integrator or GeneralizedAlpha()).tolerance)
    outputs = np.empty((system.samples, len(system.outputs), len(times)))
    failures = np.zeros((system.samples, 3))

    def run(block: int) -> int:
        series, failure = _march(system, method, tolerance, blocks[block], len(times))
        first = block * WIDTH
        count = min(WIDTH, system.samples - first)
        outputs[first : first + count] = series.transpose(2, 1, 0)[:count]
        failures[first : first + count] = failure.T[:count]
        return count

    _compile(system, method, tolerance, blocks[0])
    _in_parallel(run, len(blocks), system.samples, threads, progress)
    _raise_failures(failures, system.constraints, times)
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
    ratio = float(positive("duration [s]", duration)) / float(positive("step [s]", step))
    steps = round(ratio)
    if steps < 1 or abs(ratio - steps) > 1e-6 * ratio:
        raise InputError(
            f"duration [s] must be a whole number of steps; got {duration:g} with step {step:g}"
        )
    return np.arange(steps + 1) * float(step)


def _march(system: System, method, tolerance: float, values: Values, times: int):
    """Run one block; return its outputs (times, outputs, WIDTH) and failures (3, WIDTH)."""
    series = np.zeros((times, len(system.outputs), WIDTH))
    failure = np.zeros((3, WIDTH))
    work = Work.of(system.structure)
    march(system.structure, method, tolerance, values, work, series, failure)
    return series, failure


def _in_parallel(
    run: Callable[[int], int],
    blocks: int,
    samples: int,
    threads: int | None,
    progress: Progress | None,
) -> None:
    """Run all blocks; Ctrl-C drops those not yet begun."""
    workers = len(os.sched_getaffinity(0)) if threads is None else whole("threads", threads, 1)
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


def _compile(system: System, method, tolerance: float, values: Values) -> None:
    """Compile the engine or load it from the cache on disk; say so where it takes long."""
    if march.signatures:
        return
    with _notice("flexband: compiling the engine (once on this machine, about 15 s) ...", 2.0):
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


def _raise_failures(failures: np.ndarray, constraints: list[str], times: np.ndarray) -> None:
    """Raise the error that says which samples failed, when and why."""
    code, number, row = failures.T
    failed = np.flatnonzero(code)
    if not len(failed):
        return
    found = {}
    for sample in failed:
        where = constraints[int(row[sample])] if row[sample] >= 0 else ""
        reason = {
            NOT_ASSEMBLED: f"the constraints cannot be met, worst is {where}",
            SINGULAR_START: "constraints contradict each other or are redundant (their Jacobian "
            f"loses rank), seen at {where}",
            DIVERGED: "Newton's method diverged",
        }.get(code[sample], f"the Jacobian of the constraints loses rank, at {where}")
        found[int(sample)] = (float(times[int(number[sample])]), reason)
    lines = [f"sample {s}, t = {t:g} s: {reason}" for s, (t, reason) in list(found.items())[:5]]
    more = f"\n... and {len(found) - 5} more" if len(found) > 5 else ""
    text = f"{len(found)} of {len(failures)} runs failed\n" + "\n".join(lines) + more
    if np.all(code[failed] <= SINGULAR_START):
        raise AssemblyError(text)
    raise SimulationError(text, found)
