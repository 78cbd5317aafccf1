"""Claimed and true errors of bands for narrower inputs, on responses of `honesty.py`.

A response in standard variables is expanded by the adaptive method; then some of its intervals are
narrowed, and some of its normal variables get less scatter and another mean. True bands are those
of the response in the new variables. Rates are those of `honesty.py`; seeds below 1 000 000 may be
tuned to.
"""

from __future__ import annotations

import multiprocessing
import os
import warnings
import zlib
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.honesty.cases import PROBLEMS
from benchmarks.honesty.honesty import THREADS, cases, name_cases
from benchmarks.honesty.problems import Problem
from benchmarks.honesty.rates import Outcome, false, outcome, rates, right, too_small
from benchmarks.honesty.references import Term
from flexband.basics.response import Response

TOLERANCE = 0.01
LEAST = 0.3
MOST = 0.9
"""Widths and standard deviations of narrowed inputs, in parts of the old ones."""

UNCHANGED = 0.3
"""Share of the inputs that stay as they are."""

REACH = 3.0
"""Means move so far that the new mean ± 3σ stays within the old one."""

WHOLE = {"interval": fb.Interval(-1, 1), "normal": fb.Normal(0, 1), "uniform": fb.Uniform(-1, 1)}


def response(problem: Problem) -> tuple[Response, list[str]]:
    """Return the response to a problem's variables, and their names."""
    names = [f"y{k}" for k in range(len(problem.kinds))]
    labels = {"output": [f"q{o}" for o in range(len(problem.outputs))], "time": problem.tau}

    def values(**arguments: np.ndarray) -> xr.DataArray:
        F = problem.values(np.stack([arguments[name] for name in names], axis=1))
        return xr.DataArray(F, dims=("sample", "output", "time"), coords=labels)

    return values, names


def draw_narrowing(kinds: Sequence[str], rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return centres and sizes of new variables, in the old ones; at least one is narrower."""
    size = rng.uniform(LEAST, MOST, len(kinds))
    narrowable = np.array([kind != "uniform" for kind in kinds])
    unchanged_mask = (rng.random(len(kinds)) < UNCHANGED) | ~narrowable
    if unchanged_mask.all():
        unchanged_mask[np.argmax(narrowable)] = not narrowable.any()
    size = np.where(unchanged_mask, 1.0, size)
    reach = np.where([kind == "normal" for kind in kinds], REACH, 1.0)
    return rng.uniform(-1, 1, len(kinds)) * (1 - size) * reach, size


def narrow_problem(problem: Problem, centre: np.ndarray, size: np.ndarray) -> Problem:
    """Return the problem in variables y = centre + size y′."""

    def narrow_term(term: Term) -> Term:
        c = centre[list(term.on)]
        r = size[list(term.on)]

        def formula(*y: np.ndarray) -> np.ndarray:
            old = [c[k] + r[k] * y[k] for k in range(len(c))]
            return term.formula(*old, y[-1])

        return replace(term, formula=formula)

    return replace(
        problem, outputs=[[narrow_term(term) for term in terms] for terms in problem.outputs]
    )


def solve(trial: tuple[str, int]) -> Outcome:
    """Expand a response, narrow its inputs, and compare the bands with the true ones."""
    family, seed = trial
    rng = np.random.default_rng([seed, zlib.crc32(family.encode())])
    problem = PROBLEMS[family](rng)
    values, names = response(problem)
    centre, size = draw_narrowing(problem.kinds, rng)
    inputs = {name: WHOLE[kind] for name, kind in zip(names, problem.kinds, strict=True)}
    new = {}
    for name, kind, c, r in zip(names, problem.kinds, centre, size, strict=True):
        if r < 1:
            new[name] = fb.Interval(c - r, c + r) if kind == "interval" else fb.Normal(c, r)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            surrogate = fb.expand(values, inputs, fb.AdaptivePCCI(TOLERANCE))
            bands = surrogate.narrowed(**new).bands()
            return outcome(family, seed, bands, narrow_problem(problem, centre, size).reference(1))
        except Exception as error:
            return Outcome(family, seed, failure=f"{type(error).__name__}: {error}"[:200])


def main() -> None:
    arguments = options(
        __doc__,
        len(PROBLEMS) * 8,
        seed=(0, "first seed; documented numbers have 1000000 or higher"),
        jobs=(1, "processes"),
    )
    os.environ.update(dict.fromkeys(THREADS, "1"))
    case_names = cases(list(PROBLEMS), arguments.samples, arguments.seed)
    with ProcessPoolExecutor(arguments.jobs, multiprocessing.get_context("spawn")) as pool:
        results = list(pool.map(solve, case_names))
    rows = []
    for family in [*PROBLEMS, "all"]:
        family_results = [result for result in results if family in (result.family, "all")]
        successes = [result for result in family_results if not result.failure]
        medians = [f"{np.median(v):.2g}" if successes else "" for v in (
            [100 * result.true for result in successes],
            [100 * result.claim for result in successes],
        )]  # fmt: skip
        counts = [sum(hits) for hits in (
            [right(result, TOLERANCE) for result in successes],
            [too_small(result) for result in successes],
            [false(result, TOLERANCE) for result in successes],
        )]  # fmt: skip
        rows.append(
            [
                family,
                str(len(family_results)),
                str(len(family_results) - len(successes)),
                *medians,
                *map(str, counts),
            ]
        )
    required_rates = rates(results, TOLERANCE)
    notes = [
        f"seeds from {arguments.seed} on, tolerance {100 * TOLERANCE:g} %; errors are medians",
        *map(str, required_rates),
        *name_cases("failed", [result for result in results if result.failure]),
        *name_cases("false", [result for result in results if false(result, TOLERANCE)]),
        *name_cases("too small", [result for result in results if too_small(result)]),
    ]
    header = [
        "family", "cases", "failed", "true error [%]", "claim [%]", "right", "too small", "false",
    ]  # fmt: skip
    measurements = {"outcomes": [asdict(result) for result in results]}
    report(arguments.output, "narrowing", header, rows, measurements, notes)


if __name__ == "__main__":
    main()
