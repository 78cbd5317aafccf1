"""Memory of a study at its peak, against what is announced: methods and sizes drawn at random.

Peaks are those of all arrays that Python allocates. `--seed` chooses the sizes. With `--large`
there is one study instead, of 40 inputs, 200 outputs and 5000 times, and its peak is the largest
resident set of the process that makes it, beside that of a small study. `--ringing` makes it ring.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tracemalloc
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

import numpy as np

import flexband as fb
from benchmarks.harness import options, report
from flexband.uncertainty.adaptive import adaptation
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.phase_resolved import method as phase_resolved
from flexband.uncertainty.phases.decomposition import Stage, decompose

BYTES = 8


FREQUENCIES = (60.0, 170.0, 430.0)
"""Of the carriers of ringing outputs [rad/s]."""


def waves(outputs: int, times: int, *, ringing: int):
    """Return a response whose outputs need many terms, or ring with so many carriers."""
    t = np.linspace(0, 1, times)

    def response(**values: np.ndarray) -> np.ndarray:
        x = np.stack(list(values.values()), axis=1)
        values = np.empty((len(x), outputs, times))
        for sample_rows, a, b in zip(
            values, x @ (1 / (1 + np.arange(x.shape[1]))), x**2, strict=True
        ):
            for k, row in enumerate(
                sample_rows
            ):  # one by one: a response may need more than a study
                row[:] = t * np.exp(0.3 * b.sum())
                if not ringing:
                    row[:] += np.cos(k * t) * np.exp(a)
                for c, frequency in enumerate(FREQUENCIES[:ringing]):
                    row[:] += 0.5**c * np.cos((frequency + k) * t * (1 + 0.05 * 0.8**c * a))
        return values

    return response


def inputs_of(intervals: int, random: int) -> dict[str, Any]:
    """Return so many inputs of both kinds."""
    return {f"e{k}": fb.Interval(-0.5, 0.5) for k in range(intervals)} | {
        f"x{k}": fb.Normal(0.0, 0.3) for k in range(random)
    }


def announced_and_peak(
    method: Any, inputs: Mapping[str, Any], outputs: int, times: int, *, ringing: int = 0
) -> tuple[float, float]:
    """Return the memory in bytes that is announced for a study, and what it takes.

    It is announced for the carriers that are tried, and for one at least if outputs ring.
    """
    with warnings.catch_warnings(), count_carriers() as carrier_counts:
        warnings.simplefilter("ignore")
        small_response = waves(1, 40, ringing=ringing)
        fb.propagate(
            small_response, inputs, method
        )  # what is imported and compiled is no memory of a study
        tracemalloc.start()
        try:
            bands = fb.propagate(waves(outputs, times, ringing=ringing), inputs, method)
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
    intervals = Space(inputs).interval_dimension
    output_bytes = BYTES * outputs * times
    announcement, per_carrier = method.peak_memory(
        intervals, int(bands.attrs["runs"]), output_bytes
    )
    carriers = max(1, *carrier_counts) if ringing else 0  # one is looked for
    return announcement + carriers * per_carrier, float(peak)


@contextmanager
def count_carriers() -> Iterator[list[int]]:
    """Yield a list that takes the number of carriers of every stage of every decomposition."""
    carrier_counts = [0]

    def decompose_and_count(F: np.ndarray, dt: float) -> Iterator[Stage]:
        for stage in decompose(F, dt):
            carrier_counts.append(len(stage.carriers))
            yield stage
            del stage  # as the methods do

    with (
        patch.object(adaptation, "decompose", decompose_and_count),
        patch.object(phase_resolved, "decompose", decompose_and_count),
    ):
        yield carrier_counts


def draw_study(rng: np.random.Generator) -> tuple[Any, dict[str, Any], int]:
    """Return a method, inputs, and the number of carriers with which outputs ring."""
    intervals, random = (int(n) for n in rng.integers(1, 4, 2))
    max_runs = int(rng.integers(32, 120))
    tolerance = 1e-14
    methods = [
        (fb.PCCI(2, 2), False),
        (fb.ImprovedPCCI(1, 3), False),
        (fb.methods.RegressionPCCI(int(rng.integers(1, 4))), False),
        (fb.LHSScanning(int(rng.integers(20, 60)), 3), False),
        (fb.MonteCarlo(int(rng.integers(50, 200)), 3), False),
        (fb.methods.PerturbationChebyshev(int(rng.integers(2, 5))), False),
        (fb.AdaptivePCCI(tolerance, max_runs), False),
        (fb.AdaptivePCCI(tolerance, max_runs), True),
        (fb.methods.PhaseResolvedPCCI(1, 2), False),
        (fb.methods.PhaseResolvedPCCI(1, 2), True),
    ]
    method, rings = methods[rng.integers(len(methods))]
    ringing = int(rng.integers(1, 1 + len(FREQUENCIES))) if rings else 0
    if isinstance(method, fb.methods.RegressionPCCI | fb.AdaptivePCCI) and rng.random() < 0.5:
        intervals = int(rng.integers(0, 25))
        random = int(rng.integers(1, 26))
        method = (
            fb.methods.RegressionPCCI(1)
            if isinstance(method, fb.methods.RegressionPCCI)
            else method
        )
    return method, inputs_of(intervals, random), ringing


LARGE = (200, 5000)
SMALL = (1, 40)
"""Outputs and times of a large study, and of one that takes hardly more than Python."""


def child(max_runs: int, outputs: int, times: int, *, ringing: bool) -> None:
    """Make a study of 40 inputs; print its runs, its carriers and the resident set [bytes]."""
    warnings.simplefilter("ignore")
    method = fb.AdaptivePCCI(1e-14, max_runs)
    response = waves(outputs, times, ringing=ringing)
    bands = fb.propagate(response, inputs_of(20, 20), method)
    unit = 1 if sys.platform == "darwin" else 2**10
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
    print(int(bands.attrs["runs"]), int(bands["carriers"].max()), peak)


def judge_large_study(max_runs: int, *, ringing: bool) -> list[str]:
    """Return what is announced for a large study, and its peak [MB], as a row."""

    def numbers(outputs: int, times: int) -> list[int]:
        arguments = ["child", str(max_runs), str(outputs), str(times), str(int(ringing))]
        run = subprocess.run(
            [sys.executable, "-m", __spec__.name, *arguments],
            capture_output=True,
            text=True,
            check=True,
        )
        return [int(v) for v in run.stdout.split()]

    (runs, carriers, peak), (*_, base_size) = numbers(*LARGE), numbers(*SMALL)
    output_bytes = BYTES * LARGE[0] * LARGE[1]
    announcement, per_carrier = fb.AdaptivePCCI().peak_memory(20, runs, output_bytes)
    announcement = announcement + max(carriers, ringing) * per_carrier
    peak = peak - base_size
    name = f"adaptive PCCI, {runs} runs{', ringing' * ringing}"
    ratio = f"{announcement / peak:.2f}"
    return [name, "20", "20", f"{1e-6 * announcement:.1f}", f"{1e-6 * peak:.1f}", ratio]


def main() -> None:
    if sys.argv[1:2] == ["child"]:
        *sizes, ringing = map(int, sys.argv[2:])
        return child(*sizes, ringing=bool(ringing))
    arguments = options(
        __doc__,
        40,
        seed=(0, "seed of the sizes"),
        large=(0, "most runs of a large study"),
        ringing=(0, "1: a large study rings"),
    )
    header = ["method", "intervals", "random", "announced [MB]", "peak [MB]", "ratio"]
    if arguments.large:
        row = judge_large_study(arguments.large, ringing=bool(arguments.ringing))
        return report(arguments.output, "study_memory_large", header, [row], {"row": row})
    rng = np.random.default_rng(arguments.seed)
    rows = []
    parts = []
    for _ in range(arguments.samples):
        method, inputs, ringing = draw_study(rng)
        outputs = int(rng.integers(2, 6))
        times = int(rng.integers(800, 3000))
        announcement, peak = announced_and_peak(method, inputs, outputs, times, ringing=ringing)
        intervals = Space(inputs).interval_dimension
        parts.append(announcement / peak)
        rows.append(
            [
                f"{method.label}{f', {ringing} carriers' * (ringing > 0)}", str(intervals),
                str(len(inputs) - intervals), f"{1e-6 * announcement:.1f}", f"{1e-6 * peak:.1f}",
                f"{parts[-1]:.2f}",
            ]
        )  # fmt: skip
    notes = [f"ratios from {min(parts):.2f} to {max(parts):.2f}; required: 0.83 to 2"]
    report(arguments.output, "study_memory", header, rows, {"ratios": parts}, notes)


if __name__ == "__main__":
    main()
