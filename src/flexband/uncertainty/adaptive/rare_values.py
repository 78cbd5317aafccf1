"""Rare values of random variables, where an expansion must not grow beyond measure.

The moments of a polynomial depend on values there, and high orders may oscillate between the
outermost runs. What several variables multiply may be large together where it is small for each
alone. Whether a response grows as its expansion does, runs at rare values tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc, chdtri, ndtri

from flexband.uncertainty.adaptive.held_out_points import TIE_DIGITS
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.inputs.sampling import of_normals, sobol


class RareValueOptions(NamedTuple):
    """Where rare values are, and how far an expansion may grow there."""

    # equidistant values of |z| of one normal variable; of several, |z| are as rare
    distances: tuple[float, ...] = (3.0, 3.5, 4.0, 4.5, 5.0)
    sweeps: int = 3  # times that values of one variable are visited, at different η
    max_slopes: int = 2  # most directions of large slopes
    min_slope: float = 0.1  # of one of them, relative to the largest
    # a value of a normal variable along a slope, and the least value for which it speaks: it is in
    # the middle between 3.5 and the outermost of eight samples. A run at 3.5 would count three
    # times as much if all of |z| > 2.5 missed as much as it does
    slope_distance: float = 3.5
    slope_reach: float = 2.5
    plane_directions: int = 6  # between two variables
    joint_directions: int = 32  # among more
    # an expansion may leave the range of the runs by this factor, times this power of how much
    # farther out it is than the runs
    margin: float = 1.5
    growth: int = 2


class RareValues(NamedTuple):
    """Rare values of random variables, and values of the interval variables there."""

    xi: np.ndarray  # (points, n)
    eta: np.ndarray  # (points, m)
    along: np.ndarray  # directions of ξ, (points, n)
    weight: np.ndarray  # of an expectation, (points,)

    @staticmethod
    def from_index(
        index: np.ndarray,
        families: Sequence[Family],
        eta: np.ndarray,
        *,
        options: RareValueOptions = RareValueOptions(),
    ) -> RareValues:
        """Return those of terms with orders `index` in each ξ; η are some of those given."""
        along, distance, weight = _directions(index, options)
        xi = of_normals(distance[:, None] * along, families)
        return RareValues(xi, np.resize(eta, (len(xi), eta.shape[1])), along, weight)

    @staticmethod
    def along_slopes(
        slopes: np.ndarray,
        families: Sequence[Family],
        m: int,
        *,
        options: RareValueOptions = RareValueOptions(),
    ) -> RareValues:
        """Return rare values to both sides in the directions in which series vary most.

        A function of a few sums of random variables, such as a linear one, shows along them alone
        what it does at rare values. Where no series has a slope, all variables count alike. The m
        interval variables are in the middle. Slopes, (n, series), are in standard deviations of ξ.
        """
        slopes = slopes.round(TIE_DIGITS)
        if not slopes.any():
            slopes = np.ones((len(slopes), 1))
        directions, size, _ = np.linalg.svd(slopes, full_matrices=False)
        axes = directions.T[size > options.min_slope * size.max(initial=0.0)][: options.max_slopes]
        at = np.abs(axes).round(TIE_DIGITS).argmax(axis=1)
        largest = np.take_along_axis(axes, at[:, None], axis=1)
        axes = -np.sign(largest) * axes  # either sign may come out of the decomposition
        along = np.concatenate([axes, -axes])
        # What is missed grows as z³ at least, since z and z² are expanded; and 5!! = E z⁶.
        beyond = 15 * chdtrc(7, options.slope_reach**2)  # E[z⁶; |z| > 2.5]
        weight = np.full(len(along), beyond / options.slope_distance**6 / 2)
        xi = of_normals(options.slope_distance * along, families)
        return RareValues(xi, np.zeros((len(xi), m)), along, weight)

    @staticmethod
    def concatenate(parts: Sequence[RareValues]) -> RareValues:
        return RareValues(*map(np.concatenate, zip(*parts, strict=True)))

    def which(self, rows: slice | np.ndarray) -> RareValues:
        return RareValues(*(v[rows] for v in self))

    def first(self, share: np.ndarray, count: int) -> RareValues:
        """Return those of the largest share, the outermost of equal ones.

        Each ξ is there once, with the weights of all its values.
        """
        relative = (share / (share.max(initial=0.0) or 1.0)).round(TIE_DIGITS)
        order = np.lexsort((-np.sum(self.xi**2, axis=1), -relative))
        _, at, group = np.unique(self.xi[order], axis=0, return_index=True, return_inverse=True)
        weight = np.bincount(group.ravel(), self.weight[order], len(at))
        values = self.which(order[at])._replace(weight=weight)
        return values.which(np.argsort(at)[:count])

    def growth_limit(
        self, xi: np.ndarray, *, options: RareValueOptions = RareValueOptions()
    ) -> np.ndarray:
        """Return by what factor an expansion may leave the range of runs at `xi`, (points,)."""
        reached = np.abs(xi @ self.along.T).max(axis=0)
        farther = np.abs((self.xi * self.along).sum(axis=1)) / np.maximum(1.0, reached)
        return options.margin * np.maximum(1.0, farther) ** options.growth


def _directions(
    index: np.ndarray, options: RareValueOptions
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return directions and distances of rare values of normal variables, and their weights.

    They lie along each ξ of an order above 1, between each two that a term of order above 2
    multiplies, and among all that terms of three or more multiply. Of several variables, distances
    are as rare as `distances` are of one. Weights give the mean of the expectations that the three
    kinds of directions tell, over those along all ξ and the mean of those between two. Orders in
    each ξ are those of the index, (N, n).
    """
    n = index.shape[1]
    factors = index > 0
    normal_distances = np.array(options.distances)
    unit = np.eye(n)
    pairs = factors[index.sum(axis=1) > 2]
    alone = [unit[v : v + 1] for v in np.flatnonzero(index.max(axis=0, initial=0) > 1)]
    angles = np.pi * (np.arange(options.plane_directions) + 0.5) / options.plane_directions
    plane = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    plane_vectors = [
        plane @ unit[list(pair)]
        for pair in combinations(range(n), 2)
        if pairs[:, pair].all(axis=1).any()
    ]
    # Collect groups of directions: unit vectors, how often they are visited, and their share.
    groups = [(vectors, options.sweeps, 1.0) for vectors in alone]
    groups += [(vectors, 1, 1 / len(plane_vectors)) for vectors in plane_vectors]
    joint_variables = np.flatnonzero(factors[factors.sum(axis=1) > 2].any(axis=0))
    if len(joint_variables):
        z = ndtri(sobol(options.joint_directions, len(joint_variables), seed=1))
        groups.append(
            (z / np.linalg.norm(z, axis=1, keepdims=True) @ unit[joint_variables], 1, 1.0)
        )
    # Weigh the distances by the normal density.
    kinds = 1 + (len(plane_vectors) > 0) + (len(joint_variables) > 0)
    density = (
        np.exp(-np.square(normal_distances) / 2)
        / np.sqrt(2 * np.pi)
        * np.diff(normal_distances)[0]
        / kinds
    )
    directions = [np.zeros((0, n))]
    distances = [np.zeros(0)]
    weights = [np.zeros(0)]
    for vectors, times, share in groups:
        two_sided_vectors = np.concatenate([vectors, -vectors] * times)
        radius = np.sqrt(
            chdtri(np.count_nonzero(vectors.any(axis=0)), chdtrc(1, normal_distances**2))
        )
        directions.append(np.repeat(two_sided_vectors, len(normal_distances), axis=0))
        distances.append(np.tile(radius, len(two_sided_vectors)))
        weights.append(
            np.tile(density, len(two_sided_vectors)) * 2 * share / len(two_sided_vectors)
        )
    return np.concatenate(directions), np.concatenate(distances), np.concatenate(weights)
