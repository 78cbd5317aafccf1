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
from benchmarks.honesty.honesty import THREADS, cases, named
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

    def values(**given: np.ndarray) -> xr.DataArray:
        F = problem.values(np.stack([given[name] for name in names], axis=1))
        return xr.DataArray(F, dims=("sample", "output", "time"), coords=labels)

    return values, names


def narrower(kinds: Sequence[str], rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return centres and sizes of new variables, in the old ones; at least one is narrower."""
    size = rng.uniform(LEAST, MOST, len(kinds))
    free = np.array([kind != "uniform" for kind in kinds])
    kept = (rng.random(len(kinds)) < UNCHANGED) | ~free
    if kept.all():
        kept[np.argmax(free)] = not free.any()
    size = np.where(kept, 1.0, size)
    reach = np.where([kind == "normal" for kind in kinds], REACH, 1.0)
    return rng.uniform(-1, 1, len(kinds)) * (1 - size) * reach, size


def part(problem: Problem, centre: np.ndarray, size: np.ndarray) -> Problem:
    """Return the problem in variables y = centre + size y′."""

    def own(term: Term) -> Term:
        c, r = centre[list(term.on)], size[list(term.on)]

        def formula(*y: np.ndarray) -> np.ndarray:
            old = [c[k] + r[k] * y[k] for k in range(len(c))]
            return term.formula(*old, y[-1])

        return replace(term, formula=formula)

    return replace(problem, outputs=[[own(term) for term in terms] for terms in problem.outputs])


def solve(chosen: tuple[str, int]) -> Outcome:
    """Expand a response, narrow its inputs, and compare the bands with the true ones."""
    family, seed = chosen
    rng = np.random.default_rng([seed, zlib.crc32(family.encode())])
    problem = PROBLEMS[family](rng)
    values, names = response(problem)
    centre, size = narrower(problem.kinds, rng)
    given = {name: WHOLE[kind] for name, kind in zip(names, problem.kinds, strict=True)}
    new = {}
    for name, kind, c, r in zip(names, problem.kinds, centre, size, strict=True):
        if r < 1:
            new[name] = fb.Interval(c - r, c + r) if kind == "interval" else fb.Normal(c, r)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            surrogate = fb.expand(values, given, fb.AdaptivePCCI(TOLERANCE))
            found = surrogate.narrowed(**new).bands()
            return outcome(family, seed, found, part(problem, centre, size).reference(1))
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
    drawn = cases(list(PROBLEMS), arguments.samples, arguments.seed)
    with ProcessPoolExecutor(arguments.jobs, multiprocessing.get_context("spawn")) as pool:
        found = list(pool.map(solve, drawn))
    rows = []
    for family in [*PROBLEMS, "all"]:
        own = [one for one in found if family in (one.family, "all")]
        done = [one for one in own if not one.failure]
        medians = [f"{np.median(v):.2g}" if done else "" for v in (
            [100 * one.true for one in done], [100 * one.claim for one in done]
        )]  # fmt: skip
        counts = [sum(own_rate) for own_rate in (
            [right(one, TOLERANCE) for one in done],
            [too_small(one) for one in done],
            [false(one, TOLERANCE) for one in done],
        )]  # fmt: skip
        rows.append([family, str(len(own)), str(len(own) - len(done)), *medians, *map(str, counts)])
    required = rates(found, TOLERANCE)
    notes = [
        f"seeds from {arguments.seed} on, tolerance {100 * TOLERANCE:g} %; errors are medians",
        *map(str, required),
        *named("failed", [one for one in found if one.failure]),
        *named("false", [one for one in found if false(one, TOLERANCE)]),
        *named("too small", [one for one in found if too_small(one)]),
    ]
    header = [
        "family", "cases", "failed", "true error [%]", "claim [%]", "right", "too small", "false",
    ]  # fmt: skip
    measured = {"outcomes": [asdict(one) for one in found]}
    report(arguments.output, "narrowing", header, rows, measured, notes)


if __name__ == "__main__":
    main()
