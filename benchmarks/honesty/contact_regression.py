"""Two expansions of mechanisms with contacts: `AdaptivePCCI`, and `RegressionPCCI` of as many runs.

Mechanisms and references are those of `contact_claims`, without requirements.

    python -m benchmarks.honesty.contact_regression --seed 1432 --samples 28
"""

from __future__ import annotations

import math
import warnings

import numpy as np

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.honesty.contact_claims import TOLERANCE, draw, varying_outputs
from benchmarks.honesty.rates import errors

HEADER = ["seed", "family", "runs", "true error [%]", "order", "runs", "true error [%]"]


def order_for(runs: int, variables: int) -> int:
    """Return the largest total order whose terms are at most half as many as runs."""
    orders = range(60)
    return max(p for p in orders if 2 * math.comb(variables + p, variables) <= max(runs, 2))


def compare_expansions(seed: int) -> list[object]:
    """Return the line of a mechanism; errors are in parts of the width, over all outputs."""
    mechanism, _ = draw(seed)
    (reference, _), units = mechanism.references()
    varying = varying_outputs(reference, units.values)
    if not len(varying):
        return []
    mean, bar = (band[:, varying] for band in reference.bands())
    line: list[object] = [seed, mechanism.family]
    adaptive = fb.AdaptivePCCI(TOLERANCE, correct=False)
    bands = fb.propagate(mechanism.response, mechanism.inputs, adaptive)
    order = order_for(
        bands.attrs["runs_fitted"] + bands.attrs["runs_checked"], len(mechanism.inputs)
    )
    regression = fb.propagate(
        mechanism.response, mechanism.inputs, fb.methods.RegressionPCCI(order)
    )
    for k, result in enumerate((bands, regression)):
        error = float(errors(result.isel(output=varying), (mean, bar))[0].mean(axis=-1).max())
        line += [order] * k + [result.attrs["runs"], 100 * error]
    return line


def main() -> None:
    arguments = options(__doc__, 28, seed=(1432, "first seed"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        seeds = range(arguments.seed, arguments.seed + arguments.samples)
        rows = [line for line in map(compare_expansions, seeds) if line]
    ratios = np.array([float(str(row[6])) / float(str(row[3])) for row in rows])
    counts = [(ratios < 1 / 3).sum(), ((ratios >= 1 / 3) & (ratios <= 3)).sum(), (ratios > 3).sum()]
    note = "errors of the regression are less than a third, within 3 times, above 3 times: "
    table_rows = [[f"{v:.2g}" if isinstance(v, float) else str(v) for v in row] for row in rows]
    notes = [note + ", ".join(map(str, counts))]
    report(
        arguments.output,
        "contact_regression",
        HEADER,
        table_rows,
        {"ratios": ratios.tolist()},
        notes,
    )


if __name__ == "__main__":
    main()
