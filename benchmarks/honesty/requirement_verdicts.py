"""Verdicts on requirements of random mechanisms, judged by brute force: vertices and samples.

The runs that judge have a converged discretization and more output times, since the study corrects
the error of its own and looks between its times.

``python -m benchmarks.honesty.requirement_verdicts --cases 40 --seed 7`` writes one line per case
into a file, and goes on where it was stopped; then it prints the rates.
"""

from __future__ import annotations

import argparse
import json
import warnings
from functools import partial
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import flexband as fb
from benchmarks.honesty import mechanisms

FAMILIES: dict[str, tuple[Any, dict[str, float], float]] = {
    "slider_crank": (
        mechanisms.slider_crank,
        {"crank": 0.1, "rod": 0.4, "stiffness": 400.0, "friction": 8.0, "load": 1.5, "speed": 12.0},
        0.5,
    ),
    "quick_return": (
        mechanisms.quick_return,
        {"crank": 0.1, "pivot": 0.25, "friction": 20.0, "load": 2.0, "speed": 8.0},
        0.5,
    ),
    "four_bar": (
        mechanisms.four_bar,
        {"crank": 0.08, "coupler": 0.3, "rocker": 0.2, "ground": 0.32, "stiffness": 2.0,
         "friction": 0.1, "speed": 10.0},
        0.5,
    ),
    "pendulum": (
        mechanisms.pendulum,
        {"upper": 0.4, "lower": 0.3, "weight": 1.0, "friction": 0.3, "angle": 0.6},
        1.0,
    ),
    "elastic_four_bar": (
        mechanisms.elastic_four_bar,
        {"crank": 0.08, "coupler": 0.3, "modulus": 2e9, "damping": 2e-3, "speed": 6.0},
        0.4,
    ),
}  # fmt: skip
"""Builder, nominal parameters, and duration [s]."""

TOLERANCE = 0.01
SAMPLES = 200


def case(seed: int, number: int) -> dict[str, Any]:
    """Return the verdicts on six requirements of one random mechanism, with true margins."""
    # Draw a mechanism with tolerances.
    rng = np.random.default_rng([seed, number])
    name = list(FAMILIES)[number % len(FAMILIES)]
    builder, nominal, duration = FAMILIES[name]
    values = {k: v * rng.uniform(0.92, 1.08) for k, v in nominal.items()}
    uncertain_names = rng.choice(
        list(values), rng.integers(2, min(5, len(values)) + 1), replace=False
    )
    inputs = {
        k: fb.Interval(v * (1 - t), v * (1 + t)) if k in uncertain_names else v
        for k, v in values.items()
        for t in [10 ** rng.uniform(-2.7, -1.7)]
    }
    inputs = dict(sorted(inputs.items()))
    times = {"duration": duration, "output_step": 2e-3}
    response = fb.dynamic_response(builder, **times)
    study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=TOLERANCE))
    # Run all vertices and samples with fine steps.
    fine_builder = partial(builder, elements=8) if name.startswith("elastic") else builder
    step = 5e-5 if fine_builder is not builder else 2.5e-4
    fine_times = {"duration": duration, "output_step": 5e-4}  # a verdict is about all times
    brute = _brute_force(fb.dynamic_response(fine_builder, step=step, **fine_times), inputs, rng)
    # Draw limits near the extremes.
    requirements = []
    true_margins = []
    width = (brute.max("sample") - brute.min("sample")).mean("time")
    varying_outputs = brute["output"].values[
        width.values > 1e-9 * np.abs(brute).max(["sample", "time"])
    ]
    outputs = rng.choice(varying_outputs, min(3, len(varying_outputs)), replace=False)
    for output in outputs.tolist():
        runs = brute.sel(output=output)
        for side in ("below", "above"):
            part = float(rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-2.5, 0.0))
            size = part * float(width.sel(output=output))
            bound = float(runs.max()) + size if side == "below" else float(runs.min()) - size
            requirements.append(fb.Requirement(f"{output} {side}", output, **{side: bound}))
            true_margins.append(part)
    # Let a study judge them.
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        options = fb.RunOptions(failed="half step")
        result = fb.Study(response, inputs, study.method, requirements=requirements).run_in(
            folder, options
        )
    verdicts = [
        {"name": v.name, "verdict": str(v.verdict), "reason": str(v.reason), "true": true}
        for v, true in zip(result.verdicts, true_margins, strict=True)
    ]
    return {
        "seed": seed, "case": number, "family": name, "tolerances": len(uncertain_names),
        "runs": result.runs, "error": result.bands.attrs.get("expected_error"),
        "doubts": [str(doubt.kind) for doubt in result.doubts], "verdicts": verdicts,
        "unchecked": result.limits_unchecked,
    }  # fmt: skip


def _brute_force(response: Any, inputs: dict[str, Any], rng: np.random.Generator) -> Any:
    """Return runs at all vertices and at random places of the tolerances."""
    names = [k for k, v in inputs.items() if isinstance(v, fb.Interval)]
    vertices = np.array(list(product([-1.0, 1.0], repeat=len(names))))
    eta = np.concatenate([vertices, rng.uniform(-1, 1, (SAMPLES, len(names)))])
    values = {k: np.full(len(eta), v) for k, v in inputs.items() if k not in names}
    for column, name in enumerate(names):
        interval = inputs[name]
        middle = (interval.lower + interval.upper) / 2
        half = (interval.upper - interval.lower) / 2
        values[name] = middle + half * eta[:, column]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return response(**values)


def rates(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Return how many verdicts are contradicted, and how many of the clear ones are decided."""
    verdicts = [verdict for record in cases for verdict in record["verdicts"]]
    clear_verdicts = [v for v in verdicts if abs(v["true"]) > 2 * TOLERANCE]
    decided_verdicts = [v for v in clear_verdicts if v["verdict"] != "UNDECIDED"]
    return {
        "cases": len(cases),
        "requirements": len(verdicts),
        "PASS": sum(v["verdict"] == "PASS" for v in verdicts),
        "PASS contradicted": sum(v["verdict"] == "PASS" and v["true"] < 0 for v in verdicts),
        "FAIL": sum(v["verdict"] == "FAIL" for v in verdicts),
        "FAIL contradicted": sum(v["verdict"] == "FAIL" and v["true"] > 0 for v in verdicts),
        "clear": len(clear_verdicts),
        "clear and decided": len(decided_verdicts),
        "share decided": round(len(decided_verdicts) / max(1, len(clear_verdicts)), 4),
    }


def main() -> None:
    """Judge cases that are not in the file yet, and print the rates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--file", type=Path, default=Path("output/requirement_verdicts.jsonl"))
    options = parser.parse_args()
    options.file.parent.mkdir(parents=True, exist_ok=True)
    lines = options.file.read_text().splitlines() if options.file.exists() else []
    records = [json.loads(line) for line in lines]
    records = [record for record in records if record["seed"] == options.seed]
    case_numbers = {record["case"] for record in records}
    for number in range(options.cases):
        if number not in case_numbers:
            records.append(case(options.seed, number))
            with options.file.open("a") as file:
                file.write(json.dumps(records[-1]) + "\n")
    print(json.dumps(rates(records), indent=1))


if __name__ == "__main__":
    main()
