"""Samples of ξ, and fixed sequences of ξ and η."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import ndtr, ndtri

from flexband.errors import InputError
from flexband.uncertainty.expansions.bounds.discs import in_discs
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.points.sobol import MAX_DIMENSION, scrambled_sobol


def of_normals(normals: np.ndarray, families: Sequence[Family]) -> np.ndarray:
    """Return ξ of the families at standard normal variables, both of shape (points, n)."""
    xi = normals.copy()
    for column, family in zip(xi.T, families, strict=True):
        column[:] = family.of_normal(column)
    return xi


def latin_hypercube_normals(samples: int, dimension: int, seed: int) -> np.ndarray:
    """Return a Latin hypercube of ξ, (samples, n), as `scipy.stats.qmc` without its import."""
    if dimension == 0:
        return np.zeros((1, 0))
    rng = np.random.default_rng(seed).spawn(1)[0]
    within = rng.uniform(size=(samples, dimension))
    strata = np.tile(np.arange(1, samples + 1), (dimension, 1))
    for row in strata:
        rng.shuffle(row)
    return ndtri((strata.T - within) / samples)


def points_at_ends(
    count: int, intervals: int, families: Sequence[Family], seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return ξ and η of some runs at random ends of all intervals, the first one at 0."""
    eta = np.random.default_rng(seed).choice([-1.0, 1.0], (count, intervals))
    normals = latin_hypercube_normals(count, len(families), seed)
    xi = of_normals(np.broadcast_to(normals, (count, len(families))), families)
    xi[0] = 0.0
    eta[0] = 0.0
    return xi, eta


def stretch_samples(
    normals: np.ndarray, farthest: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return samples of ξ, (samples, n), stretched along random directions, and weights.

    They are uniformly distributed up to `farthest` on both sides; weights are ratios of densities.
    """
    direction = rng.standard_normal(normals.shape)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    along = np.sum(normals * direction, axis=1)
    position = farthest * (2 * ndtr(along) - 1)
    weight = 2 * farthest * np.exp(-(position**2) / 2) / math.sqrt(2 * math.pi)
    return normals + (position - along)[:, None] * direction, weight


def sobol(count: int, dimension: int, seed: int = 0) -> np.ndarray:
    """Return scrambled Sobol' points in (0, 1), (count, dimension), most even for powers of two."""
    if dimension == 0:
        return np.zeros((count, 0))
    if dimension > MAX_DIMENSION:
        raise InputError(
            f"a Sobol' sequence has at most {MAX_DIMENSION} variables; got {dimension}"
        )
    u = scrambled_sobol(count, dimension, seed)
    tiny = np.finfo(float).eps
    return np.clip(u, tiny, 1 - tiny)


def nested_points(
    runs: int, m: int, families: Sequence[Family], seed: int = 0, discs: Sequence[int] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Return points of a fixed scrambled Sobol' sequence: ξ, (runs, n), and η, (runs, m).

    Three tenths of each η are at the ends, where most bounds are; the others are cos πu.
    """
    end_share = 0.3  # fraction of the values of η in a sequence of points that are −1 or 1
    u = sobol(runs, m + len(families), seed)
    middle = (u[:, :m] - end_share / 2) / (1 - end_share)
    eta = -np.cos(np.pi * np.clip(middle, 0, 1))
    return of_normals(ndtri(u[:, m:]), families), in_discs(eta, discs)
