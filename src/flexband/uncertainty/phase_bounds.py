"""Moments of a phase-resolved surrogate by quadrature, and their extremes over the intervals.

Both take as many points as the phase needs: a function of ξ or η whose phase moves by `reach` has
about reach/π waves.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
from numpy.polynomial import chebyshev, hermite_e
from scipy.special import ndtri
from scipy.stats import qmc

from flexband.uncertainty.bounds import Extremes, extremes, lobatto
from flexband.uncertainty.expansion import tensor_points, tensor_values
from flexband.uncertainty.phase_expansion import PhaseExpansion

MOST_POINTS = 4096
"""Of a rule for ξ, or of a grid of η."""

STILL = 0.2
"""A reach [rad] below which Gauss–Hermite points are enough."""

TAIL = 4.5
"""Standard deviations that the trapezoidal rule goes to."""

BLOCK = 4000
"""Series in a block of times; early blocks, whose phases have not moved far, take fewer points."""


def phase_extremes(surrogate: PhaseExpansion, sigmas: tuple[float, ...]) -> list[Extremes]:
    """Return the bounds of μ(η) + c σ(η) over η ∈ [−1, 1]^m for each c of `sigmas`.

    Series are the outputs and times of the response, as for `bounds.extremes`.
    """
    if not surrogate.layout.carriers and surrogate.next_terms is None:
        return extremes(surrogate.parts, sigmas)
    outputs, times = surrogate.layout.outputs, surrogate.layout.times
    count = max(1, min(round(outputs * times / BLOCK), times // 16))
    ends = [times * k // count for k in range(count + 1)]
    all_outputs = np.arange(outputs)
    blocks = [
        _block(surrogate.of(all_outputs, slice(a, b)), sigmas) for a, b in itertools.pairwise(ends)
    ]
    return [
        Extremes(
            np.concatenate([b[k].values for b in blocks], axis=2).reshape(2, -1),
            np.concatenate([b[k].places for b in blocks], axis=2).reshape(2, outputs * times, -1),
        )
        for k in range(len(sigmas))
    ]


def phase_moments(surrogate: PhaseExpansion, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return μ and σ at η of shape (points, m), each of shape (points, outputs, times)."""
    shape = (len(eta), surrogate.layout.outputs, surrogate.layout.times)
    reach = surrogate.reach()
    more = surrogate.next_terms is not None
    orders = np.array([order + (more and order > 0) for order in surrogate.parts.orders], dtype=int)
    m = surrogate.parts.interval_dimension
    xi, weights = random_points(surrogate, orders[m:], reach[m:])
    mean, variance = np.empty(shape), np.empty(shape)
    for j, F in enumerate(surrogate.sections(eta, xi)):
        flat = F.reshape(len(F), -1)
        mean[j] = (weights @ flat).reshape(shape[1:])
        flat -= mean[j].ravel()
        variance[j] = np.einsum("q,qs,qs->s", weights, flat, flat).reshape(shape[1:])
    return mean, np.sqrt(variance)


def _block(surrogate: PhaseExpansion, sigmas: tuple[float, ...]) -> list[Extremes]:
    """Return the bounds of one block, values (2, outputs, times) and places (…, m).

    μ and σ² are found on Chebyshev–Lobatto points, interpolated to three times as many in each
    variable, and the best point is refined by parabolas.
    """
    reach = surrogate.reach()
    more = surrogate.next_terms is not None
    orders = np.array([order + (more and order > 0) for order in surrogate.parts.orders], dtype=int)
    m = surrogate.parts.interval_dimension
    xi, weights = random_points(surrogate, orders[m:], reach[m:])
    counts = _counts(orders[:m], reach[:m])
    eta = tensor_points([lobatto(count) for count in counts])
    shape = (len(eta), surrogate.layout.outputs, surrogate.layout.times)
    mean, variance = np.empty(shape), np.empty(shape)
    for j, F in enumerate(surrogate.sections(eta, xi)):
        flat = F.reshape(len(F), -1)
        mean[j] = (weights @ flat).reshape(shape[1:])
        flat -= mean[j].ravel()
        variance[j] = np.einsum("q,qs,qs->s", weights, flat, flat).reshape(shape[1:])
    fine = [count if count == 1 else 3 * count - 2 for count in counts]
    for values in (mean, variance):
        values.shape = (len(eta), -1)
    mean, variance = (_interpolated(values, counts, fine) for values in (mean, variance))
    std = np.sqrt(np.maximum(variance, 0.0))
    found = []
    for c in sigmas:
        target = mean + c * std
        ends = [least(sign * target, fine) for sign in (1.0, -1.0)]
        values = np.stack([ends[0][0], -ends[1][0]])
        places = np.stack([place for _, place in ends])
        found.append(Extremes(values.reshape(2, *shape[1:]), places.reshape(2, *shape[1:], m)))
    return found


