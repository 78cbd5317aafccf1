"""Random inputs that are given by a distribution, whose parameters may be intervals."""

from __future__ import annotations

import copy
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import Any, Self

import numpy as np
from scipy.special import ndtr, ndtri

from flexband.uncertainty.expansions.families import HERMITE, Family
from flexband.uncertainty.inputs.inputs import Input, Interval


class Distribution(Input):
    """A random number with a distribution.

    A subclass is a frozen dataclass with the functions of an `Input`, with `frozen`, and with
    `check`, which refuses impossible parameters. Any parameter may be an `Interval`: the input is
    then a parametric p-box, all of whose corners are checked.
    """

    def __post_init__(self) -> None:
        for corner in product(*((one.lower, one.upper) for one in self.intervals.values())):
            if self.intervals:
                replace(self, **dict(zip(self.intervals, corner, strict=True)))  # pyright: ignore[reportArgumentType]
        if not self.intervals:
            super().__post_init__()
            self.check()

    def check(self) -> None:
        """Raise `InputError` if the parameters, which are finite numbers, are impossible."""

    @property
    @abstractmethod
    def frozen(self) -> Any:
        """The frozen distribution of `scipy.stats`; parameters may be arrays of shape (n,)."""

    @property
    def intervals(self) -> dict[str, Interval]:
        """The parameters that are intervals, by name."""
        named = {one.name: getattr(self, one.name) for one in fields(self)}  # pyright: ignore[reportArgumentType]
        return {name: value for name, value in named.items() if isinstance(value, Interval)}

    def midpoint(self) -> Self:
        """Return the distribution with all intervals at their midpoints."""
        middles = {name: (one.lower + one.upper) / 2 for name, one in self.intervals.items()}
        return replace(self, **middles) if middles else self  # pyright: ignore[reportArgumentType]

    def at(self, parameters: Mapping[str, Any]) -> Self:
        """Return the distributions at values of parameters, numbers or of shape (n,)."""
        own = copy.copy(self)
        for name, value in parameters.items():
            object.__setattr__(own, name, value)
        return own

    def at_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the increasing function of a standard normal z that is distributed so, (n,)."""
        if self.family == HERMITE:
            return np.asarray(self.value(np.reshape(z, (-1, 1)))).reshape(np.shape(z))
        low, high = self.frozen.ppf(ndtr(np.minimum(z, 0.0))), self.frozen.isf(ndtr(-np.abs(z)))
        return np.where(z < 0, low, high)

    def to_normal(self, value: np.ndarray) -> np.ndarray:
        """Return z of values, (n,): the inverse of `at_normal`."""
        if self.family == HERMITE:
            return self.standard(value)
        below, above = self.frozen.cdf(value), self.frozen.sf(value)
        return np.where(below < 0.5, ndtri(below), -ndtri(above))


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

    @property
    def family(self) -> Family:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The polynomials of the distribution at the midpoints."""
        return self.distribution.midpoint().family

    @property
    def intervals(self) -> dict[str, Interval]:
        """The parameters that are intervals, by name."""
        return self.distribution.intervals

    def at(self, parameters: Mapping[str, Any]) -> Input:
        """Return the input at values of the parameters, numbers or of shape (n,)."""
        return _Transported(self.distribution.midpoint(), self.distribution.at(parameters))

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return values at the midpoints of the parameters."""
        return self.distribution.midpoint().value(standard)  # pyright: ignore[reportReturnType]

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return the variables of values at the midpoints of the parameters."""
        return self.distribution.midpoint().standard(value)


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
