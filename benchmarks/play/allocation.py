"""Plays and lengths of a six-bar, allocated together, against SLSQP over the exact sets.

The linkage is a Stephenson III whose output is a coupler point at one angle of the crank, with
plays in its seven pins and tolerances of two lengths, at unequal costs B/t. The reference has exact
kinematics: margins are least over the products of discs, at all ends of the lengths.
"""

from __future__ import annotations

import argparse
from itertools import product

import numpy as np
import xarray as xr
from scipy.optimize import minimize

import flexband as fb
from benchmarks.play.linkages import Dyad, Linkage, ends

LINKAGE = Linkage(
    0.35,
    [
        Dyad(("coupler", "rocker"), (0.9, 0.7), (("crank", 0.35, 0.0), ("ground", 1.0, 0.0))),
        Dyad(("rod", "lever"), (0.8, 0.6), (("coupler", 0.5, 0.2), ("ground", 1.3, 0.9)), False),
    ],
    [("rod", 0.4, 0.1)],
    np.array([0.6]),
)
LENGTHS = {"coupler": 0.9, "rod": 0.8}
COSTS = dict(
    zip([*LINKAGE.pins, *LENGTHS], [1.0, 2.0, 1.0, 3.0, 1.0, 0.5, 2.0, 4.0, 4.0], strict=True)
)
REACH = 5e-3
"""The largest tolerance, and how far the point may be from its nominal place along X."""

EXACT = 13755.9
"""The least cost, as this program computes it."""


def point(**values: np.ndarray) -> np.ndarray:
    """Return X of the coupler point, (n,)."""
    pins = {name: values[name] for name in LINKAGE.pins}
    return LINKAGE.outputs_at(pins, **{k: values[k] for k in LENGTHS})[:, 0, 0]


NOMINAL = float(LINKAGE.outputs_at({})[0, 0, 0])


def allocate_tolerances() -> xr.Dataset:
    """Return the allocation by flexband."""
    inputs = {name: fb.Play(REACH) for name in LINKAGE.pins}
    inputs |= {k: fb.Interval(v - REACH, v + REACH) for k, v in LENGTHS.items()}
    surrogate = fb.expand(point, inputs, fb.AdaptivePCCI(1e-4))
    assert isinstance(surrogate, fb.Surrogate)
    limit = fb.Requirement("response", above=NOMINAL - REACH, below=NOMINAL + REACH)
    return fb.analysis.allocate(surrogate, limit, COSTS, response=point)


def farthest(tolerances: np.ndarray) -> np.ndarray:
    """Return how far the point is from its nominal place at most, to both sides, (2,)."""
    pins = len(LINKAGE.pins)
    distances = np.zeros(2)
    for corner in product((-1.0, 1.0), repeat=len(LENGTHS)):
        sizes = {
            name: np.array([length + side * t])
            for (name, length), side, t in zip(
                LENGTHS.items(), corner, tolerances[pins:], strict=True
            )
        }

        def values(pairs: np.ndarray, sizes: dict[str, np.ndarray] = sizes) -> np.ndarray:
            pairs_by_pin = dict(zip(LINKAGE.pins, pairs, strict=True))
            return LINKAGE.outputs_at(pairs_by_pin, **sizes)[:, 0]

        low, high = ends(values, tolerances[:pins], tries=1, count=200)[:, 0]
        distances = np.maximum(distances, [NOMINAL - low, high - NOMINAL])
    return distances


def least_cost() -> float:
    """Return the least cost over the exact sets."""
    costs = np.array(list(COSTS.values()))
    start = np.log(np.full(len(costs), REACH / len(costs) / 2))
    solution = minimize(
        lambda x: np.sum(costs / np.exp(x)) * REACH / costs.sum(),
        start,
        method="SLSQP",
        bounds=[(None, np.log(REACH))] * len(costs),
        constraints={"type": "ineq", "fun": lambda x: 1 - farthest(np.exp(x)) / REACH},
        options={"ftol": 1e-8, "eps": 1e-4},
    )
    assert farthest(np.exp(solution.x)).max() < REACH * (1 + 1e-5)
    return float(np.sum(costs / np.exp(solution.x)))


def main() -> None:
    """Print both costs."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    exact = least_cost()
    plan = allocate_tolerances()
    cost = plan.attrs["cost"]
    print(f"exact {exact:.6g}, allocated {cost:.6g}, {100 * (cost / exact - 1):+.3f} %")


if __name__ == "__main__":
    main()
