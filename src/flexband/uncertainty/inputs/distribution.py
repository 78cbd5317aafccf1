"""Random inputs that are given by a distribution, whose parameters may be intervals."""

from __future__ import annotations

import warnings
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, ClassVar, Protocol, Self

import numpy as np
from scipy.special import ndtr, ndtri

from flexband.basics.checks import check_numbers, check_positive, check_spread
from flexband.basics.warning import warn
from flexband.errors import InputError
from flexband.uncertainty.expansions.densities import DensityPolynomials
from flexband.uncertainty.expansions.families import HERMITE, Family, Hermite
from flexband.uncertainty.inputs.constants import is_number
from flexband.uncertainty.inputs.distributions.quantiles import Quantiles
from flexband.uncertainty.inputs.inputs import Input, Interval, Numbers

if TYPE_CHECKING:
    from scipy.stats import rv_continuous

LIGHT = 0.85
NEAR = 4.0
FAR = 7.0
"""Least exponent c of a tail e^{−x^c} that counts as light, between these values of a normal z."""

NO_SCATTER = (
    "An input that does not scatter is written as a number, or as an Interval, in place of the "
    "distribution"
)
"""What to do about a spread of zero."""


class FrozenDistribution(Protocol):
    """A distribution of `scipy.stats` with its parameters, as far as it is used."""

    def cdf(self, x: np.ndarray, /) -> np.ndarray: ...
    def sf(self, x: np.ndarray, /) -> np.ndarray: ...
    def ppf(self, q: np.ndarray, /) -> np.ndarray: ...
    def isf(self, q: np.ndarray, /) -> np.ndarray: ...
    def support(self) -> tuple[float, float]: ...
    def mean(self) -> float: ...
    def var(self) -> float: ...


def of_scipy(name: str) -> rv_continuous:
    """Return a continuous distribution of SciPy, which is not imported before."""
    from scipy import stats  # noqa: PLC0415

    distribution = vars(stats).get(name) if isinstance(name, str) else None
    if not isinstance(distribution, stats.rv_continuous):
        raise InputError(f"scipy.stats has no continuous distribution {name!r}")
    return distribution


