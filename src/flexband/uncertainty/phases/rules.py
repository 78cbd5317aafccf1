"""Points in ξ and η for a phase expansion: as many as its phases require."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.polynomial import hermite_e
from scipy.special import ndtri

from flexband.uncertainty.expansions.bounds.scan import lobatto
from flexband.uncertainty.expansions.families import HERMITE, Family
from flexband.uncertainty.expansions.hybrid import tensor_index, tensor_points, tensor_values
from flexband.uncertainty.expansions.sobol import scrambled_sobol
from flexband.uncertainty.phases.options import MOMENTS, SEARCH

Rule = tuple[np.ndarray, np.ndarray]
"""Points ξ, (points, n), and weights of an expectation."""


def resolving_rule(
    families: Sequence[Family], orders: np.ndarray, reach: np.ndarray, slope: np.ndarray
) -> Rule | None:
    """Return points ξ, shape (points, n), and weights of the expectation; None if too many.

    The rule is a product of rules in one variable, for normal ξ along rotated axes; a rotation does
    not change their density. If the phase depends on several normal ξ, the axes are the principal
    directions of `slope`, ∂φ/∂ξ at ξ = η = 0, (carriers × times, n). The phase then changes along
    few of them, often one, and the others need few points.

    `orders` and `reach` are the order and the largest phase change [rad] of every ξ.
    """
    axes, orders, reach = _principal_axes(families, orders, reach, slope)
    if math.prod(map(_rule_size, families, orders, reach)) > MOMENTS.max_rule_points:
        return None
    rules = list(map(rule, families, orders, reach))
    weights = tensor_values([np.ones((1, 1)), *(w[None] for _, w in rules)])[0]
    return tensor_points([points for points, _ in rules]) @ axes, weights


def axis_rule(
    families: Sequence[Family],
    orders: np.ndarray,
    reach: np.ndarray,
    slope: np.ndarray,
    in_pairs: int = 3,
) -> Rule:
    """Return points ξ and weights for phases that change along one axis more than along others.

    With rules G_v along the axes of `resolving_rule`, G₁ that of most points, and values at 0,

        G₁ (1 + Σ_v (G_v − 1) + Σ_{v<w} (G_v − 1)(G_w − 1)),   v, w > 1,

    the second sum with `in_pairs` points per axis. Other parameters are those of `resolving_rule`.
    """
    axes, orders, reach = _principal_axes(families, orders, reach, slope)
    sizes = list(map(_rule_size, families, orders, reach))
    first, n = int(np.argmax(sizes)), len(families)

    def beyond(v: int, x: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points = np.append(_with_exact_zero(x), 0.0)
        return points[:, None] * (np.arange(n) == v), np.append(w, -1.0)

    further = [v for v in range(n) if v != first and orders[v] > 0]
    rules = [(np.zeros((1, n)), np.ones(1))]
    rules += [beyond(v, *rule(families[v], orders[v], reach[v])) for v in further]
    for v, u in combinations(further, 2):
        (x, a), (y, b) = (beyond(k, *families[k].gauss(in_pairs)) for k in (v, u))
        rules.append(((x[:, None] + y).reshape(-1, n), np.outer(a, b).ravel()))
    points, which = np.unique(np.concatenate([x for x, _ in rules]), axis=0, return_inverse=True)
    weights = np.bincount(which.ravel(), np.concatenate([w for _, w in rules]))
    x, w = rule(families[first], orders[first], reach[first])
    points = points + x[:, None, None] * (np.arange(n) == first)
    return points.reshape(-1, n) @ axes, np.outer(w, weights).ravel()


def _principal_axes(
    families: Sequence[Family], orders: np.ndarray, reach: np.ndarray, slope: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return axes, (n, n), and the order and the largest phase change along each."""
    normal = np.array([family == HERMITE for family in families], dtype=bool)
    axes = np.eye(len(orders))
    moving = np.flatnonzero(normal & (orders > 0) & (reach >= MOMENTS.small_reach))
    if len(moving) > 1:
        slope = slope[:, moving]
        turned = np.linalg.svd(slope, full_matrices=len(slope) < len(moving))[2]
        axes[np.ix_(moving, moving)] = turned
        bent = reach[moving] - np.abs(slope).max(axis=0)
        orders, reach = orders.copy(), reach.copy()
        reach[moving] = np.abs(slope @ turned.T).max(axis=0) + np.abs(turned) @ bent
        orders[moving] = orders[moving].max() + 1
    return axes, orders, reach


