"""Importance sampling of rare samples with a mixture of normal densities.

Half of a mixture are the groups of known rare samples with their own covariance, somewhat widened.
The rest are densities of unit covariance around the groups, whose tails are those of the inputs,
and the density of the inputs itself and a wider one, which see what the groups leave out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

GROUPS, MEMBERS = 8, 6
"""Most groups, and samples per variable that a group must have for a covariance of its own."""

FEW, MARGIN = 4, 1.3
"""Variables of which all directions are used, and how much second moments exceed their noise."""

ROUNDS = 12
"""Of Lloyd's algorithm, which finds the groups."""

WIDENED = 1.3
"""By which standard deviations of a group are multiplied."""

SHARES = {"own": 0.6, "unit": 0.25, "inputs": 0.1, "wide": 0.05}

WIDE = 1.5
"""Standard deviation of the wide density."""


@dataclass(frozen=True)
class Mixture:
    """A mixture of normal densities.

    Attributes
    ----------
    means : shape (count, n).
    factors : Cholesky factors of the covariances, (count, n, n).
    shares : of each density, (count,); their sum is one.
    """

    means: np.ndarray
    factors: np.ndarray
    shares: np.ndarray

    @staticmethod
    def of(samples: np.ndarray, rng: np.random.Generator) -> Mixture:
        """Return a mixture around rare samples, shape (count, n); there may be none."""
        basis = _directions(samples)
        n, r = basis.shape
        unit, inside = np.eye(n), samples @ basis

        def full(covariance: np.ndarray) -> np.ndarray:
            return np.linalg.cholesky(unit + basis @ (covariance - np.eye(r)) @ basis.T)

        means, factors = [np.zeros(n), np.zeros(n)], [unit, full(WIDE**2 * np.eye(r))]
        shares = [SHARES["inputs"], SHARES["wide"]]
        for group in _groups(inside, rng):
            part = len(group) / len(samples)
            middle, several = basis @ group.mean(axis=0), len(group) >= MEMBERS * r
            if several:
                covariance = WIDENED**2 * np.cov(group.T).reshape(r, r) + 1e-4 * np.eye(r)
                means.append(middle)
                factors.append(full(covariance))
                shares.append(SHARES["own"] * part)
            means.append(middle)
            factors.append(unit)
            shares.append((SHARES["unit"] + SHARES["own"] * (not several)) * part)
        return Mixture(np.array(means), np.array(factors), np.array(shares) / sum(shares))

    @staticmethod
    def mean(*several: Mixture) -> Mixture:
        """Return some mixtures in equal parts."""
        each = zip(*(vars(mixture).values() for mixture in several), strict=True)
        means, factors, shares = (np.concatenate(arrays) for arrays in each)
        return Mixture(means, factors, shares / len(several))

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
        for mean, factor, share in zip(self.means, self.factors, self.shares, strict=True):
            z = np.einsum("ij,cj->ci", np.linalg.inv(factor), u - mean)
            size = np.log(share) - np.log(np.diag(factor)).sum()
            logs.append(size - 0.5 * np.einsum("ci,ci->c", z, z))
        return np.exp(-0.5 * np.sum(u**2, axis=1) - np.logaddexp.reduce(logs))


def _directions(samples: np.ndarray) -> np.ndarray:
    """Return orthonormal directions in which rare samples are not like the inputs, (n, r).

    These are eigenvectors of the second moments, which are 1 for the inputs, beyond the noise of so
    many samples; all directions if there are few, and at least one.
    """
    count, n = samples.shape
    if n <= FEW or not count:
        return np.eye(n)
    moments, vectors = np.linalg.eigh(samples.T @ samples / count)
    noise = np.sqrt(n / count)
    unusual = np.maximum(moments / (1 + noise) ** 2, max(0.0, 1 - noise) ** 2 / moments)
    order = np.argsort(-unusual, kind="stable")[: 2 * FEW]
    return vectors[:, order[: max(1, int((unusual[order] > MARGIN).sum()))]]


def _groups(samples: np.ndarray, rng: np.random.Generator) -> list[np.ndarray]:
    """Return samples in groups that are close to each other."""
    distinct = np.unique(samples, axis=0)
    count = min(GROUPS, len(distinct) // 2)
    if count < 2:
        return [samples] if len(samples) else []
    centres = distinct[rng.choice(len(distinct), count, replace=False)]
    groups: list[np.ndarray] = []
    for _ in range(ROUNDS):
        nearest = cdist(samples, centres).argmin(axis=1)
        groups = [group for k in range(len(centres)) if len(group := samples[nearest == k])]
        centres = np.array([group.mean(axis=0) for group in groups])
    return groups
