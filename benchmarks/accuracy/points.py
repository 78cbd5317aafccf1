"""Nested points for sparse expansions: errors of bounds and moments against the number of runs.

Every index set Λ has one term and one run for each of its elements. Points that are not nested are
combined on the same set (Smolyak); the table shows their number of runs in brackets.

Errors of formulas are relative to the width of the error bar, as root mean squares over the
formulas. Errors of the parts of the slider–crank (base and envelopes relative to their size, phases
in rad) are L² norms over ξ, the largest over η. The error of its error bar is relative to its size.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
from numpy.polynomial import hermite_e

from benchmarks.accuracy.cases import slider_crank
from benchmarks.accuracy.points_cases import (
    CHOSEN,
    INTERVAL,
    RANDOM,
    Points,
    combination,
    fit,
    formulas,
    sets,
    total_order_set,
)
from benchmarks.harness import options, report
from flexband.uncertainty.expansions.families import HERMITE
from flexband.uncertainty.expansions.hybrid import tensor_points
from flexband.uncertainty.expansions.polynomials import chebyshev_values
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.phases.carriers import Carrier
from flexband.uncertainty.phases.decomposition import Stage, decompose
from flexband.uncertainty.phases.layout import PartColumns

Row = tuple[str, int, dict[str, tuple[int, float]]]
"""Name of the measurement, number of terms, and runs and error by kind of points."""

PARTS = {
    "Σν ≤ 1": total_order_set(3, 1),
    "Σν ≤ 2": total_order_set(3, 2),
    "Σν ≤ 3": total_order_set(3, 3),
    "K at order 0": [v for v in total_order_set(3, 2) if v[1] == 0],
    "K at order 1, alone": [v for v in total_order_set(3, 3) if v[0] + 3 * v[1] + v[2] <= 3],
    "K at order 1": [v for v in total_order_set(3, 3) if v[0] + 2.5 * v[1] + 1.3 * v[2] <= 4],
}
"""Index sets of L, K and E."""

DENSE = 12, 3, 8
"""Orders of the tensor grid on which the parts are compared."""

THIN = 3
"""One of this number of times is compared."""


def formula_rows(m: int, n: int, choices: dict[str, list[Points]], max_terms: int) -> Iterator[Row]:
    """Yield errors of the formulas with m interval and n random variables."""
    f = formulas(m, n)
    eta = tensor_points([np.linspace(-1, 1, {1: 201, 2: 41, 3: 17, 4: 9}.get(m, 1))] * m)
    x, w = hermite_e.hermegauss({1: 40, 2: 20, 3: 12, 4: 8}.get(n, 1))
    xi = tensor_points([x] * n)
    w = np.prod(tensor_points([w / w.sum()] * n), axis=1)
    F = f(np.concatenate([np.repeat(eta, len(xi), 0), np.tile(xi, (len(eta), 1))], axis=1))
    F = F.reshape(len(eta), len(xi), -1)
    true = spread(F, w)
    scale = np.ptp(true[1], axis=0)
    for name, orders in sets(m + n, m, f, max_terms).items():
        errors = {}
        for choice, points in choices.items():
            expansion, runs = fit(f, orders, points, m)
            deviation = np.abs(np.array(bounds(*expansion.moments(eta))) - true) / scale
            errors[choice] = (runs, *np.sqrt(np.mean(deviation**2, axis=(1, 2))))
        for k, what in enumerate(["mean", "error bar"][: 2 if n else 1], start=1):
            yield (
                f"{m} η, {n} ξ, {name}, {what}",
                len(orders),
                {c: (e[0], float(e[k])) for c, e in errors.items()},
            )


def bounds(mean: np.ndarray, std: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return bounds of mean and error bar over the first axis."""
    low = (mean - std).min(0)
    high = (mean + std).max(0)
    return np.stack([mean.min(0), mean.max(0)]), np.stack([low, high])


def part_rows(choices: dict[str, list[Points]], max_terms: int, **version: float) -> Iterator[Row]:
    """Yield errors of the parts of the slider–crank as functions of L, K (intervals) and E."""
    index: dict[tuple[float, ...], int] = {}

    def number(x: np.ndarray) -> np.ndarray:
        keys = map(tuple, (np.round(x, 9) + 0.0).tolist())
        return np.array([index.setdefault(key, len(index)) for key in keys])

    # Number the points of all index sets and of the dense grid.
    index_sets = {name: orders for name, orders in PARTS.items() if len(orders) <= max_terms}
    for orders, points in itertools.product(index_sets.values(), choices.values()):
        for v, _ in combination(orders):
            number(tensor_points([p(q) for p, q in zip(points, v, strict=True)]))
    x, w = hermite_e.hermegauss(DENSE[2] + 1)
    w /= w.sum()
    eta = tensor_points([INTERVAL["scaled zeros"](q) for q in DENSE[:2]])
    dense = number(np.column_stack([np.repeat(eta, len(x), 0), np.tile(x, len(eta))]))
    # Simulate at all points, and split the outputs into base, phase and envelopes.
    case = slider_crank(**version)
    at = np.array(list(index))
    F = case.response(**Space(case.inputs).values(at[:, 2:] * [1.0, 0.0], at[:, :2]))
    F = F.transpose("sample", "output", "time").values
    stage = list(decompose(F, 1e-3))[1]
    F = F[..., ::THIN]
    first = stage.carriers[0]
    carrier = Carrier(first.phase[:, ::THIN], first.envelope[..., ::THIN], first.frequency)
    columns = PartColumns.from_outputs(F.shape[1], 1)
    series = columns.pack(Stage([carrier], stage.base[..., ::THIN]))
    F, truth = (y[dense].reshape(len(eta), len(x), -1) for y in (F, series))
    base_end = F.shape[2]
    phase_end = F.shape[2] + stage.base[..., ::THIN].shape[2]
    parts = {
        "base": slice(base_end),
        "phase": slice(base_end, phase_end),
        "envelopes": slice(phase_end, None),
    }
    # Compare the expansions on the dense grid.
    true = spread(F, w)
    size = np.abs(F).mean()
    for name, orders in index_sets.items():
        errors: dict[str, dict[str, tuple[int, float]]] = {}
        for choice, points in choices.items():
            expansion, runs = fit(lambda at: series[number(at)], orders, points, 2)
            y = expansion.evaluate(np.tile(x, len(eta))[:, None], np.repeat(eta, len(x), axis=0))
            y = y.reshape(len(eta), len(x), -1)
            for part, part_slice in parts.items():
                deviation = np.sqrt(np.einsum("pqs,q->ps", (y - truth)[..., part_slice] ** 2, w))
                unit = 1.0 if part == "phase" else np.abs(truth[..., part_slice]).mean()
                errors.setdefault(part, {})[choice] = (
                    runs,
                    float(deviation.max(axis=0).mean() / unit),
                )
            deviation = np.abs(spread(columns.join(y).reshape(F.shape), w)[1] - true[1]).mean()
            errors.setdefault("error bar", {})[choice] = runs, float(deviation / size)
        for part, errors_by_choice in errors.items():
            yield f"{name}, {part}", len(orders), errors_by_choice


