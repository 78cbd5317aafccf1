"""Nested points in one variable: x₀, x₁, x₂, …; an expansion of order q takes the first q + 1.

A run serves every order that contains it, so a sparse expansion grows by one run per term, and its
interpolation is well posed on every downward closed set of orders (Chkifa, Cohen and Schwab, 2014).

The next point of a Leja sequence is where Π_j |x − x_j| is largest. On the interval its measured
Lebesgue constants stay below q + 1. Real projections of Leja sequences of the disk (R-Leja: Chkifa,
2013), which are Clenshaw–Curtis points in another order, are similar, with larger constants. For a
random variable the product is weighted by the square root of the density, which distributes points
as in Gauss quadrature (Narayan and Jakeman, 2014); the constants grow more slowly than
exponentially (Jantsch, Webster and Zhang, 2016). For moments the rules of Genz and Keister (1996)
are better as far as they reach: 1, 3 and 9 points integrate polynomials of degree 1, 5 and 15. So
are those of Patterson (1968) for a uniform variable: 1, 3, 7 and 15 points, of degree 1, 5, 11, 23.

Interval variables take one point after the other. For random variables orders 2k − 1 and 2k are
best added together: an odd order alone does not improve the mean.
`benchmarks/accuracy/points.py` measures all this.
"""

from __future__ import annotations

from functools import cache

import numpy as np

GENZ_KEISTER = (3**0.5, 2.861279576057058, 0.741095349994541, 4.184956017672732)
"""The positive points of a nine-point rule of N(0, 1), in the order of a weighted Leja sequence."""

PATTERSON = (
    0.6**0.5,
    0.9604912687080203,
    0.4342437493468026,
    0.9938319632127550,
    0.2233866864289669,
    0.6211029467372264,
    0.8884592328722570,
)
"""The positive points of a 15-point rule on [−1, 1], in the order of a Leja sequence."""

DECIMALS = 10
"""Points are rounded to this many decimals, so that they are the same on every machine."""


def interval_sequence(count: int) -> np.ndarray:
    """Return points of the Leja sequence 1, −1, 0, 0.577, … on [−1, 1], ends first, (count,)."""
    points = [1.0, -1.0]
    while len(points) < count:
        points.append(_next(tuple(points), rate=0.0, margin=0.0))
    return np.array(points[:count])


def normal_sequence(count: int) -> np.ndarray:
    """Return 0, √3, −√3, 2.86, … for ξ ~ N(0, 1): nine of Genz–Keister, then a Leja sequence."""
    points = _pairs(GENZ_KEISTER)
    while len(points) < count:
        point = _next(tuple(points), rate=0.25, margin=4.0)
        points += [point, -point]
    return np.array(points[:count])


def uniform_sequence(count: int) -> np.ndarray:
    """Return 0, √0.6, −√0.6, 0.96, … on [−1, 1]: 15 points of Patterson, then Leja pairs."""
    points = _pairs(PATTERSON)
    while len(points) < count:
        point = _next(tuple(points), rate=0.0, margin=1 - max(points))
        points += [point, -point]
    return np.array(points[:count])


def _pairs(positive: tuple[float, ...]) -> list[float]:
    """Return zero, then every point and its opposite."""
    return [0.0, *(sign * point for point in positive for sign in (1, -1))]


@cache
def _next(points: tuple[float, ...], rate: float, margin: float) -> float:
    """Return the next point, up to a margin outside, where Σ log|x − x_j| − rate x² is largest.

    Between two points the sum is concave, so its only maximum is where its slope is zero.
    """
    nodes = np.sort(points)
    ends = np.array([nodes[0] - margin, *nodes, nodes[-1] + margin]) if margin else nodes
    low = ends[:-1].copy()
    high = ends[1:].copy()
    for _ in range(60):
        middle = (low + high) / 2
        rises = (1 / (middle[:, None] - nodes)).sum(axis=1) > 2 * rate * middle
        low = np.where(rises, middle, low)
        high = np.where(rises, high, middle)
    places = np.round((low + high) / 2, DECIMALS) + 0.0  # no −0
    sizes = np.log(np.abs(places[:, None] - nodes)).sum(axis=1) - rate * places**2
    return float(places[sizes > sizes.max() - 1e-9].max())  # the right one of two equal maxima
