"""Orthogonal polynomials by their recurrence: Gauss points and nested points of any density.

The recurrence x p_k = √b_{k+1} p_{k+1} + a_k p_k + √b_k p_{k−1} follows from points and weights for
expectations by the procedure of Stieltjes, and Gauss points from the Jacobi matrix (Golub and
Welsch, 1969; Gautschi, *Orthogonal Polynomials: Computation and Approximation*, 2004).

Nested points start at the mean. Further ones are added as Kronrod, Patterson (1968), and Genz and
Keister (1996) do it: c new points double the gain in degree if they are the roots of q with
E[ω q x^i] = 0, i < c, where ω has the points so far as roots. This makes rules of 1, 3, 7 or 9, and
15 or 17 points where these roots are real, within the distribution, and apart; for uniform and
normal variables they are the known ones. Where they are not, points are those of a Leja sequence
weighted by the Christoffel function, which is the density times the distance of Gauss points
(Narayan and Jakeman, 2014).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh_tridiagonal

from flexband.uncertainty.expansions.points.sequences import DECIMALS


class Recurrence(NamedTuple):
    """Coefficients a_k and √b_k of orthonormal polynomials, and their sizes: the largest |p_k|."""

    a: np.ndarray
    root: np.ndarray
    sizes: np.ndarray


def stieltjes(x: np.ndarray, w: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a_k and √b_k of the points and weights of a rule, k < count."""
    a = np.zeros(count)
    root = np.zeros(count)
    before = np.zeros(len(x))
    p = np.ones(len(x))
    for k in range(count):
        a[k] = w @ (x * p * p)
        next_values = (x - a[k]) * p - root[k] * before
        if k + 1 < count:
            root[k + 1] = np.sqrt(w @ next_values**2)
            before = p
            p = next_values / root[k + 1]
    return a, root


def orthonormal(recurrence: Recurrence, order: int, x: np.ndarray) -> np.ndarray:
    """Return p_0 … p_order at x, shape (*x.shape, order + 1)."""
    p = np.ones((order + 1, *np.shape(x)))
    for k in range(order):
        before = recurrence.root[k] * p[k - 1] if k else 0.0
        p[k + 1] = ((x - recurrence.a[k]) * p[k] - before) / recurrence.root[k + 1]
    return np.moveaxis(p, 0, -1)


def gauss(recurrence: Recurrence, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the roots of p_count and their weights, (count,) each."""
    if count == 1:
        return np.zeros(1), np.ones(1)  # the mean
    x, vectors = eigh_tridiagonal(recurrence.a[:count], recurrence.root[1:count])
    return x, vectors[0] ** 2


def nested_points(
    recurrence: Recurrence, ends: np.ndarray, usual: np.ndarray, count: int
) -> np.ndarray:
    """Return at least `count` nested points between ends, a Leja sequence of usual values."""
    points = [0.0]
    symmetric = np.abs(recurrence.a).max() < 1e-9
    for counts in ((2,), (4, 6), (8,)):  # points that are added together: the first possible
        extensions = (extension(recurrence, points, count) for count in counts)
        valid_extensions = [y for y in extensions if _is_possible(y, points, ends)]
        if not valid_extensions:
            break
        points = _arrange(recurrence, points, valid_extensions[0])
    if len(points) == 1:
        points += _cubic_pair(recurrence, ends)
    while len(points) < count:
        points.append(_next(recurrence, usual, points))
        if symmetric:
            points.append(-points[-1])
    return np.round(points, DECIMALS) + 0.0  # no −0


def extension(recurrence: Recurrence, points: Sequence[float], count: int) -> np.ndarray:
    """Return further points, (count,), for the highest possible degree; none if not all are real.

    They are the roots of q = p_c + Σ_j y_j p_j with E[ω q p_i] = 0, i < c: the eigenvalues of the
    Jacobi matrix whose last row has −√b_c y added to it.
    """
    x, w = gauss(recurrence, len(points) + count + 1)
    p = orthonormal(recurrence, count, x)
    omega = np.prod(x[:, None] - np.array(points), axis=1)
    matrix = (p[:, :count] * (w * omega)[:, None]).T @ p
    try:
        y = np.linalg.solve(matrix[:, :count], -matrix[:, count])
    except np.linalg.LinAlgError:
        return np.zeros(0)
    off = recurrence.root[1:count]
    jacobi = np.diag(recurrence.a[:count]) + np.diag(off, 1) + np.diag(off, -1)
    jacobi[-1] -= recurrence.root[count] * y
    roots = np.linalg.eigvals(jacobi)
    return np.zeros(0) if np.iscomplexobj(roots) else roots


def _arrange(recurrence: Recurrence, points: list[float], candidates: np.ndarray) -> list[float]:
    """Return points with further ones in the order of a Leja sequence, opposites together."""
    points = [*points]
    while len(candidates):
        points.append(_next(recurrence, candidates, points))
        opposite = candidates[np.abs(candidates + points[-1]) < 1e-9]
        points += opposite.tolist()
        candidates = candidates[~np.isin(candidates, points)]
    return points


def _is_possible(
    y: np.ndarray, points: Sequence[float], ends: np.ndarray, min_distance: float = 0.05
) -> bool:
    """Return whether points y exist, lie between the ends, and keep a distance in deviations."""
    if not len(y) or y.min() < ends[0] or y.max() > ends[1]:
        return False
    return bool(np.diff(np.sort([*points, *y])).min() > min_distance)


def _cubic_pair(recurrence: Recurrence, ends: np.ndarray) -> list[float]:
    """Return two points for the degree 3, which makes their sum E ξ³ = a_1: one of Gauss's."""
    x = gauss(recurrence, 3)[0]
    third = recurrence.a[1]
    pairs = [np.array([third - y, y]) for y in (x[0], x[2])]
    valid_pairs = [pair for pair in pairs if _is_possible(pair, [0.0], ends)]
    return (valid_pairs[0] if valid_pairs else x[[2, 0]]).tolist()


def _next(recurrence: Recurrence, choices: np.ndarray, points: Sequence[float]) -> float:
    """Return the choice where Π_j |x − x_j| / √Σ_k p_k(x)² is largest."""
    kernel = np.sum(orthonormal(recurrence, len(recurrence.a) - 1, choices) ** 2, axis=-1)
    with np.errstate(divide="ignore"):
        sizes = np.log(np.abs(choices[:, None] - points)).sum(axis=1) - np.log(kernel) / 2
    return float(choices[sizes > sizes.max() - 1e-9].max())  # the right one of two equal maxima
