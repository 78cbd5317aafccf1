"""Claimed and true errors of the adaptive method on responses drawn from random families.

Every case is a response, its inputs and its converged bands, drawn from the name of a family and a
seed. True and claimed error are the largest of mean and error bar over all outputs, mean over time,
in parts of the mean width of the true error bar.

The method may be tuned to the seeds below 1 000 000. Tables in the documentation come from
`--seed 1000000` or higher, which must not be looked at while tuning.

`--case family:seed` shows one case in detail. `--orders 1,1/2,1` judges the phase-resolved method
with these orders of random and interval inputs, where its runs are within the budget. Cases with an
error of step and mesh, which it does not estimate, are left out.
"""

from __future__ import annotations

import csv
import multiprocessing
import os
import time
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.honesty.cases import FAMILIES, draw
from benchmarks.honesty.problems import Case
from benchmarks.honesty.rates import Outcome, errors, false, outcome, rates, right, too_small
from flexband.uncertainty.inputs.space import Space

JudgedMethod = fb.AdaptivePCCI | fb.methods.PhaseResolvedPCCI

CASES = 500
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def solve(trial: tuple[str, int, JudgedMethod]) -> Outcome:
    """Run a method on a case; one that fails becomes a failed outcome."""
    family, seed, method = trial
    case = draw(family, seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            begin = time.process_time()
            bands = fb.propagate(case.response, case.inputs, method)
            seconds = time.process_time() - begin
            return outcome(family, seed, comparable_bands(bands, case), case.reference(1), seconds)
        except Exception as error:
            return Outcome(family, seed, failure=f"{type(error).__name__}: {error}"[:200])


def comparable_bands(bands: xr.Dataset, case: Case) -> xr.Dataset:
    """Return bands with claims of the whole error where the truth has it, or of the expansion's."""
    if not case.exact_steps:
        part = bands["error_bar_expansion_error"] / bands["error_bar_expected_error"]
        return bands.assign(pointwise_error=bands["pointwise_error"] * part.fillna(1.0))
    del bands.attrs["expansion_error"]
    return bands.drop_vars(["mean_expansion_error", "error_bar_expansion_error"])


def outcomes(trials: Sequence[tuple[str, int, JudgedMethod]], jobs: int) -> Iterator[Outcome]:
    """Yield the outcomes of cases, computed by so many processes of one thread each."""
    os.environ.update(dict.fromkeys(THREADS, "1"))
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, context) as pool:
        yield from pool.map(solve, trials)


