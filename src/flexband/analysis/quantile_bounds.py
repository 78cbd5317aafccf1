"""Interval quantiles: the lowest and the highest quantile of every output over the interval inputs.

At given values of the interval inputs, the p-quantile is the value below which the output is with
the probability p. It is read from quasi-random samples of the surrogate, so it needs no runs. Its
bounds are searched on few samples, and computed at the places that are found on many.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.special import ndtri

from flexband.analysis.descent import SearchOptions, local_minima, lowest_of_neighbours
from flexband.analysis.intervals import over_intervals
from flexband.analysis.labelled_answers import Variables, answer, check_free, expected_error, places
from flexband.analysis.sampled import (
    MIN_BEYOND,
    REPLICATES,
    SampledSeries,
    samples_of,
    sampling_attrs,
    sampling_error,
)
from flexband.analysis.selection import AnySurrogate, Labels
from flexband.basics.checks import check_finite, check_integer
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.threads import in_threads
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.surrogate import Surrogate

MAX_SAMPLES = 2**22


@dataclass(frozen=True)
class QuantileOptions:
    """How the bounds of quantiles over the interval inputs are searched."""

    min_samples: int = 128
    """Least samples of ξ in the search."""
    min_beyond: int = 4
    """Least samples beyond a quantile."""
    tried_places: int = 25
    """Places that are tried for each bound, about."""
    max_values: float = 8e6
    """Values of the surrogate at these places."""
    final_factor: int = 4
    """Times as many samples with which a search ends."""
    max_scanned: float = 2e7
    """Most values of a scan, which takes fewer times if there are more."""
    max_scanned_times: int = 150
    """Most times of a scan."""
    tolerance: float = 1e-4
    """Gains that count as none, as a part of the range of a scan."""
    values_at_once: int = 2**18
    """Samples of series in one part of the work of a thread."""
    search: SearchOptions = field(default_factory=SearchOptions)
    """Steps from the places of the scan."""


def quantiles(
    surrogate: AnySurrogate,
    probabilities: ArrayLike = (0.05, 0.5, 0.95),
    *,
    at: Labels | None = None,
    samples: int = 4096,
    seed: int = 0,
) -> xr.Dataset:
    """Return the lowest and the highest quantiles of every output over the interval inputs.

    Parameters
    ----------
    surrogate : what `expand` or `load_surrogate` returns. No runs are made.
    probabilities : p of each quantile, between 0 and 1; a number or a list.
    at : dimension of the response -> its labels, where the quantiles are needed at these only:
        ``at={"time": [0.1, 0.2]}``. The nearest times that the response has are taken.
    samples : of the random inputs. At least ten must be expected beyond every quantile.
    seed : seed of the samples.

    Returns
    -------
    Dataset with the dims "bound" (lower, upper), "probability", and those of the outputs:

    - `quantiles`, the bounds over all values of the interval inputs;
    - `quantiles_at`, with a further dim "input", the values of the interval inputs at which they
      are reached;
    - `sampling_error`, half the width of the 95 % confidence interval that is due to the number of
      samples;
    - `expected_error` of the surrogate, if its method gives one: that of μ + zσ, with the
      standard normal quantile z of p.

    With choices, bounds are those over all options, and `quantiles_choice` names them.

    Notes
    -----
    Of long series the bounds are searched on fewer samples: where two places are nearly as extreme,
    the wrong one may be taken. In fresh random cases with two or three intervals one bound of 180
    was missed by more than 1 % of the width, the worst by 1.5 %; neither error covers this. With
    `at`, a few times are searched on all samples.

    Raises
    ------
    InputError
        If `surrogate` is not a surrogate, a probability is not between 0 and 1 or has too few
        samples, or `at` does not fit the response.

    Examples
    --------
    >>> inputs = {"length": fb.Interval(0.8, 1.2), "play": fb.Normal(0.0, 0.05)}
    >>> surrogate = fb.expand(lambda length, play: length + play, inputs, fb.PCCI(1, 1))
    >>> fb.analysis.quantiles(surrogate, 0.95)["quantiles"].values.round(2)  # + 1.645 σ
    array([[0.88],
           [1.28]])
    """
    p = checked_probabilities(probabilities)
    samples = check_integer("samples", samples, 2, MAX_SAMPLES)
    seed = check_integer("seed", seed, 0)
    return over_intervals(lambda case: _quantiles(case, p, samples, seed), surrogate, at)


def checked_probabilities(probabilities: ArrayLike) -> np.ndarray:
    """Return probabilities between 0 and 1, increasing, shape (probabilities,)."""
    p = np.atleast_1d(check_finite("probabilities", probabilities, rank=None))
    if p.ndim > 1 or len(np.unique(p)) < len(p):
        raise InputError(
            f"probabilities must be different numbers; got {value_text(probabilities)}"
        )
    if p.min() <= 0 or p.max() >= 1:
        raise InputError(
            f"probabilities must be above 0 and below 1; got {value_text(probabilities)}"
        )
    return np.sort(p)


def check_samples(space: Space, p: np.ndarray, samples: int) -> None:
    """Raise `InputError` if there are too few samples beyond a quantile."""
    outer = np.minimum(p, 1 - p)
    if space.random_dimension and outer.min() * samples < MIN_BEYOND * (1 - 1e-9):
        worst = float(p[outer.argmin()])
        min_samples = math.ceil(MIN_BEYOND / outer.min())
        raise InputError(
            f"samples must be {min_samples} or more for the probability {worst:g}; got {samples}"
        )


def _quantiles(surrogate: Surrogate, p: np.ndarray, samples: int, seed: int) -> xr.Dataset:
    space = surrogate.space
    labels = surrogate.labels
    check_free(labels, "probability")
    check_samples(space, p, samples)
    xi = samples_of(space.families, samples, seed)
    m = space.interval_dimension
    times = surrogate.times
    outputs = math.prod(labels.shape[1:]) // times
    shape = 2, len(p), outputs, times
    values = np.empty(shape)
    errors = np.empty(shape)
    eta = np.zeros((*shape, m))
    for expansion in surrogate.expansions:
        for series in SampledSeries.of_outputs(expansion):
            out = slice(None), slice(None), series.output
            if m:
                eta[out] = search_quantiles(series, xi, space.families, p, seed)
            values[out], errors[out] = _values(series, series.basis(xi), p, eta[out])
    dims = ("bound", "probability", *labels.dims[1:])
    whole_shape = (2, len(p), *labels.shape[1:])
    data: Variables = {
        "quantiles": (dims, values.reshape(whole_shape)),
        "sampling_error": (dims, errors.reshape(whole_shape)),
    }
    data |= places("quantiles_at", space, eta, dims, whole_shape)
    model_errors = [expected_error(surrogate, abs(float(ndtri(probability)))) for probability in p]
    if model_errors[0] is not None:
        data["expected_error"] = (dims[1:], np.stack(model_errors))  # pyright: ignore
    attrs = sampling_attrs(len(xi), seed)
    return answer(surrogate, data, {"probability": p}, attrs, LONG_NAMES)


LONG_NAMES = {
    "quantiles": "quantiles: bounds over the interval inputs",
    "quantiles_at": "values of the interval inputs at the bounds of the quantile",
    "sampling_error": "error of the quantile that is due to the number of samples (95 %)",
    "expected_error": "error expected of the surrogate, as that of μ + zσ",
    "probability": "probability of values below the quantile",
}


def search_quantiles(
    series: SampledSeries,
    xi: np.ndarray,
    families: Sequence[Family],
    p: np.ndarray,
    seed: int,
    *,
    options: QuantileOptions = QuantileOptions(),
) -> np.ndarray:
    """Return η of the lowest and the highest quantiles, shape (2, probabilities, times, m).

    Where there are many times, the search takes fewer samples than `xi`, and ends with more of
    them from the places that it found.
    """
    rows = options.tried_places * 2 * len(p) * series.times
    min_samples = max(options.min_samples, options.min_beyond / np.minimum(p, 1 - p).min())
    search_count = int(min(len(xi), max(min_samples, options.max_values / rows)))
    if search_count == len(xi):
        return _search(series, series.basis(xi), p, options)
    eta = _search(series, series.basis(samples_of(families, search_count, seed + 1)), p, options)
    final_xi = samples_of(families, min(options.final_factor * search_count, len(xi)), seed + 1)
    target = _Target(series, series.basis(final_xi), p, options)
    which = np.arange(2 * len(p) * series.times)
    starts = eta.reshape(1, -1, eta.shape[-1])
    gains = np.zeros(len(which))
    how = options.search
    eta_of_more = lowest_of_neighbours(target, which, starts, gains, descents=1, options=how)
    return eta_of_more.reshape(eta.shape)


@dataclass(frozen=True)
class _Target:
    """Quantiles to be minimized: those of lower bounds, and upper ones with the other sign.

    The functions are numbered by bound, probability and time, the last one fastest.
    """

    series: SampledSeries
    psi: np.ndarray
    p: np.ndarray
    options: QuantileOptions

    @property
    def signs(self) -> np.ndarray:
        """Of each bound and probability."""
        return np.repeat([1.0, -1.0], len(self.p))

    def __call__(self, eta: np.ndarray, which: np.ndarray) -> np.ndarray:
        target, time = np.divmod(which, self.series.times)
        rows = target % len(self.p), np.arange(len(eta))
        return self.signs[target] * self.quantiles(eta, time)[rows]

    def quantiles(self, eta: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return quantiles of some series, each at its own η, shape (probabilities, series)."""
        values = np.empty((len(self.p), len(eta)))
        rows = max(1, self.options.values_at_once // len(self.psi))

        def solve(first: int) -> None:
            part = slice(first, first + rows)
            samples = self.series.values(self.psi, eta[part], times[part])
            values[:, part] = sorted_quantiles(samples, self.p)

        in_threads(solve, range(0, len(eta), rows))
        return values


def _search(
    series: SampledSeries, psi: np.ndarray, p: np.ndarray, options: QuantileOptions
) -> np.ndarray:
    """Return what `search_quantiles` does, on given samples.

    Some times are scanned. The others start from the places of their neighbours, and from that of
    the bound of μ + zσ.
    """
    # Scan some of the times.
    points, beside = series.interval_scan
    times = series.times
    m = points.shape[1]
    stride = math.ceil(times / options.max_scanned_times)
    stride = max(stride, math.ceil(len(points) * times * len(psi) / options.max_scanned))
    coarse = np.arange(0, times, stride)
    scan_arguments = np.repeat(points, len(coarse), axis=0), np.tile(coarse, len(points))
    function = _Target(series, psi, p, options)
    scan_quantiles = (
        function.quantiles(*scan_arguments).reshape(len(p), len(points), -1).swapaxes(0, 1)
    )
    sign = function.signs
    targets = times * np.arange(len(sign))[:, None]
    signed_quantiles = sign[:, None] * np.concatenate([scan_quantiles, scan_quantiles], axis=1)
    signed_quantiles = signed_quantiles.reshape(len(points), -1)
    # Search at these, also from the places of the bounds of μ + zσ.
    extremes = series.expansion.extremes(ndtri(p).tolist())
    of_moments = np.stack([extremes[k].places[b, 0] for b in (0, 1) for k in range(len(p))])
    starts = points[local_minima(signed_quantiles, beside, options.search.starts)]
    starts = np.concatenate([starts, of_moments[:, coarse].reshape(1, -1, m)])
    tolerance = options.tolerance * np.ptp(signed_quantiles, axis=0)
    scanned_series = (targets + coarse).ravel()
    eta = lowest_of_neighbours(function, scanned_series, starts, tolerance, options=options.search)
    if stride > 1:
        # Start all times from the places of the two nearest ones.
        coarse_index = np.arange(times) // stride
        coarse_neighbours = np.stack([coarse_index, np.minimum(coarse_index + 1, len(coarse) - 1)])
        starts = eta.reshape(len(sign), len(coarse), m)[:, coarse_neighbours].swapaxes(0, 1)
        starts = np.concatenate([starts, of_moments[None]]).reshape(3, -1, m)
        tolerance = tolerance.reshape(len(sign), -1)[:, coarse_index].ravel()
        all_times = (targets + np.arange(times)).ravel()
        eta = lowest_of_neighbours(
            function, all_times, starts, tolerance, descents=1, options=options.search
        )
    return eta.reshape(2, len(p), times, m)


def sorted_quantiles(values: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return quantiles of samples (series, samples), shape (probabilities, series)."""
    count = values.shape[1]
    position = np.clip(p * count - 0.5, 0, count - 1)
    below = np.floor(position).astype(int)
    above = np.minimum(below + 1, count - 1)
    partition = np.partition(values, np.unique([below, above]), axis=1)
    share = (position - below)[:, None]
    return (1 - share) * partition[:, below].T + share * partition[:, above].T


def _values(
    series: SampledSeries,
    psi: np.ndarray,
    p: np.ndarray,
    eta: np.ndarray,
    *,
    options: QuantileOptions = QuantileOptions(),
) -> tuple[np.ndarray, np.ndarray]:
    """Return quantiles and their sampling errors at η of shape (2, probabilities, times, m)."""
    shape = eta.shape[:-1]
    values, errors = np.empty(shape), np.zeros(shape)
    rows = max(1, options.values_at_once // len(psi))

    def solve(place: tuple[int, int, int]) -> None:
        bound, k, first = place
        times = np.arange(first, min(first + rows, shape[2]))
        samples = series.values(psi, eta[bound, k, times], times)
        values[bound, k, times], errors[bound, k, times] = quantile_and_error(samples, p[k])

    in_threads(solve, product(range(2), range(len(p)), range(0, shape[2], rows)))
    return values, errors


def quantile_and_error(values: np.ndarray, p: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a quantile of samples (series, samples), and its sampling error, each (series,).

    The error is that of the probability, relative to the slope of the distribution function.
    """
    count = values.shape[1]
    if count == 1:
        return values[:, 0].copy(), np.zeros(len(values))
    reach = math.sqrt(p * (1 - p) / count)
    lower, quantile, upper = sorted_quantiles(
        values, np.clip([p - reach, p, p + reach], 0.5 / count, 1 - 0.5 / count)
    )
    _, spread = probability_below(values, quantile)
    # Half a distance of neighbouring samples exceeds 2.5 times its mean in 5 % of cases.
    return quantile, np.maximum(spread, 2.5 / count) / (2 * reach) * (upper - lower)


def probability_below(values: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which part of samples (series, samples) is at most a limit, and its sampling error.

    The error is half the width of the confidence interval, from the differences between the
    replicates. Limits, parts and errors have shape (series,).
    """
    below = values <= limits[:, None]
    if values.shape[1] == 1:
        return below[:, 0].astype(float), np.zeros(len(values))
    parts = below.reshape(len(values), REPLICATES, -1).mean(axis=2)
    return parts.mean(axis=1), sampling_error(parts, axis=1)
