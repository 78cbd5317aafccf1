"""The bandwidth of kernels around measured values, which may be of several suppliers."""

from __future__ import annotations

import numpy as np
from scipy.fft import dct
from scipy.optimize import brentq


def bandwidth(values: np.ndarray, *, part: float = 0.6) -> float:
    """Return the standard deviation of kernels around sorted values, (n,), that differ.

    It is the smaller one of Silverman's rule, which takes the values for one group, and `part` of
    that of Botev, Grotowski and Kroese (2010), which assumes no distribution. All of that, with the
    least mean square error of the density, is too wide for kernels that are wider where values are
    rare.
    """
    std = values.std(ddof=1)
    quartiles = np.ptp(np.quantile(values, [0.25, 0.75])) / 1.34
    silverman = 0.9 * min(std, quartiles or std) * len(values) ** -0.2
    by_diffusion = _by_diffusion(_spread(values))
    return min(silverman, part * by_diffusion) if np.isfinite(by_diffusion) else silverman


def resolution(values: np.ndarray, *, share: float = 0.25) -> float:
    """Return the step of a grid on which sorted values lie, if many are equal; 0 if there is none.

    At least this `share` of them are equal to another one.
    """
    distinct = np.unique(values)
    if len(values) - len(distinct) < share * len(values):
        return 0.0
    step = float(np.diff(distinct).min())
    multiples = (distinct - distinct[0]) / step
    on_grid = np.abs(multiples - np.round(multiples)) < 1e-3 * np.maximum(1.0, multiples)
    return step if on_grid.all() else 0.0


def widths(values: np.ndarray, width: float) -> np.ndarray:
    """Return the standard deviation of each kernel: wider where values are rare (Abramson, 1982).

    Tails of a density need more smoothing than its middle. With the power 0.28 of the density,
    instead of ½, probabilities beyond all values are neither too small nor too large in the median.
    """
    power = 0.28
    widest = 4.0
    at_once = 1024
    density = np.concatenate([
        np.exp(-0.5 * ((chunk[:, None] - values) / width) ** 2).sum(axis=1)
        for chunk in np.split(values, range(at_once, len(values), at_once))
    ])  # fmt: skip
    relative = density / np.exp(np.log(density).mean())
    return width * np.minimum(relative**-power, widest)


def _spread(values: np.ndarray) -> np.ndarray:
    """Return values with equal ones spread over the resolution of the measurement."""
    step = resolution(values)
    if not step:
        return values
    _, first, counts = np.unique(values, return_index=True, return_counts=True)
    place = np.arange(len(values)) - np.repeat(first, counts)
    return values + step * ((place + 0.5) / np.repeat(counts, counts) - 0.5)


def _by_diffusion(values: np.ndarray) -> float:
    """Return the bandwidth by which the heat equation smooths a histogram best; NaN if none does.

    The integrals of squared derivatives of the density follow from each other, and close at the
    seventh: equation numbers are those of Botev, Grotowski and Kroese (2010).
    """
    highest, bins, length = 7, 1024, 2 * np.ptp(values)
    start = values.min() - length / 4
    histogram = np.histogram(values, bins, (start, start + length))[0] / len(values)
    squares = (np.asarray(dct(histogram))[1:] / 2) ** 2
    frequencies, count = np.arange(1.0, bins) ** 2, len(np.unique(values))

    def norm(order: int, t: float) -> float:
        """Return ‖f⁽ˢ⁾‖² of the density that has been smoothed for a time t."""
        decay = np.exp(-frequencies * np.pi**2 * t)
        return 2 * np.pi ** (2 * order) * float(np.sum(frequencies**order * squares * decay))

    def excess(t: float) -> float:
        """Return t less the time that follows from it, Eqs. (28) to (31)."""
        size = norm(highest, t)
        for s in range(highest - 1, 1, -1):
            odd = np.prod(np.arange(1.0, 2 * s, 2)) / np.sqrt(2 * np.pi)
            time = (2 * (1 + 0.5 ** (s + 0.5)) / 3 * odd / (count * size)) ** (2 / (3 + 2 * s))
            size = norm(s, time)
        return t - (2 * count * np.sqrt(np.pi) * size) ** -0.4

    # Find the first fixed point.
    times = np.geomspace(1e-9, 0.1, 120)
    signs = np.array([excess(t) for t in times]) >= 0
    rises = np.flatnonzero(~signs[:-1] & signs[1:])
    if not len(rises):
        return np.nan
    time = brentq(excess, times[rises[0]], times[rises[0] + 1])
    return float(np.sqrt(np.asarray(time)) * length)
