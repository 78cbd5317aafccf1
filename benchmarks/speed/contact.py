"""Speed of contact: a worn pin, and the fixed step that is as accurate.

The slider–crank of examples/worn_pin.py makes three turns with clearances from 0.1 to 0.5 mm. The
instants of the first three impacts are compared with those of a much smaller tolerance. With fixed
steps the pin is a force law without damping, because such a law does not know the speed with which
a contact began; its steps are shortened until their error is that of chosen ones.

If Exudyn is there, a mass that hits a stop is compared with its contact, see `peer_contact`.
"""

from __future__ import annotations

import runpy
import time
import warnings
from dataclasses import replace

import numpy as np

import flexband as fb
from benchmarks.harness import ROOT, options, report
from benchmarks.speed import peer_contact
from benchmarks.speed import peer_exudyn as peer
from flexband.basics.cores import available_cores
from flexband.mechanics.assembly.packing import pack
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.engine.batch import begin, march_block
from flexband.mechanics.engine.newton import NEWTON
from flexband.mechanics.kernels.lane_arrays import WIDTH

EXAMPLE = runpy.run_path(str(ROOT / "examples" / "worn_pin.py"))
TURNS = 0.036
STEP = 1.2e-3
FIRST = 1.2e-3  # s: three turns, times of the result, three impacts
INSTANTS = ["impacts_t1", "impacts_t2", "impacts_t3"]
ELASTIC = replace(EXAMPLE["PIN"], restitution=1.0)


def worn_pin(clearances: np.ndarray, law: fb.contact.NormalLaw) -> fb.Mechanism:
    """Return the mechanism of the example with these clearances [m], and the impacts alone."""
    model = EXAMPLE["engine"](clearances)
    joints = dict(model.joints) | {"pin": replace(model.joints["pin"], law=law)}
    return replace(model, joints=joints, sensors={"impacts": model.sensors["impacts"]})


def run_adaptive(
    clearances, law, duration, tolerance, threads=1
) -> tuple[np.ndarray, float, float]:
    """Return instants (samples, 3) [s], and CPU and wall seconds, with steps that are chosen."""
    model = worn_pin(clearances, law)
    cpu = time.process_time()
    wall = time.perf_counter()
    motion = fb.simulate(
        model, duration=duration, step=STEP if duration > STEP else STEP / 4, threads=threads,
        integrator=fb.GeneralizedAlpha(step_tolerance=tolerance),
    )  # fmt: skip
    instants = motion.isel(time=-1).sel(output=INSTANTS).values
    return instants, time.process_time() - cpu, time.perf_counter() - wall


