"""Claims and runs for responses to four of 10 to 30 inputs: sparse polynomials up to order three.

Six to fifteen terms are drawn, products of centred inputs among them. The bands are known from a
Gauss rule for the normal inputs and a grid for the intervals.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.polynomial.hermite_e import hermegauss

import flexband as fb
from benchmarks.harness import options, report

ACTIVE = 4
GRID = {1: 801, 2: 81, 3: 25}
"""Points of the grid for so many intervals."""


class Polynomial:
    """A response to four of many inputs."""

    def __init__(self, seed: int):
        r = np.random.default_rng([seed, 77])
        self.names = [f"p{k:02d}" for k in range(int(r.integers(10, 31)))]
        random = r.random(len(self.names)) < 0.6
        which = r.permutation(len(self.names))[:ACTIVE]
        random[which[0]] = False
        random[which[1]] = True  # both kinds matter
        self.inputs = {
            name: fb.Normal(0.0, 1.0) if is_random else fb.Interval(-1.0, 1.0)
            for name, is_random in zip(self.names, random, strict=True)
        }
        self.active = [self.names[k] for k in which]
        self.random = random[which]
        terms = set[tuple[int, ...]]()
        count = int(r.integers(6, 16))
        while len(terms) < count:
            factors = r.integers(ACTIVE, size=int(r.integers(1, 4)))
            terms.add(tuple(np.bincount(factors, minlength=ACTIVE).tolist()))
        self.orders = np.array(sorted(terms))
        size = r.uniform(0.2, 1.0, count) * r.choice([-1, 1], count)
        self.coefficients = size * 0.7 ** (self.orders.sum(axis=1) - 1)

    def values(self, x: np.ndarray) -> np.ndarray:
        """Return the response at active inputs, (…, 4)."""
        return np.prod(x[..., None, :] ** self.orders, axis=-1) @ self.coefficients

    def response(self, **values: np.ndarray) -> np.ndarray:
        return self.values(np.stack([values[name] for name in self.active], axis=-1))

    def bands(self) -> np.ndarray:
        """Return interval mean and interval error bar, (2, 2)."""
        z, weights = hermegauss(12)
        n = int(self.random.sum())
        xi = np.array(list(product(z, repeat=n)))
        w = np.array([np.prod(factors) for factors in product(weights / weights.sum(), repeat=n)])
        grid = np.linspace(-1.0, 1.0, GRID[ACTIVE - n])
        means = []
        deviations = []
        for eta in product(grid, repeat=ACTIVE - n):
            x = np.empty((len(xi), ACTIVE))
            x[:, self.random] = xi
            x[:, ~self.random] = eta
            values = self.values(x)
            means.append(w @ values)
            deviations.append(np.sqrt(w @ (values - means[-1]) ** 2))
        mean = np.array(means)
        std = np.array(deviations)
        return np.array([[mean.min(), mean.max()], [(mean - std).min(), (mean + std).max()]])


def main() -> None:
    arguments = options(
        __doc__, 100, seed=(0, "first seed"), max_runs=("60,200", "budgets, separated by commas")
    )
    smallest_error = 2e-5
    rows = []
    for budget in map(int, arguments.max_runs.split(",")):
        runs = []
        errors = []
        claims = []
        for seed in range(arguments.seed, arguments.seed + arguments.samples):
            case = Polynomial(seed)
            bands = fb.propagate(case.response, case.inputs, fb.AdaptivePCCI(0.01, budget))
            exact = case.bands()
            band_values = np.array([bands["mean"].values, bands["error_bar"].values])
            errors.append(np.abs(band_values - exact).mean(axis=1).max() / np.ptp(exact[1]))
            claims.append(bands.attrs["expected_error"])
            runs.append(bands.attrs["runs"])
        true, claim = (np.maximum(values, smallest_error) for values in (errors, claims))
        rows.append([
            str(budget), str(len(runs)), f"{np.median(runs):.0f}", f"{np.quantile(runs, 0.9):.0f}",
            f"{100 * np.mean(true <= 0.01):.0f} %", f"{np.median(claim / true):.2g}",
            str(np.count_nonzero(true > 5 * claim)),
        ])  # fmt: skip
    header = ["budget", "responses", "runs, median", "runs, 90 %", "error of 1 % or less",
              "claim / true, median", "too small by 5"]  # fmt: skip
    notes = [f"seeds from {arguments.seed} on"]
    report(arguments.output, "few_inputs", header, rows, {}, notes)


if __name__ == "__main__":
    main()
