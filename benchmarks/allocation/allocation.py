"""Allocated tolerances against exhaustive searches on the response itself, on random cases.

Families: linear and quadratic responses at 41 times, four-bars of random lengths whose crank turns,
ringing oscillators. Costs are Σ B/t with random B; limits leave random parts of the range, so that
tolerances are some tenths of the largest. The reference is the cheapest set of tolerances whose
margins are kept at all points of a grid of the box, by sequential quadratic programming from
several starts. `--constants` sets others than those of `allocation.confirmation`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import xarray as xr
from scipy.optimize import minimize

import flexband as fb
from benchmarks.harness import options, report
from flexband.analysis.allocation import confirmation

SEED = 16_000
TIMES = np.linspace(0.0, 1.0, 41)
INSIDE = 3000
"""Random places at which limits are checked, besides vertices."""


@dataclass(frozen=True)
class Case:
    """A response of inputs from −1 to 1, with limits and costs.

    Attributes
    ----------
    values : returns the response, (points, times), at inputs (points, m).
    m : number of inputs.
    limit : |response − nominal| may be so large, (times,).
    costs : B of each input.
    """

    values: Callable[[np.ndarray], np.ndarray]
    m: int
    limit: np.ndarray
    costs: np.ndarray

    def response(self, **inputs: np.ndarray) -> xr.DataArray:
        """Return the difference from the nominal response."""
        x = np.stack([inputs[f"x{k}"] for k in range(self.m)], axis=1)
        return xr.DataArray(self.deviations(x), {"time": TIMES}, ("sample", "time"))

    def deviations(self, x: np.ndarray) -> np.ndarray:
        """Return differences from the nominal response, (points, times)."""
        return self.values(x) - self.values(np.zeros((1, self.m)))


def linear(rng: np.random.Generator) -> Callable[[int], Callable[[np.ndarray], np.ndarray]]:
    """Return responses that are linear in their inputs."""

    def make_values(m: int) -> Callable[[np.ndarray], np.ndarray]:
        slopes = smooth(rng, m)
        return lambda x: x @ slopes

    return make_values


def quadratic(rng: np.random.Generator) -> Callable[[int], Callable[[np.ndarray], np.ndarray]]:
    """Return responses that are quadratic in their inputs."""

    def make_values(m: int) -> Callable[[np.ndarray], np.ndarray]:
        slopes = smooth(rng, m)
        bends = 0.5 * smooth(rng, m * m).reshape(m, m, -1)
        return lambda x: x @ slopes + np.einsum("pi,pj,ijt->pt", x, x, bends)

    return make_values


def smooth(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return random functions of time, (count, times)."""
    waves = np.array([np.cos(np.pi * k * TIMES) for k in range(5)])
    return rng.standard_normal((count, 5)) @ waves


def four_bar(rng: np.random.Generator) -> Callable[[int], Callable[[np.ndarray], np.ndarray]]:
    """Return angles of the rocker of a four-bar whose crank turns once."""

    def make_values(m: int) -> Callable[[np.ndarray], np.ndarray]:
        while True:
            sizes = rng.uniform([0.2, 0.8, 0.6, 0.9], [0.5, 1.6, 1.4, 1.5])
            crank, coupler, rocker, ground = sizes
            reach = ground + crank, ground - crank
            if reach[0] < 0.93 * (coupler + rocker) and reach[1] > 1.07 * abs(coupler - rocker):
                break
        gamma = 2 * np.pi * TIMES

        def values(x: np.ndarray) -> np.ndarray:
            a, b, c, g = (sizes * (1 + 0.01 * x[:, :4])).T[:, :, None]
            px = a * np.cos(gamma) - g
            py = a * np.sin(gamma)
            d2 = px**2 + py**2
            inner = np.arccos((b**2 - c**2 - d2) / (2 * c * np.sqrt(d2)))
            return np.unwrap(np.arctan2(-py, -px) + inner, axis=1)

        return values

    return make_values


def ringing(rng: np.random.Generator) -> Callable[[int], Callable[[np.ndarray], np.ndarray]]:
    """Return deflections of an oscillator that is released, and driven at a low frequency."""

    def make_values(m: int) -> Callable[[np.ndarray], np.ndarray]:
        frequency = 2 * np.pi * rng.uniform(4, 12)
        damping = rng.uniform(0.005, 0.03)
        phase = rng.uniform(0, 2 * np.pi)

        def values(x: np.ndarray) -> np.ndarray:
            start, omega, drive = ((1 + scatter * x[:, k, None]) for k, scatter in
                                   enumerate((0.1, 0.03, 0.1)))  # fmt: skip
            ring = np.exp(-damping * omega * frequency * TIMES) * np.cos(omega * frequency * TIMES)
            return start * ring + drive * np.sin(2 * np.pi * TIMES + phase)

        return values

    return make_values


FAMILIES = {"linear": linear, "quadratic": quadratic, "four-bar": four_bar, "ringing": ringing}
INPUTS = {"linear": (2, 5), "quadratic": (2, 4), "four-bar": (4, 4), "ringing": (3, 3)}
"""Least and largest number of inputs."""


def case(family: str, seed: int) -> Case:
    """Return a random case."""
    rng = np.random.default_rng(seed)
    low, high = INPUTS[family]
    m = int(rng.integers(low, high + 1))
    values = FAMILIES[family](rng)(m)
    bare = Case(values, m, np.zeros(len(TIMES)), rng.uniform(0.2, 5.0, m))
    reach = np.abs(bare.deviations(corners(m))).max(axis=0)
    part = rng.uniform(0.05, 0.5)
    limit = part * (0.3 * reach.max() + 0.7 * reach)
    return Case(values, m, limit, bare.costs)


