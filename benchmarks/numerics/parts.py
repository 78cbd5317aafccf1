"""Distributions of peaks and counts past the horizon of predictability, by an independent program.

The slider's pin of examples/worn_pin.py has a clearance of 0.5 mm ± 10 %, and the slider's mass
scatters too. Three turns are sampled by `sample_parts`, and with other samples by worn_pin.py,
which shares neither equations nor integrator with the engine. Numbers of single parts differ, as
their motions do; distributions must not. They are compared by the test of Kolmogorov and Smirnov at
1 %, and every quantile of the reference with its interval in the other samples.

    python -m benchmarks.numerics.parts --samples 2000
"""

from __future__ import annotations

import runpy
import tempfile
import time
import warnings
from dataclasses import replace

import numpy as np
from scipy.stats import ks_2samp

import flexband as fb
from benchmarks.harness import ROOT, options, report
from benchmarks.numerics import worn_pin

EXAMPLE = runpy.run_path(str(ROOT / "examples" / "worn_pin.py"))
INPUTS = {"clearance": fb.Interval(0.45e-3, 0.55e-3), "mass": fb.Interval(0.13, 0.15)}
NUMBERS = {
    "impacts": "all_number",
    "largest force": "all_force",
    "largest force later": "late_force",
}
ALLOWED = 0.01


def engine(clearance: np.ndarray, mass: np.ndarray) -> fb.Mechanism:
    """Return the mechanism, with sensors over the whole run and after the first turn."""
    model = EXAMPLE["engine"](clearance)
    slider = fb.PointMass(mass=mass, position=(worn_pin.CRANK + worn_pin.ROD, 0.0))
    sensors = {
        "all": fb.contact.Contacts("pin", first=0),
        "late": fb.contact.Contacts("pin", first=0, window=(worn_pin.LATE, worn_pin.END)),
    }
    return replace(model, bodies={**model.bodies, "slider": slider}, sensors=sensors)


def main() -> None:
    arguments = options(
        __doc__, 2000, tolerance=(1e-6, "of the engine's steps"), seed=(1, "of both")
    )
    response = fb.dynamic_response(
        engine,
        duration=worn_pin.END,
        step=1.2e-3,
        integrator=fb.GeneralizedAlpha(step_tolerance=arguments.tolerance),
    )
    # Sample parts by the engine.
    quantities = {name: fb.analysis.Final(output) for name, output in NUMBERS.items()}
    warnings.simplefilter("ignore", fb.errors.FlexbandWarning)
    start_time = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        parts = fb.analysis.sample_parts(
            response,
            INPUTS,
            quantities=quantities,
            samples=arguments.samples,
            seed=arguments.seed,
            store=folder,
        )
        runs = fb.execution.open_runs(folder)["outputs"].isel(time=-1).load()
    cpu = time.process_time() - start_time

    # Sample other parts by the independent program.
    rng = np.random.default_rng(1000 + arguments.seed)
    points = [rng.uniform(i.lower, i.upper, arguments.samples) for i in INPUTS.values()]
    reference = np.empty((arguments.samples, 3))
    start_time = time.process_time()
    worn_pin.samples(*points, reference)
    cpu_of_reference = time.process_time() - start_time

    # Compare the distributions.
    rows = []
    measurements = {}
    agreement = True
    for (name, output), exact in zip(NUMBERS.items(), reference.T, strict=True):
        test = ks_2samp(runs.sel(output=output).values, exact)
        agreement &= bool(test.pvalue >= ALLOWED)
        for p in parts["probability"].values:
            quantile_row = parts.sel(quantity=name, probability=p)
            value, low, high = (
                float(quantile_row[k]) for k in ("quantile", "quantile_low", "quantile_high")
            )
            other = float(np.quantile(exact, p, method="inverted_cdf"))
            row = [name, f"{100 * p:g} %", f"{value:.6g}", f"{low:.6g} to {high:.6g}"]
            rows.append([*row, f"{other:.6g}", f"{test.pvalue:.2f}"])
            measurements[f"{name} {p}"] = [value, low, high, other, test.pvalue]
    report(
        arguments.output,
        "parts",
        ["number", "quantile", "flexband", "95 % interval", "independent program", "KS: p"],
        rows,
        measurements,
        [
            f"{arguments.samples} samples of each; tolerance {arguments.tolerance:g}",
            f"CPU {cpu:.0f} s; of the independent program {cpu_of_reference:.0f} s",
            f"two-sample tests at {100 * ALLOWED:g} % {'agree' if agreement else 'DO NOT agree'}",
        ],
    )
    if not agreement:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
