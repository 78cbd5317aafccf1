"""Throughput for the slider–crank, 600 steps, on all cores, compared with Exudyn.

Exudyn runs in as many processes with each of its settings; the fastest setting is the baseline. The
results of both programs are compared too. Without Exudyn the table contains flexband only.
"""

from __future__ import annotations

import multiprocessing
import runpy
import time
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

import flexband as fb
from benchmarks.harness import ROOT, alternate, medians, options, report
from benchmarks.speed import peer_exudyn as peer
from flexband.basics.cores import available_cores

DURATION = 0.6
STEP = 1e-3


EXAMPLE = runpy.run_path(str(ROOT / "examples" / "paper" / "slider_crank.py"))
SENSORS = {
    "F": fb.Reaction("A"),
    "crank": fb.Position("crank"),
    "slider": fb.Position("slider"),
}


def slider_crank(*parameters: ArrayLike) -> fb.Mechanism:
    """Return the mechanism of the example, with sensors for the comparison."""
    return replace(EXAMPLE["slider_crank"](*parameters), sensors=SENSORS)


def parameters(samples: int) -> np.ndarray:
    """Return samples of the study's parameters, shape (samples, 4)."""
    rng = np.random.default_rng(0)
    scatter = rng.standard_normal((2, samples))
    return np.stack(
        [
            rng.uniform(0.194, 0.206, samples),
            rng.uniform(970.0, 1030.0, samples),
            69e9 * (1 + 0.01 * scatter[0]),
            0.34 * (1 + 0.01 * scatter[1]),
        ],
        axis=1,
    )


def own_time(model: fb.Mechanism, samples: int, threads: int) -> float:
    """Return milliseconds per sample."""
    begin = time.perf_counter()
    fb.simulate(model, duration=DURATION, step=STEP, threads=threads)
    return 1e3 * (time.perf_counter() - begin) / samples


def peer_time(pool, rows: np.ndarray, processes: int, setting: str) -> float:
    """Return milliseconds per sample of Exudyn, with all processes running at the same time."""
    jobs = [(part, DURATION, STEP, setting) for part in np.array_split(rows, processes)]
    return 1e3 * sum(pool.starmap(peer.seconds, jobs, chunksize=1)) / len(rows) / processes


def agreement() -> list[str]:
    """Return the differences of the two programs in positions and reactions for ρ∞ = 0.5."""
    row = parameters(1)[0]
    motion = fb.simulate(
        slider_crank(*row),
        duration=DURATION,
        step=STEP,
        integrator=fb.GeneralizedAlpha(spectral_radius=0.5),
    )
    exudyn_motion = peer.motion(row, DURATION, STEP, 0.5)
    exudyn_motion["F"] = -exudyn_motion["F"]  # on the crank instead of on the ground
    notes = []
    for name in ("crank", "slider"):
        values = motion.sel(output=[f"{name}_X", f"{name}_Y"]).values.T
        difference = np.abs(values - exudyn_motion[name]).max()
        notes.append(
            f"largest difference in the {name}'s position: {difference:.1e} m (allowed 1e-4)"
        )
    for k, axis in enumerate("XY"):
        values = motion.sel(output=f"F_{axis}").values
        exact = exudyn_motion["F"][:, k]
        difference = 100 * np.abs(values - exact).sum() / np.abs(exact).sum()
        notes.append(f"∫|Δ|dt / ∫|F|dt of F_{axis} at A: {difference:.3f} % (allowed 0.2 %)")
    return notes


def main() -> None:
    arguments = options(__doc__, 2048)
    cores = available_cores()
    rows = parameters(arguments.samples)
    model = slider_crank(*rows.T)
    exudyn_rows = rows[: max(cores, arguments.samples // 32)]
    own_time(slider_crank(*rows[0]), 1, 1)  # compile
    cases = {
        f"flexband, {cores} threads": partial(own_time, model, len(rows), cores),
        "flexband, 1 thread": partial(own_time, model, len(rows), 1),
    }
    notes = [f"{len(rows)} samples of {round(DURATION / STEP)} steps; medians of alternating runs"]
    if not peer.AVAILABLE:
        measurements = alternate(cases, arguments.repeats)
        notes.append("Exudyn is not installed: its rows are omitted")
    else:
        with multiprocessing.get_context("spawn").Pool(cores) as pool:
            for setting in peer.SETTINGS:
                name = f"Exudyn, {setting}, {cores} processes"
                cases[name] = partial(peer_time, pool, exudyn_rows, cores, setting)
            peer_time(pool, exudyn_rows, cores, next(iter(peer.SETTINGS)))  # import and warm up
            measurements = alternate(cases, arguments.repeats)
        notes += [
            f"Exudyn: {len(exudyn_rows)} of the samples, time of its solver only",
            *agreement(),
        ]
    middle = medians(measurements)
    peers = {k: v for k, v in middle.items() if k.startswith("Exudyn")}
    baseline = min(peers.values()) if peers else middle["flexband, 1 thread"]
    what = "the fastest Exudyn" if peers else "one thread"
    report(
        arguments.output,
        "engine",
        ["case", "ms per sample", f"throughput relative to {what}"],
        [[name, f"{ms:.3f}", f"{baseline / ms:.2f}"] for name, ms in middle.items()],
        measurements,
        notes,
    )


if __name__ == "__main__":
    main()
