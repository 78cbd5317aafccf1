"""Measured values, smoothed by a kernel density."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.polynomial import hermite_e
from scipy.special import ndtr, ndtri

from flexband.arguments import frozen
from flexband.errors import InputError, check_finite, check_numbers, check_positive, warn
from flexband.uncertainty.inputs.distribution import NO_SCATTER, Distribution
from flexband.words import number_of


@frozen(repr=False)
class Samples(Distribution):
    """Measured values of a random number, smoothed by normal kernels.

    Mean and standard deviation are those of the values (with n − 1): the kernels, which would add
    their own variance, are moved towards the mean (Silverman and Young, 1987).

    Parameters
    ----------
    values : independent measurements, shape (n,).
    bandwidth : standard deviation of the kernels before that, in the unit of the values; by
        default Silverman's 0.9 min(s, quartile range/1.34) n^(−1/5).

    Raises
    ------
    InputError
        If there are fewer than 5 values, one is not finite, or all are equal.

    Examples
    --------
    >>> measured = np.random.default_rng(0).normal(350.0, 10.0, 100)  # [MPa]
    >>> inputs = {"strength": fb.Samples(measured)}
    >>> bands = fb.propagate(lambda strength: strength, inputs, fb.PCCI(3, 0))
    >>> np.allclose(bands["mean"], measured.mean())
    True
    """

    values: Sequence[float] | np.ndarray
    bandwidth: float | None = None

    def __repr__(self) -> str:
        """Return the number of the values and their range."""
        low, high = self.values[0], self.values[-1]
        return f"Samples({number_of(len(self.values), 'value')} from {low:g} to {high:g})"

    def check(self) -> None:
        """Raise `InputError` if the values tell no distribution; remark on few values."""
        fewest, few = 5, 30  # values that are refused, and remarked on, if there are fewer
        values = np.sort(check_finite("Samples values", self.values, rank=None), axis=None)
        if np.ndim(self.values) != 1 or len(values) < fewest:
            raise InputError(
                f"Samples values must be {number_of(fewest, 'number')} or more, shape (n,); "
                f"got shape {np.shape(self.values)}"
            )
        if not np.ptp(values) > 1e-12 * np.abs(values).max():
            same = f"all {len(values)} are {values[0]:g}"
            raise InputError(f"Samples values must differ; {same}. {NO_SCATTER}")
        object.__setattr__(self, "values", tuple(values.tolist()))
        if self.bandwidth is not None:
            width = check_positive("Samples bandwidth", check_numbers("bandwidth", self.bandwidth))
            object.__setattr__(self, "bandwidth", float(width))
        n = len(values)
        if n < few:
            warn(
                f"{self!r} are few: their mean is uncertain by {100 / np.sqrt(n):.2g} % of the "
                f"standard deviation, and the standard deviation by {100 / np.sqrt(2 * n - 2):.2g} "
                "%; a distribution whose parameters are Intervals says so"
            )

    @property
    def frozen(self) -> None:
        """None: SciPy has no such distribution."""
        return None

    @cached_property
    def light(self) -> bool:
        """Whether tails are light: those of kernels are normal."""
        return True

    @property
    def support(self) -> tuple[float, float]:
        """No bounds: kernels are normal."""
        return -np.inf, np.inf

    @cached_property
    def kernels(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Centres, weights and standard deviation of the kernels, one for almost equal values."""
        # in standard deviations of the values. Wider kernels give the same distribution,
        # a normal one.
        largest_bandwidth = 1e8
        x = np.array(self.values)
        mean, std = x.mean(), x.std(ddof=1)
        quartiles = np.ptp(np.quantile(x, [0.25, 0.75])) / 1.34
        width = self.bandwidth or 0.9 * min(std, quartiles or std) * len(x) ** -0.2
        width = min(width, largest_bandwidth * std)
        near = 0.05 * width  # values that are nearer to each other share a kernel
        group = np.unique(np.round((x - mean) / near), return_inverse=True)[1]
        count = np.bincount(group)
        centres, weights = np.bincount(group, x - mean) / count, count / len(x)
        shrink = std / np.sqrt(weights @ centres**2 + width**2)
        return mean + shrink * centres, weights, float(shrink * width)

    def to_normal(self, value: np.ndarray) -> np.ndarray:
        at_once = 10**6  # numbers in memory when kernels are summed
        value = np.asarray(value, dtype=float)
        centres, weights, width = self.kernels
        parts = np.array_split(value.ravel(), 1 + value.size * len(centres) // at_once)
        apart = [(part[:, None] - centres) / width for part in parts]
        below, above = (np.concatenate([ndtr(s * d) @ weights for d in apart]) for s in (1, -1))
        z = np.where(below < 0.5, ndtri(below), -ndtri(above))
        return z.reshape(value.shape)

    def at_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the values at a standard normal z, between those of the outermost kernels."""
        from scipy.optimize import elementwise  # noqa: PLC0415

        z = np.asarray(z, dtype=float)
        centres, _, width = self.kernels
        ends = centres.min() + width * (z - 1e-9), centres.max() + width * (z + 1e-9)
        solution = elementwise.find_root(lambda x, z: self.to_normal(x) - z, ends, args=(z,))
        return solution.x

    def rule(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return Gauss points of all kernels, and weights; polynomials are integrated exactly."""
        centres, weights, width = self.kernels
        t, w = hermite_e.hermegauss(count + 1)
        points = centres[:, None] + width * t
        return points.ravel(), np.outer(weights, w / w.sum()).ravel()
