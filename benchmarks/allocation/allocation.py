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

    def made(m: int) -> Callable[[np.ndarray], np.ndarray]:
        slopes = smooth(rng, m)
        return lambda x: x @ slopes

    return made


def quadratic(rng: np.random.Generator) -> Callable[[int], Callable[[np.ndarray], np.ndarray]]:
    """Return responses that are quadratic in their inputs."""

    def made(m: int) -> Callable[[np.ndarray], np.ndarray]:
        slopes, bends = smooth(rng, m), 0.5 * smooth(rng, m * m).reshape(m, m, -1)
        return lambda x: x @ slopes + np.einsum("pi,pj,ijt->pt", x, x, bends)

    return made


def smooth(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return random functions of time, (count, times)."""
    waves = np.array([np.cos(np.pi * k * TIMES) for k in range(5)])
    return rng.standard_normal((count, 5)) @ waves


def four_bar(rng: np.random.Generator) -> Callable[[int], Callable[[np.ndarray], np.ndarray]]:
    """Return angles of the rocker of a four-bar whose crank turns once."""

    def made(m: int) -> Callable[[np.ndarray], np.ndarray]:
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

    return made


def ringing(rng: np.random.Generator) -> Callable[[int], Callable[[np.ndarray], np.ndarray]]:
    """Return deflections of an oscillator that is released, and driven at a low frequency."""

    def made(m: int) -> Callable[[np.ndarray], np.ndarray]:
        frequency, damping = 2 * np.pi * rng.uniform(4, 12), rng.uniform(0.005, 0.03)
        phase = rng.uniform(0, 2 * np.pi)

        def values(x: np.ndarray) -> np.ndarray:
            start, omega, drive = ((1 + own * x[:, k, None]) for k, own in
                                   enumerate((0.1, 0.03, 0.1)))  # fmt: skip
            ring = np.exp(-damping * omega * frequency * TIMES) * np.cos(omega * frequency * TIMES)
            return start * ring + drive * np.sin(2 * np.pi * TIMES + phase)

        return values

    return made


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


def cheapest(one: Case, rng: np.random.Generator) -> float:
    """Return the least cost with which limits are kept on a grid, by an exchange of its points."""
    grid = np.array(list(product(np.linspace(-1, 1, 5 if one.m < 5 else 3), repeat=one.m)))
    best = np.inf
    for k in range(4):
        y = rng.uniform(-3, 0, one.m) if k else np.full(one.m, -1.0)
        chosen = []
        for _ in range(30):
            off = np.abs(one.deviations(np.exp(y) * grid)) - one.limit
            worst = off.argmax(axis=0)
            new = [(int(p), t) for t, p in enumerate(worst)]
            if chosen and off.max() < 1e-7 * one.limit.max():
                best = min(best, float((one.costs / np.exp(y)).sum()))
                break
            chosen = sorted({*chosen, *new})
            y = solved(one, grid, chosen, y)
    return best


def solved(one: Case, grid: np.ndarray, chosen: list[tuple[int, int]], y: np.ndarray) -> np.ndarray:
    """Return logarithms of the cheapest tolerances that keep limits at some points and times."""
    point, at = np.array(chosen).T
    own, row = np.unique(point, return_inverse=True)

    def margins(v: np.ndarray) -> np.ndarray:
        off = np.abs(one.deviations(np.exp(v) * grid[own]))
        return 1 - off[row, at] / one.limit[at]

    def slopes(v: np.ndarray) -> np.ndarray:
        steps = 1e-5 * np.eye(one.m)
        return np.array([(margins(v + d) - margins(v - d)) / 2e-5 for d in steps]).T

    found = minimize(
        lambda v: np.log((one.costs / np.exp(v)).sum()),
        y,
        bounds=[(np.log(1e-4), 0.0)] * one.m,
        constraints={"type": "ineq", "fun": margins, "jac": slopes},
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-12},
    )
    return np.clip(found.x, np.log(1e-4), 0.0)


def judged(family: str, seed: int, tolerance: float) -> dict[str, float]:
    """Return how a case is allocated."""
    one = case(family, seed)
    rng = np.random.default_rng(seed)
    inputs = {f"x{k}": fb.Interval(-1.0, 1.0) for k in range(one.m)}
    surrogate = fb.expand(one.response, inputs, fb.AdaptivePCCI(tolerance))
    assert isinstance(surrogate, fb.Surrogate)
    began = time.perf_counter()
    found = fb.analysis.allocate(
        surrogate, fb.Limit(below=one.limit, above=-one.limit),
        {name: float(cost) for name, cost in zip(inputs, one.costs, strict=True)},
        response=one.response,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    t = found["tolerance"].sel(name=list(inputs)).values
    places = np.concatenate([corners(one.m), rng.uniform(-1, 1, (INSIDE, one.m))])
    beyond = (np.abs(one.deviations(t * places)) / one.limit).max() - 1
    return {
        "confirmed": float(found.attrs["confirmed"] == "yes"),
        "beyond": float(beyond),
        "cost": float(found.attrs["cost"]) / cheapest(one, rng) - 1,
        "runs": float(surrogate.diagnostics.attrs["runs"]),
        "further": float(found.attrs["runs"]),
        "seconds": seconds,
    }


def main() -> None:
    chosen = options(
        __doc__,
        40,
        seed=(SEED, "of the first case"),
        tolerance=(1e-3, "of the surrogates"),
        constants="such as looser=2,margin_tolerance=0.05",
        families=(",".join(FAMILIES), "of the cases"),
    )
    defaults = confirmation.confirm_tolerances.__kwdefaults__
    for text in filter(None, chosen.constants.split(",")):
        name, value = text.split("=")
        kind = type(getattr(defaults["options"], name))
        defaults["options"] = replace(defaults["options"], **{name: kind(float(value))})
    rows = []
    data = {}
    for family in chosen.families.split(","):
        found = [judged(family, chosen.seed + k, chosen.tolerance) for k in range(chosen.samples)]
        own = {name: np.array([one[name] for one in found]) for name in found[0]}
        data[family] = {name: values.tolist() for name, values in own.items()}
        rows.append([
            family,
            f"{own['confirmed'].sum():.0f} of {len(found)}",
            f"{(own['beyond'] > 1e-6).sum()}, {max(0.0, own['beyond'].max()):.1e}",
            f"{np.median(own['cost']):.1e}",
            f"{own['cost'].min():.1e} to {own['cost'].max():.1e}",
            f"{np.median(own['runs']):.0f} + {np.median(own['further']):.0f}",
            f"{(own['runs'] + own['further']).max():.0f}",
            f"{np.median(own['seconds']):.2g}, {own['seconds'].max():.2g}",
        ])  # fmt: skip
    header = ["family", "confirmed", "beyond limits, by", "cost above, median", "from to",
              "runs, median", "most", "seconds, median and most"]  # fmt: skip
    report(chosen.output, "allocation", header, rows, data)


if __name__ == "__main__":
    main()
