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

Judged = fb.AdaptivePCCI | fb.methods.PhaseResolvedPCCI

CASES = 500
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def solve(chosen: tuple[str, int, Judged]) -> Outcome:
    """Run a method on a case; one that fails becomes a failed outcome."""
    family, seed, method = chosen
    case = draw(family, seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            begin = time.process_time()
            found = fb.propagate(case.response, case.inputs, method)
            seconds = time.process_time() - begin
            return outcome(family, seed, compared(found, case), case.reference(1), seconds)
        except Exception as error:
            return Outcome(family, seed, failure=f"{type(error).__name__}: {error}"[:200])


def compared(found: xr.Dataset, case: Case) -> xr.Dataset:
    """Return bands with claims of the whole error where the truth has it, or of the expansion's."""
    if not case.whole:
        part = found["error_bar_expansion_error"] / found["error_bar_expected_error"]
        return found.assign(pointwise_error=found["pointwise_error"] * part.fillna(1.0))
    del found.attrs["expansion_error"]
    return found.drop_vars(["mean_expansion_error", "error_bar_expansion_error"])


def outcomes(chosen: Sequence[tuple[str, int, Judged]], jobs: int) -> Iterator[Outcome]:
    """Yield the outcomes of cases, computed by so many processes of one thread each."""
    os.environ.update(dict.fromkeys(THREADS, "1"))
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, context) as pool:
        yield from pool.map(solve, chosen)


def cases(families: Sequence[str], count: int, seed: int) -> list[tuple[str, int]]:
    """Return so many cases, equally many of each family, with seeds from the given one on."""
    each = -(-count // len(families))
    return [(name, seed + k) for name in families for k in range(each)][:count]


def with_orders(
    chosen: Sequence[tuple[str, int]], orders: str, most: int
) -> Iterator[tuple[str, int, Judged]]:
    """Yield cases and the phase-resolved method with each of some orders, if its runs are few.

    Parameters
    ----------
    orders : as 1,1/2,1 for two pairs of the order of random and of interval inputs.
    """
    pairs = [tuple(map(int, one.split(","))) for one in orders.split("/")]
    for family, seed in chosen:
        case = draw(family, seed)
        space = Space(case.inputs)
        random = space.random_dimension > 0
        intervals = space.interval_dimension > 0
        different = {(k * random, q * intervals): (k, q) for k, q in pairs}
        for own in different.values():
            method = fb.methods.PhaseResolvedPCCI(*own)
            if not case.whole and method.runs(space) <= most:
                yield family, seed, method


def row(name: str, own: Sequence[Outcome], tolerance: float) -> list[str]:
    """Return the line of a family."""
    done = [one for one in own if not one.failure]

    def middle(values) -> str:
        return f"{np.median(values):.2g}" if done else ""

    visible, bars = (sum(getattr(one, k) for one in done) for k in ("visible", "visible_bars"))
    return [
        name,
        str(len(own)),
        str(len(own) - len(done) or ""),
        middle([one.runs for one in done]),
        middle([100 * one.true for one in done]),
        middle([100 * one.claim for one in done]),
        str(sum(right(one, tolerance) for one in done)),
        str(sum(too_small(one) for one in done) or ""),
        str(sum(false(one, tolerance) for one in done) or ""),
        f"{100 * sum(one.missed for one in done) / visible:.0f}" if visible else "",
        f"{100 * sum(one.exceeded for one in done) / bars:.0f}" if bars else "",
        middle([one.seconds for one in done]),
    ]


def named(what: str, chosen: Sequence[Outcome]) -> list[str]:
    """Return a line that names cases, so that they can be repeated, or none."""
    if not chosen:
        return []
    return [f"{what}: " + ", ".join(f"{one.family}:{one.seed}" for one in chosen)]


HEADER = [
    "family", "cases", "failed", "runs", "true error [%]", "claim [%]", "right", "too small",
    "false", "too small in time [%]", "twice exceeded in time [%]", "CPU [s]",
]  # fmt: skip


def write(file: Path, found: Sequence[Outcome]) -> None:
    """Write all outcomes as a table of comma-separated values."""
    with file.open("w", newline="", encoding="utf-8") as stream:
        table = csv.DictWriter(stream, [field.name for field in fields(Outcome)])
        table.writeheader()
        table.writerows(asdict(one) for one in found)


def show(family: str, seed: int, method: fb.AdaptivePCCI) -> None:
    """Print all that is known of one case."""
    case = draw(family, seed)
    for name, one in sorted(case.inputs.items()):
        print(f"{name} = {one}")
    truth = case.reference(1)
    finer = case.reference(2)
    found = compared(fb.propagate(case.response, case.inputs, method), case)
    true, claim = (v.mean(axis=-1) for v in errors(found, truth))
    moved = errors(
        found.assign(
            mean=found["mean"].copy(data=truth[0]), error_bar=found["error_bar"].copy(data=truth[1])
        ),
        finer,
    )[0]
    for name, value in found.attrs.items():
        print(f"{name}: {value}")
    for b, band in enumerate(("mean", "error_bar")):
        for o, label in enumerate(found["output"].values):
            print(
                f"{label} {band}: true {true[b, o]:.2e}, claim {claim[b, o]:.2e}, "
                f"reference converged to {moved[b, o].mean():.1e}"
            )
    print(outcome(family, seed, found, truth))


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
    drawn = cases(families, arguments.samples, arguments.seed)
    judged: list[tuple[str, int, Judged]] = [(*one, method) for one in drawn]
    if arguments.orders:
        judged = list(with_orders(drawn, arguments.orders, arguments.max_runs))
    found = list(outcomes(judged, arguments.jobs))
    if arguments.csv:
        write(Path(arguments.csv), found)
    families = [name for name in families if any(one.family == name for one in found)]
    rows = [row(name, [o for o in found if o.family == name], tolerance) for name in families]
    rows.append(row("all", found, tolerance))
    required = rates(found, tolerance)
    notes = [
        f"seeds from {arguments.seed} on, tolerance {100 * tolerance:g} %, {method.max_runs} runs "
        "at most; runs, errors and CPU time are medians",
        *map(str, required),
        *named("failed", [one for one in found if one.failure]),
        *named("false", [one for one in found if false(one, tolerance)]),
        *named("too small", [one for one in found if too_small(one)]),
    ]
    measured = {
        "outcomes": [asdict(one) for one in found],
        "rates": [asdict(one) for one in required],
    }
    report(arguments.output, "honesty", HEADER, rows, measured, notes)


if __name__ == "__main__":
    main()
