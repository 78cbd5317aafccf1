"""Whether a closed outline touches or crosses itself, decided exactly."""

from __future__ import annotations

from fractions import Fraction

import numpy as np


def touching_edges(x: np.ndarray, y: np.ndarray) -> tuple[int, int] | None:
    """Return two edges of an outline that meet elsewhere than at a common corner, or None.

    Parameters
    ----------
    x, y : corners, shape (corners, n); edge k runs from corner k to the next. No corner equals
        the next one.
    """
    count = len(x)
    start = np.stack([x, y])
    end = np.roll(start, -1, axis=1)
    after = np.roll(start, -2, axis=1)
    back = _orientation(start, end, after) == 0
    back &= _forward(start, end, after) < 0
    if back.any():
        k = int(np.argwhere(back)[0, 0])
        return k, (k + 1) % count
    for k in range(count - 2):
        others = slice(k + 2, count - (k == 0))
        p, q, r, s = start[:, k, None], end[:, k, None], start[:, others], end[:, others]
        apart = np.maximum(p, q) < np.minimum(r, s)
        apart |= np.maximum(r, s) < np.minimum(p, q)
        near = ~apart.any(axis=0)
        if not near.any():
            continue
        near &= _orientation(p, q, r) * _orientation(p, q, s) <= 0
        near &= _orientation(r, s, p) * _orientation(r, s, q) <= 0
        if near.any():
            return k, k + 2 + int(np.argwhere(near)[0, 0])
    return None


def _orientation(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return the sign of the turn from a over b to c, points of shape (2, …): 1 is to the left."""
    (ax, ay), (bx, by), (cx, cy) = a, b, c
    rounding = 4 * np.finfo(float).eps  # more than that of the difference of both products
    with np.errstate(all="ignore"):
        first_product, second_product = (bx - ax) * (cy - ay), (by - ay) * (cx - ax)
        sign = np.sign(first_product - second_product)
        unsure = ~(
            np.abs(first_product - second_product)
            > rounding * (np.abs(first_product) + np.abs(second_product)) + 1e-290
        )
    unsure &= ~(((bx == ax) | (cy == ay)) & ((by == ay) | (cx == ax)))  # 0 − 0
    points = [np.broadcast_to(v, sign.shape)[unsure] for v in (ax, ay, bx, by, cx, cy)]
    sign[unsure] = [_exact(*map(Fraction, numbers)) for numbers in zip(*points, strict=True)]
    return sign


def _exact(ax, ay, bx, by, cx, cy) -> int:
    turn = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return (turn > 0) - (turn < 0)


def _forward(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return a number that is negative where c, on the line from a to b, is on a's side of b."""
    return (np.sign(b - a) * np.sign(c - b)).sum(axis=0)
