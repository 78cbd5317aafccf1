"""Converged bands of sums of elementwise formulas, without any expansion of the library.

Moments are sums over equal steps of normal variables and over Gauss–Legendre points of uniform
ones. Bounds over interval variables are searched for on a grid, and on ever finer grids around the
best point at each time. Where the moments are smooth in the interval variables they are
interpolated between Chebyshev points, otherwise computed at every point of the search.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np

TAIL = 7.5
"""Standard deviations to which normal variables are integrated."""

POINTS = {0: 1, 1: 121, 2: 49, 3: 25}
"""Points for each of so many random variables."""

NODES = {0: 1, 1: 41, 2: 21, 3: 11}
"""Nodes for each of so many interval variables, between which smooth moments are interpolated."""

GRID = {1: 129, 2: 65, 3: 17}
"""Points of the first grid along each of so many interval variables."""

MAX_GAUSS = 400
"""Most Gauss–Legendre points; longer rules, for kinks, have equal steps and weights."""

ZOOMS = 6
"""How often the search halves its steps."""

CHUNK = 2_000_000
"""Most values of a formula at once."""

Formula = Callable[..., np.ndarray]
"""f(*variables, τ) of arrays that broadcast; τ from 0 to 1 is the time over the duration."""


@dataclass(frozen=True)
class Term:
    """A formula of some of the variables of a problem.

    Attributes
    ----------
    on : the numbers of its variables.
    smooth : whether its moments are smooth functions of the interval variables.
    points, nodes : for each random and interval variable, instead of `POINTS` and `NODES`.
    """

    formula: Formula
    on: tuple[int, ...]
    smooth: bool = True
    points: int | None = None
    nodes: int | None = None


class Moments(Protocol):
    """Mean and variance of a term as functions of its m interval variables.

    Attributes
    ----------
    m : number of interval variables.
    certain : whether there are no random variables.
    """

    m: int
    certain: bool

    def at(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and variance at η (points, 1 or times, m), each (points, times)."""
        ...


