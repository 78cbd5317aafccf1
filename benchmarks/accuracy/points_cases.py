"""Points, index sets and formulas of `points.py`."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np

from flexband.uncertainty.expansions.families import HERMITE
from flexband.uncertainty.expansions.hybrid import HybridExpansion, tensor_index, tensor_points
from flexband.uncertainty.expansions.points.sequences import (
    GENZ_KEISTER,
    interval_sequence,
    normal_sequence,
)
from flexband.uncertainty.expansions.polynomials import chebyshev_values, scaled_chebyshev_zeros

Points = Callable[[int], np.ndarray]
COUNT = 21  # length of the longest sequences, for orders up to 20


def leja_points(first: Sequence[float], rate: float, end: float, *, pairs: bool) -> np.ndarray:
    """Return a Leja sequence weighted by e^{−rate x²}, on a grid."""
    grid = np.linspace(-end, end, 40001)
    points = list(first)
    with np.errstate(divide="ignore"):
        while len(points) < COUNT:
            size = np.log(np.abs(grid[:, None] - points)).sum(axis=1) - rate * grid**2
            best = grid[np.flatnonzero(size > size.max() - 1e-9)[-1]]
            points += [best, -best] if pairs else [best]
    return np.array(points[:COUNT])


def real_leja(first: list[float]) -> np.ndarray:
    """Return Clenshaw–Curtis points: real parts of e^{iπθ}, θ = 0.b₀b₁… for j = …b₁b₀."""
    angles = [sum((j >> b & 1) * 0.5**b for b in range(8)) for j in range(4, 200)]
    new = dict.fromkeys(math.cos(math.pi * a) for a in angles if 0 < a < 1)
    signed_points = [x for a in new if a > 0 for x in (a, -a)] if first[0] == 0 else list(new)
    return np.array(list(dict.fromkeys(np.round([*first, *signed_points], 14)))[:COUNT])


def nested_points(points: np.ndarray) -> Points:
    """Return a function that gives the points of an order."""
    return lambda order: points[: order + 1]


GK = [0.0, *(sign * x for x in GENZ_KEISTER for sign in (1, -1))]
INTERVAL: dict[str, Points] = {
    "Leja 0, pairs": nested_points(leja_points([0.0, 1.0, -1.0], 0.0, 1.0, pairs=True)),
    "Leja 0": nested_points(leja_points([0.0, 1.0, -1.0], 0.0, 1.0, pairs=False)),
    "Clenshaw–Curtis 0": nested_points(real_leja([0.0, 1.0, -1.0])),
    "R-Leja 1": nested_points(real_leja([1.0, -1.0, 0.0])),
    "Leja 1 (chosen)": nested_points(interval_sequence(COUNT)),
    "scaled zeros": scaled_chebyshev_zeros,
}
RANDOM: dict[str, Points] = {
    "√pdf Leja": nested_points(leja_points([0.0], 0.25, 12.0, pairs=False)),
    "√pdf Leja, pairs": nested_points(leja_points([0.0], 0.25, 12.0, pairs=True)),
    "pdf Leja": nested_points(leja_points([0.0], 0.5, 12.0, pairs=False)),
    "√3, √pdf Leja": nested_points(leja_points(GK[:3], 0.25, 12.0, pairs=False)),
    "√3, √pdf Leja, pairs": nested_points(leja_points(GK[:3], 0.25, 12.0, pairs=True)),
    "Genz–Keister, √pdf Leja (chosen)": nested_points(normal_sequence(COUNT)),
    "Gauss–Hermite": lambda k: HERMITE.gauss(k + 1)[0],
}
CHOSEN = "Leja 1 (chosen)", "Genz–Keister, √pdf Leja (chosen)"


def combination(orders: list[tuple[int, ...]]) -> list[tuple[tuple[int, ...], int]]:
    """Return the tensor grids, and their factors, that form the interpolation on a set."""
    members = set(orders)
    steps = list(itertools.product((0, 1), repeat=len(orders[0])))
    factors = [sum((-1) ** sum(z) for z in steps if tuple(np.add(v, z)) in members) for v in orders]
    return [(v, c) for v, c in zip(orders, factors, strict=True) if c]


def fit(f, orders, points: Sequence[Points], m: int) -> tuple[HybridExpansion, int]:
    """Return the expansion on a set of orders, the m variables η first, and its number of runs."""
    max_orders = np.max(orders, axis=0)
    beta = None
    runs = []
    for v, factor in combination(orders):
        nodes = [p(q) for p, q in zip(points, v, strict=True)]
        runs.append(tensor_points(nodes))
        y = f(runs[-1])
        y = y.reshape(*(q + 1 for q in v), -1)
        for a, (q, x) in enumerate(zip(v, nodes, strict=True)):
            basis = chebyshev_values(q, x) if a < m else HERMITE.values(q, x)
            y = np.moveaxis(np.tensordot(np.linalg.inv(basis), y, (1, a)), 0, a)
        beta = np.zeros((*(max_orders + 1), y.shape[-1])) if beta is None else beta
        beta[tuple(slice(q + 1) for q in v)] += factor * y
    count = len(np.unique(np.round(np.concatenate(runs), 9) + 0.0, axis=0))
    beta = beta.reshape(math.prod(max_orders + 1), beta.shape[-1])
    return HybridExpansion(
        (HERMITE,) * (len(max_orders) - m), tensor_index(max_orders), beta
    ), count


def formulas(m: int, n: int) -> Callable[[np.ndarray], np.ndarray]:
    """Return forty smooth formulas of m interval and n random variables, shape (·, 40)."""
    d = m + n
    rng = np.random.default_rng(0)
    fade = 0.6 ** np.arange(d)
    A = rng.uniform(0.5, 1.0, (5, 8, d)) * rng.choice([-1, 1], (5, 8, d)) * fade
    offset = rng.uniform(-0.6, 0.9, (5, 8))
    B = rng.uniform(-1, 1, (8, d, d)) * np.outer(fade, fade)

    def f(x: np.ndarray) -> np.ndarray:
        x = x * np.repeat([1.0, 0.4], [m, n])
        s = np.einsum("pd,kjd->kjp", x, A) + offset[..., None]
        q = np.einsum("pa,jab,pb->jp", x, B, x)
        parts = [np.exp(0.7 * s[0]), 1 / (1 + (0.5 * s[1] + 0.5) ** 2), np.cos(1.2 * s[2])]
        parts += [(1 + s[3] + 0.5 * q) * np.exp(0.4 * s[3]), q + np.sin(s[4])]
        return np.concatenate(parts).T

    return f


def total_order_set(d: int, order: int) -> list[tuple[int, ...]]:
    return [v for v in itertools.product(range(order + 1), repeat=d) if sum(v) <= order]


def adaptive_set(size: int, expansion: HybridExpansion) -> list[tuple[int, ...]]:
    """Return the downward closed set that adds the largest coefficients one after the other."""
    large = (
        np.abs(expansion.orthonormal_coefficients)
        .sum(axis=1)
        .reshape([q + 1 for q in expansion.orders])
    )
    units = np.eye(large.ndim, dtype=int)
    index_set = [(0,) * large.ndim]
    while len(index_set) < size:
        neighbours = {tuple(map(int, v + e)) for v in index_set for e in units} - set(index_set)
        new = [
            v
            for v in neighbours
            if all(k < n for k, n in zip(v, large.shape, strict=True))
            and all(tuple(map(int, v - e)) in index_set for e in units if v @ e)
        ]
        index_set.append(max(new, key=lambda v: (large[v], v)))
    return index_set


def with_pairs(orders: list[tuple[int, ...]], first: int) -> list[tuple[int, ...]]:
    """Return the set with odd orders raised to the next even ones, from variable `first` on."""
    tops = [[*v[:first], *(2 * ((q + 1) // 2) for q in v[first:])] for v in orders]
    boxes = (itertools.product(*(range(q + 1) for q in top)) for top in tops)
    return sorted(set(itertools.chain(*boxes)))


def sets(d: int, m: int, f, max_terms: int) -> dict[str, list[tuple[int, ...]]]:
    """Return index sets by name; pairs refer to random variables if there are any."""
    if d == 1:
        return {f"order {q}": total_order_set(1, q) for q in range(1, min(9, max_terms))}
    best = [INTERVAL["scaled zeros"]] * m + [RANDOM["Gauss–Hermite"]] * (d - m)
    dense = fit(f, total_order_set(d, 10 if d == 2 else 6), best, m)[0]
    index_sets = {f"Σν ≤ {q}": total_order_set(d, q) for q in range(1, 6)}
    index_sets["tensor, order 1"] = list(itertools.product((0, 1), repeat=d))
    for size in (7, 12, 20, 33, 54):
        index_sets[f"adaptive {size}"] = adaptive_set(size, dense)
        index_sets[f"adaptive {size}, pairs"] = with_pairs(index_sets[f"adaptive {size}"], m % d)
    return {name: orders for name, orders in index_sets.items() if len(orders) <= max_terms}
