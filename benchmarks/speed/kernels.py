"""Time of each part of the engine for one block of samples of the slider–crank."""

from __future__ import annotations

import runpy
import time
from collections.abc import Callable
from functools import partial

import numpy as np

import flexband as fb
from benchmarks.harness import ROOT, alternate, medians, options, report
from flexband.mechanics.assembly.packing import pack
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.engine.batch import begin, run
from flexband.mechanics.engine.entries import MARCH
from flexband.mechanics.kernels.equations import residual, tangent
from flexband.mechanics.kernels.factorization import factorize, solve
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.kernels.lanes import cached, splat
from flexband.mechanics.kernels.records import Record

DURATION = 0.6
STEP = 1e-3


@cached
def residuals(count, structure, values, work):
    for _ in range(count):
        residual(structure, values, 0, work.z, work.r, work.blocks)


@cached
def tangents(count, structure, values, work):
    for _ in range(count):
        tangent(structure, values, 0, work.z, splat(1e-7), 0.0, work.matrix, work.blocks)


@cached
def tangents_and_factors(count, structure, values, work):
    for _ in range(count):
        tangent(structure, values, 0, work.z, splat(1e-7), 0.0, work.matrix, work.blocks)
        factorize(structure.pattern, work.matrix, splat(1e-12), work.r)


@cached
def solutions(count, structure, values, work):
    for _ in range(count):
        solve(structure.pattern, structure.pattern.below, work.matrix, (work.r,))


def kernel_time(kernel, count: int, *arguments) -> float:
    """Return microseconds per call."""
    before = time.perf_counter()
    kernel(count, *arguments)
    return 1e6 * (time.perf_counter() - before) / count


def kernel_cases(count: int, *arguments) -> dict[str, Callable[[], float]]:
    """Return functions that time each compiled kernel; arguments: structure, values, work."""
    structure, values, work = arguments
    arguments = Record(structure), Record(values), Record(work)
    kernels = {
        "residual": residuals,
        "tangent": tangents,
        "tangent and factorization": tangents_and_factors,
        "solution": solutions,
    }
    for kernel in kernels.values():
        kernel_time(kernel, 1, *arguments)  # compile
    return {name: partial(kernel_time, k, count, *arguments) for name, k in kernels.items()}


def main() -> None:
    arguments = options(__doc__, 10_000)
    mechanism = runpy.run_path(str(ROOT / "examples" / "paper" / "slider_crank.py"))["slider_crank"]
    system = assemble(mechanism(np.linspace(0.194, 0.206, WIDTH), 1000.0, 69e9, 0.34))
    times = np.arange(round(DURATION / STEP) + 1) * STEP
    structure = system.structure
    values = pack(system, times)(0)
    integrator = fb.GeneralizedAlpha()
    work, failure = begin(system, values)
    first = work.z.copy()
    outputs = np.zeros((len(times), system.sensor_row_count, WIDTH))

    def step_time() -> float:
        work.z[:] = first
        before = time.perf_counter()
        run(MARCH, system, values, work, outputs, failure,
            integrator.coefficients(STEP), integrator.tolerance)  # fmt: skip
        return 1e6 * (time.perf_counter() - before) / (len(times) - 1)

    step_time()  # compile
    cases = {"complete step": step_time}
    cases |= kernel_cases(arguments.samples, structure, values, work)
    measurements = alternate(cases, arguments.repeats)
    middle = medians(measurements)
    pattern = structure.pattern
    state = structure.state
    report(
        arguments.output,
        "kernels",
        ["case", f"µs per block of {WIDTH}", "part of a step"],
        [[n, f"{us:.2f}", f"{us / middle['complete step']:.2f}"] for n, us in middle.items()],
        measurements,
        [
            f"{state.coordinates} coordinates, {state.angle - state.multiplier} multipliers, "
            f"{len(pattern.below.tile)} tiles below the diagonal, "
            f"{len(pattern.product_v) + len(pattern.below.tile)} products in a factorization",
            f"{arguments.samples} consecutive calls; a step computes a residual and a solution in "
            "every iteration, and a tangent and a factorization once",
        ],
    )


if __name__ == "__main__":
    main()
