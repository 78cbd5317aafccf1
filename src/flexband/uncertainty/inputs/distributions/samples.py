"""Measured values, smoothed by a kernel density."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.polynomial import hermite_e
from scipy.special import ndtr, ndtri

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_numbers
from flexband.basics.warning import warn
from flexband.basics.words import number_of
from flexband.errors import InputError
from flexband.uncertainty.inputs.distribution import NO_SCATTER, Distribution
from flexband.uncertainty.inputs.distributions.bandwidth import bandwidth, resolution, widths


@frozen(repr=False)
class Samples(Distribution):
    """Measured values of a random number, smoothed by normal kernels.

    Mean and standard deviation are those of the values (with n − 1): the kernels, which would add
    their own variance, are moved towards the mean (Silverman and Young, 1987). Values may come from
    several suppliers or machines whose means are far apart: the bandwidth does not assume one
    group. What is beyond all values, or rarer than one of their number, rests on the smoothing.

    Parameters
    ----------
    values : independent measurements, shape (n,).
    bandwidth : standard deviation of the kernels before that, in the unit of the values; 0 for the
        values themselves, each as likely as the others. By default it is the smaller one of
        Silverman's 0.9 min(s, quartile range/1.34) n^(−1/5) and 0.6 of that of Botev, Grotowski
        and Kroese (2010), and kernels are wider where values are rare (Abramson, 1982).

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
        low = self.values[0]
        high = self.values[-1]
        return f"Samples({number_of(len(self.values), 'value')} from {low:g} to {high:g})"

    def check(self) -> None:
        """Raise `InputError` if the values tell no distribution; remark on few values."""
        fewest = 5
        few = 30  # values that are refused, and remarked on, if there are fewer
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
            width = float(check_numbers("Samples bandwidth", self.bandwidth))
            if not width >= 0:
                raise InputError(f"Samples bandwidth must be 0 or more; got {width:g}")
            object.__setattr__(self, "bandwidth", width)
        n = len(values)
        step = resolution(values)
        if step and self.bandwidth is None:
            warn(
                f"{self!r} are multiples of {step:g}, which is taken for the resolution of the "
                "measurement; discrete values are a Choice with probabilities"
            )
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
    def kernels(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Centres, weights and standard deviations of kernels, one for almost equal values."""
        # in standard deviations of the values. Wider kernels give the same distribution,
        # a normal one; narrower ones are the values
        smallest = 1e-6
        largest = 1e8
        x = np.array(self.values)
        mean = x.mean()
        std = x.std(ddof=1)
        if self.bandwidth is None:
            kernel_widths = widths(x, bandwidth(x))
        else:
            kernel_widths = np.full(len(x), np.clip(self.bandwidth, smallest * std, largest * std))
        # values that are nearer to each other share a kernel
        merge_distance = 0.05 * kernel_widths.min()
        group = np.unique(np.round((x - mean) / merge_distance), return_inverse=True)[1]
        count = np.bincount(group)
        centres = np.bincount(group, x - mean) / count
        weights = count / len(x)
        kernel_widths = np.sqrt(np.bincount(group, kernel_widths**2) / count)
        shrink = std / np.sqrt(weights @ (centres**2 + kernel_widths**2))
        if self.bandwidth == 0:
            shrink = 1.0
        return mean + shrink * centres, weights, shrink * kernel_widths

    def to_normal(self, value: np.ndarray) -> np.ndarray:
        at_once = 10**6  # numbers in memory when kernels are summed
        value = np.asarray(value, dtype=float)
        centres, weights, kernel_widths = self.kernels
        parts = np.array_split(value.ravel(), 1 + value.size * len(centres) // at_once)
        distances = [(part[:, None] - centres) / kernel_widths for part in parts]
        below, above = (np.concatenate([ndtr(s * d) @ weights for d in distances]) for s in (1, -1))
        z = np.where(below < 0.5, ndtri(below), -ndtri(above))
        return z.reshape(value.shape)

    def at_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the values at a standard normal z, between those of the outermost kernels."""
        from scipy.optimize import elementwise  # noqa: PLC0415

        z = np.asarray(z, dtype=float)
        centres, _, kernel_widths = self.kernels
        widest = kernel_widths.max()
        narrowest = kernel_widths.min()
        low = np.where(z < 0, widest, narrowest) * z - 1e-9 * widest
        high = np.where(z < 0, narrowest, widest) * z + 1e-9 * widest
        ends = centres.min() + low, centres.max() + high
        solution = elementwise.find_root(lambda x, z: self.to_normal(x) - z, ends, args=(z,))
        return solution.x

    def rule(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return Gauss points of all kernels, and weights; polynomials are integrated exactly."""
        centres, weights, kernel_widths = self.kernels
        t, w = hermite_e.hermegauss(count + 1)
        points = centres[:, None] + kernel_widths[:, None] * t
        return points.ravel(), np.outer(weights, w / w.sum()).ravel()
