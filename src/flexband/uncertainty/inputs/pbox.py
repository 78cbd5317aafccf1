"""Distributions whose parameters are intervals: parametric p-boxes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.inputs.distribution import Distribution
from flexband.uncertainty.inputs.inputs import Input, Interval


@dataclass(frozen=True)
class PBox(Input):
    """A distribution whose parameters are intervals, as a function of one standard variable.

    The variable is that of the distribution with the parameters at their midpoints. Equal
    probabilities have equal variables, whatever the parameters are.
    """

    distribution: Distribution

    def __repr__(self) -> str:
        """Return that of the distribution."""
        return repr(self.distribution)

    @cached_property
    def _middle(self) -> Distribution:
        return self.distribution.midpoint()

    @property
    def family(self) -> Family:
        """The polynomials of the distribution at the midpoints."""
        return self._middle.family

    @property
    def intervals(self) -> dict[str, Interval]:
        """The parameters that are intervals, by name."""
        return self.distribution.intervals

    def at(self, parameters: Mapping[str, Any]) -> Input:
        """Return the input at values of the parameters, numbers or of shape (n,)."""
        return _Transported(self._middle, self.distribution.at(parameters))

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return values at the midpoints of the parameters."""
        return self._middle.value(standard)  # pyright: ignore[reportReturnType]

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