class Distribution(Input):
    """A random number with a distribution.

    A subclass is a frozen dataclass with `frozen`, and with `check`, which refuses impossible
    parameters. Any parameter may be an `Interval`: the input is then a parametric p-box, all of
    whose corners are checked.

    It is expanded in the polynomials of its own density, with ξ = (x − mean)/std. If a
    tail is heavier than exponential, these do not converge (Ernst et al., 2012), or need values
    that hardly ever occur; then ξ is standard normal, and the number a function of it.
    """

    def __post_init__(self) -> None:
        if self.intervals:
            for corner in product(
                *((interval.lower, interval.upper) for interval in self.intervals.values())
            ):
                self.with_parameters(dict(zip(self.intervals, corner, strict=True)))
            return
        super().__post_init__()
        self.check()
        remark_limit = 1e-3  # part of the variance that polynomials of the highest order may miss
        if (
            isinstance(self.family, Hermite)
            and (missing_share := self._residual_share()) > remark_limit
        ):
            warn(
                f"{self!r} has a heavy tail: expansions up to order {HERMITE.highest} miss "
                f"{100 * missing_share:.2g} % of its variance; use LHSScanning with many samples"
            )

    def __repr__(self) -> str:
        parameters = {parameter.name: getattr(self, parameter.name) for parameter in fields(self)}
        text = ", ".join(
            f"{name}={value!r}" for name, value in parameters.items() if value is not None
        )
        return f"{type(self).__name__}({text})"

    def check(self) -> None:
        """Raise `InputError` if the parameters, which are finite numbers, are impossible."""

    @property
    @abstractmethod
    def frozen(self) -> FrozenDistribution | None:
        """The frozen distribution of `scipy.stats`; parameters may be arrays of shape (n,).

        None if it has no such one, and the functions that take it are defined here.
        """

    @property
    def name(self) -> str:
        """Its name, for files and messages."""
        return type(self).__name__

    @property
    def kinks(self) -> list[float]:
        """Standard normal variables at which the density is not smooth."""
        return []

    @property
    def support(self) -> tuple[float, float]:
        """The lowest and the highest possible value; infinite if there is none."""
        low, high = self._scipy_distribution.support()
        return float(low), float(high)

    @cached_property
    def _scipy_distribution(self) -> FrozenDistribution:
        """The `frozen` distribution, kept since SciPy takes a millisecond to make one."""
        frozen = self.frozen
        assert frozen is not None
        return frozen

    @property
    def has_finite_bounds(self) -> bool:
        """Whether all values are between finite bounds."""
        return bool(np.isfinite(self.support).all())

    @property
    def intervals(self) -> dict[str, Interval]:
        parameters = {parameter.name: getattr(self, parameter.name) for parameter in fields(self)}
        return {name: value for name, value in parameters.items() if isinstance(value, Interval)}

    def midpoint(self) -> Self:
        """Return the distribution with all intervals at their midpoints."""
        middles = {
            name: (interval.lower + interval.upper) / 2 for name, interval in self.intervals.items()
        }
        return self.with_parameters(middles) if middles else self

    def with_parameters(self, parameters: Mapping[str, float | Input]) -> Self:
        return replace(self, **parameters)

    def at(self, parameters: Mapping[str, Numbers]) -> Self:
        if not parameters:
            return self
        distribution = object.__new__(type(self))
        for parameter in fields(self):
            value = parameters.get(parameter.name, getattr(self, parameter.name))
            object.__setattr__(distribution, parameter.name, value)
        return distribution

    def at_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the increasing function of a standard normal z that is distributed so, (n,)."""
        frozen = self._scipy_distribution
        below = np.minimum(z, 0.0)
        above = np.maximum(z, 0.0)
        with warnings.catch_warnings():  # of SciPy's, about quantiles of rare values
            warnings.simplefilter("ignore")
            low = frozen.ppf(ndtr(below))
            high = frozen.isf(ndtr(-above))
        return np.where(z < 0, low, high)

    def to_normal(self, value: np.ndarray) -> np.ndarray:
        """Return z of values, (n,): the inverse of `at_normal`."""
        below = self._scipy_distribution.cdf(value)
        above = self._scipy_distribution.sf(value)
        return np.where(below < 0.5, ndtri(below), -ndtri(above))

    def hermite_coefficients(self, order: int, points: int) -> np.ndarray:
        """Return coefficients in orthonormal Hermite polynomials of `at_normal`, (order + 1,)."""
        nodes, weights = HERMITE.gauss(points)
        polynomials = HERMITE.values(order, nodes) / np.sqrt(HERMITE.norms(order))
        return (weights * self.at_normal(nodes)) @ polynomials

    def _residual_share(self) -> float:
        """Return the part of the variance that Hermite polynomials of the highest order miss."""
        rule = 60  # Gauss points
        terms = self.hermite_coefficients(HERMITE.highest, rule)
        return float(1 - np.sum(terms[1:] ** 2) / self._scipy_distribution.var())

    @cached_property
    def light(self) -> bool:
        """Whether both tails decrease exponentially or faster, as far as numbers go."""
        near_exponent = -np.log(ndtr(-NEAR))
        far_exponent = -np.log(ndtr(-FAR))
        x = np.abs(self.at_normal(np.array([-FAR, -NEAR, NEAR, FAR])) - self.at_normal(np.zeros(1)))
        max_ratio = (far_exponent / near_exponent) ** (1 / LIGHT)
        return bool(x[0] <= max_ratio * x[1] and x[3] <= max_ratio * x[2])

    @property
    def family(self) -> Family:
        """The polynomials of its density, or those of a normal variable if a tail is heavy."""
        return self._polynomials if self.light else HERMITE

    @cached_property
    def _polynomials(self) -> DensityPolynomials:
        return DensityPolynomials(self)

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return the number, shape (n,), at ξ of shape (n, 1)."""
        family = self.family
        xi = standard[:, 0]
        if not isinstance(family, DensityPolynomials):
            return self.at_normal(xi)
        mean, std = family.scale
        return np.clip(mean + std * xi, *self.support)

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return ξ of values; those that are impossible raise `InputError`."""
        low, high = self.support
        slack = 1e-9 * (high - low) if self.has_finite_bounds else 0.0
        outside = (value < low - slack) | (value > high + slack)
        if np.any(outside):
            worst = np.ravel(value)[np.ravel(outside)][0]
            raise InputError(f"values must be from {low:g} to {high:g}; got {worst:g}")
        value = np.clip(value, low, high)
        family = self.family
        if isinstance(family, DensityPolynomials):
            return family.standardize(value)
        return self.to_normal(value)

    def rule(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return points and weights for expectations of polynomials up to the degree 2 count."""
        z, weights = self.quantiles.rule(count)
        return self.at_normal(z), weights

    @property
    def tolerance_or_std(self) -> float:
        """The parameter `std`, where all parameters are numbers."""
        std = vars(self).get("std")
        return float(std) if is_number(std) and not self.intervals else 0.0

    def mean_or_midpoint(self) -> float:
        """Return the mean, of what SciPy has no distribution for by Gauss points."""
        gauss_points = 20
        if self.frozen is not None:
            return float(self.frozen.mean())
        xi, weights = self.family.gauss(gauss_points)
        return float(weights @ self.value(xi[:, None]))

    @cached_property
    def quantiles(self) -> Quantiles:
        """The numbers at values of a standard normal variable, as polynomials."""
        reach = 30.0  # z up to which quantiles matter for polynomials of high orders
        return Quantiles.from_function(self.at_normal, reach, self.kinks)