def rule(family: Family, order: float, a: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points and weights of E over one ξ, for P_j, j ≤ 2k, times e^{2iφ}, |φ| ≤ a.

    A Gauss rule, except for a ξ without bounds that changes the phase: then the trapezoidal rule
    for a normal variable, exact to e^{−15} if its step is at most 2π/(2a + 5.5).
    """
    size = _rule_size(family, order, a)
    if not family.bounded and order > 0 and a >= MOMENTS.small_reach:
        end = MOMENTS.trapezoidal_end if family == HERMITE else MOMENTS.far_end
        x = np.linspace(-end, end, size)
        w = np.exp(-x * x / 2)
        return family.of_normal(x), w / w.sum()
    return family.gauss(size)


def _rule_size(family: Family, order: float, a: float) -> int:
    if order == 0:
        return 1
    if family.bounded:  # two points per wave of e^{2iφ}, and some more
        return int(order) + 1 + math.ceil(a + 4 * np.cbrt(2 * a))
    if a < MOMENTS.small_reach:
        return int(order) + 1 + 2 * bool(a > 0)  # Python's integers do not overflow in a product
    if family != HERMITE:
        a *= MOMENTS.tail_slope / MOMENTS.trapezoidal_end
        waves = 2 * a + MOMENTS.trapezoidal_band + order
        return math.ceil(2 * MOMENTS.far_end * waves / (2 * np.pi)) + 1
    end, waves = MOMENTS.trapezoidal_end, 2 * a + MOMENTS.trapezoidal_band
    return math.ceil(2 * end * waves / (2 * np.pi)) + 1


def saddle_rule(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points and weights of E[f(ζ)], for f with weak interaction between variables.

    f(0) + Σ_v (G − 1) f along each axis + Σ_uv (G₃ − 1)(G₃ − 1) f of each pair of axes, with
    Gauss–Hermite rules G, the finest along the first. With more axes than `max_paired_axes`, pairs
    are those of the first axis with each other.
    """

    def beyond(v: int, count: int) -> tuple[np.ndarray, np.ndarray]:
        x, w = hermite_e.hermegauss(count)
        w /= w.sum()
        w[count // 2] -= 1.0
        return _with_exact_zero(x)[:, None] * (np.arange(n) == v), w

    rules = [(np.zeros((1, n)), np.ones(1))]
    for v in range(n):
        rules.append(beyond(v, 5 if v else 9))
        for u in range(v if n <= MOMENTS.max_paired_axes else min(v, 1)):
            (x, a), (y, b) = beyond(u, 3), beyond(v, 3)
            rules.append(((x[:, None] + y).reshape(-1, n), np.outer(a, b).ravel()))
    points, weights = map(np.concatenate, zip(*rules, strict=True))
    points, which = np.unique(points, axis=0, return_inverse=True)
    return points, np.bincount(which.ravel(), weights)


def _with_exact_zero(x: np.ndarray) -> np.ndarray:
    """Return points without rounding at 0."""
    return np.where(np.abs(x) < 1e-12, 0.0, x)


def sobol_normal(n: int, count: int) -> np.ndarray:
    """Return quasi-random normal points, the same at every call."""
    return ndtri(scrambled_sobol(count, n))


def scan_points(orders: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return η for a scan, and the numbers of the points next to each, (points, count).

    Chebyshev–Lobatto points, about five per wave of phases that change by `reach`. If these are too
    many, quasi-random points without neighbours, at the ends in variables that change no phase.
    """
    counts = [
        1 if q == 0 else math.ceil(q + 2 + (a > SEARCH.scanned_reach) * (3 * a + 2 * np.cbrt(a)))
        for q, a in zip(orders, reach, strict=True)
    ]
    if math.prod(counts) <= SEARCH.max_scan_points:
        where = tensor_index([count - 1 for count in counts])
        step = np.concatenate([np.eye(len(counts), dtype=int), -np.eye(len(counts), dtype=int)])
        beside = np.clip(where[:, None] + step, 0, np.array(counts, dtype=int) - 1)
        strides = np.cumprod([1, *counts[:0:-1]])[::-1][: len(counts)]
        return tensor_points([lobatto(count) for count in counts]), beside @ strides
    u = scrambled_sobol(SEARCH.max_scan_points // 2, len(orders))
    eta = np.where(reach > SEARCH.scanned_reach, -np.cos(np.pi * u), np.where(u < 0.5, -1.0, 1.0))
    return eta * (orders > 0), np.zeros((len(eta), 0), dtype=int)
