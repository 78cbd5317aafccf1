"""Claims of studies whose samples choose their steps, judged by runs with much shorter steps.

Each seed draws a mechanism of `contact_mechanisms` with stops, clearances or friction, one
uncertain input, and a tolerance of steps, which one study in four leaves out. The reference are
runs on a grid of the inputs with a tolerance of 1e-10, as in `contact_claims`. Its own error is
what changes with every second point of the grid, or with a tolerance of 1e-9. Where that is more
than a tenth of the claim and of the true error, a study is left out, and counted.

    python -m benchmarks.honesty.step_tolerances --seed 1 --samples 300

goes on where it was stopped.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.honesty.contact_claims import UncertainMechanism, draw, judge_cases, varying_outputs
from benchmarks.honesty.problems import Bands
from benchmarks.honesty.rates import FACTOR, outcome, widths

MECHANISMS = 300
TOLERANCES = (None, 1e-6, 1e-5, 1e-4)
FINE = 1e-9
FINER = 1e-10
DIMENSIONS = [(0, 1), (1, 0)]
"""Numbers of random and interval inputs that are drawn."""


def with_tolerance(mechanism: UncertainMechanism, tolerance: float | None) -> UncertainMechanism:
    """Return the mechanism with a tolerance of its steps."""
    integrator = fb.GeneralizedAlpha(step_tolerance=tolerance)
    return replace(mechanism, response=replace(mechanism.response, integrator=integrator))


def largest_difference(first: Bands, second: Bands) -> float:
    """Return the largest difference of bands, mean over time, in parts of the width."""
    differences = [np.abs(a - b).mean(axis=(0, -1)) for a, b in zip(first, second, strict=True)]
    return float((np.max(differences, axis=0) / widths(first)).max())


def judge_mechanism(seed: int) -> dict[str, Any]:
    """Return what a study claims, and how far that is true; its failure if it fails."""
    tolerance = TOLERANCES[seed % len(TOLERANCES)]
    mechanism, _ = draw(1000 * (seed // len(TOLERANCES)) + seed % 997, dimensions=DIMENSIONS)
    about: dict[str, Any] = {"seed": seed, "family": mechanism.family, "tolerance": tolerance}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return about | _judge(mechanism, tolerance)
        except (fb.errors.InputError, fb.errors.RunError) as error:
            return about | {"failure": f"{type(error).__name__}: {error}"[:200]}


def _judge(mechanism: UncertainMechanism, tolerance: float | None) -> dict[str, Any]:
    (best, sparse), units = with_tolerance(mechanism, FINER).references()
    (fine, _), _ = with_tolerance(mechanism, FINE).references()
    outputs = varying_outputs(best, units.values)
    if not len(outputs):
        return {"failure": "no output depends on the inputs"}
    truth, *others = (
        tuple(band[:, outputs] for band in reference.bands()) for reference in (best, sparse, fine)
    )
    reference_error = max(largest_difference(truth, other) for other in others)
    response = with_tolerance(mechanism, tolerance).response
    bands = fb.propagate(response, mechanism.inputs, fb.AdaptivePCCI())
    del bands.attrs["expansion_error"]
    bands = bands.drop_vars(["mean_expansion_error", "error_bar_expansion_error"])
    result = outcome(mechanism.family, mechanism.seed, bands.isel(output=outputs), truth)
    return {
        "own": reference_error, "true": result.true, "claim": result.claim, "runs": result.runs,
        "halved": len(bands.attrs.get("halved", [])),
    }  # fmt: skip


def is_sure(case: dict[str, Any]) -> bool:
    """Return whether the reference can tell if a claim is right."""
    return case["own"] <= 0.1 * max(case["claim"], case["true"])


def row(name: str, cases: list[dict[str, Any]]) -> list[str]:
    """Return the line of a tolerance."""
    successes = [case for case in cases if "failure" not in case]
    sure_cases = [case for case in successes if is_sure(case)]
    small_claims = [case for case in sure_cases if case["true"] > FACTOR * case["claim"]]
    ratios = [case["claim"] / max(case["true"], 1e-12) for case in sure_cases]
    middles = [
        f"{np.median(values):.2g}" if values else ""
        for values in ([100 * case[key] for case in sure_cases] for key in ("true", "claim"))
    ]
    return [
        name, str(len(cases)), str(len(cases) - len(successes)),
        str(len(successes) - len(sure_cases)), str(len(small_claims)), *middles,
        f"{np.median(ratios):.2g}" if ratios else "",
    ]  # fmt: skip


HEADER = [
    "step tolerance", "mechanisms", "failed", "not sure", f"claims too small by {FACTOR:g}",
    "true error [%]", "claim [%]", "claim over true error",
]  # fmt: skip


def main() -> None:
    arguments = options(
        __doc__,
        MECHANISMS,
        seed=(1, "first seed; those of documented tables must not be looked at before"),
        file=("output/step_tolerances.jsonl", "one line for each mechanism that was judged"),
    )
    seeds = range(arguments.seed, arguments.seed + arguments.samples)
    cases = judge_cases(arguments.file, seeds, judge_mechanism)
    rows = [
        row("left out" if tolerance is None else f"{tolerance:g}", of_tolerance)
        for tolerance in TOLERANCES
        if (of_tolerance := [case for case in cases if case["tolerance"] == tolerance])
    ]
    rows.append(row("all", cases))
    notes = [
        f"seeds {seeds[0]} to {seeds[-1]}; errors and ratios are medians",
        *[f"failed: {c['seed']} {c['failure']}" for c in cases if "failure" in c],
    ]
    report(arguments.output, "step_tolerances", HEADER, rows, {"cases": cases}, notes)


if __name__ == "__main__":
    main()