def _counts(orders: np.ndarray, reach: np.ndarray) -> list[int]:
    """Return the points of every η."""
    counts = [
        1 if q == 0 else math.ceil(q + 2 + (a > 0.3) * (1.5 * a + 2 * np.cbrt(a)))
        for q, a in zip(orders, reach, strict=True)
    ]
    while math.prod(counts) > MOST_POINTS:
        counts = [max(2, count - 1) if count > 1 else 1 for count in counts]
    return counts


def _interpolated(values: np.ndarray, counts: list[int], fine: list[int]) -> np.ndarray:
    """Return values (points, series) of a Lobatto grid on a finer one, variable by variable."""
    before = 1
    for count, many in zip(counts, fine, strict=True):
        coarse = chebyshev.chebvander(lobatto(count), count - 1)
        step = chebyshev.chebvander(lobatto(many), count - 1) @ np.linalg.inv(coarse)
        values = step @ values.reshape(before, count, -1)
        before *= many
    return values.reshape(before, -1)


def least(values: np.ndarray, counts: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the least of values (points, series) on a Lobatto grid, and where, (series, m).

    In each variable the bottom of the parabola through the best point and its neighbours in
    θ = arccos(−η), of which all functions of η are even.
    """
    best, series = values.argmin(axis=0), np.arange(values.shape[1])
    bottom = values[best, series]
    gain, places = np.zeros_like(bottom), np.zeros((len(series), len(counts)))
    where = np.stack(np.unravel_index(best, counts)) if counts else np.zeros((0, len(series)), int)
    for a, count in enumerate(counts):
        if count < 3:
            places[:, a] = lobatto(count)[where[a]]
            continue
        sides = []
        for step in (-1, 1):
            k = where.copy()
            k[a] = (count - 1) - np.abs(count - 1 - np.abs(where[a] + step))
            sides.append(values[np.ravel_multi_index(tuple(k), counts), series])
        bend = sides[0] + sides[1] - 2 * bottom
        slope = sides[1] - sides[0]
        curved = np.where(bend > 0, bend, np.inf)
        gain += slope**2 / (8 * curved)
        places[:, a] = -np.cos(np.pi / (count - 1) * (where[a] - slope / (2 * curved)))
    return bottom - gain, places


def random_points(
    surrogate: PhaseExpansion, orders: np.ndarray, reach: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return points ξ, shape (points, n), and weights of the expectation.

    They are products of rules in one variable, along axes turned with the phase: the normal
    density does not change by a rotation. Where the phase moves with several ξ, the axes are the
    principal directions of ∂φ/∂ξ over times and carriers: it then moves along few of them, often
    one, and the others take few points.
    """
    n = len(orders)
    axes, moving = np.eye(n), np.flatnonzero((orders > 0) & (reach >= STILL))
    if len(moving) > 1:
        m = surrogate.parts.interval_dimension
        index, phases = surrogate.parts.index(), surrogate.phases()
        flat = phases.reshape(-1, phases.shape[2])
        alone = index.sum(axis=0) == 1
        first = [np.flatnonzero(alone & (index[m + v] == 1))[0] for v in moving]
        slope = flat[first].T
        turned = np.linalg.svd(slope, full_matrices=False)[2]
        axes[np.ix_(moving, moving)] = turned
        bent = reach[moving] - np.abs(slope).max(axis=0)
        orders, reach = orders.copy(), reach.copy()
        reach[moving] = np.abs(slope @ turned.T).max(axis=0) + np.abs(turned) @ bent
        orders[moving] = orders[moving].max() + 1
    rules = list(_rules(orders, reach))
    if math.prod(len(points) for points, _ in rules) <= MOST_POINTS:
        weights = tensor_values([np.ones((1, 1)), *(w[None] for _, w in rules)])[0]
        return tensor_points([points for points, _ in rules]) @ axes, weights
    xi = ndtri(qmc.Sobol(n, rng=np.random.default_rng(0)).random(MOST_POINTS)) @ axes
    return xi, np.full(len(xi), 1 / len(xi))


def _rules(orders: np.ndarray, reach: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield points and weights of E over one ξ, for He_j, j ≤ k, times e^{iaξ}, |a| ≤ 2 reach.

    Gauss–Hermite where the phase stands still; otherwise the trapezoidal rule, exact to e^{−12}
    where its step is at most 2π/(2 reach + 5).
    """
    for order, a in zip(orders, reach, strict=True):
        if order == 0:
            yield np.zeros(1), np.ones(1)
            continue
        if a < STILL:
            x, w = hermite_e.hermegauss(int(order) + 1 + 2 * (a > 0))
        else:
            x = np.linspace(-TAIL, TAIL, math.ceil(2 * TAIL * (2 * a + 5) / (2 * np.pi)) + 1)
            w = np.exp(-x * x / 2)
        yield x, w / w.sum()
