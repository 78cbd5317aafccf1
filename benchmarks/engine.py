"""Throughput on the slider–crank, 600 steps, all cores, against Exudyn on as many processes.

Exudyn runs with each of its settings; its throughput is that of the fastest. Both programs are
also compared in what they compute. Without Exudyn the table has flexband's own rows only.
"""

from __future__ import annotations

import multiprocessing
import time
from functools import partial

import numpy as np
import peer_exudyn as peer
from harness import alternate, medians, options, report

import flexband as fb
from flexband.mechanics.simulate import available_cores

DURATION, STEP = 0.6, 1e-3


def slider_crank(crank_length, spring_stiffness, youngs_modulus, poissons_ratio):
    """Return the slider–crank of the example, with sensors for the comparison."""
    crank = fb.RigidBody.bar(length=crank_length, height=0.01, width=0.01, density=7800.0)
    link = fb.Beam(
        length=0.45,
        height=0.01,
        width=0.01,
        density=2700.0,
        youngs_modulus=youngs_modulus,
        poissons_ratio=poissons_ratio,
        elements=3,
        integration=fb.FullIntegration(),
        start=(crank_length, 0.0),
    )
    slider = fb.RigidBody.block(
        length=0.08, height=0.08, width=0.2, density=7800.0, position=(crank_length + 0.45, 0.0)
    )
    return fb.Mechanism(
        bodies={"crank": crank, "link": link, "slider": slider},
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("link.start", "crank.end"),
            "C": fb.Revolute("slider", "link.end"),
            "guide": fb.Prismatic("slider", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: 4 * np.pi * t),
        },
        loads={"spring": fb.Spring("slider", (2.0, 0.0), spring_stiffness)},
        sensors={
            "F": fb.Reaction("A"),
            "crank": fb.Position("crank"),
            "slider": fb.Position("slider"),
        },
    )


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
    """Return milliseconds a sample."""
    begin = time.perf_counter()
    fb.simulate(model, duration=DURATION, step=STEP, threads=threads)
    return 1e3 * (time.perf_counter() - begin) / samples


def peer_time(pool, rows: np.ndarray, processes: int, setting: str) -> float:
    """Return milliseconds a sample of Exudyn, all processes at work at once."""
    jobs = [(part, DURATION, STEP, setting) for part in np.array_split(rows, processes)]
    return 1e3 * sum(pool.starmap(peer.seconds, jobs, chunksize=1)) / len(rows) / processes


def agreement() -> list[str]:
    """Return how far the two programs are apart in positions and, at ρ∞ = 0.5, in reactions."""
    row = parameters(1)[0]
    ours = fb.simulate(
        slider_crank(*row),
        duration=DURATION,
        step=STEP,
        integrator=fb.GeneralizedAlpha(spectral_radius=0.5),
    )
    theirs = peer.motion(row, DURATION, STEP, 0.5)
    theirs["F"] = -theirs["F"]  # on the ground rather than on the crank
    notes = []
    for name in ("crank", "slider"):
        found = ours.sel(output=[f"{name}_X", f"{name}_Y"]).values.T
        off = np.abs(found - theirs[name]).max()
        notes.append(f"largest difference in the {name}'s position: {off:.1e} m (allowed 1e-4)")
    for k, axis in enumerate("XY"):
        found, exact = ours.sel(output=f"F_{axis}").values, theirs["F"][:, k]
        off = 100 * np.abs(found - exact).sum() / np.abs(exact).sum()
        notes.append(f"∫|Δ|dt / ∫|F|dt of F_{axis} at A: {off:.3f} % (allowed 0.2 %)")
    return notes


def main() -> None:
    chosen, cores = options(__doc__, 2048), available_cores()
    rows = parameters(chosen.samples)
    model, few = slider_crank(*rows.T), rows[: max(cores, chosen.samples // 32)]
    own_time(slider_crank(*rows[0]), 1, 1)  # compile
    cases = {
        f"flexband, {cores} threads": partial(own_time, model, len(rows), cores),
        "flexband, 1 thread": partial(own_time, model, len(rows), 1),
    }
    notes = [f"{len(rows)} samples of {round(DURATION / STEP)} steps; medians of alternating runs"]
    if not peer.AVAILABLE:
        measured = alternate(cases, chosen.repeats)
        notes.append("Exudyn is not installed: its rows are left out")
    else:
        with multiprocessing.get_context("spawn").Pool(cores) as pool:
            for setting in peer.SETTINGS:
                name = f"Exudyn, {setting}, {cores} processes"
                cases[name] = partial(peer_time, pool, few, cores, setting)
            peer_time(pool, few, cores, next(iter(peer.SETTINGS)))  # import and warm up
            measured = alternate(cases, chosen.repeats)
        notes += [f"Exudyn: {len(few)} of the samples, time in its solver only", *agreement()]
    middle = medians(measured)
    peers = {k: v for k, v in middle.items() if k.startswith("Exudyn")}
    baseline = min(peers.values()) if peers else middle["flexband, 1 thread"]
    what = "fastest Exudyn" if peers else "one thread"
    report(
        chosen.output,
        "engine",
        ["case", "ms a sample", f"throughput, {what} = 1"],
        [[name, f"{ms:.3f}", f"{baseline / ms:.2f}"] for name, ms in middle.items()],
        measured,
        notes,
    )


if __name__ == "__main__":
    main()
