"""Peak memory of a batch: 10 000 samples, 600 steps, 2 outputs, in separate processes.

The resident set includes the libraries. The first row, a process that simulates one sample, shows
their part.
"""

from __future__ import annotations

import resource
import subprocess
import sys
from functools import partial

import flexband as fb
from benchmarks.harness import alternate, medians, options, report
from benchmarks.speed.engine import DURATION, EXAMPLE, STEP, parameters

OUTPUTS = 2
ALLOWED = 200.0  # MiB beyond the outputs


def peak(samples: int) -> float:
    """Return the peak resident set [MiB] of a new process that simulates `samples` samples."""
    run = subprocess.run(
        [sys.executable, "-m", __spec__.name, "child", str(samples)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return float(run.stdout.split()[-1])


def child(samples: int) -> None:
    """Simulate and print the peak resident set [MiB]."""
    fb.simulate(EXAMPLE["slider_crank"](*parameters(samples).T), duration=DURATION, step=STEP)
    unit = 2**20 if sys.platform == "darwin" else 2**10
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit)


def main() -> None:
    arguments = options(__doc__, 10_000)
    measurements = alternate(
        {
            "one sample": partial(peak, 1),
            f"{arguments.samples} samples": partial(peak, arguments.samples),
        },
        arguments.repeats,
    )
    single_sample, batch = medians(measurements).values()
    outputs = arguments.samples * (round(DURATION / STEP) + 1) * OUTPUTS * 8 / 2**20
    report(
        arguments.output,
        "memory",
        ["case", "MiB"],
        [
            ["one sample", f"{single_sample:.0f}"],
            [f"{arguments.samples} samples", f"{batch:.0f}"],
            ["outputs", f"{outputs:.0f}"],
            ["beyond the outputs", f"{batch - outputs:.0f}"],
            ["beyond the outputs and one sample", f"{batch - outputs - single_sample:.0f}"],
        ],
        measurements,
        [f"allowed beyond the outputs: {ALLOWED:.0f} MiB"],
    )


if __name__ == "__main__":
    if sys.argv[1:2] == ["child"]:
        child(int(sys.argv[2]))
    else:
        main()
