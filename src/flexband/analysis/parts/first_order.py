"""Which input numbers of parts depend on: first-order indices of samples that are there already."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri


def first_order(
    inputs: np.ndarray, numbers: np.ndarray, confidence: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return first-order Sobol' indices and half the widths of their confidence intervals.

    With the samples in the order of an input, neighbours have nearly the same value of it, so the
    mean of y_j y_{j+1} is that of E[y | x]² for centred y. After Gamboa, Gremaud, Klein and Lagnoux
    (Bernoulli 28, 2022). Neighbouring products depend on each other, those two apart do not; so the
    variance of their mean is that of one, and twice the covariance of neighbours.

    Parameters
    ----------
    inputs : shape (samples, inputs).
    numbers : shape (samples, numbers).

    Returns
    -------
    Two arrays of shape (inputs, numbers); zeros for numbers that do not vary.
    """
    count, centred = len(numbers), numbers - numbers.mean(axis=0)
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
