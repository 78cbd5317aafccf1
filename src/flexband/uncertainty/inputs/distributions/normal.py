"""Normal, lognormal and truncated normal numbers."""

from __future__ import annotations

from dataclasses import field
from typing import ClassVar

import numpy as np
from scipy.special import log_ndtr

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_numbers, check_positive
from flexband.errors import InputError
from flexband.uncertainty.expansions.families import HERMITE, Family
from flexband.uncertainty.inputs.distribution import FrozenDistribution, Spread, of_scipy
from flexband.uncertainty.inputs.inputs import Numbers

LARGEST_LOGARITHM = 300.0
LARGEST_VARIATION = 100.0
"""|mean| + variance of a logarithm, and std over mean, of a lognormal number."""


@frozen(repr=False)
class Normal(Spread):
    """A normally distributed number.

    Parameters
    ----------
    mean, std : mean and standard deviation.
    cv : coefficient of variation, the standard deviation over |mean|, instead of `std`.

    Raises
    ------
    InputError
        If a number is not finite, the spread is not positive, or both or none are given.

    Examples
    --------
    >>> fb.Normal(200.0, cv=0.05)
    Normal(mean=200.0, std=10.0)
    >>> fb.Normal(mean=fb.Interval(190.0, 210.0), std=10.0)
    Normal(mean=Interval(lower=190.0, upper=210.0), std=10.0)
    """

    usual_cv: ClassVar[float] = 1.0

    @property
    def frozen(self) -> FrozenDistribution:
        return of_scipy("norm")(self.mean, self.spread)

    @property
    def family(self) -> Family:
        return HERMITE

    def at_normal(self, z: np.ndarray) -> np.ndarray:
        return self.mean + self.spread * z

    def to_normal(self, value: np.ndarray) -> np.ndarray:
        return (value - self.mean) / self.spread

    def _residual_share(self) -> float:
        return 0.0  # it is a linear function of ξ


@frozen(repr=False)
class LogNormal(Spread):
    """A positive number whose logarithm is normally distributed.

    It is expanded in Hermite polynomials of its logarithm, since those of the number itself do not
    converge (Ernst, Mugler, Starkloff and Ullmann, 2012). Its nominal value is its median.

    Parameters
    ----------
    mean, std : mean and standard deviation of the number, not of its logarithm.
    cv : coefficient of variation, the standard deviation over the mean, instead of `std`.
    log_mean, log_std : mean and standard deviation of the natural logarithm, instead of these.

    Raises
    ------
    InputError
        If a number is not positive, or both or none of `std` and `cv` are given.

    Examples
    --------
    >>> inputs = {"life": fb.LogNormal(log_mean=2.0, log_std=0.5)}
    >>> bands = fb.propagate(lambda life: np.log(life), inputs, fb.PCCI(1, 0))
    >>> bands["error_bar"].values.round(4)
    array([1.5, 2.5])
    """

    mean: float | None = None  # pyright: ignore[reportIncompatibleVariableOverride]
    log_mean: float | None = field(default=None, kw_only=True)
    log_std: float | None = field(default=None, kw_only=True)

    usual_cv: ClassVar[float] = 1.0

    @classmethod
    def of_logarithm(cls, mean: float, std: float) -> LogNormal:
        """Return the number whose natural logarithm has this mean and standard deviation."""
        return cls(log_mean=mean, log_std=std)

    @property
    def logarithm(self) -> tuple[Numbers, Numbers]:
        """Mean and standard deviation of the natural logarithm."""
        if self.log_mean is not None and self.log_std is not None:
            return self.log_mean, self.log_std
        assert self.mean is not None
        variance = np.log1p((self.spread / self.mean) ** 2)
        return np.log(self.mean) - variance / 2, np.sqrt(variance)

    @property
    def frozen(self) -> FrozenDistribution:
        mean, std = self.logarithm
        return of_scipy("lognorm")(std, scale=np.exp(mean))

    @property
    def family(self) -> Family:
        """Hermite polynomials of the logarithm."""
        return HERMITE

    def check(self) -> None:
        """Raise `InputError` if a parameter is not positive; find the moments of the number."""
        either = "LogNormal must have either mean and one of std and cv, or log_mean and log_std"
        if self.log_mean is not None or self.log_std is not None:
            self._check_logarithm()
        if self.mean is None:
            raise InputError(f"{either}; got none")
        mean = check_positive("LogNormal mean", check_numbers("LogNormal mean", self.mean))
        object.__setattr__(self, "mean", float(mean))
        super().check()
        if self.spread > LARGEST_VARIATION * self.mean:
            raise InputError(
                f"LogNormal std must be {LARGEST_VARIATION:g} times the mean {self.mean:g} or "
                f"less; got {self.spread:g}"
            )

    def _check_logarithm(self) -> None:
        """Replace mean and standard deviation of the logarithm by those of the number."""
        if any(value is not None for value in (self.mean, self.std, self.cv)):
            raise InputError(
                f"LogNormal must have either mean, or log_mean and log_std; got {self!r}"
            )
        mean = float(check_numbers("LogNormal log_mean", self.log_mean))  # pyright: ignore[reportArgumentType]
        std = check_numbers("LogNormal log_std", self.log_std)  # pyright: ignore[reportArgumentType]
        std = float(check_positive("LogNormal log_std", std))
        if not abs(mean) + std * std < LARGEST_LOGARITHM:
            raise InputError(
                f"the mean and std of the logarithm must be smaller for the LogNormal to be "
                f"finite; got {mean:g} and {std:g}"
            )
        of_number = float(np.exp(mean + std**2 / 2))
        moments = {"mean": of_number, "std": float(of_number * np.sqrt(np.expm1(std**2)))}
        for name, value in (moments | {"log_mean": None, "log_std": None}).items():
            object.__setattr__(self, name, value)

    def at_normal(self, z: np.ndarray) -> np.ndarray:
        mean, std = self.logarithm
        return np.exp(mean + std * z)

    def to_normal(self, value: np.ndarray) -> np.ndarray:
        mean, std = self.logarithm
        return (np.log(value) - mean) / std


