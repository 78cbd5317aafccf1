"""Verdicts of `verify` on the responses of `honesty.py`: false alarms, and errors that are found.

Every case is verified with the expected error of the method, and again with expected errors that
are made smaller, until the true error is 6, 10 and 20 times as large.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.honesty.cases import FAMILIES, draw
from benchmarks.honesty.honesty import cases
from benchmarks.honesty.problems import Case
from benchmarks.honesty.rates import LEAST, errors

FACTORS = (6, 10, 20)
"""How many times the true error is larger than expected errors that are made smaller."""

VISIBLE = 1e-3
"""Of the width: errors above this are expected to be found."""

NAMES = ("error_bar_expansion_error", "error_bar_expected_error")


def verdicts(case: Case, method: fb.AdaptivePCCI, runs: int) -> tuple[float, bool, dict[int, bool]]:
    """Return the ratio of true and expected error, whether that is confirmed, and smaller ones."""
    surrogate = fb.expand(case.response, case.inputs, method)
    true, claim = errors(surrogate.bands(), case.reference(1))
    true = true.mean(axis=-1).max(axis=0)
    claim = claim[1].mean(axis=-1)
    ratio = float((true / np.maximum(claim, LEAST)).max())

    def is_confirmed(part: float) -> bool:
        diagnostics = surrogate.diagnostics
        diagnostics = diagnostics.assign({name: diagnostics[name] * part for name in NAMES})
        scaled_surrogate = replace(surrogate, diagnostics=diagnostics)
        return (
            fb.verify(scaled_surrogate, case.response, runs=runs).verification.attrs["confirmed"]
            == "yes"
        )

    smaller = {k: ratio / k for k in FACTORS if ratio < k and true.max() > VISIBLE}
    return ratio, is_confirmed(1.0), {k: is_confirmed(part) for k, part in smaller.items()}


def main() -> None:
    arguments = options(
        __doc__,
        80,
        seed=(0, "first seed"),
        families=("", "families separated by commas; all without"),
        max_runs=(200, "budget of the method"),
        runs=(16, "new runs"),
    )
    warnings.simplefilter("ignore")
    families = [name for name in arguments.families.split(",") if name] or list(FAMILIES)
    case_names = cases(families, arguments.samples, arguments.seed)
    method = fb.AdaptivePCCI(0.01, arguments.max_runs)
    results = [verdicts(draw(*case_name), method, arguments.runs) for case_name in case_names]
    kinds = {
        "right: true error at most as expected": [not ok for r, ok, _ in results if r <= 1],
        "true error 1 to 5 times as expected": [not ok for r, ok, _ in results if 1 < r <= 5],
        "true error more than 5 times as expected": [not ok for r, ok, _ in results if r > 5],
    }
    for k in FACTORS:
        kinds[f"made {k} times too small"] = [
            not confirmations[k] for *_, confirmations in results if k in confirmations
        ]
    rows = [[name, str(len(flags)), str(sum(flags))] for name, flags in kinds.items()]
    measurements = {name: [int(v) for v in flags] for name, flags in kinds.items()}
    header = ["expected error", "cases", "not confirmed"]
    report(arguments.output, "verification", header, rows, measurements, [])


if __name__ == "__main__":
    main()
