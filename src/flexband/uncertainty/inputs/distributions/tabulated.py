"""Distributions whose quantiles take long: they are computed once, as polynomials on panels."""

from __future__ import annotations

from abc import abstractmethod
from functools import cached_property

import numpy as np

from flexband.uncertainty.inputs.distribution import Distribution
from flexband.uncertainty.inputs.distributions.quantiles import Quantiles

REACHES, ACCURACY = (30.0, 20.0, 12.0, 9.0), 1e-6
"""Standard normal variables up to which there are panels, the first at which quantiles are the
inverse of probabilities; else 7: all but 3·10⁻¹² of the values."""


class Tabulated(Distribution):
    """A distribution with the function `exact` instead of a fast `at_normal`."""

    @abstractmethod
    def exact(self, z: np.ndarray) -> np.ndarray:
        """Return the increasing function of a standard normal z that is distributed so."""

    @cached_property
    def quantiles(self) -> Quantiles:
        """The numbers at values of a standard normal variable, as polynomials."""
        return Quantiles.of(self.exact, next(filter(self._reaches, REACHES), 7.0))

    def _reaches(self, reach: float) -> bool:
        """Return whether quantiles are accurate so far out."""
        z = np.array([-reach, reach])
        with np.errstate(all="ignore"):
            return bool(np.all(np.abs(self.to_normal(self.exact(z)) - z) < ACCURACY))

    def at_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the increasing function of a standard normal z that is distributed so."""
        z = np.asarray(z, dtype=float)
        low, high = self.quantiles.reach
        values, outside = self.quantiles(np.clip(z, low, high)), (z < low) | (z > high)
        if np.any(outside):
            values = np.array(values)
            values[outside] = self.exact(z[outside])
        return values
