"""Throughput of the engine on the slider–crank study: 600 steps, 36 coordinates, 15 multipliers.

Prints medians of alternating runs as a Markdown table and writes output/bench/engine.json.
Ratios are to one thread in the same run.
"""

import argparse
import json
import os
import platform
import runpy
import statistics
import time
from pathlib import Path

import numpy as np

import flexband as fb

ROOT = Path(__file__).parents[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=2048)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--output", type=Path, default=ROOT / "output" / "bench")
    options = parser.parse_args()

    example = runpy.run_path(str(ROOT / "examples" / "slider_crank.py"))
    rng = np.random.default_rng(0)

    def mechanism(n: int) -> fb.Mechanism:
        return example["slider_crank"](
            rng.uniform(0.194, 0.206, n),
            rng.uniform(970.0, 1030.0, n),
            69e9 * (1 + 0.01 * rng.standard_normal(n)),
            0.34 * (1 + 0.01 * rng.standard_normal(n)),
        )

    cores = len(os.sched_getaffinity(0))
    cases = {
        "batch, 1 thread": (mechanism(options.samples), 1, options.samples),
        f"batch, {cores} threads": (mechanism(options.samples), cores, options.samples),
        "one sample alone": (mechanism(1), 1, 1),
    }
    times: dict[str, list[float]] = {name: [] for name in cases}
    fb.simulate(cases["one sample alone"][0], duration=0.6, step=1e-3)  # compile
    for _ in range(options.repeats):
        for name, (model, threads, samples) in cases.items():
            begin = time.perf_counter()
            fb.simulate(model, duration=0.6, step=1e-3, threads=threads)
            times[name].append(1e3 * (time.perf_counter() - begin) / samples)

    medians = {name: statistics.median(values) for name, values in times.items()}
    baseline = medians["batch, 1 thread"]
    python = f"Python {platform.python_version()}, NumPy {np.__version__}"
    print(f"{platform.machine()}, {cores} cores, {python}")
    print(f"{options.samples} samples, medians of {options.repeats} alternating runs\n")
    print("| case | ms a sample | throughput, one thread = 1 |\n| --- | --- | --- |")
    for name, median in medians.items():
        print(f"| {name} | {median:.3f} | {baseline / median:.2f} |")
    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "engine.json").write_text(json.dumps(times, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
