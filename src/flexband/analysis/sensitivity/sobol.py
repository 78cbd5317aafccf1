"""Sobol' indices of random inputs over time, as bounds over the interval inputs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import xarray as xr

from flexband.analysis.descent import lowest_over_times
from flexband.analysis.intervals import over_options
from flexband.analysis.labelled_answers import Variables, answer, check_free, expected_error, places
from flexband.analysis.sampled import SampledSeries, sampling_error
from flexband.analysis.selection import AnySurrogate, Labels, select_places, surrogates_of
from flexband.analysis.sensitivity.contributions import groups
from flexband.analysis.sensitivity.variances import Variances, variances_of
from flexband.basics.checks import check_integer
from flexband.basics.words import number_of
from flexband.errors import InputError
from flexband.uncertainty.surrogates.axes import units_of
from flexband.uncertainty.surrogates.surrogate import Surrogate

WORSE = 2.0
"""More than any index: what counts where the variance vanishes."""


def sobol_indices(
    surrogate: AnySurrogate, *, at: Labels | None = None, seed: int = 0
) -> xr.Dataset:
    """Return which part of the variance each random input causes, as bounds over interval inputs.

    At fixed values of the interval inputs, the first-order index of an input is the part of the
    variance that it causes alone, the total index the part that it takes part in, with interactions
    (Sobol', 2001; Homma and Saltelli, 1996). They are computed from the coefficients of the
    surrogate (Sudret, 2008), or, where an output is expanded in phases, from its samples.

    Parameters
    ----------
    surrogate : what `expand` or `load_surrogate` returns. No runs are made. At least one of its
        inputs must be random.
    at : dimension of the response -> its labels, as for `quantiles`.
    seed : of the samples, if there are phases.

    Returns
    -------
    Dataset with the dims "bound" (lower, upper), "name" and those of the outputs. A field counts as
    one input, and so do correlated inputs, under their name in `inputs`. The name with the largest
    upper bounds of the total index is the first, as a mean over time weighted by `std`²:

    - `first_order` and `total`, the lowest and the highest index over all values of the interval
      inputs, and `first_order_at` and `total_at`, with a further dim "input", where they are;
    - `std`, σ with the interval inputs at their midpoints: where it is small, little depends on
      the indices;
    - `defined`, whether the variance is above rounding for all values of the interval inputs that
      were searched. Bounds are those where it is; NaN if it is nowhere;
    - `sampling_error`, half the width of the 95 % confidence interval of both indices, if there are
      phases;
    - `expected_error` of both indices, if the method gives one: twice that of σ as a part of the
      least σ at the bounds, 1 at most.

    ``attrs["undefined"]`` counts the times at which the variance vanishes.

    Raises
    ------
    InputError
        If `surrogate` is not a surrogate or has no random input, or `at` does not fit the response.

    Examples
    --------
    >>> inputs = {"a": fb.Normal(0.0, 2.0), "b": fb.Normal(0.0, 1.0)}
    >>> surrogate = fb.expand(lambda a, b: a + b, inputs, fb.PCCI(1, 0))
    >>> indices = fb.analysis.sobol_indices(surrogate)
    >>> indices["total"].sel(name="a").values.round(4)  # 4/(4 + 1)
    array([0.8, 0.8])
    """
    surrogates = surrogates_of(surrogate)
    seed = check_integer("seed", seed, 0)
    if any(not case_surrogate.space.random_dimension for case_surrogate in surrogates.values()):
        raise InputError("surrogate must have random inputs; Sobol' indices are parts of variance")
    parts = {
        label: select_places(case_surrogate, at) for label, case_surrogate in surrogates.items()
    }
    answers = {label: _indices(case_surrogate, seed) for label, case_surrogate in parts.items()}
    joint = over_options(answers)
    for case_answer in answers.values():
        joint["defined"] = joint["defined"] & case_answer["defined"]
    weight = joint["std"] ** 2
    time = next(iter(parts.values())).time
    weight = weight / weight.sum(() if time is None else time).where(lambda sums: sums > 0)
    total = (joint["total"].sel(bound="upper") * weight).fillna(0.0)
    total = total.sum([dim for dim in total.dims if dim != "name"])
    return joint.isel(name=np.argsort(-total.values, kind="stable"))


def _indices(surrogate: Surrogate, seed: int) -> xr.Dataset:
    """Return what `sobol_indices` does, for one combination of options."""
    space, labels = surrogate.space, surrogate.labels
    check_free(labels, "name", "bound", "input", "total", "first_order", "defined")
    random = space.of_kind(random=True)
    ends = np.cumsum([0, *(input_.dimension for input_ in random.values())])
    variables = dict(zip(random, (range(*pair) for pair in pairwise(ends)), strict=True))
    random_groups = {k: members for k, members in groups(surrogate).items() if members[0] in random}
    numbers = [
        [k for name in members for k in variables[name]] for members in random_groups.values()
    ]
    # Search the bounds of the indices of each output, and compute the indices there.
    m, times = space.interval_dimension, surrogate.times
    count = math.prod(labels.shape[1:]) // times
    mean, std = (
        moment.reshape(count, times) for moment in surrogate.standard_moments(np.zeros((1, m)))
    )
    size = np.max(np.abs(mean) + std, axis=1)
    # Standard deviations below 1e-12 of an output's largest value are due to rounding.
    min_variance = units_of(labels).least_variation(size, 1e-12) ** 2
    shape = 2, 2 * len(random_groups), count, times
    values, errors, eta = np.empty(shape), np.zeros(shape), np.zeros((*shape, m))
    variance, defined = np.empty(shape), np.empty((count, times), dtype=bool)
    for expansion in surrogate.expansions:
        for series in SampledSeries.of_outputs(expansion):
            k = series.output
            variances = variances_of(series, space.families, numbers, seed)
            search_indices, result_indices = (
                _Indices(part, times, min_variance[k]) for part in variances
            )
            eta[:, :, k], defined[k] = search_indices.search(series.interval_scan)
            values[:, :, k], errors[:, :, k], variance[:, :, k] = result_indices.at(eta[:, :, k])
    # Put bounds in order, and total indices above those of first order.
    defined &= np.all(np.isfinite(values), axis=(0, 1))
    values = np.clip(values, 0.0, 1.0)  # those from samples may be beyond, or in the wrong order
    order = np.argsort(values, axis=0)
    values, errors = (np.take_along_axis(array, order, axis=0) for array in (values, errors))
    eta = np.take_along_axis(eta, order[..., None], axis=0)
    first, total = np.split(values, 2, axis=1)
    np.minimum(first, total, out=first)  # as at every η; the first has the larger sampling error
    # Make the dataset, with errors of sampling and of the expansion.
    dims, inner = labels.dims[1:], labels.shape[1:]
    data: Variables = {"defined": (dims, defined.reshape(inner))}
    data["std"] = dims, std.reshape(inner)
    index_dims, whole_shape = ("bound", "name", *dims), (2, len(random_groups), *inner)
    for k, name in enumerate(("first_order", "total")):
        part = slice(k * len(random_groups), (k + 1) * len(random_groups))
        data[name] = index_dims, values[:, part].reshape(whole_shape)
        data |= places(f"{name}_at", space, eta[:, part], index_dims, whole_shape)
    largest_errors = errors.reshape(2, 2, len(random_groups), count, times).max(axis=1)
    if errors.any():
        data["sampling_error"] = index_dims, largest_errors.reshape(whole_shape)
    if (error := expected_error(surrogate, 1.0)) is not None:
        deviation = np.sqrt(np.nanmin(np.maximum(variance, 0), axis=(0, 1))).reshape(inner)
        share = np.divide(2 * error, deviation, out=np.ones(inner), where=deviation > 2 * error)
        data["expected_error"] = dims, share
    lost = int(np.sum(~defined))
    values = number_of(defined.size, "value")
    attrs = {"undefined": f"the variance vanishes at {lost} of {values} of the outputs"}
    if errors.any():
        attrs["sampling"] = _sampling_text(largest_errors, std)
    result = answer(surrogate, data, {"name": list(random_groups)}, attrs, LONG_NAMES)
    for name in {"first_order", "total", "defined", "sampling_error", "expected_error"} & {*data}:
        result[name].attrs.update(units="1")
    return result


def _sampling_text(errors: np.ndarray, std: np.ndarray) -> str:
    """Return how large errors (2, names, outputs, times) are where σ is largest, in words."""
    widest = std.argmax(axis=1)
    percent = 100 * errors[:, :, np.arange(len(widest)), widest].max()
    size = f"± {percent:.1f} % of the variance at most" if percent >= 0.1 else "below 0.1 %"
    return f"sampling error where σ is largest: {size}"


@dataclass(frozen=True)
class _Indices:
    """First-order and total indices of one output, numbered by bound, index, and time."""

    variances: Variances
    times: int
    min_variance: float  # variances up to this are due to rounding

    def shares(self, eta: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return all indices, NaN without variance, and the variance.

        Their shapes are (indices, rows, replicates) and (rows,). The mean of an index over the
        replicates is a ratio of means, and the replicates scatter as this ratio does, to first
        order: where a part and the variance have the same errors, the index has none.
        """
        parts = self.variances(eta, times)
        variance = parts[0]
        mean = parts.mean(axis=2, keepdims=True)
        mean_variance = np.where(mean[0] > self.min_variance, mean[0], np.nan)
        index = mean[1:] / mean_variance
        return index + (parts[1:] - index * variance) / mean_variance, mean[0, :, 0]

    def objectives(self, eta: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return indices to minimize for lower bounds, then minus these, (bounds, rows)."""
        shares = self.shares(eta, times)[0].mean(axis=2)
        objectives = np.concatenate([shares, -shares])
        return np.where(np.isnan(objectives), WORSE, objectives)

    def search(self, scan: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Return η of the bounds, (2, indices, times, m), and where all of a scan is defined."""
        eta, values = lowest_over_times(self.objectives, scan, self.times, tolerance=1e-5)
        return eta.reshape(2, len(eta) // 2, *eta.shape[1:]), np.all(values < WORSE, axis=(0, 1))

    def at(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return indices, their sampling errors and variances at η, each (2, indices, times)."""
        shape = eta.shape[:-1]
        index, time = (grid.ravel() for grid in np.indices(shape)[1:])
        flat = eta.reshape(math.prod(shape), eta.shape[-1])
        shares, variance = self.shares(flat, time)
        shares = shares[index, np.arange(len(flat))]
        exact = shares.shape[1] == 1
        error = np.zeros(len(flat)) if exact else sampling_error(shares, axis=1)
        mean = shares.mean(axis=1)
        return mean.reshape(shape), error.reshape(shape), variance.reshape(shape)


LONG_NAMES = {
    "first_order": "part of the variance that the input causes alone: bounds over the intervals",
    "total": "part of the variance that the input takes part in: bounds over the intervals",
    "first_order_at": "values of the interval inputs at the bounds of the first-order index",
    "total_at": "values of the interval inputs at the bounds of the total index",
    "std": "σ with the interval inputs at their midpoints",
    "defined": "whether the variance is above rounding",
    "sampling_error": "error of the indices that is due to the number of samples (95 %)",
    "expected_error": "error expected of the indices",
}