@frozen(repr=False)
class TruncatedNormal(Spread):
    """A normally distributed number of which only values between two limits occur.

    Parameters
    ----------
    mean, std : mean and standard deviation before truncation.
    lower, upper : limits; None where there is none.
    cv : coefficient of variation before truncation, instead of `std`.

    Raises
    ------
    InputError
        If the spread is not positive, or the limits leave nothing of the normal distribution.
    """

    lower: float | None = None
    upper: float | None = None

    @property
    def frozen(self) -> FrozenDistribution:
        return of_scipy("truncnorm")(*self._limits(), self.mean, self.spread)

    def check(self) -> None:
        """Raise `InputError` if the limits leave nothing."""
        min_probability = 1e-100  # of the values of a normal distribution that truncation leaves
        super().check()
        for name in ("lower", "upper"):
            if (limit := getattr(self, name)) is not None:
                limit = float(check_numbers(f"TruncatedNormal {name}", limit))
                object.__setattr__(self, name, limit)
        low, high = self._limits()
        if not low < high:
            raise InputError(
                f"TruncatedNormal lower {self.lower:g} must be below upper {self.upper:g}"
            )
        near_limit, far_limit = sorted((abs(low), abs(high))) if low * high > 0 else (0.0, np.inf)
        if near_limit > 0:
            logarithm = log_ndtr(-near_limit) + np.log1p(
                -np.exp(log_ndtr(-far_limit) - log_ndtr(-near_limit))
            )
            if not logarithm > np.log(min_probability):
                raise InputError(
                    f"{self!r} leaves nothing of the normal distribution: its limits are "
                    f"{near_limit:.3g} standard deviations or more from the mean"
                )

    def _limits(self) -> tuple[Numbers, Numbers]:
        """Return the limits in standard deviations from the mean."""
        low = -np.inf if self.lower is None else (self.lower - self.mean) / self.spread
        high = np.inf if self.upper is None else (self.upper - self.mean) / self.spread
        return low, high
