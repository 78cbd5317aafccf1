"""Cost of expansions: improved PCCI (3, 3) compared with its runs, and bounds of oscillations.

Improved PCCI uses 256 runs of the slider–crank with 601 times and 10 outputs. chaospy, which has no
bounds over intervals, fits the same data and computes its moments with all four inputs as random
variables.

Phase-resolved bounds are computed for cos ωt at 10 000 times in 200 periods, and for a surrogate
with five interval and five random variables, 600 times and 3 outputs. For comparison, the second
surrogate is sampled at 32 points η with 512 points ξ each, about 1 % of what bounds would require.
"""

from __future__ import annotations

import runpy
import time
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.accuracy.formulas import FORMULA_INPUTS, wave
from benchmarks.harness import ROOT, alternate, medians, options, report
from flexband.uncertainty.expansions.expansion import SIGMAS
from flexband.uncertainty.expansions.families import HERMITE
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.phases.expansion import PhaseExpansion
from flexband.uncertainty.phases.layout import PartColumns

DURATION = 0.6
STEP = 1e-3
ORDER = 3
EXAMPLE = runpy.run_path(str(ROOT / "examples" / "paper" / "slider_crank.py"))
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
    """Return a function that times chaospy's fit, mean and standard deviation."""
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


def long_phase(times: int):
    """Return a function that times the propagation of cos ωt over 200 periods, orders (1, 1)."""
    t = np.linspace(0.0, 200.0, times)

    def response(x, e):
        values = wave(x[:, None], e[:, None], t)
        return xr.DataArray(values, dims=("sample", "time"), coords={"time": t})

    return lambda: seconds(
        fb.propagate, response, FORMULA_INPUTS, fb.methods.PhaseResolvedPCCI(1, 1)
    )


def many_inputs(times: int) -> PhaseExpansion:
    """Return a surrogate of 5 η, 5 ξ and 3 outputs; two η and two ξ change the only phase."""
    r = np.random.default_rng(0)
    t = np.linspace(0.0, 1.0, times)
    product_orders = [np.eye(10)[[a, b]].sum(axis=0) for a, b in ((0, 5), (1, 6), (2, 8), (3, 4))]
    index = np.array([np.zeros(10), *np.eye(10), *2 * np.eye(10), *product_orders]).astype(int)
    size = np.array([1.0, 0.15, 0.02])[index.sum(axis=1)][:, None, None]
    phase_mask = index @ np.isin(np.arange(10), (0, 1, 5, 6)) == index.sum(axis=1)
    rate = (
        np.array([125.0, 5.0, 0.15])[index.sum(axis=1)] * phase_mask * r.uniform(0.5, 1, len(index))
    )
    base, re, im = (
        (size * r.standard_normal((len(index), 3, 1)) * np.cos(r.uniform(1, 3) * t)).reshape(
            len(index), -1
        )
        for _ in range(3)
    )
    terms = np.concatenate([base, rate[:, None] * t, re, im], axis=1)
    parts = HybridExpansion((HERMITE,) * 5, index, terms)
    return PhaseExpansion(np.arange(3), parts, PartColumns.from_outputs(3, 1))


def sample_moments(surrogate: PhaseExpansion) -> None:
    """Compute moments of a surrogate from samples at 32 points η × 512 points ξ."""
    r = np.random.default_rng(0)
    for eta in r.uniform(-1, 1, (32, 5)):
        F = surrogate.evaluate(r.standard_normal((512, 5)), np.tile(eta, (512, 1)))
        F.mean(axis=0), F.std(axis=0)


def main() -> None:
    arguments = options(__doc__, 256)
    order = ORDER if arguments.samples >= 256 else 1
    # Record the runs of improved PCCI.
    response = fb.dynamic_response(slider_crank, duration=DURATION, step=STEP)
    inputs = EXAMPLE["inputs"]
    method = fb.ImprovedPCCI(random_order=order, interval_order=order)
    calls = []

    def record_call(**values):
        calls.append((values, response(**values)))
        return calls[-1][1]

    fb.propagate(record_call, inputs, method)  # also compiles
    values, runs = calls[0]

    def look_up(**values):
        """Return the recorded runs; the one that is repeated as a check is simulated."""
        count = max(len(value) for value in values.values() if isinstance(value, np.ndarray))
        return runs if count == len(runs) else response(**values)

    cases = {
        "simulations": lambda: seconds(response, **values),
        "flexband: fit, moments, bounds": lambda: seconds(fb.propagate, look_up, inputs, method),
    }
    # Surrogates of oscillations.
    full_size = arguments.samples >= 256
    phase_resolved = long_phase(10_000 if full_size else 2_000)
    wide_surrogate = many_inputs(600 if full_size else 24)
    phase_resolved()
    wide_surrogate.extremes(SIGMAS)
    cases |= {
        "phase-resolved, 200 periods": phase_resolved,
        "phase-resolved bounds, 5 + 5 inputs": lambda: seconds(wide_surrogate.extremes, SIGMAS),
        "the same surrogate, sampled 32 × 512 times": lambda: seconds(
            sample_moments, wide_surrogate
        ),
    }
    # Compare with chaospy, if it is there.
    notes = [f"{runs.shape[0]} runs, {runs.sizes['time']} times, {runs.sizes['output']} outputs"]
    if find_spec("chaospy") is None:
        notes.append("chaospy is not installed: its row is omitted")
    elif order < ORDER:
        notes.append("the size is too small for chaospy's row")
    else:
        cases["chaospy: regression, mean, standard deviation"] = chaospy_case(runs.values)
    measurements = alternate(cases, arguments.repeats)
    middle = medians(measurements)
    report(
        arguments.output,
        "bounds",
        ["case", "ms", "relative to the simulations"],
        [[n, f"{1e3 * s:.1f}", f"{s / middle['simulations']:.2f}"] for n, s in middle.items()],
        measurements,
        notes,
    )


if __name__ == "__main__":
    main()
