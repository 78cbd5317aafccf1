"""What independent samples tell with which confidence, and how many of them are needed.

A number of samples below a quantile has a binomial distribution, whatever that of the samples is.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import scipy
from scipy.special import ndtri


def quantiles_of(
    values: np.ndarray, probabilities: np.ndarray, confidence: float, lost: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return quantiles of samples (samples, …), and their intervals, (probabilities, …) each.

    All are samples, so that those of counts are whole numbers. An end is infinite where the samples
    are too few. Lost samples, which `values` has not, may be anywhere.
    """
    ordered = np.sort(values, axis=0)
    count = len(values) + lost
    beyond = np.full((1 + lost, *values.shape[1:]), np.inf)
    tail = (1 - confidence) / 2
    ranks = np.ceil(len(values) * probabilities - 1e-9) - 1
    low, high = (scipy.stats.binom.ppf(part, count, probabilities) for part in (tail, 1 - tail))
    lowest = np.concatenate([-beyond, ordered])
    highest = np.concatenate([ordered, beyond])
    return ordered[ranks.astype(int)], lowest[low.astype(int)], highest[high.astype(int)]


def share_of(
    hits: tuple[int, int, int], count: int, confidence: float, lost: int
) -> tuple[float, float, float]:
    """Return a share of samples, and its interval after Clopper and Pearson.

    Hits are those that are sure, all, and those that are possible. Lost samples may be hits or not;
    `count` is without them.
    """
    sure, all_hits, possible = hits
    ends = [
        scipy.stats.binomtest(number, count + lost).proportion_ci(confidence, method="exact")
        for number in (sure, possible + lost)
    ]
    return all_hits / count, float(ends[0].low), float(ends[1].high)


def needed_samples(
    probabilities: np.ndarray, allowed: Iterable[float], confidence: float, accuracy: float
) -> int:
    """Return how many samples confidence intervals need.

    They are finite, reach by `accuracy` of the tail beyond the quantile at most (by the normal
    distribution that is the limit of the binomial one), and an allowed share that fails is shown
    not to be exceeded if no sample fails.
    """
    tail = np.minimum(probabilities, 1 - probabilities)
    of_width = ndtri((1 + confidence) / 2) ** 2 * (1 - tail) / (accuracy**2 * tail)
    finite_counts = np.log((1 - confidence) / 2) / np.log1p(-np.array([*tail, *allowed]))
    return math.ceil(max(*of_width, *finite_counts))


def first_order(
    inputs: np.ndarray, numbers: np.ndarray, confidence: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return first-order Sobol' indices and half the widths of their confidence intervals.

    With the samples in the order of an input, neighbours have nearly the same value of it, so the
    mean of y_j y_{j+1} is that of E[y | x]² for centred y. After Gamboa, Gremaud, Klein and Lagnoux
    (Bernoulli 28, 2022). Neighbouring products depend on each other, those two apart do not; so the
    variance of their mean is that of one, and twice the covariance of neighbours.

    Of (samples, inputs) and (samples, numbers) the indices are (inputs, numbers), zero where
    numbers do not vary.
    """
    count = len(numbers)
    centred = numbers - numbers.mean(axis=0)
    variance = (centred**2).mean(axis=0)
    scale = np.where(variance > 0, variance, np.inf)
    indices = np.empty((inputs.shape[1], numbers.shape[1]))
    errors = np.empty(indices.shape)
    for k, column in enumerate(inputs.T):
        y = centred[np.argsort(column, kind="stable")]
        after = np.roll(y, -1, axis=0)
        indices[k] = (y * after).mean(axis=0) / scale
        influence = (y * after - indices[k] * (y**2 + after**2) / 2) / scale
        lags = [(influence * np.roll(influence, -lag, axis=0)).mean(axis=0) for lag in range(3)]
        variance_of_mean = np.maximum(lags[0] + 2 * (lags[1] - lags[2]), 0.0) / count
        errors[k] = ndtri((1 + confidence) / 2) * np.sqrt(variance_of_mean)
    return indices, errors
