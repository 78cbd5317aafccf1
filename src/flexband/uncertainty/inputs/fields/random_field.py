"""Random fields: Gaussian or lognormal functions of position or time."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import field, replace
from functools import cached_property
from itertools import product
from typing import ClassVar, Self

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import (
    check_function,
    check_instance,
    check_integer,
    check_option,
    check_positive,
    check_spread,
)
from flexband.basics.warning import warn
from flexband.basics.words import number_of
from flexband.errors import InputError
from flexband.uncertainty.inputs.fields.correlation import (
    MAX_NODES,
    Correlation,
    Matern,
    exponential,
    squared_exponential,
    triangular,
    twice_differentiable,
)
from flexband.uncertainty.inputs.fields.eole import eole
from flexband.uncertainty.inputs.fields.field import Field, Profile, check_profile, profile
from flexband.uncertainty.inputs.fields.galerkin import karhunen_loeve, orthogonal_series
from flexband.uncertainty.inputs.fields.series import Discretization, Series
from flexband.uncertainty.inputs.inputs import Interval, Numbers


@frozen()
class RandomField(Field):
    """A random function of the position along a line [m] or of the time [s], as a series.

    It is μ(x) + σ(x) u(x), or exp(λ(x) + ζ(x) u(x)) if lognormal, where u is a homogeneous Gaussian
    field of zero mean and unit variance.

    Parameters
    ----------
    mean, std : mean and standard deviation: numbers, functions of positions of shape (points,) that
        return as many values, or an `Interval` each of which only limits are known.
    correlation_length : unit of the distances of `correlation`; a of Eq. (30) [m].
    domain : positions (start, end) on which the field is used. If None, `propagate` finds it by
        runs at the means and at the ends of the intervals, in which it records the positions where
        the response evaluates the field.
    terms : number of terms, each with one standard variable; if None, as few as `tolerance` allows.
    tolerance : largest variance error, as a fraction of the variance.
    correlation : of u, as a function of distance over correlation length: `squared_exponential`,
        `exponential`, `triangular`, ``Matern(nu)`` or your own. For a lognormal field it is the
        correlation of the logarithm.
    nodes : number of equidistant EOLE nodes on the domain, or of polynomials; if None, eight per
        correlation length and at least 21, and more if the tolerance requires them.
    distribution : "normal" or "lognormal".
    discretization : `eole`, `karhunen_loeve`, `orthogonal_series` or your own.

    Attributes
    ----------
    correlations : correlation functions by name. A surrogate can be saved if those of its fields
        are among them; add yours under a new name before saving and before loading.

    Raises
    ------
    InputError
        If a number is out of its range or the expansion is not possible.

    Examples
    --------
    >>> modulus = fb.RandomField(210e9, 5e9, correlation_length=0.5, domain=(0.0, 1.0))
    >>> modulus.dimension  # terms, as many as the tolerance of 5 % requires
    4
    >>> modulus.realizations(np.linspace(0.0, 1.0, 9), count=3).shape
    (3, 9)
    >>> bool(modulus.largest_variance_error() < 0.05)
    True
    """

    mean: Profile | Interval
    std: Profile | Interval
    correlation_length: float
    domain: tuple[float, float] | None = None
    terms: int | None = None
    tolerance: float = 0.05
    correlation: Correlation = field(default=squared_exponential)
    nodes: int | None = None
    distribution: str = "normal"
    discretization: Discretization = field(default=eole)

    correlations: ClassVar[dict[str, Correlation | type]] = {
        "squared_exponential": squared_exponential,
        "exponential": exponential,
        "triangular": triangular,
        "Matern": Matern,
    }

    _smoother = (
        "take a correlation function with a fourth derivative at distance 0, such as "
        "fields.squared_exponential or fields.Matern(2.5)"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("mean", "std"):
            if not isinstance(getattr(self, name), Interval):
                value = check_profile(f"RandomField {name}", getattr(self, name))
                object.__setattr__(self, name, value)
        for name in ("correlation_length", "tolerance"):
            check_positive(f"RandomField {name}", getattr(self, name))
        check_option("RandomField distribution", self.distribution, ("normal", "lognormal"))
        # Check mean and scatter at all ends of intervals.
        for mean, std in product(*map(_ends, (self.mean, self.std))):
            if not callable(std):
                check_positive("RandomField std", std)
            if not callable(mean):
                self._check_mean(np.asarray(mean))
                if not callable(std):
                    check_spread("RandomField std", std, mean)
        if self.tolerance >= 1:
            raise InputError(f"RandomField tolerance must be below 1; got {self.tolerance:g}")
        for name in ("correlation", "discretization"):
            check_function(f"RandomField {name}", getattr(self, name))
        # Check what determines the expansion.
        for name, smallest, largest in (("terms", 1, None), ("nodes", 2, MAX_NODES)):
            if (count := getattr(self, name)) is not None:
                count = check_integer(f"RandomField {name}", count, smallest, largest)
                object.__setattr__(self, name, count)
        if self.terms and self.nodes and self.terms > self.nodes:
            raise InputError(
                f"RandomField terms must be {self.nodes} or less here; got {self.terms}"
            )
        self._check_domain()

    def _check_mean(self, mean: np.ndarray) -> np.ndarray:
        if self.distribution == "lognormal":
            check_positive("mean of the lognormal RandomField", mean, rank=None)
        return mean

    @property
    def intervals(self) -> dict[str, Interval]:
        moments = {"mean": self.mean, "std": self.std}
        return {name: value for name, value in moments.items() if isinstance(value, Interval)}

    def at(self, parameters: Mapping[str, Numbers]) -> Self:
        if not parameters:
            return self
        _ = self.expansion  # the copy has it
        field_copy = copy(self)
        for name, value in parameters.items():
            object.__setattr__(field_copy, name, value)
        return field_copy

    def mean_or_midpoint(self) -> np.ndarray:
        """Return the standard variables of the mean, which `standard` takes."""
        return np.zeros((1, self.dimension))

    def nominal(self, x: np.ndarray) -> np.ndarray:
        return self._check_mean(profile("RandomField mean", self.mean, x))

    def deviation(self, x: np.ndarray) -> np.ndarray:
        """Return the standard deviation at positions x, shape x.shape."""
        return check_positive("RandomField std", profile("RandomField std", self.std, x), rank=None)

    def _logarithmic_variance(self, x: np.ndarray) -> np.ndarray:
        """Return ζ² of a lognormal field: the variance of its logarithm."""
        return np.log1p((self.deviation(x) / self.nominal(x)) ** 2)

    @cached_property
    def expansion(self) -> Series:
        """The series of the standardized field, which must have a domain."""
        # share of the tolerance that is met with all nodes, so that a part of the terms meets it
        few_terms = 0.7
        start, end = self.extent
        count = self.nodes or max(21, np.ceil(8 * (end - start) / self.correlation_length) + 1)
        if count > MAX_NODES:
            raise InputError(
                f"RandomField nodes must be {MAX_NODES} or less; got {count:.0f}, eight per "
                f"correlation length of {self.correlation_length:g} on ({start:g}, {end:g})"
            )
        before = np.inf
        while True:
            series = self.discretization(
                self.correlation, self.correlation_length, self.extent, int(count)
            )
            check_instance("what RandomField discretization returns", series, Series)
            x = series.places()
            _ = self.nominal(x), self.deviation(x)  # refused here if impossible anywhere
            if self.terms is not None:
                return series.first(self.terms)
            errors = self._errors(series, x).max(axis=-1)
            smallest_error = float(errors.min())
            if self.nodes or smallest_error <= few_terms * self.tolerance or 2 * count > MAX_NODES:
                break
            halvings = np.log2(MAX_NODES / count)
            gain = smallest_error / before
            if gain > 0 and smallest_error * gain ** (2 * halvings) > self.tolerance:
                break  # even if the error fell twice as fast as it does
            count = 2 * count - 1
            before = smallest_error
        sufficient_terms = np.flatnonzero(errors <= self.tolerance)
        if not len(sufficient_terms):
            raise InputError(
                f"RandomField tolerance {self.tolerance:g} on the variance error is not met "
                f"by {number_of(len(errors), 'term')} on {count:.0f} nodes; the best is "
                f"{errors.min():.3g}"
            )
        return series.first(int(sufficient_terms[0]) + 1)

    def _errors(self, series: Series, x: np.ndarray) -> np.ndarray:
        """Return the variance errors of the first 1, 2, … terms at positions x."""
        variance, covariance = series.second_moments(x)
        if self.distribution == "normal":
            return 1 - covariance - (covariance - variance)
        widest = replace(self, mean=_ends(self.mean)[0], std=_ends(self.std)[-1])
        square = widest._logarithmic_variance(x)
        field_variance, joint_variance, expansion_variance = (
            np.expm1(square * part) for part in (1.0, covariance, variance)
        )
        return (
            field_variance - joint_variance - (joint_variance - expansion_variance)
        ) / field_variance

    @property
    def dimension(self) -> int:
        """Number of standard variables, one per term."""
        return len(self.expansion.eigenvalues)

    def variance_error(self, x: np.ndarray) -> np.ndarray:
        """Return E[(field − its expansion)²]/σ² at positions x: Eq. (31) over σ²."""
        return self._errors(self.expansion, np.asarray(x, dtype=float))[-1]

    def largest_variance_error(self) -> float:
        """Return the largest variance error on the domain, on 1001 positions."""
        return float(self.variance_error(np.linspace(*self.extent, 1001)).max())

    @property
    def summary(self) -> str:
        """Number of terms and largest variance error."""
        return (
            f"random field, {number_of(self.dimension, 'term')}, "
            f"largest variance error {self.largest_variance_error():.4f}"
        )

    @property
    def twice_differentiable(self) -> bool:
        """Whether the correlation function has a fourth derivative at distance 0."""
        return twice_differentiable(self.correlation)

    def check_motion(self, part: str) -> None:
        """Raise `InputError` as any `Field`; warn if the terms lack much of the accelerations."""
        largest_acceleration_error = 0.05  # of a field that prescribes a motion, without a warning
        super().check_motion(part)
        missing_share = self.expansion.acceleration_error()
        if missing_share > largest_acceleration_error:
            warn(
                f"{part} is prescribed by a RandomField of {number_of(self.dimension, 'term')}, "
                f"which lack {100 * missing_share:.2g} % of the variance of its accelerations: "
                "they need more terms than the field itself, so take a smaller tolerance"
            )

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return `value`: a field is given by its standard variables, shape (n, terms)."""
        if value.ndim != 2 or value.shape[1] != self.dimension:
            raise InputError(
                f"a RandomField is given by standard variables of shape (n, {self.dimension}); "
                f"got shape {value.shape}"
            )
        return value

    def samples(self, standard: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return samples, shape (n, points), Eq. (29), at positions x of shape (1 or n, points).

        A lognormal field has its mean whatever the number of terms is.
        """
        basis = self.expansion.basis(x)
        u = np.einsum("nt,tnp->np", standard, basis)
        mean = self.nominal(x)
        if self.distribution == "normal":
            return mean + self.deviation(x) * u
        square = self._logarithmic_variance(x)
        return mean * np.exp(np.sqrt(square) * u - square / 2 * np.sum(basis**2, axis=0))


def _ends(value: Profile | Interval) -> list[Profile]:
    """Return both bounds of an interval, or the value itself."""
    return [value.lower, value.upper] if isinstance(value, Interval) else [value]


Field.functions.update(
    {"eole": eole, "karhunen_loeve": karhunen_loeve, "orthogonal_series": orthogonal_series}
)
