"""Extremes of surrogates that the search for bounds misses, with up to ten interval variables.

Random polynomials of a total order, whose terms decay with their order, have their bounds searched
as usual and from 200 random points, half of them vertices. A bound is missed where the second
search finds one that is farther out by more than 1e-4 of the width.
"""

from __future__ import annotations

import numpy as np

from benchmarks.harness import options, report
from flexband.uncertainty.expansions.bounds import extremes
from flexband.uncertainty.expansions.expansion import SIGMAS, Extremes
from flexband.uncertainty.expansions.families import HERMITE
from flexband.uncertainty.expansions.hybrid import HybridExpansion

CASES = ((1, 1, 9), (2, 1, 5), (2, 2, 7), (3, 1, 4), (3, 1, 6), (4, 1, 3), (5, 1, 3), (6, 1, 2),
         (7, 1, 2), (8, 1, 2), (9, 1, 2), (10, 0, 2))  # fmt: skip
"""Numbers of interval and of random variables, and total orders."""

SEED = 7000
STARTS = 200
AT_ONCE = 50
TOLERANCE = 1e-4


def random_expansion(m: int, n: int, order: int, series: int, seed: int) -> HybridExpansion:
    """Return random polynomials of a total order whose terms decay with their order."""
    rng = np.random.default_rng(seed)
    index = np.array([np.zeros(m + n, dtype=int)])
    for _ in range(order):
        index = np.unique(
            np.concatenate([index, *(index + unit for unit in np.eye(m + n, dtype=int))]), axis=0
        )
    size = rng.uniform(0.3, 1.0, m + n) ** index
    terms = size.prod(axis=1)[:, None] * rng.standard_normal((len(index), series))
    return HybridExpansion((HERMITE,) * n, index, terms)


def from_many_starts(expansion: HybridExpansion, m: int, seed: int) -> list[list[Extremes]]:
    """Return bounds that are searched from random points, some at a time."""
    starts = np.random.default_rng(seed).uniform(-1, 1, (STARTS, m))
    starts[::2] = np.sign(starts[::2])
    usual = extremes.scan
    results = []
    try:
        for first in range(0, STARTS, AT_ONCE):
            batch = starts[first : first + AT_ONCE]
            alone = np.zeros((len(batch), 0), dtype=int)
            extremes.scan = lambda orders, batch=batch, alone=alone: (batch, alone)
            results.append(extremes.extremes(expansion, SIGMAS))
    finally:
        extremes.scan = usual
    return results


def count_misses(m: int, n: int, order: int, series: int, seed: int) -> tuple[int, int, float]:
    """Return how many bounds are missed, of how many, and by how much of the width at most."""
    expansion = random_expansion(m, n, order, series, seed)
    usual = np.stack([extreme.values for extreme in extremes.extremes(expansion, SIGMAS)])
    low = usual[:, 0]
    high = usual[:, 1]
    for others in from_many_starts(expansion, m, seed):
        values = np.stack([extreme.values for extreme in others])
        low = np.minimum(low, values[:, 0])
        high = np.maximum(high, values[:, 1])
    off = np.stack([usual[:, 0] - low, high - usual[:, 1]]) / (high - low)
    return int((off > TOLERANCE).sum()), off.size, float(off.max())


def main() -> None:
    arguments = options(__doc__, 100)
    rows = []
    for k, case in enumerate(CASES):
        count, bounds, largest = count_misses(*case, arguments.samples, SEED + k)
        rows.append([*map(str, case), str(bounds), str(count), f"{largest:.1e}"])
    header = ["intervals", "random", "order", "bounds", "missed", "by at most"]
    report(arguments.output, "missed", header, rows, {})


if __name__ == "__main__":
    main()
