"""Latency: the import, the first simulation of a process, and a single sample.

The first simulation is measured in new processes, with the compiled engine on disk and with an
empty cache. A single sample is compared with one run of Exudyn's solver.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from functools import partial

from benchmarks.harness import alternate, medians, options, report
from benchmarks.speed import peer_exudyn as peer
from benchmarks.speed.engine import DURATION, STEP, own_time, parameters, slider_crank

FIRST = """
import time
begin = time.perf_counter()
import flexband as fb
print(time.perf_counter() - begin)
bar = fb.RigidBody.bar(length=1.0, height=0.1, width=0.1, density=1000.0)
model = fb.Mechanism(bodies={"bar": bar}, joints={"hinge": fb.Revolute("bar.start", (0.0, 0.0))},
                     loads={"gravity": fb.Gravity()}, sensors={"tip": fb.Position("bar.end")})
fb.simulate(model, duration=0.1, step=1e-3)
print(time.perf_counter() - begin)
"""


def first_seconds(line: int, cache: str | None = None) -> float:
    """Return seconds from the start of a process to the import (line 0) or the result (line 1)."""
    environment = os.environ | ({"NUMBA_CACHE_DIR": cache} if cache else {})
    run = subprocess.run(
        [sys.executable, "-c", FIRST], capture_output=True, text=True, check=True, env=environment
    )
    return float(run.stdout.split()[line])


def main() -> None:
    arguments = options(__doc__, 1)
    row = parameters(1)
    model = slider_crank(*row[0])
    own_time(model, 1, 1)  # compile
    first_seconds(1)
    cases = {
        "import [s]": partial(first_seconds, 0),
        "first simulation, engine on disk [s]": partial(first_seconds, 1),
        "single sample [ms]": partial(own_time, model, 1, 1),
    }
    if peer.AVAILABLE:
        for setting in peer.SETTINGS:
            cases[f"one run of Exudyn, {setting} [ms]"] = partial(peer_milliseconds, row, setting)
    measurements = alternate(cases, arguments.repeats)
    with tempfile.TemporaryDirectory() as empty:
        measurements["first simulation, empty cache, once [s]"] = [first_seconds(1, empty)]
    report(
        arguments.output,
        "latency",
        ["case", "median"],
        [[name, f"{value:.3g}"] for name, value in medians(measurements).items()],
        measurements,
        ["the time of flexband includes assembly and packing, that of Exudyn only its solver"],
    )


def peer_milliseconds(row, setting: str) -> float:
    """Return milliseconds of one run of Exudyn."""
    return 1e3 * peer.seconds(row, DURATION, STEP, setting)


if __name__ == "__main__":
    main()
