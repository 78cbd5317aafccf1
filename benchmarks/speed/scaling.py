"""Time per step and sample as mechanisms grow: a flexible pendulum and a chain of closed loops.

"Single" compares one sample on one thread with one run of Exudyn, "batched" many samples on all
cores with as many processes of Exudyn. Only the solvers are timed, not the setup of the models.
Exudyn uses modified Newton with the faster of the dense (up to 16 elements or loops) and the sparse
solver.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from functools import partial

import numpy as np

import flexband as fb
from benchmarks.harness import alternate, medians, options, report
from benchmarks.speed import peer_exudyn as peer
from benchmarks.speed.peer_models import MODULUS, OURS
from flexband.basics.cores import available_cores
from flexband.mechanics.assembly.packing import pack
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.engine.batch import march_block
from flexband.mechanics.engine.threads import in_parallel
from flexband.mechanics.kernels.lane_arrays import WIDTH

SIZES = {"pendulum": (4, 16, 64, 256, 1024), "parallelograms": (1, 4, 16, 64)}
STEPS = 200
STEP = 1e-3
FEW = 20  # steps of Exudyn for large models, in which its Newton iteration fails later
LARGEST_DENSE = 16
PATIENCE = 60  # seconds: time limit of a process of Exudyn


def repeats(size: int) -> int:
    """Return the number of consecutive runs that are timed together."""
    return max(1, 64 // size)


class FlexbandBatch:
    """An assembled batch; calling it returns microseconds per step and sample."""

    def __init__(self, kind: str, size: int, samples: int, threads: int):
        moduli = MODULUS * np.linspace(0.99, 1.01, samples) if samples > 1 else MODULUS
        self.system = assemble(OURS[kind](size, moduli))
        self.packed = pack(self.system, np.arange(STEPS + 1) * STEP)
        self.samples = samples
        self.threads = threads
        self.repeats = repeats(size)

    def _run(self, block: int) -> int:
        method = fb.GeneralizedAlpha().coefficients(STEP)
        block = march_block(self.system, method, 1e-10, self.packed(block), STEPS + 1)
        if block.failure[0].any():
            raise RuntimeError("a run failed")
        self.tips = block.series[:, :2, -1]
        return WIDTH

    def __call__(self) -> float:
        begin = time.perf_counter()
        for _ in range(self.repeats):
            in_parallel(self._run, -(-self.samples // WIDTH), self.samples, self.threads, None)
        return 1e6 * (time.perf_counter() - begin) / self.repeats / STEPS / self.samples


def peer_runs(kind: str, size: int, processes: int, setting: str) -> list[dict]:
    """Run several processes of Exudyn at the same time and return their results."""
    steps = STEPS if size < 256 else FEW
    job = json.dumps([kind, size, repeats(size), steps, STEP, setting])
    command = [sys.executable, "-m", "benchmarks.speed.peer_models", job]
    children = [
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        for _ in range(processes)
    ]
    outputs = [process.communicate(timeout=PATIENCE)[0] for process in children]
    return [json.loads(text.splitlines()[-1]) | {"steps": steps} for text in outputs]


def peer_time(kind: str, size: int, processes: int) -> float:
    """Return microseconds per step and sample of Exudyn's fastest setting."""
    settings = ["modified Newton, sparse"]
    if size <= LARGEST_DENSE:
        settings.append("modified Newton, dense")
    microseconds = []
    for setting in settings:
        runs = peer_runs(kind, size, processes, setting)
        step_times = [run["seconds"] / run["steps"] for run in runs]
        microseconds.append(1e6 * sum(step_times) / processes**2)
    return min(microseconds)


def main() -> None:
    arguments = options(__doc__, 64)
    cores = available_cores()
    rows = []
    all_measurements = {}
    notes = []
    for kind, sizes in SIZES.items():
        for size in sizes if arguments.samples >= WIDTH * cores else sizes[:2]:
            single_batch = FlexbandBatch(kind, size, 1, 1)
            single_batch()  # compile
            cases = {
                "single": single_batch,
                "batched": FlexbandBatch(kind, size, arguments.samples, cores),
            }
            if peer.AVAILABLE:
                cases["Exudyn single"] = partial(peer_time, kind, size, 1)
                cases["Exudyn batched"] = partial(peer_time, kind, size, cores)
            measurements = alternate(cases, arguments.repeats)
            all_measurements |= {f"{kind} {size}, {name}": v for name, v in measurements.items()}
            rows.append([f"{kind}, {size}", *_columns(medians(measurements), size)])
            if peer.AVAILABLE:
                run = peer_runs(kind, size, 1, "modified Newton, sparse")[0]
                tip_distance = np.abs(single_batch.tips[run["steps"]] - run["tip"]).max()
                notes.append(
                    f"{kind}, {size}: tips differ by {tip_distance:.0e} m "
                    f"after {run['steps']} steps"
                )
    batch = f"batch of {arguments.samples} on {cores} cores"
    report(
        arguments.output,
        "scaling",
        ["case", "single: µs per step", "per element or loop", "Exudyn single",
         f"{batch}: µs per step and sample", "per element or loop", "Exudyn batched"],
        rows,
        all_measurements,
        notes,
    )  # fmt: skip


def _columns(middle: dict[str, float], size: int) -> list[str]:
    """Return flexband's time, its time per element or loop, and Exudyn's time with the ratio."""
    columns = []
    for name in ("single", "batched"):
        flexband_time = middle[name]
        exudyn_time = middle.get(f"Exudyn {name}")
        ratio = (
            "-"
            if exudyn_time is None
            else f"{exudyn_time:.3g} ({exudyn_time / flexband_time:.1f} ×)"
        )
        columns += [f"{flexband_time:.3g}", f"{flexband_time / size:.3f}", ratio]
    return columns


if __name__ == "__main__":
    main()
