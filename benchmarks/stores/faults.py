"""A study of some thousand runs that is killed 20 times: what is lost, and what is made twice."""

from __future__ import annotations

import random
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np

import flexband as fb
from benchmarks.harness import options, report

BATCH = 16
INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}


def response(a: np.ndarray, b: np.ndarray, log: str = "") -> np.ndarray:
    """Return two outputs; write to a file which runs begin, and take 0.5 ms for each."""
    if log:
        with Path(log).open("a") as file:
            file.writelines(f"{x.hex()} {y.hex()}\n" for x, y in zip(a, b, strict=True))
        time.sleep(5e-4 * len(a))
    return np.stack([a * b, a + b], axis=1)


def child(folder: str, samples: str) -> None:
    """Run the study, and write its bands to a file."""
    response_with_log = partial(response, log=f"{folder}/log")
    method = fb.LHSScanning(int(samples) // 8, 8)
    bands = fb.propagate(response_with_log, INPUTS, method, store=f"{folder}/store", batch=BATCH)
    np.save(f"{folder}/bands.npy", bands["mean"].values)


def runs_in_log(folder: str) -> list[str]:
    """Return the runs that began."""
    log = Path(folder) / "log"
    return log.read_text().split("\n")[:-1] if log.exists() else []


def main() -> None:
    arguments = options(__doc__, 4000, kills=(20, "number of kills"), seed=(0, "of the moments"))
    draw = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", __spec__.name, "child", folder, str(arguments.samples)]
        for _ in range(arguments.kills):
            goal = len(runs_in_log(folder)) + draw.randint(
                1, max(1, arguments.samples // arguments.kills)
            )
            process = subprocess.Popen(command)
            while process.poll() is None and len(runs_in_log(folder)) < goal:
                time.sleep(0.002)
            time.sleep(0.02 * draw.random())
            process.kill()
            process.wait()
        subprocess.run(command, check=True)
        runs = runs_in_log(folder)
        bands = np.load(f"{folder}/bands.npy")
        stored_count = len(fb.execution.open_runs(f"{folder}/store").run)
    exact = fb.propagate(response, INPUTS, fb.LHSScanning(arguments.samples // 8, 8))
    rows = [
        ["runs of the study", str(len(set(runs)))],
        ["runs in the store", str(stored_count)],
        ["runs that began", str(len(runs))],
        ["allowed: a call in flight and two checks for every kill",
         str(len(set(runs)) + arguments.kills * (BATCH + 2) + 2)],
        ["bands as without kills, bit for bit", str(np.array_equal(bands, exact["mean"].values))],
    ]  # fmt: skip
    report(arguments.output, "faults", ["after the kills", "value"], rows, {"runs": len(runs)})


if __name__ == "__main__":
    if sys.argv[1:2] == ["child"]:
        child(*sys.argv[2:])
    else:
        main()
