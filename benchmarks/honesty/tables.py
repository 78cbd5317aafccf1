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


def random(r: np.random.Generator, dimension: int) -> Rows:
    """Draw rows at random."""
    count = int(r.integers(16 + 4 * dimension, 60 + 20 * dimension))
    return r.uniform(size=(count, dimension)), np.ones(count, int)


def gridded(r: np.random.Generator, dimension: int) -> Rows:
    """Draw a grid, of many inputs a fraction of it."""
    levels = int(r.integers(3, 8 if dimension < 3 else 5))
    ticks = (np.arange(levels) + 0.03) / (levels - 1 + 0.06)
    most = 200
    if levels**dimension <= most:
        mesh = np.meshgrid(*[ticks] * dimension, indexing="ij")
        rows = np.stack(mesh, axis=-1).reshape(-1, dimension)
    else:
        rows = ticks[r.integers(levels, size=(most, dimension))]
    rows = np.unique(rows, axis=0)
    return rows, np.ones(len(rows), int)


def clustered(r: np.random.Generator, dimension: int) -> Rows:
    """Draw most rows in two small parts, and some everywhere."""
    count = int(r.integers(30 + 4 * dimension, 80 + 20 * dimension))
    rows = r.uniform(size=(count, dimension))
    for part in range(2):
        own = slice(part * count // 3, (part + 1) * count // 3)
        middle = r.uniform(0.2, 0.8, dimension)
        size = r.uniform(0.05, 0.2)
        rows[own] = np.clip(middle + size * (rows[own] - 0.5), 0.001, 0.999)
    return rows, np.ones(count, int)


def repeated(r: np.random.Generator, dimension: int) -> Rows:
    """Draw rows at random, a third of them three times."""
    rows, times = random(r, dimension)
    times[: len(rows) // 3] = 3
    return rows, times


KINDS: dict[str, Callable[[np.random.Generator, int], Rows]] = {
    "random": random,
    "gridded": gridded,
    "clustered": clustered,
    "noisy": repeated,
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
    unit, times = KINDS[kind](r, m + n)
    far = ndtr(2.5)
    of_random = unit[:, m:] if kind != "gridded" else 1 - far + (2 * far - 1) * unit[:, m:]
    xi = of_normals(ndtri(np.clip(of_random, 1e-4, 1 - 1e-4)), space.families)
    values: Mapping[str, np.ndarray] = {
        k: np.repeat(v, times) for k, v in space.numbers_at(xi, 2 * unit[:, :m] - 1).items()
    }
    F = case.response(**values)
    noise = r.choice([0.003, 0.02]) if kind == "noisy" else 0.0
    F = F.copy(data=F.values + noise * F.values.std(axis=0) * r.standard_normal(F.shape))
    table = F.to_dataset(name="F").assign({k: ("sample", v) for k, v in values.items()})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = fb.surrogate_of(table, case.inputs, outputs=["F"]).bands()
        except Exception as error:
            return Outcome(family, seed, failure=f"{type(error).__name__}: {error}"[:200])
    if "expected_error" not in found.attrs:
        return Outcome(family, seed, failure="not judged")
    if "beyond_runs" in found.attrs:
        return Outcome(family, seed, failure=f"no verdict: {found.attrs['beyond_runs']}")
    return outcome(family, seed, found, case.reference(1))


def main() -> None:
    arguments = options(__doc__, 200, seed=(0, "first seed; documented tables have fresh ones"))
    rows = []
    small = []
    each = math.ceil(arguments.samples / len(KINDS))
    for kind in KINDS:
        seeds = iter(range(arguments.seed, arguments.seed + 10 * each))
        found: list[Outcome] = []
        while len(found) < each:
            if (one := judge(kind, next(seeds))) is not None:
                found.append(one)
        done = [one for one in found if not one.failure]
        ratio = [max(one.claim, 2e-5) / max(one.true, 2e-5) for one in done]
        wrong = [one for one in done if too_small(one)]
        small += [
            f"{kind}:{one.family}:{one.seed} ({one.true:.2g}, {one.claim:.2g})" for one in wrong
        ]
        undecided = sum(one.failure.startswith("no verdict") for one in found)
        rows.append([
            kind, str(len(found)), str(len(found) - len(done) - undecided), str(undecided),
            f"{100 * np.median([one.true for one in done]):.2g}",
            f"{100 * np.median([one.claim for one in done]):.2g}",
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
