"""Check runs: they are never fitted, so what an expansion misses in them is its error.

Generic points lie on no coordinate of the nested sequences, so nothing that these alias is hidden
from them. Points at the extremes of an expansion lie where its bounds are attained.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri

from flexband.uncertainty.expansions.bounds.discs import in_discs
from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.inputs.sampling import of_normals, sobol

TIE_DIGITS = 6
"""Digits that count of sizes, distances and slopes that choose a run: rounding decides nothing."""


def generic_points(
    first: int, count: int, m: int, families: Sequence[Family], discs: Sequence[int] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Return ξ, (count, n), and η, (count, m): `count` points of a sequence, from number `first`.

    It is a scrambled Sobol' sequence, which fills intervals evenly and random variables by their
    density.
    """
    u = sobol(first + count, m + len(families), seed=1)[first:]
    return of_normals(ndtri(u[:, m:]), families), in_discs(2 * u[:, :m] - 1, discs)


def extreme_places(
    extremes: Sequence[Extremes],
    count: int,
    reached: np.ndarray,
    tolerance: float,
    min_distance: float = 0.3,
) -> np.ndarray:
    """Return the η of some bounds of the error bar, far from each other, shape (≤ count, m).

    Bounds that are reached at places that were run need no further run. Of the others, the first
    belongs to the widest bound, each further one is the farthest from all before. A bound that no
    interval moves has its place in the middle.

    Parameters
    ----------
    extremes : bounds of μ, μ − σ and μ + σ at some times.
    reached : lowest μ − σ and highest μ + σ at places that were run, shape (2, outputs, times).
    tolerance : for `reached`, relative to the error bar's width.
    min_distance : places that are nearer to each other than this, in units of η, are run once.
    """
    # Leave out bounds that are reached at places that were run; sort the others by width.
    _, lower, upper = extremes
    low = lower.values[0]
    high = upper.values[1]
    middle = (low + high).mean(axis=-1, keepdims=True) / 2
    width = (high - low).mean(axis=-1, keepdims=True) + 1e-300
    beyond = np.stack([middle - low, high - middle]) / width
    beyond[np.stack([reached[0] - low, high - reached[1]]) <= tolerance * width] = -np.inf
    beyond = beyond.round(TIE_DIGITS)
    moved = np.stack([lower.values[1] - low, high - upper.values[0]]) / width
    order = np.argsort(-beyond.ravel(), kind="stable")[: np.isfinite(beyond).sum()]
    waiting = np.stack([lower.places[0], upper.places[1]])
    waiting[moved.round(TIE_DIGITS) == 0] = 0.0
    waiting = waiting.reshape(beyond.size, -1)[order]
    # Take the farthest place from those taken so far, until all others are near.
    distances = np.full(len(waiting), np.inf)
    places = []
    while len(places) < count and distances.max(initial=0.0) > min_distance:
        places.append(waiting[np.argmax(distances.round(TIE_DIGITS))])
        distances = np.minimum(distances, np.abs(waiting - places[-1]).max(axis=1))
    return np.array(places).reshape(-1, waiting.shape[1])
