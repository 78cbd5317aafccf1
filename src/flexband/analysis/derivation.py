"""Bands of quantities that are made of outputs, such as the largest force of the whole motion.

A quantity is computed from samples of the surrogate, so it need not be smooth in the inputs: it is
not expanded again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.analysis.descent import SearchOptions, local_minima, lowest_of_neighbours
from flexband.analysis.intervals import over_intervals
from flexband.analysis.labelled_answers import Variables, answer, check_free, expected_error, places
from flexband.analysis.quantities import Quantity, made_of
from flexband.analysis.sampled import (
    MIN_BEYOND,
    REPLICATES,
    SampledSeries,
    samples_of,
    sampling_attrs,
    sampling_error,
)
from flexband.analysis.selection import AnySurrogate, surrogates_of
from flexband.basics.checks import check_fraction, check_function, check_integer
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.uncertainty.expansions.bounds.scan import scatter_points
from flexband.uncertainty.surrogates.sigmas import checked_sigmas
from flexband.uncertainty.surrogates.surrogate import Surrogate

MAX_SAMPLES = 2**20

BANDS = ("mean", "error_bar", "range")
"""What is bounded. Each has a statistic for its lower and one for its upper bound."""


@dataclass(frozen=True)
class DerivationOptions:
    """How the bounds of a quantity over the interval inputs are searched."""

    min_samples: int = 128
    """Least samples of ξ."""
    max_values: float = 1e8
    """Values of the surrogate, about."""
    max_points: int = 256
    """Most points of a scan."""
    values_at_once: int = 2**22
    """Values of the surrogate that are computed together."""
    lattice: int = 64
    """Bounds are at multiples of 1/lattice in η, so that many share samples."""
    fine_lattice: int = 4096
    """The lattice where the quantity is few numbers."""
    few_numbers: int = 12
    """Most numbers of a quantity for the fine lattice."""
    patterns: int = 6
    """Patterns of signs in which outputs are shifted by their expected errors."""
    tolerance: float = 1e-4
    """Gains that count as none, as a part of the range of the scan."""
    search: SearchOptions = field(default_factory=SearchOptions)
    """Steps from the places of the scan."""


def derived(
    surrogate: AnySurrogate,
    quantity: Quantity,
    *,
    sigmas: float = 1.0,
    probability: float = 0.99,
    samples: int = 2048,
    seed: int = 0,
) -> xr.Dataset:
    """Return the bands of a quantity that is made of outputs.

    Parameters
    ----------
    surrogate : what `expand` or `load_surrogate` returns. No runs are made.
    quantity : `Peak`, `Trough`, `PeakTime`, `RootMeanSquare`, `Spectrum`, `Magnitude`, or any
        function that takes a response, dims ("sample", …), and returns an array with the same
        first dim: ``Peak(Magnitude("F_X", "F_Y"))`` is the largest force of the whole motion.
    sigmas : k of the error bar μ ± kσ.
    probability : of the values in the range.
    samples : of the random inputs.
    seed : seed of the samples.

    Returns
    -------
    Dataset with the dim "bound" (lower, upper) and those of the quantity:

    - `mean` and `error_bar`, as in bands;
    - `range`, from the lowest to the highest quantile such that the quantity is in it at least with
      the given probability, whatever the values of the interval inputs are;
    - `mean_at`, `error_bar_at` and `range_at`, with a further dim "input", the values of the
      interval inputs at which the bounds are reached;
    - `mean_sampling_error` and so on, half the widths of 95 % confidence intervals, which are due
      to the number of samples;
    - `mean_expected_error` and so on, if the method of the surrogate gives one: by how much bounds
      move where the outputs are shifted by their own expected errors, up or down.

    Raises
    ------
    InputError
        If `surrogate` is not a surrogate, a number is out of its range, or the quantity does not
        return finite numbers, one for each sample.

    Examples
    --------
    >>> time = np.linspace(0.0, 1.0, 101)
    >>> def stroke(size, offset):
    ...     return offset[:, None] + size[:, None] * np.sin(np.pi * time)
    ...
    >>> inputs = {"size": fb.Interval(0.9, 1.1), "offset": fb.Normal(0.0, 0.01)}
    >>> surrogate = fb.expand(stroke, inputs, fb.PCCI(1, 1))
    >>> fb.analysis.derived(surrogate, fb.analysis.Peak())["error_bar"].values.round(3)
    array([0.89, 1.11])
    """
    surrogates = surrogates_of(surrogate)
    check_function("quantity", quantity, ", such as Peak(), of a response")
    sigmas, seed = checked_sigmas(sigmas), check_integer("seed", seed, 0)
    samples = check_integer("samples", samples, REPLICATES, MAX_SAMPLES)
    part = check_fraction("probability", probability)
    min_samples = math.ceil(2 * MIN_BEYOND / (1 - part))
    if samples < min_samples and any(case.space.random_dimension for case in surrogates.values()):
        raise InputError(f"samples must be {min_samples} or more for {part:g}; got {samples}")
    return over_intervals(
        lambda case: _Derivation(case, quantity, sigmas, part).bands(samples, seed), surrogate
    )


class _Derivation:
    """A quantity of a surrogate, as functions of η."""

    def __init__(
        self,
        surrogate: Surrogate,
        quantity: Quantity,
        sigmas: float,
        part: float,
        *,
        options: DerivationOptions = DerivationOptions(),
    ):
        self.surrogate = surrogate
        self.quantity = quantity
        self.options = options
        self.sigmas = sigmas
        self.part = part
        space = surrogate.space
        self.frame = self.compute_quantity(surrogate.standard(*space.nominal()))
        check_free(self.frame, "bound", "input")
        self.size = math.prod(self.frame.shape[1:])
        is_small = self.size <= options.few_numbers
        self.lattice = options.fine_lattice if is_small else options.lattice

    def compute_quantity(self, values: np.ndarray) -> xr.DataArray:
        """Compute the quantity from values of the surrogate, dims ("sample", …)."""
        return made_of(self.surrogate._label_values(values), self.quantity)

    def statistics(self, values: np.ndarray) -> np.ndarray:
        """Return the statistics of the bands of samples (…, samples, size), (6, …, size)."""
        mean = values.mean(axis=-2)
        std = values.std(axis=-2)
        if values.shape[-2] == 1:
            low = high = values[..., 0, :]
        else:
            ends = [(1 - self.part) / 2, (1 + self.part) / 2]
            low, high = np.quantile(values, ends, axis=-2, method="hazen")
        k = self.sigmas
        return np.stack([mean, mean, mean - k * std, mean + k * std, low, high])

    def at(self, xi: np.ndarray, eta: np.ndarray, shift: ArrayLike = 0.0) -> np.ndarray:
        """Return samples of the quantity at places η, shape (places, samples, size)."""
        count = len(xi)
        values = self.surrogate.standard(np.tile(xi, (len(eta), 1)), np.repeat(eta, count, axis=0))
        return self.compute_quantity(values + shift).values.reshape(len(eta), count, self.size)

    def bands(self, samples: int, seed: int) -> xr.Dataset:
        """Return what `derived` does."""
        space = self.surrogate.space
        size = self.size
        xi = samples_of(space.families, samples, seed)
        m = space.interval_dimension
        eta, search_samples = self.places(xi, seed) if m else (np.zeros((6, size, 0)), len(xi))
        # Compute the statistics at each place once: several bounds may be there.
        flat, which = np.unique(eta.reshape(6 * size, m), axis=0, return_inverse=True)
        which = which.reshape(6, size)
        statistics, error, shift_error = (np.empty((6, size)) for _ in range(3))
        shifts = self.shifts(seed)
        for k, place in enumerate(flat):
            entries = np.nonzero(which == k)
            values = self.at(xi, place[None])[0]
            statistics[entries] = self.statistics(values)[entries]
            error[entries] = self.sampling_error(values)[entries]
            if shifts:
                first_xi = xi[: max(1, len(xi) // REPLICATES)]
                base = self.statistics(self.at(first_xi, place[None])[0])
                changes = [
                    np.abs(self.statistics(self.at(first_xi, place[None], shift)[0]) - base)
                    for shift in shifts
                ]
                shift_error[entries] = np.max(changes, axis=0)[entries]
        # Join the lower and upper bounds of each band.
        dims = ("bound", *self.frame.dims[1:])
        shape = (2, *self.frame.shape[1:])
        data: Variables = {}
        for k, name in enumerate(BANDS):
            bound_rows = slice(2 * k, 2 * k + 2)
            data[name] = dims, statistics[bound_rows].reshape(shape)
            data[f"{name}_sampling_error"] = dims, error[bound_rows].reshape(shape)
            if shifts:
                data[f"{name}_expected_error"] = dims, shift_error[bound_rows].reshape(shape)
            data |= places(f"{name}_at", space, eta[bound_rows], dims, shape)
        attrs = {
            "sigmas": self.sigmas,
            "probability": self.part,
            "quantity": value_text(self.quantity),
        }
        attrs |= sampling_attrs(
            len(xi), seed, f" on {search_samples}, to the nearest 1/{self.lattice} in η"
        )
        return answer(self.surrogate, data, {}, attrs, LONG_NAMES, self.frame)

    def sampling_error(self, values: np.ndarray) -> np.ndarray:
        """Return that of the statistics of samples (samples, size), shape (6, size)."""
        if len(values) == 1:
            return np.zeros((6, self.size))
        parts = self.statistics(values.reshape(REPLICATES, -1, self.size))
        return sampling_error(parts, axis=1)

    def shifts(self, seed: int) -> list[np.ndarray]:
        """Return the outputs' expected errors with several patterns of signs."""
        error = expected_error(self.surrogate, self.sigmas)
        if error is None:
            return []
        rng = np.random.default_rng(seed)
        signs = [np.ones(error.shape), -np.ones(error.shape)]
        signs += [rng.choice([-1.0, 1.0], error.shape) for _ in range(self.options.patterns - 2)]
        return [error * pattern for pattern in signs]

    def places(self, xi: np.ndarray, seed: int) -> tuple[np.ndarray, int]:
        """Return η of the bounds, shape (6, size, m), and the number of samples of the search."""
        surrogate = self.surrogate
        space = self.surrogate.space
        size = self.size
        m = space.interval_dimension
        options = self.options
        # Choose the points of the scan, and how many samples are affordable.
        scans = [
            series.interval_scan
            for e in surrogate.expansions
            for series in SampledSeries.of_outputs(e)
        ]
        points, beside = max(scans, key=lambda scan: len(scan[0]))
        if len(points) > options.max_points:
            points, beside = scatter_points(options.max_points, np.full(m, True))
        points = np.round(points * self.lattice) / self.lattice
        numbers_of_one = max(1, math.prod(surrogate.labels.shape[1:]))
        max_count = options.max_values / (numbers_of_one * (len(points) + 40 * (m + 1)))
        if (count := int(max(max_count, options.min_samples))) < len(xi):
            xi = samples_of(space.families, count, seed + 1)
        statistics_at: dict[bytes, np.ndarray] = {}
        at_once = max(1, options.values_at_once // (len(xi) * numbers_of_one))

        def learn(eta: np.ndarray) -> None:
            new_places = np.unique(
                [row for row in eta if row.tobytes() not in statistics_at], axis=0
            )
            for first in range(0, len(new_places), at_once):
                block = new_places[first : first + at_once]
                statistics = self.statistics(self.at(xi, block))
                for k, place in enumerate(block):
                    statistics_at[place.tobytes()] = statistics[:, k]

        sign = np.array([1.0, -1.0] * len(BANDS))

        def lowest(eta: np.ndarray, which: np.ndarray) -> np.ndarray:
            rounded = np.round(eta * self.lattice) / self.lattice + 0.0
            learn(rounded)
            target, positions = np.divmod(which, size)
            statistics = np.array([statistics_at[place.tobytes()] for place in rounded])
            return sign[target] * statistics[np.arange(len(rounded)), target, positions]

        # Scan the box, and search from the lowest points of each statistic.
        points = points + 0.0
        learn(points)
        scan_values = np.stack([statistics_at[place.tobytes()] for place in points])
        scan_values = (sign[:, None] * scan_values).reshape(len(points), -1)
        starts = points[local_minima(scan_values, beside, options.search.starts)]
        tolerance = options.tolerance * np.ptp(scan_values, axis=0)
        which = np.arange(6 * size)
        eta = lowest_of_neighbours(lowest, which, starts, tolerance, options=options.search)
        return (np.round(eta * self.lattice) / self.lattice + 0.0).reshape(6, size, m), len(xi)


LONG_NAMES = {
    "mean": "interval mean: bounds of μ",
    "error_bar": "interval error bar: lowest μ − kσ and highest μ + kσ",
    "range": "lowest and highest quantiles of the range of values",
    **{f"{k}_at": f"values of the interval inputs at the bounds of the {k}" for k in BANDS},
    **{f"{k}_sampling_error": "error that is due to the number of samples (95 %)" for k in BANDS},
    **{f"{k}_expected_error": "change where outputs are shifted by their errors" for k in BANDS},
}