def corners(m: int) -> np.ndarray:
    """Return the vertices of the box, (2^m, m)."""
    return np.array(list(product((-1.0, 1.0), repeat=m)))


def cheapest_cost(problem: Case, rng: np.random.Generator) -> float:
    """Return the least cost with which limits are kept on a grid, by an exchange of its points."""
    grid = np.array(list(product(np.linspace(-1, 1, 5 if problem.m < 5 else 3), repeat=problem.m)))
    best = np.inf
    for k in range(4):
        y = rng.uniform(-3, 0, problem.m) if k else np.full(problem.m, -1.0)
        constraints = []
        for _ in range(30):
            excess = np.abs(problem.deviations(np.exp(y) * grid)) - problem.limit
            worst = excess.argmax(axis=0)
            new = [(int(p), t) for t, p in enumerate(worst)]
            if constraints and excess.max() < 1e-7 * problem.limit.max():
                best = min(best, float((problem.costs / np.exp(y)).sum()))
                break
            constraints = sorted({*constraints, *new})
            y = optimize_tolerances(problem, grid, constraints, y)
    return best


def optimize_tolerances(
    problem: Case, grid: np.ndarray, constraints: list[tuple[int, int]], y: np.ndarray
) -> np.ndarray:
    """Return logarithms of the cheapest tolerances that keep limits at some points and times."""
    point, at = np.array(constraints).T
    grid_rows, row = np.unique(point, return_inverse=True)

    def margins(v: np.ndarray) -> np.ndarray:
        deviations = np.abs(problem.deviations(np.exp(v) * grid[grid_rows]))
        return 1 - deviations[row, at] / problem.limit[at]

    def slopes(v: np.ndarray) -> np.ndarray:
        steps = 1e-5 * np.eye(problem.m)
        return np.array([(margins(v + d) - margins(v - d)) / 2e-5 for d in steps]).T

    solution = minimize(
        lambda v: np.log((problem.costs / np.exp(v)).sum()),
        y,
        bounds=[(np.log(1e-4), 0.0)] * problem.m,
        constraints={"type": "ineq", "fun": margins, "jac": slopes},
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-12},
    )
    return np.clip(solution.x, np.log(1e-4), 0.0)


def judge_case(family: str, seed: int, tolerance: float) -> dict[str, float]:
    """Return how a case is allocated."""
    problem = case(family, seed)
    rng = np.random.default_rng(seed)
    inputs = {f"x{k}": fb.Interval(-1.0, 1.0) for k in range(problem.m)}
    surrogate = fb.expand(problem.response, inputs, fb.AdaptivePCCI(tolerance))
    assert isinstance(surrogate, fb.Surrogate)
    began = time.perf_counter()
    allocation = fb.analysis.allocate(
        surrogate, fb.Requirement("response", below=problem.limit, above=-problem.limit),
        {name: float(cost) for name, cost in zip(inputs, problem.costs, strict=True)},
        response=problem.response,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    t = allocation["tolerance"].sel(name=list(inputs)).values
    places = np.concatenate([corners(problem.m), rng.uniform(-1, 1, (INSIDE, problem.m))])
    beyond = (np.abs(problem.deviations(t * places)) / problem.limit).max() - 1
    return {
        "confirmed": float(allocation.attrs["confirmed"] == "yes"),
        "beyond": float(beyond),
        "cost": float(allocation.attrs["cost"]) / cheapest_cost(problem, rng) - 1,
        "runs": float(surrogate.diagnostics.attrs["runs"]),
        "further": float(allocation.attrs["runs"]),
        "seconds": seconds,
    }


def main() -> None:
    arguments = options(
        __doc__,
        40,
        seed=(SEED, "of the first case"),
        tolerance=(1e-3, "of the surrogates"),
        constants="such as looser=2,margin_tolerance=0.05",
        families=(",".join(FAMILIES), "of the cases"),
    )
    defaults = confirmation.confirm_tolerances.__kwdefaults__
    for text in filter(None, arguments.constants.split(",")):
        name, value = text.split("=")
        kind = type(getattr(defaults["options"], name))
        defaults["options"] = replace(defaults["options"], **{name: kind(float(value))})
    rows = []
    values_by_family = {}
    for family in arguments.families.split(","):
        results = [
            judge_case(family, arguments.seed + k, arguments.tolerance)
            for k in range(arguments.samples)
        ]
        columns = {name: np.array([result[name] for result in results]) for name in results[0]}
        values_by_family[family] = {name: values.tolist() for name, values in columns.items()}
        rows.append([
            family,
            f"{columns['confirmed'].sum():.0f} of {len(results)}",
            f"{(columns['beyond'] > 1e-6).sum()}, {max(0.0, columns['beyond'].max()):.1e}",
            f"{np.median(columns['cost']):.1e}",
            f"{columns['cost'].min():.1e} to {columns['cost'].max():.1e}",
            f"{np.median(columns['runs']):.0f} + {np.median(columns['further']):.0f}",
            f"{(columns['runs'] + columns['further']).max():.0f}",
            f"{np.median(columns['seconds']):.2g}, {columns['seconds'].max():.2g}",
        ])  # fmt: skip
    header = ["family", "confirmed", "beyond limits, by", "cost above, median", "from to",
              "runs, median", "most", "seconds, median and most"]  # fmt: skip
    report(arguments.output, "allocation", header, rows, values_by_family)


if __name__ == "__main__":
    main()
