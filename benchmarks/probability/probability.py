"""Whether stated intervals hold the largest probability over interval inputs, on random functions.

A response c(η) + a(η)·x of standard normal x, with polynomials c and a, exceeds a limit L with the
probability Φ(−(L − c)/|a|). The largest over the box is p where L is the maximum of
c − Φ⁻¹(p) |a|, at a vertex or inside. Surrogates of these functions are exact, so that what is off
is due to sampling and to the search over the box. Widths are compared with those of as many samples
at the known maximum. With --narrowed, the box is narrowed around that maximum instead, which must
not make the largest probability larger.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.special import ndtri

import flexband as fb
from benchmarks.harness import options, report
from flexband.analysis.probability.estimates import TWO_SIDED, estimate
from flexband.analysis.probability.states import LimitState
from flexband.analysis.probability.subset import rare
from flexband.requirements.requirement import corridors
from flexband.uncertainty.inputs.sampling import sobol

SEED = 18_000
LARGEST = 0.3
LEAST = 1e-6
"""Levels of the largest probability, between which its logarithm is uniform."""

SCANNED = 2048
POLISHED = 6
"""Points of the box at which the maximum is looked for, and from which it is improved."""


NARROWED = 0.5
"""Distance of the ends of a narrower box from the known maximum, inside the whole one."""


@dataclass(frozen=True)
class Case:
    """A response of interval and random inputs, and its largest probability.

    Attributes
    ----------
    linear, quadratic : of c: slopes, and curvatures about `center`, (m,) each.
    slopes : of a: a(η) = slopes[0] + slopes[1:]ᵀ η, (1 + m, n).
    """

    linear: np.ndarray
    quadratic: np.ndarray
    center: np.ndarray
    slopes: np.ndarray
    level: float

    @staticmethod
    def draw(seed: int) -> Case:
        """Return a case; every other has its maximum inside the box in most directions."""
        rng = np.random.default_rng(seed)
        m = int(rng.integers(1, 4))
        n = int(rng.integers(2, 4))
        inside = rng.random(m) < (0.9 if seed % 2 else 0.1)
        quadratic = np.where(inside, rng.uniform(0.3, 3.0, m), rng.uniform(-0.3, 0.1, m))
        linear = np.where(inside, rng.normal(0, 0.1, m), rng.normal(0, 0.5, m))
        slopes = np.concatenate([rng.normal(0, 0.6, (1, n)), rng.normal(0, 0.1, (m, n))])
        level = float(np.exp(rng.uniform(np.log(LEAST), np.log(LARGEST))))
        return Case(linear, quadratic, rng.uniform(-0.7, 0.7, m), slopes, level)

    @property
    def inputs(self) -> dict[str, Any]:
        """The inputs: η first."""
        m = len(self.linear)
        n = self.slopes.shape[1]
        intervals = {f"e{k}": fb.Interval(-1, 1) for k in range(m)}
        return intervals | {f"x{k}": fb.Normal(0, 1) for k in range(n)}

    def parts(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return c and a at η (points, m): (points,) and (points, n)."""
        c = eta @ self.linear - ((eta - self.center) ** 2) @ self.quadratic
        return c, self.slopes[0] + eta @ self.slopes[1:]

    def response(self, inputs: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the response, (samples, 1)."""
        columns = np.stack(list(inputs.values()), axis=1)
        m = len(self.linear)
        c, a = self.parts(columns[:, :m])
        return (c + np.sum(a * columns[:, m:], axis=1))[:, None]

    def limit(self) -> tuple[float, np.ndarray]:
        """Return L, and the η of the largest probability."""
        m = len(self.linear)
        k = -float(ndtri(self.level))

        def negative_height(eta: np.ndarray) -> np.ndarray:
            c, a = self.parts(np.atleast_2d(eta))
            return -(c + k * np.linalg.norm(a, axis=1))

        points = np.concatenate([np.array(list(product((-1.0, 1.0), repeat=m))),
                                 2 * sobol(SCANNED, m) - 1])  # fmt: skip
        best = points[np.argsort(negative_height(points))[:POLISHED]]
        optima = [
            minimize(lambda eta: negative_height(eta)[0], at, bounds=[(-1, 1)] * m, tol=1e-13)
            for at in best
        ]
        lowest: Any = min(optima, key=lambda optimum: optimum.fun)
        return -float(lowest.fun), lowest.x

    def surrogate(self) -> Any:
        """Return the exact surrogate."""
        names = list(self.inputs)

        def response(**inputs: np.ndarray) -> np.ndarray:
            return self.response({name: inputs[name] for name in names})

        response.__signature__ = _signature(names)  # pyright: ignore[reportFunctionMemberAccess]
        return fb.expand(response, self.inputs, fb.PCCI(2, 3))  # with orders to spare


def _signature(names: list[str]) -> Any:
    from inspect import Parameter, Signature  # noqa: PLC0415

    return Signature([Parameter(name, Parameter.KEYWORD_ONLY) for name in names])


@dataclass(frozen=True)
class Outcome:
    """What was stated of a case: ln of estimate, low and high over the largest probability.

    `width` is that of the interval, in logarithms, over that of as many samples at the maximum.
    """

    off: np.ndarray
    width: float
    seconds: float

    @property
    def covers_level(self) -> bool:
        """Whether the interval holds the largest probability."""
        return bool(self.off[1] <= 0 <= self.off[2])


def outcome(case: Case, seed: int) -> Outcome:
    """Return what `failure_probability` states of a case."""
    surrogate = case.surrogate()
    height, eta = case.limit()
    limit = fb.Requirement("response", below=height)
    start = time.process_time()
    result = (
        fb.analysis.failure_probability(surrogate, limit, seed=seed)
        .sel(bound="upper")
        .isel(limit=0)
    )
    seconds = time.process_time() - start
    answers = [float(result[k]) for k in ("probability", "confidence_low", "confidence_high")]
    rng = np.random.default_rng(seed)
    (corridor,) = corridors(limit, surrogate.labels).values()
    state = LimitState.from_surrogate(
        surrogate, [corridor], np.zeros(surrogate.labels.shape[1:]), rng
    )
    rare_samples = rare(
        lambda u: state.least_margins(u, eta), surrogate.space.random_dimension, rng
    )
    at = estimate(state, state, eta, rare_samples, 0.025, rng)
    reference_width = 2 * TWO_SIDED * at.error / at.probability
    reference_width *= np.sqrt(len(at.u) / float(result["samples"]))
    off = np.log(np.maximum(answers, 1e-300) / case.level)
    return Outcome(off, float(off[2] - off[1]) / reference_width, seconds)


def rise(case: Case, seed: int) -> tuple[float, bool]:
    """Return by how much the probability rises in a narrower box, and if it leaves the interval."""
    surrogate = case.surrogate()
    height, eta = case.limit()
    limit = fb.Requirement("response", below=height)
    ends = zip(np.maximum(eta - NARROWED, -1.0), np.minimum(eta + NARROWED, 1.0), strict=True)
    narrow_intervals = {f"e{k}": fb.Interval(*map(float, pair)) for k, pair in enumerate(ends)}
    wide_result, narrow_result = (
        fb.analysis.failure_probability(box_surrogate, limit, seed=seed)
        .sel(bound="upper")
        .isel(limit=0)
        for box_surrogate in (surrogate, surrogate.narrowed(**narrow_intervals))
    )
    change = float(narrow_result["probability"] / wide_result["probability"]) - 1
    return change, bool(narrow_result["probability"] > wide_result["confidence_high"])


def narrowing(arguments: Any) -> None:
    """Report how often, and how far, the probability rises in narrower boxes."""
    seeds = range(arguments.seed, arguments.seed + arguments.samples)
    rises, above = map(np.array, zip(*(rise(Case.draw(k), k) for k in seeds), strict=True))
    header = ["cases", "rises", "most", "above the stated interval"]
    row = [str(len(rises)), str(int((rises > 0).sum())), f"{100 * rises.max():.1f} %",
           str(int(above.sum()))]  # fmt: skip
    report(arguments.output, "probability_narrowed", header, [row], {"rises": rises.tolist()})


def main() -> None:
    arguments = options(
        __doc__,
        200,
        seed=(SEED, "of the first case"),
        narrowed=(0, "1 to narrow the box around the maximum instead"),
    )
    if arguments.narrowed:
        narrowing(arguments)
        return
    results = [
        outcome(Case.draw(k), k) for k in range(arguments.seed, arguments.seed + arguments.samples)
    ]
    off = np.array([result.off for result in results])
    groups = {
        "all": np.ones(len(results), dtype=bool),
        "even (vertex)": np.arange(arguments.seed, arguments.seed + len(results)) % 2 == 0,
        "odd (inside)": np.arange(arguments.seed, arguments.seed + len(results)) % 2 == 1,
    }
    rows = []
    for name, group_mask in groups.items():
        part = [result for result, member in zip(results, group_mask, strict=True) if member]
        if not part:
            continue
        rows.append([
            name, str(len(part)),
            f"{100 * np.mean([result.covers_level for result in part]):.1f} %",
            str(int(np.sum(off[group_mask, 2] < 0))), str(int(np.sum(off[group_mask, 1] > 0))),
            f"{100 * np.median(off[group_mask, 0]):.1f} %",
            f"{100 * np.abs(off[group_mask, 0]).max():.1f} %",
            f"{np.median([result.width for result in part]):.2f}",
            f"{np.median([result.seconds for result in part]):.2f}",
        ])  # fmt: skip
    header = ["maxima", "cases", "held", "too low", "too high", "off, median", "off, most",
              "width, median", "CPU s"]  # fmt: skip
    worst = np.argsort(-np.abs(off[:, 0]))[:5]
    notes = [f"farthest off: seeds {(arguments.seed + worst).tolist()}"]
    report(arguments.output, "probability", header, rows, {"off": off.tolist()}, notes)


if __name__ == "__main__":
    main()