@dataclass(frozen=True, repr=False)
class Spread(Distribution):
    """A distribution that is given by mean and standard deviation, or by cv = std over |mean|."""

    mean: float
    std: float | None = None
    cv: float | None = field(default=None, kw_only=True)

    usual_cv: ClassVar[float] = np.inf
    """Largest coefficient of variation that is likely not meant in per cent."""

    @property
    def spread(self) -> Numbers:
        """The standard deviation."""
        return _spread(self.mean, self.std, self.cv)

    def check(self) -> None:
        """Raise `InputError` if the spread is impossible; give `std` the number that `cv` tells."""
        object.__setattr__(self, "std", checked_std(self, self.mean))
        object.__setattr__(self, "cv", None)


def _spread(mean: Numbers, std: Numbers | None, cv: Numbers | None) -> Numbers:
    if std is not None:
        return std
    assert cv is not None
    return cv * np.abs(mean)


def checked_std(distribution: Spread | Moments, mean: float) -> float:
    """Return the standard deviation that `std` or `cv` tells; `InputError` if it is impossible."""
    name = type(distribution).__name__
    if (distribution.std is None) == (distribution.cv is None):
        std_and_cv = f"both: std={distribution.std!r} and cv={distribution.cv!r}"
        text = "neither" if distribution.std is None else std_and_cv
        raise InputError(f"{name} must have either std or cv; got {text}")
    if distribution.cv is not None:
        cv = check_numbers(f"{name} cv", distribution.cv)
        _check_scatter(name, "cv", cv)
        if cv > distribution.usual_cv:
            warn(
                f"{name} cv is {cv:g}, a standard deviation of {cv:g} times the mean; is it in per "
                "cent? A cv of 0.05 is 5 %"
            )
        if mean == 0:
            raise InputError(f"{name} cv must be given as std where the mean is 0")
    spread = distribution.std if distribution.cv is None else distribution.cv * abs(mean)
    std = float(check_numbers(f"{name} std", spread))  # pyright: ignore[reportArgumentType]
    _check_scatter(name, "std", std)
    check_spread(f"{name} std", std, mean)
    return std


def _check_scatter(name: str, parameter: str, spread: Numbers) -> None:
    if spread == 0:
        raise InputError(f"{name} {parameter} must be positive; got 0. {NO_SCATTER}")
    check_positive(f"{name} {parameter}", spread)


@dataclass(frozen=True, repr=False)
class Moments(Distribution):
    """A distribution that is given by two parameters of its own, or by mean and spread.

    A subclass names its own parameters in `parameter_names`, and finds them in `of_moments`.
    """

    mean: float | None = field(default=None, kw_only=True)
    std: float | None = field(default=None, kw_only=True)
    cv: float | None = field(default=None, kw_only=True)

    parameter_names: ClassVar[tuple[str, str]]
    usual_cv: ClassVar[float] = np.inf

    @abstractmethod
    def of_moments(self, mean: Numbers, std: Numbers) -> tuple[Numbers, Numbers]:
        """Return its own parameters at mean and standard deviation, numbers or of shape (n,)."""

    @abstractmethod
    def check_moments(self, mean: float, std: float) -> None:
        """Raise `InputError` if it cannot have this mean and standard deviation."""

    @property
    def parameters(self) -> tuple[Numbers, Numbers]:
        """Its own parameters, numbers or of shape (n,)."""
        if self.mean is None:
            first, second = (getattr(self, name) for name in self.parameter_names)
            return first, second
        return self.of_moments(self.mean, _spread(self.mean, self.std, self.cv))

    def check(self) -> None:
        """Raise `InputError` if parameters are missing; find its own from the moments."""
        name = type(self).__name__
        moments = {k: getattr(self, k) for k in ("mean", "std", "cv")}
        of_moments = any(value is not None for value in moments.values())
        parameters = [getattr(self, k) for k in self.parameter_names]
        count = sum(value is not None for value in parameters)
        if count != (0 if of_moments else 2):
            arguments = dict(zip(self.parameter_names, parameters, strict=True)) | moments
            text = ", ".join(f"{k}={v!r}" for k, v in arguments.items() if v is not None)
            raise InputError(
                f"{name} must have either {' and '.join(self.parameter_names)}, or mean and one of "
                f"std and cv; got {text or 'none'}"
            )
        if of_moments:
            mean = float(check_numbers(f"{name} mean", self.mean))  # pyright: ignore[reportArgumentType]
            std = checked_std(self, mean)
            self.check_moments(mean, std)
            parameters = map(float, self.of_moments(mean, std))
        for k, value in zip(self.parameter_names, parameters, strict=True):
            object.__setattr__(
                self, k, float(check_positive(f"{name} {k}", check_numbers(f"{name} {k}", value)))
            )
        for k in moments:
            object.__setattr__(self, k, None)