@lru_cache
def rule(kind: str, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points and weights for the mean over a standard variable."""
    if kind == "uniform" and count <= MAX_GAUSS:
        x, weights = np.polynomial.legendre.leggauss(count)
    elif kind == "uniform":
        x = (2 * np.arange(count) + 1 - count) / count
        weights = np.ones(count)
    else:
        x = TAIL * (2 * np.arange(count) + 1 - count) / count
        weights = np.exp(-x * x / 2)
    return x, weights / weights.sum()


def grid(*axes: np.ndarray) -> np.ndarray:
    """Return all points of a grid, shape (points, axes)."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


class IntegratedMoments:
    """Moments of a term computed anew at every η."""

    def __init__(self, term: Term, kinds: Sequence[str], tau: np.ndarray, refine: int):
        self.formula = term.formula
        self.tau = tau
        term_kinds = [kinds[k] for k in term.on]
        self.random = [kind != "interval" for kind in term_kinds]
        self.m = self.random.count(False)
        n = len(term_kinds) - self.m
        self.certain = n == 0
        points = refine * (term.points or POINTS[n])
        rules = [rule(kind, points) for kind in term_kinds if kind != "interval"]
        self.xi = grid(*(x for x, _ in rules)) if n else np.zeros((1, 0))
        self.weights = grid(*(w for _, w in rules)).prod(axis=1) if n else np.ones(1)

    def at(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and variance at η."""
        size = max(1, CHUNK // (len(self.xi) * len(self.tau)))
        moment_pairs = [self._moments_at(eta[k : k + size]) for k in range(0, len(eta), size)]
        mean, variance = (np.concatenate(v) for v in zip(*moment_pairs, strict=True))
        return mean, variance

    def _moments_at(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        xi = iter(self.xi.T)
        interval_values = iter(np.moveaxis(eta, -1, 0))
        variables = [
            next(xi)[:, None, None] if r else next(interval_values)[None] for r in self.random
        ]
        F = self.formula(*variables, self.tau)
        F = np.broadcast_to(F, (len(self.xi), len(eta), len(self.tau)))
        mean = np.tensordot(self.weights, F, 1)
        return mean, np.tensordot(self.weights, (F - mean) ** 2, 1)


class InterpolatedMoments:
    """Moments between their values at Chebyshev points, (nodes, …, nodes, times) each."""

    def __init__(self, mean: np.ndarray, variance: np.ndarray):
        self.m = mean.ndim - 1
        self.certain = not variance.any()
        self.counts = mean.shape[:-1]
        self.coefficients = [_coefficients(v).reshape(-1, v.shape[-1]) for v in (mean, variance)]

    def at(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and variance at η."""
        basis = np.ones((*eta.shape[:2], 1))
        for a, count in enumerate(self.counts):
            axis_basis = _chebyshev(eta[..., a], count)
            basis = (basis[..., None] * axis_basis[..., None, :]).reshape(*eta.shape[:2], -1)
        if eta.shape[1] == 1:
            mean, variance = (basis[:, 0] @ c for c in self.coefficients)
        else:
            mean, variance = (np.einsum("ptk,kt->pt", basis, c) for c in self.coefficients)
        return mean, np.maximum(variance, 0.0)


def chebyshev_nodes(count: int) -> np.ndarray:
    """Return the extremes of a Chebyshev polynomial, ends included."""
    return -np.cos(np.pi * np.arange(count) / (count - 1))


def _chebyshev(x: np.ndarray, count: int) -> np.ndarray:
    return np.cos(np.arange(count) * np.arccos(np.clip(x, -1, 1))[..., None])


def _coefficients(values: np.ndarray) -> np.ndarray:
    for a, count in enumerate(values.shape[:-1]):
        basis = np.linalg.inv(_chebyshev(chebyshev_nodes(count), count))
        values = np.moveaxis(np.tensordot(basis, values, (1, a)), 0, a)
    return values


def moments(term: Term, kinds: Sequence[str], tau: np.ndarray, refine: int) -> Moments:
    """Return the moments of a term."""
    exact_moments = IntegratedMoments(term, kinds, tau, refine)
    if not term.smooth or exact_moments.m == 0:
        return exact_moments
    nodes = chebyshev_nodes(refine * (term.nodes or NODES[exact_moments.m]))
    at = exact_moments.at(grid(*[nodes] * exact_moments.m)[:, None])
    return InterpolatedMoments(*(v.reshape(*[len(nodes)] * exact_moments.m, len(tau)) for v in at))


def bands(parts: Sequence[Moments], times: int, refine: int) -> tuple[np.ndarray, np.ndarray]:
    """Return interval mean and error bar, each (2, times), of a sum of independent terms.

    Terms without interval variables do not depend on η, and the bounds of terms without random
    variables add up; all others are searched together.
    """
    nowhere = np.zeros((1, 1, 0))
    constant_terms = [part.at(nowhere) for part in parts if part.m == 0]
    mean = np.zeros((2, times)) + sum(value[0] for value, _ in constant_terms)
    variance = np.zeros(times) + sum(value[0] for _, value in constant_terms)
    for part in parts:
        if part.m and part.certain:
            alone = Search([part], np.zeros(times), refine)
            mean = mean + np.stack([alone.extreme(0, 1), alone.extreme(0, -1)])
    search = Search([part for part in parts if part.m and not part.certain], variance, refine)
    mean_bounds = np.stack([search.extreme(0, 1), search.extreme(0, -1)])
    bar = np.stack([search.extreme(-1, 1), search.extreme(1, -1)])
    return mean + mean_bounds, mean + bar


class Search:
    """Extremes of μ + c σ of a sum of terms over the interval variables of all of them."""

    def __init__(self, parts: Sequence[Moments], variance: np.ndarray, refine: int):
        """Compute the moments on the first grid; `variance` (times) is that of other terms."""
        self.parts = parts
        self.variance = variance
        m = sum(part.m for part in parts)
        count = refine * (GRID[m] - 1) + 1 if m else 1
        self.step = 2 / max(count - 1, 1)
        self.points = [grid(*[np.linspace(-1, 1, count)] * part.m)[:, None] for part in parts]
        self.first = self._values(self.points)

    def extreme(self, c: float, sign: int) -> np.ndarray:
        """Return the lowest (sign 1) or highest (sign −1) value at every time."""
        points = self.points
        values = self.first
        step = self.step
        for _ in range(ZOOMS if self.parts else 0):
            centres = self._best(points, values, c, sign)
            offsets = step * np.linspace(-1, 1, 5)
            points = [
                np.clip(centre + grid(*[offsets] * part.m)[:, None], -1, 1)
                for part, centre in zip(self.parts, centres, strict=True)
            ]
            values = self._values(points)
            step = step / 2
        mean, std = values
        return sign * (sign * (mean + c * std)).min(axis=0)

    def _values(self, points: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and standard deviation at all combinations of the terms' points."""
        mean = np.zeros((1, len(self.variance)))
        variance = self.variance[None]
        for part, eta in zip(self.parts, points, strict=True):
            part_moments = part.at(eta)
            mean, variance = (
                (a[:, None] + b).reshape(-1, a.shape[-1])
                for a, b in zip((mean, variance), part_moments, strict=True)
            )
        return mean, np.sqrt(variance)

    def _best(self, points, values, c: float, sign: int) -> list[np.ndarray]:
        """Return the best point of every term at every time, each (times, m)."""
        mean, std = values
        best = (sign * (mean + c * std)).argmin(axis=0)
        where = np.unravel_index(best, [len(candidates) for candidates in points])
        times = np.arange(len(best))
        return [
            candidates[i, times if candidates.shape[1] > 1 else 0]
            for candidates, i in zip(points, where, strict=True)
        ]
