"""Importance sampling of rare samples with a mixture of normal densities.

Half of a mixture are the groups of known rare samples with their own covariance, somewhat widened.
The rest are densities of unit covariance around the groups, whose tails are those of the inputs,
and the density of the inputs itself and a wider one, which see what the groups leave out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy


@dataclass(frozen=True)
class MixtureOptions:
    """How a mixture is built; its shares are those of the densities."""

    max_groups: int = 8
    """Most groups of rare samples."""
    min_members: int = 6
    """Samples per variable of a group with a covariance of its own."""
    rounds: int = 12
    """Rounds of Lloyd's algorithm, which finds the groups."""
    all_directions: int = 4
    """Variables of which all directions are used."""
    min_excess: float = 1.3
    """Factor of second moments over their noise in other directions."""
    widened: float = 1.3
    """Factor of the standard deviations of a group."""
    wide_std: float = 1.5
    """Standard deviation of the wide density."""
    group_share: float = 0.6
    """Part of the densities with the covariances of the groups."""
    unit_share: float = 0.25
    """Part of those with unit covariance around the groups."""
    input_share: float = 0.1
    """Part of the density of the inputs."""
    wide_share: float = 0.05
    """Part of the wide density."""


@dataclass(frozen=True)
class Mixture:
    """A mixture of normal densities."""

    means: np.ndarray  # shape (count, n)
    factors: np.ndarray  # Cholesky factors of the covariances, (count, n, n)
    shares: np.ndarray  # of each density, (count,); their sum is one

    @staticmethod
    def from_samples(
        samples: np.ndarray,
        rng: np.random.Generator,
        *,
        options: MixtureOptions = MixtureOptions(),
    ) -> Mixture:
        """Return a mixture around rare samples, shape (count, n); there may be none."""
        basis = _directions(samples, options)
        n, r = basis.shape
        unit = np.eye(n)
        inside = samples @ basis

        def full(covariance: np.ndarray) -> np.ndarray:
            return np.linalg.cholesky(unit + basis @ (covariance - np.eye(r)) @ basis.T)

        means = [np.zeros(n), np.zeros(n)]
        factors = [unit, full(options.wide_std**2 * np.eye(r))]
        shares = [options.input_share, options.wide_share]
        for group in _groups(inside, rng, options):
            part = len(group) / len(samples)
            middle = basis @ group.mean(axis=0)
            has_covariance = len(group) >= options.min_members * r
            if has_covariance:
                covariance = options.widened**2 * np.cov(group.T).reshape(r, r) + 1e-4 * np.eye(r)
                means.append(middle)
                factors.append(full(covariance))
                shares.append(options.group_share * part)
            means.append(middle)
            factors.append(unit)
            shares.append((options.unit_share + options.group_share * (not has_covariance)) * part)
        return Mixture(np.array(means), np.array(factors), np.array(shares) / sum(shares))

    @staticmethod
    def mean(*mixtures: Mixture) -> Mixture:
        """Return some mixtures in equal parts."""
        fields = ((mixture.means, mixture.factors, mixture.shares) for mixture in mixtures)
        means, factors, shares = map(np.concatenate, zip(*fields, strict=True))
        return Mixture(means, factors, shares / len(mixtures))

    @cached_property
    def _inverses(self) -> tuple[np.ndarray, np.ndarray]:
        """The inverse factors, and the logarithms of shares over determinants."""
        determinants = np.log(np.diagonal(self.factors, 0, 1, 2)).sum(axis=1)
        return np.linalg.inv(self.factors), np.log(self.shares) - determinants

    def sample(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return samples, shape (count, n); the number of each density is that of its share."""
        ends = np.concatenate([[0.0], np.cumsum(self.shares)])
        places = (np.arange(count) + rng.random()) / count
        which = np.minimum(np.searchsorted(ends, places, "right") - 1, len(self.shares) - 1)
        z = rng.standard_normal((count, self.means.shape[1]))
        return self.means[which] + np.einsum("cij,cj->ci", self.factors[which], z)

    def weights(self, u: np.ndarray) -> np.ndarray:
        """Return the density of the inputs over that of the mixture, shape (points,)."""
        logs = []
        for mean, inverse, size in zip(self.means, *self._inverses, strict=True):
            z = np.einsum("ij,cj->ci", inverse, u - mean)
            logs.append(size - 0.5 * np.einsum("ci,ci->c", z, z))
        return np.exp(-0.5 * np.sum(u**2, axis=1) - np.logaddexp.reduce(logs))


def _directions(samples: np.ndarray, options: MixtureOptions) -> np.ndarray:
    """Return orthonormal directions in which rare samples are not like the inputs, (n, r).

    These are eigenvectors of the second moments, which are 1 for the inputs, beyond the noise of so
    many samples; all directions if there are few, and at least one.
    """
    (count, n), few = samples.shape, options.all_directions
    if n <= few or not count:
        return np.eye(n)
    moments, vectors = np.linalg.eigh(samples.T @ samples / count)
    noise = np.sqrt(n / count)
    unusual = np.maximum(moments / (1 + noise) ** 2, max(0.0, 1 - noise) ** 2 / moments)
    order = np.argsort(-unusual, kind="stable")[: 2 * few]
    return vectors[:, order[: max(1, int((unusual[order] > options.min_excess).sum()))]]


def _groups(
    samples: np.ndarray, rng: np.random.Generator, options: MixtureOptions
) -> list[np.ndarray]:
    if not len(samples):
        return []
    ordered = samples[np.lexsort(samples.T[::-1])]  # np.unique takes 20 times as long
    distinct = ordered[np.append(True, (np.diff(ordered, axis=0) != 0).any(axis=1))]
    count = min(options.max_groups, len(distinct) // 2)
    if count < 2:
        return [samples]
    centres = distinct[rng.choice(len(distinct), count, replace=False)]
    nearest = np.zeros(len(samples), int)
    for _ in range(options.rounds):
        nearest = scipy.spatial.distance.cdist(samples, centres).argmin(axis=1)
        sums = np.stack([np.bincount(nearest, column) for column in samples.T], axis=1)
        sizes = np.bincount(nearest)[:, None]
        before = centres
        centres = (sums / np.maximum(sizes, 1))[sizes[:, 0] > 0]
        if np.array_equal(before, centres):
            break
    return [samples[nearest == k] for k in np.unique(nearest)]
