"""Distributions as functions of one standard variable, also parametric p-boxes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.inputs.distribution import Distribution
from flexband.uncertainty.inputs.inputs import Input, Interval, Numbers


@dataclass(frozen=True)
class Score(Input):
    """A distribution as a function of a standard normal variable."""

    distribution: Distribution

    def __repr__(self) -> str:
        return repr(self.distribution)

    @property
    def intervals(self) -> dict[str, Interval]:
        return self.distribution.intervals

    def at(self, parameters: Mapping[str, Numbers]) -> Input:
        return Score(self.distribution.at(parameters))

    def value(self, standard: np.ndarray) -> np.ndarray:
        return self.distribution.at_normal(standard[:, 0])

    def mean_or_midpoint(self) -> Numbers:
        """Return the mean, at the midpoints of parameters that are intervals."""
        return self.distribution.midpoint().mean_or_midpoint()

    def standard(self, value: np.ndarray) -> np.ndarray:
        return self.distribution.to_normal(value)


@dataclass(frozen=True)
class PBox(Score):
    """A distribution with interval parameters in the variable ξ of that at their midpoints."""

    @cached_property
    def _middle(self) -> Distribution:
        return self.distribution.midpoint()

    @property
    def family(self) -> Family:
        """The polynomials of the distribution at the midpoints."""
        return self._middle.family

    def at(self, parameters: Mapping[str, Numbers]) -> Input:
        return _Transported(self._middle, self.distribution.at(parameters))

    def with_parameters(self, parameters: Mapping[str, float | Input]) -> Distribution:
        return self.distribution.with_parameters(parameters)

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return values at the midpoints of the parameters."""
        return self._middle.value(standard)

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return the variables of values at the midpoints of the parameters."""
        return self._middle.standard(value)


@dataclass(frozen=True)
class _Transported(Input):
    """A distribution as a function of the standard variable of another."""

    source: Distribution
    target: Distribution

    def value(self, standard: np.ndarray) -> np.ndarray:
        source = np.asarray(self.source.value(standard))
        return self.target.at_normal(self.source.to_normal(source))

    def standard(self, value: np.ndarray) -> np.ndarray:
        return self.source.standard(self.source.at_normal(self.target.to_normal(value)))