def cases(families: Sequence[str], count: int, seed: int) -> list[tuple[str, int]]:
    """Return so many cases, equally many of each family, with seeds from the given one on."""
    cases_per_family = -(-count // len(families))
    return [(name, seed + k) for name in families for k in range(cases_per_family)][:count]


def with_orders(
    selection: Sequence[tuple[str, int]], orders: str, max_runs: int
) -> Iterator[tuple[str, int, JudgedMethod]]:
    """Yield cases and the phase-resolved method with each of some orders, if its runs are few.

    Parameters
    ----------
    orders : as 1,1/2,1 for two pairs of the order of random and of interval inputs.
    """
    pairs = [tuple(map(int, text.split(","))) for text in orders.split("/")]
    for family, seed in selection:
        case = draw(family, seed)
        space = Space(case.inputs)
        random = space.random_dimension > 0
        intervals = space.interval_dimension > 0
        different = {(k * random, q * intervals): (k, q) for k, q in pairs}
        for order_pair in different.values():
            method = fb.methods.PhaseResolvedPCCI(*order_pair)
            if not case.exact_steps and method.runs(space) <= max_runs:
                yield family, seed, method


def row(name: str, family_outcomes: Sequence[Outcome], tolerance: float) -> list[str]:
    """Return the line of a family."""
    successes = [result for result in family_outcomes if not result.failure]

    def middle(values) -> str:
        return f"{np.median(values):.2g}" if successes else ""

    visible, bars = (
        sum(getattr(result, k) for result in successes) for k in ("visible", "visible_bars")
    )
    return [
        name,
        str(len(family_outcomes)),
        str(len(family_outcomes) - len(successes) or ""),
        middle([result.runs for result in successes]),
        middle([100 * result.true for result in successes]),
        middle([100 * result.claim for result in successes]),
        str(sum(right(result, tolerance) for result in successes)),
        str(sum(too_small(result) for result in successes) or ""),
        str(sum(false(result, tolerance) for result in successes) or ""),
        f"{100 * sum(result.missed for result in successes) / visible:.0f}" if visible else "",
        f"{100 * sum(result.exceeded for result in successes) / bars:.0f}" if bars else "",
        middle([result.seconds for result in successes]),
    ]


def name_cases(what: str, selection: Sequence[Outcome]) -> list[str]:
    """Return a line that names cases, so that they can be repeated, or none."""
    if not selection:
        return []
    return [f"{what}: " + ", ".join(f"{result.family}:{result.seed}" for result in selection)]


HEADER = [
    "family", "cases", "failed", "runs", "true error [%]", "claim [%]", "right", "too small",
    "false", "too small in time [%]", "twice exceeded in time [%]", "CPU [s]",
]  # fmt: skip


def write(file: Path, results: Sequence[Outcome]) -> None:
    """Write all outcomes as a table of comma-separated values."""
    with file.open("w", newline="", encoding="utf-8") as stream:
        table = csv.DictWriter(stream, [field.name for field in fields(Outcome)])
        table.writeheader()
        table.writerows(asdict(result) for result in results)


def show(family: str, seed: int, method: fb.AdaptivePCCI) -> None:
    """Print all that is known of one case."""
    case = draw(family, seed)
    for name, distribution in sorted(case.inputs.items()):
        print(f"{name} = {distribution}")
    truth = case.reference(1)
    fine_truth = case.reference(2)
    bands = comparable_bands(fb.propagate(case.response, case.inputs, method), case)
    true, claim = (v.mean(axis=-1) for v in errors(bands, truth))
    reference_error = errors(
        bands.assign(
            mean=bands["mean"].copy(data=truth[0]), error_bar=bands["error_bar"].copy(data=truth[1])
        ),
        fine_truth,
    )[0]
    for name, value in bands.attrs.items():
        print(f"{name}: {value}")
    for b, band in enumerate(("mean", "error_bar")):
        for o, label in enumerate(bands["output"].values):
            print(
                f"{label} {band}: true {true[b, o]:.2e}, claim {claim[b, o]:.2e}, "
                f"reference converged to {reference_error[b, o].mean():.1e}"
            )
    print(outcome(family, seed, bands, truth))


def main() -> None:
    arguments = options(
        __doc__,
        CASES,
        seed=(0, "first seed; documented tables have 1000000 or higher"),
        families=("", "families separated by commas; all without"),
        method_tolerance=(0.01, "tolerance of the method"),
        max_runs=(200, "budget of the method"),
        jobs=(1, "processes"),
        csv=("", "file for the outcome of every case"),
        case=("", "family:seed of the only case to run and show"),
        orders=("", "orders of the phase-resolved method, which is judged instead"),
    )
    tolerance = arguments.method_tolerance
    method = fb.AdaptivePCCI(tolerance, arguments.max_runs)
    if arguments.case:
        family, _, seed = arguments.case.partition(":")
        show(family, int(seed), method)
        return
    families = [name for name in arguments.families.split(",") if name] or list(FAMILIES)
    case_names = cases(families, arguments.samples, arguments.seed)
    trials: list[tuple[str, int, JudgedMethod]] = [(*case_name, method) for case_name in case_names]
    if arguments.orders:
        trials = list(with_orders(case_names, arguments.orders, arguments.max_runs))
    results = list(outcomes(trials, arguments.jobs))
    if arguments.csv:
        write(Path(arguments.csv), results)
    families = [name for name in families if any(result.family == name for result in results)]
    rows = [row(name, [o for o in results if o.family == name], tolerance) for name in families]
    rows.append(row("all", results, tolerance))
    required_rates = rates(results, tolerance)
    notes = [
        f"seeds from {arguments.seed} on, tolerance {100 * tolerance:g} %, {method.max_runs} runs "
        "at most; runs, errors and CPU time are medians",
        *map(str, required_rates),
        *name_cases("failed", [result for result in results if result.failure]),
        *name_cases("false", [result for result in results if false(result, tolerance)]),
        *name_cases("too small", [result for result in results if too_small(result)]),
    ]
    measurements = {
        "outcomes": [asdict(result) for result in results],
        "rates": [asdict(rate) for rate in required_rates],
    }
    report(arguments.output, "honesty", HEADER, rows, measurements, notes)


if __name__ == "__main__":
    main()
