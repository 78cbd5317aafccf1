"""Held-out runs: they are never fitted, so what an expansion misses in them is its error.

Generic points lie on no coordinate of the nested sequences, so nothing that these alias is hidden
from them. Points at the extremes of an expansion lie where its bounds are attained.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri

from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.inputs.sampling import of_normals, sobol

APART = 0.3
"""Places of extremes that are nearer to each other than this, in units of η, are run once."""


def generic_points(
    first: int, count: int, m: int, families: Sequence[Family]
) -> tuple[np.ndarray, np.ndarray]:
    """Return ξ, (count, n), and η, (count, m): `count` points of a sequence, from number `first`.

    It is a scrambled Sobol' sequence, which fills intervals evenly and random variables by their
    density.
    """
    u = sobol(first + count, m + len(families), seed=1)[first:]
    return of_normals(ndtri(u[:, m:]), families), 2 * u[:, :m] - 1


def extreme_places(found: Sequence[Extremes], known: np.ndarray, count: int) -> np.ndarray:
    """Return the η of some bounds of the error bar, far from each other, shape (≤ count, m).

    The first belongs to the widest bound, each further one is the farthest from all before.

    Parameters
    ----------
    found : bounds of μ, μ − σ and μ + σ at some times.
    known : places that have been run, shape (places, m).
    """
    _, lower, upper = found
    low, high = lower.values[0], upper.values[1]
    middle = (low + high).mean(axis=-1, keepdims=True) / 2
    width = (high - low).mean(axis=-1, keepdims=True) + 1e-300
    beyond = np.stack([middle - low, high - middle]) / width
    places = np.stack([lower.places[0], upper.places[1]]).reshape(-1, known.shape[1])
    waiting = places[np.argsort(-beyond.ravel(), kind="stable")]
    near = _distances(waiting, known)
    chosen: list[np.ndarray] = []
    while len(chosen) < count and near.max(initial=0.0) > APART:
        chosen.append(waiting[np.argmax(near)])
        near = np.minimum(near, _distances(waiting, chosen[-1][None]))
    return np.array(chosen).reshape(-1, known.shape[1])


def _distances(places: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return how far each place is from the nearest of others; ∞ where there are none."""
    if not others.size:
        return np.full(len(places), np.inf)
    return np.abs(places[:, None] - others).max(axis=2).min(axis=1)
