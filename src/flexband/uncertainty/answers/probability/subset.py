"""Subset simulation: rare samples, level by level (Au and Beck, 2001).

The samples with the smallest margins, a tenth of all, start Markov chains that stay below their
largest margin. A tenth of these are below the next level, and so on until margins are negative.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

COUNT, SHARE = 1000, 0.1
"""Samples of a level, and which part of them is below the next."""

LEAST = 1e-10
"""Smaller probabilities are not looked for."""

ACCEPTED = 0.44
"""The part of the steps of a chain that are accepted."""


@dataclass(frozen=True)
class Rare:
    """Samples with negative margins.

    Attributes
    ----------
    u : the samples, (count, n); none if no margin is negative.
    probability : of a negative margin, a rough estimate; an upper bound if there is no sample.
    """

    u: np.ndarray
    probability: float


def rare(
    least: Callable[[np.ndarray], np.ndarray],
    dimension: int,
    rng: np.random.Generator,
    count: int = COUNT,
) -> Rare:
    """Return samples of standard normal variables with negative margins.

    Parameters
    ----------
    least : returns margins, shape (points,), of samples of shape (points, dimension).
    count : samples of a level.
    """
    u = rng.standard_normal((count, dimension))
    margin, probability, step = least(u), 1.0, 0.6
    few = round(count * SHARE)
    while True:
        negative = margin < 0
        if negative.sum() >= few:
            return Rare(u[negative], probability * float(negative.mean()))
        if probability * SHARE < LEAST:
            if negative.any():
                return Rare(u[negative], probability * float(negative.mean()))
            return Rare(u[:0], probability * -math.log(0.05) / few)
        probability *= SHARE
        order = np.argsort(margin, kind="stable")[:few]
        u, margin, step = _chains(least, u[order], margin[order], step, rng)


def _chains(
    least: Callable[[np.ndarray], np.ndarray],
    u: np.ndarray,
    margin: np.ndarray,
    step: float,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return chains from some samples, whose margins stay below the largest, and the next step."""
    level, places, margins = margin.max(), [], []
    for _ in range(round(1 / SHARE)):
        z = rng.standard_normal(u.shape)
        other = math.sqrt(1 - step**2) * u + step * z
        found = least(other)
        better = found <= level
        u, margin = np.where(better[:, None], other, u), np.where(better, found, margin)
        step = min(0.99, step * math.exp(float(better.mean()) - ACCEPTED))
        places.append(u)
        margins.append(margin)
    return np.concatenate(places), np.concatenate(margins), step
