"""Whether verdicts and intervals of probabilities hold, whatever the surrogate misses in its tails.

A response f(x, y) + c e of two standard normal inputs and an interval is even, odd, a product, a
centred product, a ridge, has a kink or a pole. It is expanded with orders that may be blind to it,
by PCCI, improved PCCI, perturbation or regression. The probability of exceeding a limit, from 0.3
to 10⁻⁵, is known: for every y, all crossings on a fine grid of x are found, and the normal
distribution function says how likely x is to be between two of them.

``python -m benchmarks.probability.judged_tails --samples 200`` prints how many verdicts and
intervals are wrong.
"""

from __future__ import annotations

import argparse
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.special import ndtr
from scipy.stats import norm

import flexband as fb

SEED = 410_000
LARGEST = 0.3
LEAST = 1e-5
"""Levels of the probability, between which its logarithm is uniform."""

FARTHEST = 7.5
POINTS = 3001
NODES = 301
"""Largest |x| and |y|, and points of each."""

Formula = Callable[[np.ndarray, np.ndarray], np.ndarray]


def even(rng: np.random.Generator) -> Formula:
    """Return cosh, cos or a square of x, and b y."""
    a = rng.uniform(0.3, 1.2)
    b = rng.uniform(-0.4, 0.4)
    kind = rng.integers(3)
    shape = (lambda x: np.cosh(a * x), lambda x: -np.cos(0.8 * a * x), lambda x: a * x**2)[kind]
    return lambda x, y: shape(x) + b * y


def odd(rng: np.random.Generator) -> Formula:
    """Return sinh, a cube or an inverse tangent of x, and b y."""
    a = rng.uniform(0.3, 1.2)
    b = rng.uniform(-0.4, 0.4)
    kind = rng.integers(3)
    shapes = (
        lambda x: np.sinh(a * x),
        lambda x: x + 0.2 * a * x**3,
        lambda x: np.arctan(2 * a * x),
    )
    return lambda x, y: shapes[kind](x) + b * y


def product(rng: np.random.Generator) -> Formula:
    """Return x + b y + a x y."""
    a = rng.uniform(0.2, 1.0)
    b = rng.uniform(0.0, 1.0)
    return lambda x, y: x + b * y + a * x * y


def centred_product(rng: np.random.Generator) -> Formula:
    """Return a x y, or a (x² − 1) y, of which no single variable tells."""
    a = rng.uniform(0.3, 1.0)
    b = rng.uniform(0.0, 0.1)
    power = rng.integers(1, 3)
    return lambda x, y: a * (x if power == 1 else x**2 - 1) * y + b * x


def ridge(rng: np.random.Generator) -> Formula:
    """Return a function of one direction."""
    angle = rng.uniform(0, np.pi)
    a = rng.uniform(0.3, 0.9)
    kind = rng.integers(3)
    shape = (np.exp, np.tanh, lambda z: np.logaddexp(0, 3 * z - 3))[kind]
    return lambda x, y: shape(a * (np.cos(angle) * x + np.sin(angle) * y)) + 0.05 * y


def kink(rng: np.random.Generator) -> Formula:
    """Return x + a y + b max(0, x − c), or |x − c| + a y."""
    a = rng.uniform(-0.5, 0.5)
    b = rng.uniform(0.5, 3.0)
    c = rng.uniform(-1.0, 2.5)
    if rng.integers(2):
        return lambda x, y: np.abs(x - c) + a * y
    return lambda x, y: x + a * y + b * np.maximum(0.0, x - c)


def pole(rng: np.random.Generator) -> Formula:
    """Return a function that is large beyond all runs of low order: 1/cos, or a resonance."""
    a = rng.uniform(0.1, 0.35)
    b = rng.uniform(0.0, 0.2)
    d = rng.uniform(1.15, 2.0)
    if rng.integers(2):
        return lambda x, y: 1 / np.cos(1.5 * np.tanh(a * x)) + b * y
    return lambda x, y: (1 + 0.3 * b * y) / (d - np.tanh(2 * a * x))


FORMULAS = (even, odd, product, centred_product, ridge, kink, pole)


def method_of(rng: np.random.Generator) -> Any:
    """Return a method with given orders."""
    order = int(rng.integers(1, 6))
    interval = int(rng.integers(1, 4))
    return rng.choice(
        [
            fb.PCCI(order, interval),
            fb.ImprovedPCCI(order, interval),
            fb.methods.PerturbationChebyshev(interval),
            fb.methods.RegressionPCCI(order),
        ],
        p=[0.4, 0.3, 0.15, 0.15],
    )