def work(clearances: np.ndarray, law: fb.contact.NormalLaw, tolerance: float) -> np.ndarray:
    """Return steps of a sample, and Newton iterations and factorizations of a block."""
    system = assemble(worn_pin(clearances, law))
    times = np.arange(round(TURNS / STEP) + 1) * STEP
    integrator = fb.GeneralizedAlpha(step_tolerance=tolerance)
    limits = integrator.step_limits(system.structure.state, STEP)
    packed = pack(system, times, None, tolerance)
    counts = []
    method = integrator.coefficients(STEP)._replace(matrices=NEWTON.factorizations)
    for block in range(len(clearances) // WIDTH):
        values = packed(block)
        initial_state = begin(system, values)
        rounds = len(packed.schedule.parts)
        result = march_block(
            system,
            method,
            integrator.tolerance,
            values,
            rounds,
            limits=limits,
            block_start=initial_state,
        )
        counts.append(result.work.counts.mean(axis=1))
    return np.mean(counts, axis=0)


def elastic(t, x, v, p, force):
    """Fill in the forces of a pin in its hole, K δ^1.5; the parameters are K and the clearance."""
    dx = x[0, 0] - x[1, 0]
    dy = x[0, 1] - x[1, 1]
    distance = np.sqrt(dx * dx + dy * dy)
    depth = distance - p[1]
    if depth > 0.0:
        force[0, 0] = -p[0] * depth**1.5 * dx / distance
        force[0, 1] = -p[0] * depth**1.5 * dy / distance
        force[1, 0], force[1, 1] = -force[0, 0], -force[0, 1]


def run_fixed(clearances: np.ndarray, step: float) -> np.ndarray:
    """Return instants (samples, 3) [s] with steps of this length [s]."""
    sensors = {"pin": fb.Position("rod.pin"), "slider": fb.Position("slider")}
    motion = fb.simulate(replace(by_hand(clearances), sensors=sensors), duration=FIRST, step=step)
    place = [motion.sel(output=name).values for name in ("pin_X", "slider_X", "pin_Y", "slider_Y")]
    gap = clearances[:, None] - np.hypot(place[0] - place[1], place[2] - place[3])
    instants = np.empty((len(clearances), 3))
    for sample, row in enumerate(gap):
        closing = np.flatnonzero((row[:-1] > 0) & (row[1:] <= 0))[:3]
        before = row[closing]
        after = row[closing + 1]
        instants[sample] = (closing + before / (before - after)) * step
    return instants


def by_hand(clearances: np.ndarray) -> fb.Mechanism:
    """Return the mechanism with a pin that is a force law."""
    model = worn_pin(clearances, ELASTIC)
    joints = {name: joint for name, joint in model.joints.items() if name != "pin"}
    law = fb.ForceLaw(["rod.pin", "slider"], elastic, (ELASTIC.stiffness, clearances))
    return replace(model, joints=joints, loads={"pin": law}, sensors={"x": fb.Position("slider")})


def cost_of_fixed(clearances: np.ndarray, step: float) -> float:
    """Return CPU seconds of three turns with steps of this length [s]."""
    model = by_hand(clearances)
    before = time.process_time()
    fb.simulate(model, duration=TURNS, step=STEP, substeps=round(STEP / step), threads=1)
    return time.process_time() - before


def error(instants: np.ndarray, exact: np.ndarray) -> float:
    """Return the largest relative error of an instant."""
    return float(np.abs(instants / exact - 1).max())


def main() -> None:
    arguments = options(__doc__, 128, tolerance=(1e-6, "of the chosen steps"))
    tolerance = arguments.tolerance
    cores = available_cores()
    clearances = np.random.default_rng(0).uniform(1e-4, 5e-4, arguments.samples)
    subset = clearances[: 4 * WIDTH]
    law = EXAMPLE["PIN"]
    warnings.simplefilter("ignore", fb.errors.FlexbandWarning)
    run_adaptive(subset, law, FIRST, 1e-6)  # compile
    run_fixed(subset, 1e-5)

    # Measure the chosen steps and their errors.
    instants, cpu, wall = run_adaptive(clearances, law, TURNS, tolerance, cores)
    exact = run_adaptive(subset, law, FIRST, 1e-11)[0]
    half = run_adaptive(subset, law, TURNS, tolerance / 2)[0]
    subset_instants = instants[: len(subset)]
    error_of_all = error(subset_instants, exact)
    change = error(half, subset_instants)
    steps, iterations, matrices = work(subset, law, tolerance)
    steps_of_elastic = work(subset, ELASTIC, tolerance)[0]

    elastic_instants = run_adaptive(subset, ELASTIC, FIRST, 1e-11)[0]
    of_elastic, cpu_elastic, _ = run_adaptive(subset, ELASTIC, TURNS, tolerance)
    limit = error(of_elastic, elastic_instants)
    # Find the fixed step that is as accurate.
    step = STEP
    fixed_error = np.inf
    for parts in (150, 200, 240, 300, 400, 480, 600, 800, 1200, 2400, 4800):
        if fixed_error > limit:
            step = STEP / parts
            fixed_error = error(run_fixed(subset, step), elastic_instants)
    cpu_fixed = cost_of_fixed(subset, step)

    # Report costs per sample.
    per_sample = 1e3 * cpu / len(clearances)
    elastic_cost = 1e3 * cpu_elastic / len(subset)
    fixed_cost = 1e3 * cpu_fixed / len(subset)
    count = round(TURNS / step)
    rows = [
        ["chosen steps, e = 0.9", per_sample, steps, error_of_all],
        ["chosen steps, e = 1", elastic_cost, steps_of_elastic, limit],
        [f"fixed steps of {step:.3g} s, e = 1", fixed_cost, count, fixed_error],
    ]
    report(
        arguments.output,
        "contact",
        ["case", "CPU ms per sample", "steps per sample", "error of the first three impacts"],
        [[name, f"{ms:.1f}", f"{n:.0f}", f"{100 * e:.4f} %"] for name, ms, n, e in rows],
        {"cpu": cpu, "wall": wall, "rows": rows, "change at half the tolerance": change},
        [
            f"{len(clearances)} samples, tolerance {tolerance:g}: {cpu:.1f} s of CPU, {wall:.1f} s "
            f"on {cores} cores; {len(subset)} of them checked",
            f"half of the tolerance changes their first three impacts by {100 * change:.4f} %",
            f"for a block of {WIDTH} samples {iterations:.0f} Newton iterations and {matrices:.0f} "
            f"factorizations, {iterations / steps:.2f} and {matrices / steps:.2f} per step of a "
            f"sample; {1e3 * per_sample / steps:.2f} µs per step",
            f"fixed steps take {fixed_cost / elastic_cost:.1f} × as long, "
            f"{1e3 * fixed_cost / count:.2f} µs per step",
        ],
    )
    # Compare with Exudyn, if it is there.
    if peer.AVAILABLE:
        comparison = peer_contact.compare(1024, arguments.repeats, 1e-5)
        report(
            arguments.output,
            "contact_exudyn",
            ["a mass, a spring and a stop", "CPU ms per sample", "error / interval of impacts"],
            [[name, f"{ms:.3f}", f"{100 * e:.4f} %"] for name, ms, e in comparison],
            {"rows": comparison},
        )


if __name__ == "__main__":
    main()
