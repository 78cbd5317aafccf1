"""Bounds over the interval variables: scan a grid, then polish by Newton's method on the box.

The paper scans, Eqs. (16)–(18). Here the scan only finds the right neighbourhood, and for every
series the place of the extreme is kept: which tolerances make the worst case.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from flexband.uncertainty.expansion import HybridExpansion, tensor_points

LARGEST_SCAN = 20_000
SWEEPS = 6
CHUNK = 4_000_000  # numbers in a temporary array


@dataclass(frozen=True)
class Extremes:
    """Bounds of μ + c σ and where they are.

    Attributes
    ----------
    values : lower and upper bound, shape (2, series).
    places : η of the bounds, shape (2, series, m).
    """

    values: np.ndarray
    places: np.ndarray


def extremes(expansion: HybridExpansion, sigmas: tuple[float, ...]) -> list[Extremes]:
    """Return the bounds of μ(η) + c σ(η) over η ∈ [−1, 1]^m for each c of `sigmas`."""
    grid = scan_grid(expansion.interval_order, expansion.interval_dimension)
    series = expansion.coefficients.shape[2]
    step = max(1, CHUNK // (len(grid) * expansion.coefficients.shape[1]))
    found = [Extremes(np.empty((2, series)), np.empty((2, series, grid.shape[1]))) for _ in sigmas]
    for first in range(0, series, step):
        here = slice(first, first + step)
        part = _part(expansion, here)
        mean, std = part.moments(grid)
        for c, result in zip(sigmas, found, strict=True):
            scanned = mean + c * std
            for bound, sign in enumerate((1.0, -1.0)):
                best = grid[np.argmin(sign * scanned, axis=0)]
                value, place = _polish(part, c, sign, best)
                result.values[bound, here] = value
                result.places[bound, here] = place
    return found


def scan_grid(order: int, dimension: int) -> np.ndarray:
    """Return Chebyshev–Lobatto points with the ends, about two a wave of the highest order."""
    if order == 0 or dimension == 0:
        return np.zeros((1, dimension))
    count = 2 * order + 3
    while count > 2 and count**dimension > LARGEST_SCAN:
        count -= 1
    return tensor_points(-np.cos(np.pi * np.arange(count) / (count - 1)), dimension)


def _part(expansion: HybridExpansion, here: slice) -> HybridExpansion:
    return HybridExpansion(
        expansion.random_order,
        expansion.interval_order,
        expansion.random_dimension,
        expansion.interval_dimension,
        expansion.coefficients[:, :, here],
    )


def _polish(
    expansion: HybridExpansion, c: float, sign: float, eta: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Minimize sign (μ + c σ) of every series from its own start; never leave a better point."""
    eta = eta.copy()
    value, gradient, hessian = _derivatives(expansion, c, sign, eta)
    if expansion.interval_order == 0 or expansion.interval_dimension == 0:
        return sign * value, eta
    reach = np.full(len(eta), 1.0)
    for _ in range(SWEEPS):
        trial = np.clip(eta + reach[:, None] * _newton_step(eta, gradient, hessian), -1, 1)
        if np.abs(trial - eta).max() < 1e-12:
            break
        new = _derivatives(expansion, c, sign, trial)
        better = new[0] < value
        eta = np.where(better[:, None], trial, eta)
        value = np.where(better, new[0], value)
        gradient = np.where(better[:, None], new[1], gradient)
        hessian = np.where(better[:, None, None], new[2], hessian)
        reach = np.where(better, 1.0, 0.25 * reach)
    return sign * value, eta


def _newton_step(eta: np.ndarray, gradient: np.ndarray, hessian: np.ndarray) -> np.ndarray:
    """Return a descent step: Newton's in the free variables, with |eigenvalues| of the Hessian."""
    held = ((eta <= -1) & (gradient > 0)) | ((eta >= 1) & (gradient < 0))
    free = ~held
    hessian = np.where(free[:, :, None] & free[:, None, :], hessian, np.eye(eta.shape[1]))
    values, vectors = np.linalg.eigh(hessian)
    size = np.maximum(np.abs(values), 1e-9 * np.abs(values).max(axis=1, keepdims=True) + 1e-300)
    turned = np.einsum("sij,si->sj", vectors, np.where(free, gradient, 0.0))
    return -np.einsum("sij,sj->si", vectors, turned / size)


def _derivatives(
    expansion: HybridExpansion, c: float, sign: float, eta: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return sign (μ + c σ) of series s at eta[s], with gradient and Hessian over η."""
    m, gamma = expansion.interval_dimension, expansion.norms
    unit = np.eye(m, dtype=int)
    pairs = list(combinations_with_replacement(range(m), 2))
    orders = [
        tuple(np.zeros(m, int)),
        *map(tuple, unit),
        *(tuple(unit[a] + unit[b]) for a, b in pairs),
    ]
    phi = np.stack([expansion.chebyshev(eta, tuple(o)) for o in orders], axis=-1)
    terms = np.einsum("sid,ijs->sjd", phi, expansion.coefficients, optimize=True)

    def variance(a: int, b: int) -> np.ndarray:
        return np.einsum("j,sj,sj->s", gamma[1:], terms[:, 1:, a], terms[:, 1:, b])

    std = np.sqrt(variance(0, 0))
    safe = np.where(std > 0, std, 1.0)  # where σ = 0 its derivatives count as zero
    value = terms[:, 0, 0] + c * std
    slope = [np.where(std > 0, variance(0, 1 + a) / safe, 0.0) for a in range(m)]
    gradient = np.stack([terms[:, 0, 1 + a] + c * slope[a] for a in range(m)] or [value * 0], -1)
    hessian = np.zeros((len(eta), m, m))
    for k, (a, b) in enumerate(pairs):
        curve = variance(1 + a, 1 + b) + variance(0, 1 + m + k) - slope[a] * slope[b]
        entry = terms[:, 0, 1 + m + k] + c * np.where(std > 0, curve / safe, 0.0)
        hessian[:, a, b] = hessian[:, b, a] = entry
    return sign * value, sign * gradient, sign * hessian
