"""Nominal sizes at which searches of the cheapest tolerances start.

At each of many sizes margins are linear functions of the tolerances, about. Those sizes are the
best at which tolerances in the ratio of the largest are the loosest; a pattern search improves
them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from flexband.analysis.allocation.worst_case import SIGNS, WorstCaseBounds
from flexband.analysis.descent import descend
from flexband.uncertainty.inputs.sampling import sobol


@dataclass(frozen=True)
class SizeOptions:
    """How sizes are found at which searches start."""

    tried: int = 1024
    """Sizes that are tried."""
    improved: int = 16
    """Sizes that are improved."""
    max_starts: int = 9
    """Most starts."""
    min_distance: float = 0.05
    """Least distance of improved starts, in half the range of a size."""
    min_distance_of_others: float = 0.3
    """Least distance of other starts."""
    step: float = 1e-3
    """Step of differences in η."""
    loosest: float = 10.0
    """Tolerances, relative to the largest, beyond which sizes are alike."""
    margins_at_once: int = 2_000_000
    """Margins that are computed together."""


def starts(worst: WorstCaseBounds, *, options: SizeOptions = SizeOptions()) -> np.ndarray:
    """Return variables of a search, the best first, (starts, variables)."""
    tolerances = worst.tolerances
    count, (low, high) = len(tolerances.sizes), tolerances.bounds
    reach = high[-count:]

    def negative_looseness(places: np.ndarray, _: np.ndarray) -> np.ndarray:
        return -looseness(worst, reach * places, options)

    places = np.concatenate([np.zeros((1, count)), 2 * sobol(options.tried, count, 0) - 1])
    values = negative_looseness(places, np.arange(0))
    order = np.argsort(values, kind="stable")
    best = order[: options.improved]
    all_places = places[order]
    all_values = values[order]
    which = np.zeros(len(best), int)
    gains = np.full(len(best), 1e-6)
    values, places = descend(negative_looseness, which, places[best], values[best], gains)
    if values.min() > 0 and not tolerances.compensators:  # no margins without any tolerance
        places[0] = _with_most_room(worst, places[values.argmin()], reach, options.step)
        values[0] = negative_looseness(places[:1], which[:1])[0]
    order = np.argsort(values, kind="stable")
    distances = [options.min_distance] * len(order)
    distances += [options.min_distance_of_others] * len(all_places)
    places = np.concatenate([places[order], all_places])
    values = np.concatenate([values[order], all_values])
    start_pairs: list[tuple[np.ndarray, float]] = []
    for place, value, distance in zip(places, values, distances, strict=True):
        is_distinct = all(np.abs(place - other).max() > distance for other, _ in start_pairs)
        if not start_pairs or (is_distinct and value < 0 and len(start_pairs) < options.max_starts):
            start_pairs.append((place, value))
    variables = np.tile(high, (len(start_pairs), 1))
    part = np.clip([[-value] for _, value in start_pairs], 1e-300, 1.0)
    variables[:, :-count] = np.maximum(np.log(part), low[:-count])
    variables[:, -count:] = reach * np.array([place for place, _ in start_pairs])
    return variables


def _with_most_room(
    worst: WorstCaseBounds, place: np.ndarray, reach: np.ndarray, step: float
) -> np.ndarray:
    """Return sizes, relative to their reach, near which the least margin is largest."""
    low, _ = worst.tolerances.bounds
    limit_mask = np.isfinite(worst.bounds)

    def margins(places: np.ndarray) -> np.ndarray:
        eta = worst.tolerances.center(_replace_sizes(low, reach * places))
        return (worst.margins(worst.bars_at(eta, low)) / worst.scale)[:, limit_mask]

    def slopes(v: np.ndarray) -> np.ndarray:
        steps = step * np.eye(len(place))
        after, before = np.split(margins(np.concatenate([v[:-1] + steps, v[:-1] - steps])), 2)
        return np.column_stack([(after - before).T / (2 * step), -np.ones(after.shape[1])])

    downward = np.append(np.zeros(len(place)), -1.0)
    solution: Any = scipy.optimize.minimize(
        lambda v: -v[-1],
        np.append(place, margins(place[None]).min()),
        jac=lambda v: downward,
        bounds=[(-1.0, 1.0)] * len(place) + [(None, None)],
        constraints={
            "type": "ineq",
            "fun": lambda v: margins(v[None, :-1])[0] - v[-1],
            "jac": slopes,
        },
        method="SLSQP",
    )
    ends = np.stack([place, np.clip(solution.x[:-1], -1.0, 1.0)])
    return ends[margins(ends).min(axis=1).argmax()]


def _replace_sizes(x: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the variables x with other sizes, (points, variables)."""
    count = sizes.shape[1]
    return np.concatenate([np.tile(x[: len(x) - count], (len(sizes), 1)), sizes], axis=1)


def looseness(worst: WorstCaseBounds, sizes: np.ndarray, options: SizeOptions) -> np.ndarray:
    """Return the tolerances relative to the largest that sizes allow, to first order, (points,).

    Where margins are negative without any tolerance, it is the least of these relative to their
    scale. The sizes are η, shape (points, sizes).
    """
    (low, high), tolerances = worst.tolerances.bounds, worst.tolerances
    radii = tolerances.radius(high)
    radii[list(tolerances.compensators.values())] = 0.0
    m = tolerances.space.interval_dimension
    block = max(1, options.margins_at_once // (2 * len(worst.numbers) * (1 + 2 * m)))
    blocks = []
    for first in range(0, len(sizes), block):
        eta = tolerances.center(_replace_sizes(high, sizes[first : first + block]))
        if tolerances.compensators:
            eta = worst.with_compensators(worst.expansions).best(eta)[1]
        bars = worst.bars_at(eta, low)
        margins = worst.margins(bars)
        loss = np.maximum(SIGNS[:, None] * (bars - worst.bars_at(eta, high)), 0.0)
        for shift, radius in zip(options.step * np.eye(m), radii, strict=True):
            after, before = (worst.bars_at(eta + k * shift, low) for k in (1, -1))
            loss += radius * np.abs(after - before) / (2 * options.step)
        room = (margins / worst.scale).min(axis=(1, 2))
        margins = np.where(np.isfinite(margins), margins, options.loosest * loss + 1e-300)
        part = (margins / np.maximum(loss, margins / options.loosest + 1e-300)).min(axis=(1, 2))
        blocks.append(np.where(room > 0, part, room))
    return np.concatenate(blocks)
