"""What the expansion costs next to the runs: fit, moments and bounds of improved PCCI at (3, 3).

256 runs of the slider–crank, 601 times, 10 outputs. chaospy fits and takes moments of the same data
with all four inputs as random variables: that is what it offers, it has no bounds over intervals.
"""

from __future__ import annotations

import runpy
import time
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
from harness import ROOT, alternate, medians, options, report

import flexband as fb

DURATION, STEP, ORDER = 0.6, 1e-3, 3
EXAMPLE = runpy.run_path(str(ROOT / "examples" / "slider_crank.py"))
SENSORS = {
    "F": fb.Reaction("A"),
    "B": fb.Reaction("B"),
    "C": fb.Reaction("C"),
    "slider": fb.Position("slider"),
    "middle": fb.Position("link.middle"),
}


def slider_crank(**parameters) -> fb.Mechanism:
    """Return the mechanism of the example with ten outputs."""
    return replace(EXAMPLE["slider_crank"](**parameters), sensors=SENSORS)


def seconds(action, *arguments, **options_) -> float:
    begin = time.perf_counter()
    action(*arguments, **options_)
    return time.perf_counter() - begin


def chaospy_case(runs: np.ndarray):
    """Return a function that fits and takes mean and standard deviation with chaospy."""
    import chaospy as cp  # noqa: PLC0415

    joint = cp.J(cp.Normal(0, 1), cp.Normal(0, 1), cp.Uniform(-1, 1), cp.Uniform(-1, 1))
    expansion = cp.generate_expansion(ORDER, joint, cross_truncation=np.inf)
    nodes, _ = cp.generate_quadrature(ORDER, joint, rule="gaussian")
    data = runs.reshape(len(runs), -1)

    def case() -> float:
        begin = time.perf_counter()
        fitted = cp.fit_regression(expansion, nodes, data)
        cp.E(fitted, joint)
        cp.Std(fitted, joint)
        return time.perf_counter() - begin

    return case


def main() -> None:
    chosen = options(__doc__, 256)
    order = ORDER if chosen.samples >= 256 else 1
    response = fb.dynamic_response(slider_crank, duration=DURATION, step=STEP)
    inputs = EXAMPLE["inputs"]
    method = fb.ImprovedPCCI(random_order=order, interval_order=order)
    kept = []

    def keeping(**values):
        kept.append((values, response(**values)))
        return kept[-1][1]

    fb.propagate(keeping, inputs, method)  # also compiles
    values, runs = kept[0]
    cases = {
        "simulations": lambda: seconds(response, **values),
        "flexband: fit, moments, bounds": lambda: seconds(
            fb.propagate, lambda **_: runs, inputs, method
        ),
    }
    notes = [f"{runs.shape[0]} runs, {runs.sizes['time']} times, {runs.sizes['output']} outputs"]
    if find_spec("chaospy") is None:
        notes.append("chaospy is not installed: its row is left out")
    elif order < ORDER:
        notes.append("too small for chaospy's row")
    else:
        cases["chaospy: regression, mean, standard deviation"] = chaospy_case(runs.values)
    measured = alternate(cases, chosen.repeats)
    middle = medians(measured)
    report(
        chosen.output,
        "bounds",
        ["case", "ms", "simulations = 1"],
        [[n, f"{1e3 * s:.1f}", f"{s / middle['simulations']:.2f}"] for n, s in middle.items()],
        measured,
        notes,
    )


if __name__ == "__main__":
    main()
