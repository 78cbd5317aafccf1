"""What a store and worker processes cost: three measurements, each in alternating runs.

The slider–crank of the paper with and without a store; trivial responses without a store; a
response of 20 ms in one and two processes.
"""

from __future__ import annotations

import runpy
import tempfile
import time
from collections.abc import Callable
from functools import partial

import numpy as np

import flexband as fb
from benchmarks.harness import ROOT, alternate, medians, options, report

INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}


def seconds(study: Callable[..., object], *, with_store: bool = False) -> float:
    """Return the wall time of a study [s]."""
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        study(store=folder if with_store else None)
        return time.perf_counter() - begin


def trivial_response(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return one number per sample."""
    return a * b


def slow_response(a: float, b: float) -> float:
    """Take 20 ms."""
    end = time.perf_counter() + 0.02
    while time.perf_counter() < end:
        pass
    return a * b


def main() -> None:
    arguments = options(__doc__, 10_000)
    points = 10
    example = runpy.run_path(str(ROOT / "examples" / "paper" / "slider_crank.py"))
    scan = fb.LHSScanning(max(2, arguments.samples // points**2), points)
    crank = partial(fb.propagate, example["response"], example["inputs"], fb.LHSScanning(10, 2))
    crank()  # compile
    crank = partial(fb.propagate, example["response"], example["inputs"], scan)
    quick = partial(fb.propagate, trivial_response, INPUTS, fb.LHSScanning(100_000, 10))
    scan = fb.LHSScanning(100, 10)
    single = partial(fb.propagate, fb.models.samplewise(slow_response), INPUTS, scan)
    raw = alternate(
        {
            "slider–crank": partial(seconds, crank),
            "slider–crank, stored": partial(seconds, crank, with_store=True),
            "1 000 000 trivial runs": partial(seconds, quick),
            "1000 runs of 20 ms, one process": partial(
                seconds, partial(single, executor=fb.execution.Processes(1))
            ),
            "1000 runs of 20 ms, two processes": partial(
                seconds, partial(single, executor=fb.execution.Processes(2))
            ),
        },
        arguments.repeats,
    )
    medians_by_case = medians(raw)
    plain_time, store_time, trivial_time, one_process, two_processes = medians_by_case.values()
    report(
        arguments.output,
        "store",
        ["case", "value"],
        [
            *([name, f"{value:.2f} s"] for name, value in medians_by_case.items()),
            ["a store adds", f"{100 * (store_time / plain_time - 1):.1f} %"],
            ["trivial runs in a second", f"{1e6 / trivial_time:.0f}"],
            ["two processes are faster by", f"{one_process / two_processes:.2f}"],
        ],
        raw,
    )


if __name__ == "__main__":
    main()
