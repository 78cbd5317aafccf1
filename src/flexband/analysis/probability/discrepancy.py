"""What a surrogate misses of least margins, learnt from few runs of the model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.spatial.distance import cdist

ROUGHNESS = 0.1, 1.0, 10.0
"""Variances of the rough part, relative to the mean one of the quadratic function."""

LENGTHS = 0.5, 1.0, 2.0, 4.0
"""Over which the rough part varies, relative to the root of the number of variables."""

NOISE = 1e-8, 1e-4, 1e-2, 0.1, 1.0
"""Variances of the noise, in the same parts."""


@dataclass(frozen=True)
class DiscrepancyModel:
    """Margins of the model less those of a surrogate, learnt from few runs.

    It is a Gaussian process: a quadratic function of u with the covariance (1 + u·v)², a rough
    part with that of Matérn (ν = 3/2), which kinks need, and noise. Their ratios and the length
    of the rough part are those under which every run is the most likely if it is left out, which
    scales the variances as well (Rasmussen and Williams, 2006, section 5.4.2).
    """

    u: np.ndarray  # where they are known, shape (runs, n)
    missed: np.ndarray  # their values, shape (runs,)

    def with_runs(self, u: np.ndarray, missed: np.ndarray) -> DiscrepancyModel:
        """Return the model that has learnt from further runs."""
        return DiscrepancyModel(np.concatenate([self.u, u]), np.concatenate([self.missed, missed]))

    @cached_property
    def _fit(self) -> _Fit:
        kernels = (0.0, 1.0), *product(ROUGHNESS, LENGTHS)  # the first one is smooth
        return max(
            (_Fit.of_kernel(self, *kernel) for kernel in kernels), key=lambda fit: fit.likelihood
        )

    @cached_property
    def _factors(self) -> np.ndarray:
        return self._fit.inverse @ self.missed

    def predict(self, u: np.ndarray) -> np.ndarray:
        """Predict the discrepancy at u (points, n), shape (points,)."""
        return self._fit.kernel.covariance(u, self.u) @ self._factors

    def scatter(self, u: np.ndarray) -> np.ndarray:
        """Return the standard deviation of what is missed at u (points, n), shape (points,)."""
        fit = self._fit
        across = fit.kernel.covariance(u, self.u)
        explained_variance = np.sum(across @ fit.inverse * across, axis=1)
        variance = np.maximum(fit.kernel.variance(u) - explained_variance, 0.0)
        return np.sqrt(fit.scale * (variance + fit.noise))


@dataclass(frozen=True)
class _Kernel:
    """The covariance of a quadratic function and of a rough part."""

    roughness: float  # variance of the rough part
    length: float

    def covariance(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the covariance between points, (points of u, points of v)."""
        quadratic = (1 + u @ v.T) ** 2
        if not self.roughness:
            return quadratic
        distance = np.sqrt(3) / self.length * cdist(u, v)
        return quadratic + self.roughness * (1 + distance) * np.exp(-distance)

    def variance(self, u: np.ndarray) -> np.ndarray:
        """Return the variance at points, (points,)."""
        return (1 + np.sum(u**2, axis=1)) ** 2 + self.roughness


@dataclass(frozen=True)
class _Fit:
    """A covariance with the noise that suits it best, its inverse, and how likely the runs are."""

    kernel: _Kernel
    noise: float
    inverse: np.ndarray
    scale: float  # of all variances
    likelihood: float

    @staticmethod
    def of_kernel(model: DiscrepancyModel, roughness: float, length: float) -> _Fit:
        """Return the fit with a ratio of variances and a relative length."""
        u = model.u
        missed = model.missed
        size = float(np.mean((1 + np.sum(u**2, axis=1)) ** 2))
        kernel = _Kernel(roughness * size, length * float(np.sqrt(u.shape[1])))
        sizes, vectors = np.linalg.eigh(kernel.covariance(u, u))
        shrunk = 1 / (np.maximum(sizes, 0.0) + size * np.array(NOISE)[:, None])  # (noise, runs)
        precision = shrunk @ (vectors**2).T
        left_out = (shrunk * (missed @ vectors)) @ vectors.T / precision
        scale = np.mean(left_out**2 * precision, axis=1) + 1e-300
        likelihood = np.sum(np.log(precision), axis=1) - len(u) * np.log(scale)
        best = int(np.argmax(likelihood))
        inverse = (vectors * shrunk[best]) @ vectors.T
        return _Fit(
            kernel, size * NOISE[best], inverse, float(scale[best]), float(likelihood[best])
        )