@dataclass(frozen=True)
class Case:
    """A formula, the slope c of e, a method, the side of the limit and the probability."""

    kind: str
    formula: Formula
    slope: float
    method: Any
    above: bool
    level: float
    factor: float  # of the probability that is allowed

    @staticmethod
    def draw(seed: int) -> Case:
        """Return a case; the formulas take turns."""
        rng = np.random.default_rng(seed)
        kind = FORMULAS[seed % len(FORMULAS)]
        formula = kind(rng)
        method = method_of(rng)
        level = float(np.exp(rng.uniform(np.log(LEAST), np.log(LARGEST))))
        x, y = rng.standard_normal((2, 1000))
        slope = float(rng.choice([0.0, 0.2]) * formula(x, y).std())
        above = bool(rng.integers(2))
        factor = float(np.exp(rng.choice([-1, 1]) * rng.uniform(np.log(1.1), np.log(10))))
        return Case(kind.__name__, formula, slope, method, above, level, factor)

    def response(self, x: np.ndarray, y: np.ndarray, e: np.ndarray) -> np.ndarray:
        """Return the response, (samples, 1)."""
        sign = -1.0 if self.above else 1.0
        return sign * (self.formula(x, y) + self.slope * e)[:, None]

    def probability(self, values: np.ndarray, limit: float) -> float:
        """Return the probability of exceeding a limit, of values on the grid at the worst e."""
        x = np.linspace(-FARTHEST, FARTHEST, POINTS)
        y = np.linspace(-FARTHEST, FARTHEST, NODES)
        excess = values - limit
        first = excess[:, :-1]
        second = excess[:, 1:]
        cross = first * second < 0
        part = np.divide(first, first - second, out=np.zeros(first.shape), where=cross)
        place = ndtr(x[:-1] + part * np.diff(x))
        low = ndtr(x[:-1])
        high = ndtr(x[1:])
        chance = np.where(
            cross,
            np.where(second > 0, high - place, place - low),
            np.where(first > 0, high - low, 0.0),
        )
        return float(np.trapezoid(norm.pdf(y) * chance.sum(axis=1), y))

    def limit(self, level: float) -> float:
        """Return the limit that is exceeded with a probability at the worst e."""
        x = np.linspace(-FARTHEST, FARTHEST, POINTS)
        y = np.linspace(-FARTHEST, FARTHEST, NODES)
        sign = -1.0 if self.above else 1.0
        values = sign * self.formula(x[None], y[:, None]) + self.slope
        low = float(values.min())
        high = float(values.max())
        for _ in range(60):
            middle = (low + high) / 2
            exceeds_level = self.probability(values, middle) > level
            low, high = (middle, high) if exceeds_level else (low, middle)
        return high

    def width(self) -> float:
        """Return the width of μ ± σ over the interval."""
        x, y = np.random.default_rng(0).standard_normal((2, 20_000))
        return 2 * float(self.formula(x, y).std()) + 2 * self.slope


@dataclass(frozen=True)
class Outcome:
    """What a study states of a case."""

    case: Case
    verdict: str
    low: float
    high: float
    margin: float  # between the limit and that of the allowed probability, in parts of the width

    @property
    def right(self) -> str:
        """The verdict that is right."""
        return "PASS" if self.case.factor >= 1 else "FAIL"

    @property
    def covers_level(self) -> bool:
        """Whether the interval holds the probability."""
        return self.low <= self.case.level <= self.high

    @property
    def wrong(self) -> bool:
        """Whether the verdict is contradicted."""
        return self.verdict not in (self.right, "UNDECIDED")


def outcome(case: Case) -> Outcome:
    """Return the verdict of a study of a case, and its interval of the probability."""
    allowed_probability = min(0.999, case.level * case.factor)
    limit = case.limit(case.level)
    margin = abs(limit - case.limit(allowed_probability)) / case.width()
    requirement = fb.Requirement(
        "q", below=limit, criterion=fb.analysis.Probability(allowed_probability)
    )
    inputs = {"x": fb.Normal(0, 1), "y": fb.Normal(0, 1), "e": fb.Interval(-1, 1)}
    study = fb.Study(case.response, inputs, case.method, requirements=[requirement])
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        (verdict,) = study.run_in(folder, fb.RunOptions(failed="stop")).verdicts
    _, low, high = verdict.share
    return Outcome(case, str(verdict.verdict), low, high, margin)


def summary(outcomes: list[Outcome]) -> dict[str, Any]:
    """Return the rates of some outcomes."""
    frequent_results = [result for result in outcomes if result.case.level >= 1e-3]
    spans = [result.high / max(result.low, 1e-300) for result in frequent_results]
    clear_results = [result for result in outcomes if not 0.5 < result.case.factor < 2]
    undecided_results = [result for result in clear_results if result.verdict == "UNDECIDED"]
    return {
        "cases": len(outcomes),
        "PASS that is FAIL": sum(result.wrong and result.right == "FAIL" for result in outcomes),
        "FAIL that is PASS": sum(result.wrong and result.right == "PASS" for result in outcomes),
        "intervals that miss": sum(not result.covers_level for result in outcomes),
        "high/low for P ≥ 1e-3, median": round(float(np.median(spans)), 2) if spans else None,
        "allowed is a factor of 2 off or more": len(clear_results),
        "of these undecided": len(undecided_results),
        "margin above 5 % of the width": sum(result.margin > 0.05 for result in outcomes),
        "of these undecided, too": sum(
            result.margin > 0.05 and result.verdict == "UNDECIDED" for result in outcomes
        ),
        "verdicts": dict(Counter(result.verdict for result in outcomes)),
    }


def main() -> None:
    """Draw cases and print how many statements are wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=200)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    outcomes = []
    for seed in range(options.seed, options.seed + options.samples):
        outcomes.append(result := outcome(Case.draw(seed)))
        if result.wrong or not result.covers_level:
            case = result.case
            print(
                f"{seed} {case.kind} {case.method.label}: P = {case.level:.3g}, allowed "
                f"{case.level * case.factor:.3g}, {result.verdict}, "
                f"{result.low:.3g} … {result.high:.3g}"
            )
    for name, number in summary(outcomes).items():
        print(f"{name}: {number}")


if __name__ == "__main__":
    main()
