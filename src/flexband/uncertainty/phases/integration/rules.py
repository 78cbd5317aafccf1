"""Points in ξ and η for a phase expansion: as many as its phases require."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.polynomial import hermite_e
from scipy.special import ndtri

from flexband.uncertainty.expansions.bounds.scan import lobatto
from flexband.uncertainty.expansions.families import HERMITE, Family
from flexband.uncertainty.expansions.hybrid import tensor_index, tensor_points, tensor_values
from flexband.uncertainty.expansions.points.sobol import scrambled_sobol
from flexband.uncertainty.phases.phase_options import MOMENTS, SEARCH

Rule = tuple[np.ndarray, np.ndarray]
"""Points ξ, (points, n), and weights of an expectation."""


class PhaseChange(NamedTuple):
    """What the phases of parts do over ξ, of which rules are made.

    Attributes
    ----------
    families : of every ξ.
    orders : the highest order in every ξ, (n,).
    reach : how far every ξ moves a phase at most [rad], (n,); counts where ξ has bounds.
    slopes : ∂φ/∂x at values far into the tails, (values, n), where ξ is a function of a standard
        normal variable x; counts where ξ has no bounds.
    """

    families: Sequence[Family]
    orders: np.ndarray
    reach: np.ndarray
    slopes: np.ndarray

    @property
    def turns(self) -> np.ndarray:
        """The reach of ξ with bounds, and the largest slope of others, (n,)."""
        bounded = np.array([family.has_finite_bounds for family in self.families], dtype=bool)
        return np.where(bounded, self.reach, np.abs(self.slopes).max(axis=0, initial=0.0))


def resolving_rule(
    change: PhaseChange, max_points: int = MOMENTS.max_rule_points, fineness: float = 1.0
) -> Rule | None:
    """Return points ξ, (points, n), and weights of the expectation; None if above `max_points`.

    The rule is a product of rules in one variable, for normal ξ along rotated axes; a rotation does
    not change their density. If the phase depends on several normal ξ, the axes are the principal
    directions of its slopes. The phase then changes along few of them, often one, and the others
    need few points. With another `fineness`, a rule is so many times as dense, and goes so many
    times as far where ξ has no bounds.
    """
    families = change.families
    axes, orders, turns = _axes(change)
    sizes = [
        math.ceil(size * (fineness if family.has_finite_bounds else fineness**2)) if size > 1 else 1
        for family, size in zip(families, map(_rule_size, families, orders, turns), strict=True)
    ]
    if math.prod(sizes) > max_points:
        return None
    rules = [rule(*axis, fineness) for axis in zip(families, orders, turns, sizes, strict=True)]
    weights = tensor_values([np.ones((1, 1)), *(w[None] for _, w in rules)])[0]
    return tensor_points([points for points, _ in rules]) @ axes, weights


def axis_rule(change: PhaseChange, in_pairs: int = 3) -> Rule:
    """Return points ξ and weights for phases that change along one axis more than along others.

    With rules G_v along the axes of `resolving_rule`, G₁ that of most points, and values at 0,

        G₁ (1 + Σ_v (G_v − 1) + Σ_{v<w} (G_v − 1)(G_w − 1)),   v, w > 1,

    the second sum with `in_pairs` points per axis.
    """
    families = change.families
    axes, orders, turns = _axes(change)
    sizes = list(map(_rule_size, families, orders, turns))
    first = int(np.argmax(sizes))
    n = len(families)

    def beyond(v: int, x: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points = np.append(_with_exact_zero(x), 0.0)
        return points[:, None] * (np.arange(n) == v), np.append(w, -1.0)

    other_axes = [v for v in range(n) if v != first and orders[v] > 0]
    rules = [(np.zeros((1, n)), np.ones(1))]
    rules += [beyond(v, *rule(families[v], orders[v], turns[v], sizes[v])) for v in other_axes]
    for v, u in combinations(other_axes, 2):
        (x, a), (y, b) = (beyond(k, *families[k].gauss(in_pairs)) for k in (v, u))
        rules.append(((x[:, None] + y).reshape(-1, n), np.outer(a, b).ravel()))
    # Join equal points, and repeat them at the points of the first axis.
    points, which = np.unique(np.concatenate([x for x, _ in rules]), axis=0, return_inverse=True)
    weights = np.bincount(which.ravel(), np.concatenate([w for _, w in rules]))
    x, w = rule(families[first], orders[first], turns[first], sizes[first])
    points = points + x[:, None, None] * (np.arange(n) == first)
    return points.reshape(-1, n) @ axes, np.outer(w, weights).ravel()


def _axes(change: PhaseChange) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return axes, (n, n), and the order and the change of phase along each, as `rule` takes it.

    They are rotated if the rule has fewer points then.
    """
    families = change.families
    orders = change.orders
    turns = change.turns
    normal = np.array([family == HERMITE for family in families], dtype=bool)
    axes = np.eye(len(orders))
    moving = np.flatnonzero(normal & (orders > 0) & (turns >= MOMENTS.small_reach))
    if len(moving) < 2:
        return axes, orders, turns
    slopes = change.slopes[:, moving]
    principal_axes = np.linalg.eigh(slopes.T @ slopes)[1].T[::-1]
    own_orders = orders.copy()
    own_turns = turns.copy()
    own_turns[moving] = np.abs(slopes @ principal_axes.T).max(axis=0)
    own_orders[moving] = orders[moving].max() + 1
    sizes = [
        map(_rule_size, families, *pair) for pair in ((orders, turns), (own_orders, own_turns))
    ]
    # Rotate only if that takes fewer points.
    before, after = map(math.prod, sizes)
    if after >= before:
        return axes, orders, turns
    axes[np.ix_(moving, moving)] = principal_axes
    return axes, own_orders, own_turns


def rule(
    family: Family, order: float, turns: float, size: int | None = None, farther: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return points and weights of E over one ξ, for P_j, j ≤ 2k, times e^{2iφ}.

    A Gauss rule, except for a ξ without bounds that changes the phase: then the trapezoidal rule
    for a normal variable, exact to e^{−15} if its step is at most 2π/(2a + 5.5), where a is the
    largest slope of φ. The `turns` are those of `PhaseChange`. Without a `size` the rule resolves
    the phase; it ends so many times `farther` out.
    """
    size = _rule_size(family, order, turns) if size is None else size
    if not family.has_finite_bounds and order > 0 and turns >= MOMENTS.small_reach:
        end = farther * (MOMENTS.trapezoidal_end if family == HERMITE else MOMENTS.far_end)
        x = np.linspace(-end, end, size)
        w = np.exp(-x * x / 2)
        return family.of_normal(x), w / w.sum()
    return family.gauss(size)


def _rule_size(family: Family, order: float, a: float) -> int:
    if order == 0:
        return 1
    if family.has_finite_bounds:  # two points per wave of e^{2iφ}, and some more
        return int(order) + 1 + math.ceil(a + 4 * np.cbrt(2 * a))
    if a < MOMENTS.small_reach:
        return int(order) + 1 + 2 * bool(a > 0)  # Python's integers do not overflow in a product
    end = MOMENTS.trapezoidal_end if family == HERMITE else MOMENTS.far_end
    waves = 2 * a + MOMENTS.trapezoidal_band + order * (family != HERMITE)
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


def sobol_normal(n: int, count: int, seed: int = 0) -> np.ndarray:
    """Return quasi-random normal points, the same at every call."""
    return ndtri(scrambled_sobol(count, n, seed))


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
