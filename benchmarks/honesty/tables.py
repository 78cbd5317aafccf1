"""Claimed and true errors of surrogates of tables, whose rows someone else has chosen.

Responses and their true bands are those of the families of `honesty.py`. Rows are drawn at random,
on a grid, in clusters, or at random with noise and repeated rows.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping

import numpy as np
from scipy.special import ndtr, ndtri

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.honesty.cases import draw
from benchmarks.honesty.rates import Outcome, outcome, too_small
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.inputs.space import Space

FAMILIES = ("smooth", "rational", "saturating", "products", "scalars", "ring", "beats", "kinks",
            "powers", "uniform", "intervals", "randoms", "units", "many", "bent")  # fmt: skip
MOST_INPUTS = 12
Rows = tuple[np.ndarray, np.ndarray]
"""Values in the unit cube, (rows, inputs), and the number of times that each is repeated."""


def random_rows(r: np.random.Generator, dimension: int) -> Rows:
    """Draw rows at random."""
    count = int(r.integers(16 + 4 * dimension, 60 + 20 * dimension))
    return r.uniform(size=(count, dimension)), np.ones(count, int)


def grid_rows(r: np.random.Generator, dimension: int) -> Rows:
    """Draw a grid, of many inputs a fraction of it."""
    levels = int(r.integers(3, 8 if dimension < 3 else 5))
    ticks = (np.arange(levels) + 0.03) / (levels - 1 + 0.06)
    max_rows = 200
    if levels**dimension <= max_rows:
        mesh = np.meshgrid(*[ticks] * dimension, indexing="ij")
        rows = np.stack(mesh, axis=-1).reshape(-1, dimension)
    else:
        rows = ticks[r.integers(levels, size=(max_rows, dimension))]
    rows = np.unique(rows, axis=0)
    return rows, np.ones(len(rows), int)


def cluster_rows(r: np.random.Generator, dimension: int) -> Rows:
    """Draw most rows in two small parts, and some everywhere."""
    count = int(r.integers(30 + 4 * dimension, 80 + 20 * dimension))
    rows = r.uniform(size=(count, dimension))
    for part in range(2):
        cluster = slice(part * count // 3, (part + 1) * count // 3)
        middle = r.uniform(0.2, 0.8, dimension)
        size = r.uniform(0.05, 0.2)
        rows[cluster] = np.clip(middle + size * (rows[cluster] - 0.5), 0.001, 0.999)
    return rows, np.ones(count, int)


def repeated_rows(r: np.random.Generator, dimension: int) -> Rows:
    """Draw rows at random, a third of them three times."""
    rows, times = random_rows(r, dimension)
    times[: len(rows) // 3] = 3
    return rows, times


KINDS: dict[str, Callable[[np.random.Generator, int], Rows]] = {
    "random": random_rows,
    "gridded": grid_rows,
    "clustered": cluster_rows,
    "noisy": repeated_rows,
}


def judge(kind: str, seed: int) -> Outcome | None:
    """Return what the surrogate of a table claims and misses; None of a case that is no table's."""
    r = np.random.default_rng([seed, len(kind)])
    family = FAMILIES[r.integers(len(FAMILIES))]
    case = draw(family, seed)
    space = Space(case.inputs)
    m = space.interval_dimension
    n = space.random_dimension
    if m + n > MOST_INPUTS:
        return None
    # Draw the rows of the table.
    unit, times = KINDS[kind](r, m + n)
    edge = ndtr(2.5)
    of_random = unit[:, m:] if kind != "gridded" else 1 - edge + (2 * edge - 1) * unit[:, m:]
    xi = of_normals(ndtri(np.clip(of_random, 1e-4, 1 - 1e-4)), space.families)
    values: Mapping[str, np.ndarray] = {
        k: np.repeat(v, times) for k, v in space.numbers_at(xi, 2 * unit[:, :m] - 1).items()
    }
    # Fill in the responses, with noise in noisy tables.
    F = case.response(**values)
    noise = r.choice([0.003, 0.02]) if kind == "noisy" else 0.0
    F = F.copy(data=F.values + noise * F.values.std(axis=0) * r.standard_normal(F.shape))
    table = F.to_dataset(name="F").assign({k: ("sample", v) for k, v in values.items()})
    # Judge the bands of the surrogate.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            bands = fb.surrogate_of(table, case.inputs, outputs=["F"]).bands()
        except Exception as error:
            return Outcome(family, seed, failure=f"{type(error).__name__}: {error}"[:200])
    if "expected_error" not in bands.attrs:
        return Outcome(family, seed, failure="not judged")
    if "beyond_runs" in bands.attrs:
        return Outcome(family, seed, failure=f"no verdict: {bands.attrs['beyond_runs']}")
    return outcome(family, seed, bands, case.reference(1))


def main() -> None:
    arguments = options(__doc__, 200, seed=(0, "first seed; documented tables have fresh ones"))
    rows = []
    small = []
    cases_per_kind = math.ceil(arguments.samples / len(KINDS))
    for kind in KINDS:
        seeds = iter(range(arguments.seed, arguments.seed + 10 * cases_per_kind))
        results: list[Outcome] = []
        while len(results) < cases_per_kind:
            if (result := judge(kind, next(seeds))) is not None:
                results.append(result)
        successes = [result for result in results if not result.failure]
        ratio = [max(result.claim, 2e-5) / max(result.true, 2e-5) for result in successes]
        wrong = [result for result in successes if too_small(result)]
        small += [
            f"{kind}:{result.family}:{result.seed} ({result.true:.2g}, {result.claim:.2g})"
            for result in wrong
        ]
        undecided = sum(result.failure.startswith("no verdict") for result in results)
        rows.append([
            kind, str(len(results)), str(len(results) - len(successes) - undecided), str(undecided),
            f"{100 * np.median([result.true for result in successes]):.2g}",
            f"{100 * np.median([result.claim for result in successes]):.2g}",
            f"{np.median(ratio):.2g}", str(len(wrong)),
        ])  # fmt: skip
    header = ["rows", "tables", "refused", "no verdict", "true error [%]", "claim [%]",
              "claim / true, median", "too small by 5"]  # fmt: skip
    notes = [
        f"seeds from {arguments.seed} on",
        *([f"too small: {', '.join(small)}"] if small else []),
    ]
    report(arguments.output, "tables", header, rows, {}, notes)


if __name__ == "__main__":
    main()
