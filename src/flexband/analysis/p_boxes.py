"""The p-box of a number: the lowest and the highest distribution function over the intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from flexband.analysis.intervals import over_options
from flexband.analysis.labelled_answers import Variables, answer, check_free, expected_error, places
from flexband.analysis.quantile_bounds import (
    MAX_SAMPLES,
    probability_below,
    search_quantiles,
    sorted_quantiles,
)
from flexband.analysis.sampled import (
    CONFIDENCE,
    MIN_BEYOND,
    SampledSeries,
    samples_of,
    sampling_attrs,
)
from flexband.analysis.selection import AnySurrogate, Labels, select_places, surrogates_of
from flexband.basics.checks import check_finite, check_instance, check_integer
from flexband.errors import InputError
from flexband.uncertainty.surrogates.surrogate import Surrogate

VALUES = 101
"""Values of the output, unless others are given."""


def p_box(
    surrogate: AnySurrogate,
    output: ArrayLike | None = None,
    time: ArrayLike | None = None,
    *,
    at: Labels | None = None,
    values: ArrayLike | None = None,
    samples: int = 4096,
    seed: int = 0,
) -> xr.Dataset:
    """Return the bounds of a distribution function over the interval inputs.

    At given values of the interval inputs, the distribution function is the probability that the
    output is at most a value.

    Parameters
    ----------
    surrogate : what `expand` or `load_surrogate` returns. No runs are made.
    output, time : which output, and at which time; short for ``at={"output": …, "time": …}``, or
        another name of the dim that is time; its positions, from 0, where it has no labels.
    at : dimension of the response -> its label. All of them together must leave one number.
    values : of the output at which the function is computed; by default equidistant ones, from the
        lowest to the highest quantile that the samples can tell.
    samples : of the random inputs, 128 or more.
    seed : seed of the samples.

    Returns
    -------
    Dataset with the dims "bound" (lower, upper) and "value": `distribution`, the lowest and the
    highest probability of an output up to the value; `distribution_at`, with a further dim "input",
    the values of the interval inputs at which they are reached; and `sampling_error`, half the
    width of the 95 % confidence interval that is due to the number of samples. `expected_error` is
    that of the surrogate, as a shift of the values, if its method gives one.

    Raises
    ------
    InputError
        If `surrogate` is not a surrogate, an argument is out of its range, or not one number is
        left.

    Examples
    --------
    >>> inputs = {"length": fb.Interval(0.8, 1.2), "play": fb.Normal(0.0, 0.1)}
    >>> surrogate = fb.expand(lambda length, play: length + play, inputs, fb.PCCI(1, 1))
    >>> fb.analysis.p_box(surrogate, values=[1.2])["distribution"].values.round(2)
    array([[0.5],
           [1. ]])
    """
    surrogates = surrogates_of(surrogate)
    samples = check_integer("samples", samples, 128, MAX_SAMPLES)
    seed = check_integer("seed", seed, 0)
    if at is not None:
        check_instance("at", at, Mapping, "a mapping from dimensions to labels")
    where = dict(at or {})
    dim = next(iter(surrogates.values())).time or "time"
    where |= {k: v for k, v in (("output", output), (dim, time)) if v is not None}
    envelopes = {
        label: _Envelope.from_surrogate(select_places(case_surrogate, where), samples, seed)
        for label, case_surrogate in surrogates.items()
    }
    if values is None:
        low = min(envelope.quantiles[0].min() for envelope in envelopes.values())
        high = max(envelope.quantiles[1].max() for envelope in envelopes.values())
        grid = np.linspace(low, high, VALUES) if high > low else np.array([low])
    else:
        grid = np.unique(check_finite("values", values, rank=None))
    return over_options({label: envelope.at(grid) for label, envelope in envelopes.items()})


@dataclass(frozen=True)
class _Envelope:
    """The lowest and the highest quantiles of one number, and where they are."""

    surrogate: Surrogate
    series: SampledSeries  # the number
    psi: np.ndarray  # polynomials of the samples
    eta: np.ndarray  # places of the quantiles, (2, levels, m)
    quantiles: np.ndarray  # (2, levels)
    seed: int  # of the samples

    @staticmethod
    def from_surrogate(surrogate: Surrogate, samples: int, seed: int) -> _Envelope:
        """Return them for a surrogate of one number."""
        space = surrogate.space
        labels = surrogate.labels
        check_free(labels, "value")
        if int(np.prod(labels.shape[1:])) != 1:
            dimensions = ", ".join(f"{dim} ({labels.sizes[dim]})" for dim in labels.dims[1:])
            raise InputError(
                f"output, time and at must leave one number; dimensions left: {dimensions}"
            )
        xi = samples_of(space.families, samples, seed)
        end = -ndtri(MIN_BEYOND / samples)
        levels = 41  # whose lowest and highest quantiles are searched
        p = ndtr(np.linspace(-end, end, levels)) if len(xi) > 1 else np.array([0.5])
        (expansion,) = surrogate.expansions
        (series,) = SampledSeries.of_outputs(expansion)
        psi = series.basis(xi)
        m = space.interval_dimension
        eta = np.zeros((2, len(p), 1, 0))
        if m:
            eta = search_quantiles(series, xi, space.families, p, seed)
        flat = eta.reshape(2 * len(p), m)
        sample_values = series.values(psi, flat, np.zeros(len(flat), dtype=int))
        levels = np.tile(np.arange(len(p)), 2)
        quantiles = sorted_quantiles(sample_values, p)[levels, np.arange(len(flat))].reshape(2, -1)
        quantiles = np.maximum.accumulate(quantiles, axis=1)
        return _Envelope(surrogate, series, psi, eta[:, :, 0], quantiles, seed)

    def at(self, values: np.ndarray) -> xr.Dataset:
        """Return the answer at increasing values of the output."""
        shape = 2, len(values)
        probability = np.empty(shape)
        error = np.empty(shape)
        eta = np.empty((*shape, self.eta.shape[-1]))
        first_time = np.zeros(len(values), dtype=int)
        for bound in (0, 1):  # the highest probabilities are where quantiles are lowest
            opposite = 1 - bound
            above = np.searchsorted(self.quantiles[opposite], values)
            last = self.quantiles.shape[1] - 1
            level_numbers = np.clip(np.stack([above - 1, above]), 0, last)
            at = self.eta[opposite][level_numbers]
            samples = (self.series.values(self.psi, tried_eta, first_time) for tried_eta in at)
            estimates = [probability_below(place_samples, values) for place_samples in samples]
            parts = np.stack([part for part, _ in estimates])
            best = parts.argmax(axis=0) if bound else parts.argmin(axis=0)
            rows = np.arange(len(values))
            probability[bound] = parts[best, rows]
            error[bound] = np.stack([spread for _, spread in estimates])[best, rows]
            eta[bound] = at[best, rows]
        samples = len(self.psi)
        unseen = 1 - (1 - CONFIDENCE) ** (1 / samples) if samples > 1 else 0.0
        dims = ("bound", "value")
        data: Variables = {
            "distribution": (dims, probability),
            "sampling_error": (dims, np.maximum(error, unseen)),
            "value": ("value", values),
        }
        data |= places("distribution_at", self.surrogate.space, eta, dims, shape)
        if (missed := expected_error(self.surrogate, 1.0)) is not None:
            data["expected_error"] = (), float(missed.ravel()[0])
        attrs = sampling_attrs(samples, self.seed)
        result = answer(self.surrogate, data, {}, attrs, LONG_NAMES)
        units = result["distribution"].attrs.pop("units", None)
        result["sampling_error"].attrs.pop("units", None)
        if units is not None:
            result["value"].attrs["units"] = units
        return result


LONG_NAMES = {
    "distribution": "distribution function: bounds over the interval inputs",
    "distribution_at": "values of the interval inputs at the bounds",
    "sampling_error": "error of the probability that is due to the number of samples (95 %)",
    "expected_error": "error expected of the surrogate, as a shift of the values",
    "value": "value of the output",
}
