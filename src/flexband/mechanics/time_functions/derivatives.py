"""First and second derivatives of tabulated functions of time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np


def derivatives(
    values: np.ndarray, half: float, *, noise: float = 1e-8, max_reach: float = 1 / 12
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return f′ and f″ at every other time of a table, shape (times, 2, n).

    Further results are how far from each time the values are that they are taken from [s], and the
    distance of these values [s]. They are those of the polynomial through five values, or seven at
    the ends, which are further apart than `half` [s] where rounding errors would be above the part
    `noise` of the largest f″.
    """
    rounding = 6 * np.finfo(float).eps * np.abs(values).max(initial=0.0)
    stride = 1
    # Widen the stride until rounding is small beside f″.
    while True:
        differences = _differences(values, stride)
        curvature = np.abs(differences[:, 1]).max(initial=0.0)
        if rounding <= noise * curvature or 2 * stride > max_reach * len(values):
            break
        stride *= 2
    spacing = stride * half
    place = half * np.arange(0, len(values), 2)
    edge = np.minimum(place, half * (len(values) - 1) - place)
    reach = np.where(edge < 2 * spacing, 6 * spacing, 2 * spacing)
    return differences / spacing ** np.arange(1, 3)[:, None], reach, spacing


def _differences(values: np.ndarray, stride: int) -> np.ndarray:
    """Return f′ and f″ from every `stride`-th value, in units of their distance."""
    last = len(values) - 1
    count = (len(values) + 1) // 2
    differences = np.empty((count, 2, values.shape[1]))
    places = 2 * np.arange(count)
    inner = (places >= 2 * stride) & (places <= last - 2 * stride)
    centre = [np.roll(values, -k * stride, axis=0)[places[inner]] for k in range(-2, 3)]
    differences[inner] = _weighted_sum(_weights(5, np.array([2.0])), centre)
    first = np.clip(places[~inner] - 3 * stride, 0, last - 6 * stride)
    stencil = [values[first + k * stride] for k in range(7)]
    differences[~inner] = _weighted_sum(_weights(7, (places[~inner] - first) / stride), stencil)
    return differences


def _weighted_sum(weights: np.ndarray, values: Sequence[np.ndarray]) -> np.ndarray:
    """Return Σ_k weights (places, 2, k) × values (places, n) in the order of k, as no `einsum`."""
    total = weights[:, :, 0, None] * values[0][:, None]
    for k, value in enumerate(values[1:], start=1):
        total = total + weights[:, :, k, None] * value[:, None]
    return total


def _weights(count: int, at: np.ndarray) -> np.ndarray:
    """Return the weights of equidistant values for f′ and f″ at places between them."""
    powers = np.ones((len(at), count, count))
    powers[..., 1:] = (np.arange(float(count)) - at[:, None])[..., None]
    powers = np.multiply.accumulate(powers, axis=-1)
    return np.linalg.inv(powers)[:, 1:3] * [[1.0], [2.0]]


def derivatives_within(
    points: Callable[[np.ndarray], np.ndarray],
    times: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    spacing: float,
) -> np.ndarray:
    """Return f′ and f″ at times between smooth ends `low` and `high`, shape (times, 2).

    They are those of the polynomial through seven values, `spacing` apart or nearer.
    """
    distance = np.minimum(spacing, (high - low) / 6)
    first = np.clip(times - 3 * distance, low, np.maximum(low, high - 6 * distance))
    values = points(first[:, None] + distance[:, None] * np.arange(7))
    place = (times - first) / distance
    powers = (np.arange(7.0) - place[:, None])[..., None] ** np.arange(7)
    weights = np.linalg.inv(powers)[:, 1:3] * [[1.0], [2.0]]
    return np.einsum("tdk,tk->td", weights, values) / distance[:, None] ** np.arange(1, 3)
