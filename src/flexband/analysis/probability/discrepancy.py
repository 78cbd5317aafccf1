"""What a surrogate misses of least margins, learnt from few runs of the model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class DiscrepancyModel:
    """Margins of the model less those of a surrogate, learnt from few runs.

    It is a Gaussian process with the covariance (1 + u·v)², that is a quadratic function of u, and
    noise. Their ratio is that with the least leave-one-out errors, which scale the variances as
    well (Rasmussen and Williams, 2006, section 5.4.2).
    """

    u: np.ndarray  # where they are known, shape (runs, n)
    missed: np.ndarray  # their values, shape (runs,)

    @cached_property
    def _fit(self) -> tuple[np.ndarray, float, float]:
        """The inverse of the covariance, the variance of its noise, and the factor of both."""
        covariance = (1 + self.u @ self.u.T) ** 2
        fits = []
        for ratio in (1e-8, 1e-4, 1e-2, 0.1, 1.0):  # of the noise to the quadratic function
            noise = ratio * float(np.mean(np.diag(covariance)))
            inverse = np.linalg.inv(covariance + noise * np.eye(len(self.u)))
            left_out = inverse @ self.missed / np.diag(inverse)
            scale = float(np.mean(left_out**2 * np.diag(inverse)))
            fits.append((float(np.sum(left_out**2)), inverse, noise, scale))
        _, inverse, noise, scale = min(fits, key=lambda fit: fit[0])
        return inverse, noise, scale

    def expected(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what is expected to be missed at u (points, n), and its scatter, each (points,).

        Without runs these are 0 and ∞.
        """
        if not len(self.u):
            return np.zeros(len(u)), np.full(len(u), np.inf)
        inverse, noise, scale = self._fit
        across = (1 + u @ self.u.T) ** 2
        prior = (1 + np.sum(u**2, axis=1)) ** 2
        variance = np.maximum(prior - np.sum(across @ inverse * across, axis=1), 0.0) + noise
        return across @ (inverse @ self.missed), np.sqrt(scale * variance)
