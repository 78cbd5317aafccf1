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


def parts(rng: np.random.Generator, count: int) -> Parts:
    """Return a random response."""
    terms = np.stack([smooth(rng, len(POWERS)) for _ in range(count + 1)])
    terms *= 0.6 ** POWERS.sum(axis=1)[:, None]

    def found(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        own = np.tensordot((z**POWERS).prod(axis=1), terms, axes=(0, 1))
        return own[0], own[1:]

    return found


def cheapest(own: Parts, limit: float, costs: np.ndarray) -> float:
    """Return the least cost of all sizes; infinite if no sizes of the grid keep the limit."""

    def margins(v: np.ndarray) -> np.ndarray:
        h, g = own(v[:2])
        return 1 - (np.abs(h) + np.exp(v[2:]) @ np.abs(g)) / limit

    def slopes(v: np.ndarray) -> np.ndarray:
        steps = 1e-6 * np.eye(len(v))
        return np.array([(margins(v + d) - margins(v - d)) / 2e-6 for d in steps]).T

    def solved(start: np.ndarray, *, free: bool) -> Any:
        reach = [(-1.0, 1.0)] * 2 if free else [(z, z) for z in start[:2]]
        return minimize(
            lambda v: np.log((costs / np.exp(v[2:])).sum()),
            start,
            bounds=[*reach, *[(np.log(1e-4), 0.0)] * len(costs)],
            constraints={"type": "ineq", "fun": margins, "jac": slopes},
            method="SLSQP",
            options={"maxiter": 200, "ftol": 1e-11},
        )

    found = []
    for z in product(GRID, repeat=2):
        h, g = own(np.array(z))
        room = ((limit - np.abs(h)) / np.abs(g).sum(axis=0)).min()
        if room > 1e-4:
            y = np.full(len(costs), np.log(min(room, 1.0)))
            found.append(solved(np.concatenate([z, y]), free=False))
    found.sort(key=lambda one: one.fun)
    best = [solved(one.x, free=True) for one in found[:POLISHED]]
    kept = [one.fun for one in (*found, *best) if margins(one.x).min() > -1e-7]
    return float(np.exp(min(kept, default=np.inf)))


def judged(seed: int) -> dict[str, float]:
    """Return how a case is allocated."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 4))
    own, costs = parts(rng, count), rng.uniform(0.2, 5.0, count)
    sizes = [own(np.array(z))[0] for z in product(GRID, repeat=2)]
    limit = float(np.abs(sizes).max(axis=1).min() * rng.uniform(1.05, 2.0))

    def response(**inputs: np.ndarray) -> xr.DataArray:
        rows = zip(*(inputs[name] for name in ("z0", "z1", *names)), strict=True)
        both = [(own(np.array(row[:2])), np.array(row[2:])) for row in rows]
        values = [h + b @ g for (h, g), b in both]
        return xr.DataArray(np.array(values), {"time": TIMES}, ("sample", "time"))

    names = [f"b{k}" for k in range(count)]
    given: dict[str, Any] = dict.fromkeys(names, fb.Interval(-1.0, 1.0))
    given |= dict.fromkeys(("z0", "z1"), fb.Sizing(-1.0, 1.0))
    surrogate = fb.expand(response, given, fb.AdaptivePCCI(1e-3))
    assert isinstance(surrogate, fb.Surrogate)
    began = time.perf_counter()
    found = fb.analysis.allocate(
        surrogate, fb.Limit(below=limit, above=-limit),
        dict(zip(names, costs.tolist(), strict=True)), response=response,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    h, g = own(found["size"].sel(sizing=["z0", "z1"]).values)
    off = (np.abs(h) + found["tolerance"].sel(name=names).values @ np.abs(g)).max() / limit
    return {
        "confirmed": float(found.attrs["confirmed"] == "yes"),
        "beyond": float(off - 1),
        "cost": float(found.attrs["cost"]) / cheapest(own, limit, costs) - 1,
        "runs": float(surrogate.diagnostics.attrs["runs"]) + float(found.attrs["runs"]),
        "seconds": seconds,
    }


def main() -> None:
    chosen = options(__doc__, 30, seed=(SEED, "of the first case"))
    found = [judged(chosen.seed + k) for k in range(chosen.samples)]
    own = {name: np.array([one[name] for one in found]) for name in found[0]}
    rows = [[
        f"{own['confirmed'].sum():.0f} of {len(found)}",
        f"{(own['beyond'] > 1e-6).sum()}, {max(0.0, own['beyond'].max()):.1e}",
        f"{np.median(own['cost']):.1e}",
        f"{own['cost'].min():.1e} to {own['cost'].max():.1e}",
        f"{(own['cost'] > 0.01).sum()}",
        f"{np.median(own['runs']):.0f}, {own['runs'].max():.0f}",
        f"{np.median(own['seconds']):.2g}, {own['seconds'].max():.2g}",
    ]]  # fmt: skip
    header = ["confirmed", "beyond limits, by", "cost above, median", "from to", "above by 1 %",
              "runs, median and most", "seconds, median and most"]  # fmt: skip
    report(chosen.output, "allocation_sizes", header, rows, {k: v.tolist() for k, v in own.items()})


if __name__ == "__main__":
    main()