def spread(F: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds of mean and error bar of values of shape (η, ξ, series)."""
    mean = np.einsum("pqs,q->ps", F, w)
    return bounds(mean, np.sqrt(np.einsum("pqs,q->ps", (F - mean[:, None]) ** 2, w)))


def lebesgue(x: np.ndarray, *, random: bool) -> float:
    """Return the maximum of Σ|ℓ_j|; for ξ the maximum of √pdf(ξ) Σ|ℓ_j(ξ)|/√pdf(x_j)."""
    fine, rate = (np.linspace(-14, 14, 5601), 0.25) if random else (np.linspace(-1, 1, 4001), 0.0)
    others = [np.delete(x, j) for j in range(len(x))]
    ell = [np.prod((fine[:, None] - o) / (p - o), axis=1) for p, o in zip(x, others, strict=True)]
    weight = np.exp(rate * (x[:, None] ** 2 - fine**2))
    return float(np.sum(np.abs(ell) * weight, axis=0).max())


def condition(points: Points, *, random: bool) -> float:
    """Return the condition number of V for Σν ≤ 4 in three variables, polynomials normalized."""
    orders = np.array(total_order_set(3, 4)).T
    x = points(4)
    values = HERMITE.values if random else chebyshev_values
    norms = np.sqrt([math.factorial(j) for j in range(5)]) if random else np.ones(5)
    return float(np.linalg.cond(np.prod([(values(4, x) / norms)[np.ix_(v, v)] for v in orders], 0)))


def main() -> None:
    arguments = options(__doc__, 60)
    max_terms = arguments.samples
    a = INTERVAL[CHOSEN[0]]
    b = RANDOM[CHOSEN[1]]
    tables: dict[str, list[Row]] = {"points_interval": [], "points_random": []}
    # Errors of formulas with one to four variables of a kind, then with both kinds.
    for d in (1, 2, 3, 4):
        point_choices = [{k: [p] * d for k, p in choices.items()} for choices in (INTERVAL, RANDOM)]
        tables["points_interval"] += formula_rows(d, 0, point_choices[0], max_terms)
        tables["points_random"] += formula_rows(0, d, point_choices[1], max_terms)
    mixed = {k: [p, p, b, b] for k, p in INTERVAL.items()}
    mixed |= {k: [a, a, p, p] for k, p in RANDOM.items()}
    tables["points_mixed"] = list(formula_rows(2, 2, mixed, max_terms))
    # Errors of the parts of the slider–crank.
    wide = {"_wide": {"scatter": 0.05, "tolerance": 0.1}} if max_terms >= 20 else {}
    for name, version in {"": {}, **wide}.items():
        three = {k: p[:3] for k, p in mixed.items()}
        tables[f"points_parts{name}"] = list(part_rows(three, max_terms, **version))
    note = "if both kinds of variables occur, variables of the other kind have the chosen points"
    for name, rows in tables.items():
        header = ["case", "terms", *rows[0][2]]
        body = [
            [case, str(terms), *format_errors(measurements, terms)]
            for case, terms, measurements in rows
        ]
        report(
            arguments.output,
            name,
            header,
            body,
            {c: measurements for c, _, measurements in rows},
            [note],
        )
    # Lebesgue constants and condition numbers.
    orders = (*range(1, 9), 12, 16, 20)
    body = []
    constants = {}
    for random, choices in ((False, INTERVAL), (True, RANDOM)):
        for name, points in choices.items():
            constants[name] = [lebesgue(points(q), random=random) for q in orders]
            nested = np.array_equal(points(4)[:2], points(1))
            last = f"{condition(points, random=random):.3g}" if nested else "—"
            body.append([name, *(f"{v:.3g}" for v in constants[name]), last])
    header = ["case", *(f"order {q}" for q in orders), "cond V, Σν ≤ 4, d = 3"]
    report(arguments.output, "points_stability", header, body, constants)


def format_errors(measurements: dict[str, tuple[int, float]], terms: int) -> list[str]:
    """Return the errors, followed by the number of runs if it exceeds the number of terms."""
    return [
        f"{e:.2g}" + (f" ({runs})" if runs != terms else "") for runs, e in measurements.values()
    ]


if __name__ == "__main__":
    main()
