"""Sizes that are chosen with tolerances, against an exhaustive search over the sizes.

Random responses y = h(z, t) + Σ b_j g_j(z, t) of two or three tolerances b and two sizes z, of
which h and g are cubic. For given sizes the cheapest tolerances solve a convex problem. It
is solved on a grid of sizes, and from its best points with free sizes.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import minimize

import flexband as fb
from benchmarks.allocation.allocation import TIMES, smooth
from benchmarks.harness import options, report

SEED = 17_000
GRID = np.linspace(-1.0, 1.0, 21)
POLISHED = 6
"""Best points of the grid that are improved."""

POWERS = np.array([p for p in product(range(4), repeat=2) if sum(p) <= 3])

Parts = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Sizes (2,) -> h, (times,), and g, (tolerances, times)."""


def random_parts(rng: np.random.Generator, count: int) -> Parts:
    """Return a random response."""
    terms = np.stack([smooth(rng, len(POWERS)) for _ in range(count + 1)])
    terms *= 0.6 ** POWERS.sum(axis=1)[:, None]

    def evaluate(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        series = np.tensordot((z**POWERS).prod(axis=1), terms, axes=(0, 1))
        return series[0], series[1:]

    return evaluate


def cheapest_cost(parts_at: Parts, limit: float, costs: np.ndarray) -> float:
    """Return the least cost of all sizes; infinite if no sizes of the grid keep the limit."""

    def margins(v: np.ndarray) -> np.ndarray:
        h, g = parts_at(v[:2])
        return 1 - (np.abs(h) + np.exp(v[2:]) @ np.abs(g)) / limit

    def slopes(v: np.ndarray) -> np.ndarray:
        steps = 1e-6 * np.eye(len(v))
        return np.array([(margins(v + d) - margins(v - d)) / 2e-6 for d in steps]).T

    def minimize_from(start: np.ndarray, *, free_sizes: bool) -> Any:
        reach = [(-1.0, 1.0)] * 2 if free_sizes else [(z, z) for z in start[:2]]
        return minimize(
            lambda v: np.log((costs / np.exp(v[2:])).sum()),
            start,
            bounds=[*reach, *[(np.log(1e-4), 0.0)] * len(costs)],
            constraints={"type": "ineq", "fun": margins, "jac": slopes},
            method="SLSQP",
            options={"maxiter": 200, "ftol": 1e-11},
        )

    optima = []
    for z in product(GRID, repeat=2):
        h, g = parts_at(np.array(z))
        room = ((limit - np.abs(h)) / np.abs(g).sum(axis=0)).min()
        if room > 1e-4:
            y = np.full(len(costs), np.log(min(room, 1.0)))
            optima.append(minimize_from(np.concatenate([z, y]), free_sizes=False))
    optima.sort(key=lambda optimum: optimum.fun)
    best = [minimize_from(optimum.x, free_sizes=True) for optimum in optima[:POLISHED]]
    log_costs = [optimum.fun for optimum in (*optima, *best) if margins(optimum.x).min() > -1e-7]
    return float(np.exp(min(log_costs, default=np.inf)))


def judge_case(seed: int) -> dict[str, float]:
    """Return how a case is allocated."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 4))
    parts_at = random_parts(rng, count)
    costs = rng.uniform(0.2, 5.0, count)
    sizes = [parts_at(np.array(z))[0] for z in product(GRID, repeat=2)]
    limit = float(np.abs(sizes).max(axis=1).min() * rng.uniform(1.05, 2.0))

    def response(**inputs: np.ndarray) -> xr.DataArray:
        rows = zip(*(inputs[name] for name in ("z0", "z1", *names)), strict=True)
        part_values = [(parts_at(np.array(row[:2])), np.array(row[2:])) for row in rows]
        values = [h + b @ g for (h, g), b in part_values]
        return xr.DataArray(np.array(values), {"time": TIMES}, ("sample", "time"))

    names = [f"b{k}" for k in range(count)]
    variables: dict[str, Any] = dict.fromkeys(names, fb.Interval(-1.0, 1.0))
    variables |= dict.fromkeys(("z0", "z1"), fb.Sizing(-1.0, 1.0))
    surrogate = fb.expand(response, variables, fb.AdaptivePCCI(1e-3))
    assert isinstance(surrogate, fb.Surrogate)
    began = time.perf_counter()
    allocation = fb.analysis.allocate(
        surrogate, fb.Requirement("response", below=limit, above=-limit),
        dict(zip(names, costs.tolist(), strict=True)), response=response,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    h, g = parts_at(allocation["size"].sel(sizing=["z0", "z1"]).values)
    largest_ratio = (
        np.abs(h) + allocation["tolerance"].sel(name=names).values @ np.abs(g)
    ).max() / limit
    return {
        "confirmed": float(allocation.attrs["confirmed"] == "yes"),
        "beyond": float(largest_ratio - 1),
        "cost": float(allocation.attrs["cost"]) / cheapest_cost(parts_at, limit, costs) - 1,
        "runs": float(surrogate.diagnostics.attrs["runs"]) + float(allocation.attrs["runs"]),
        "seconds": seconds,
    }


def main() -> None:
    arguments = options(__doc__, 30, seed=(SEED, "of the first case"))
    results = [judge_case(arguments.seed + k) for k in range(arguments.samples)]
    columns = {name: np.array([result[name] for result in results]) for name in results[0]}
    rows = [[
        f"{columns['confirmed'].sum():.0f} of {len(results)}",
        f"{(columns['beyond'] > 1e-6).sum()}, {max(0.0, columns['beyond'].max()):.1e}",
        f"{np.median(columns['cost']):.1e}",
        f"{columns['cost'].min():.1e} to {columns['cost'].max():.1e}",
        f"{(columns['cost'] > 0.01).sum()}",
        f"{np.median(columns['runs']):.0f}, {columns['runs'].max():.0f}",
        f"{np.median(columns['seconds']):.2g}, {columns['seconds'].max():.2g}",
    ]]  # fmt: skip
    header = ["confirmed", "beyond limits, by", "cost above, median", "from to", "above by 1 %",
              "runs, median and most", "seconds, median and most"]  # fmt: skip
    report(
        arguments.output,
        "allocation_sizes",
        header,
        rows,
        {k: v.tolist() for k, v in columns.items()},
    )


if __name__ == "__main__":
    main()
