"""What is stated of probabilities that a surrogate finds: with its error, bounded, or not at all.

Few runs tell what a surrogate misses in its tails. Intervals allow for what may be missed, rare
probabilities are only bounded, and a surrogate that missed its tolerance states none.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from flexband.analysis.labelled_answers import POINTWISE_ERRORS, error_of, is_judged
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.diagnostics import share
from flexband.uncertainty.surrogates.surrogate import Surrogate

if TYPE_CHECKING:
    from flexband.analysis.probability.estimates import Estimate

STATED = "probability", "confidence_low", "confidence_high"
BETWEEN = "between_times", "between_times_low", "between_times_high"
AT_EACH = "at_each_time", "at_each_time_low", "at_each_time_high"
"""Names of probabilities and the ends of their intervals."""

ANYTHING = 0.0, 1.0
"""Interval of a probability that no runs judge: those of `verify` say nothing about tails."""

RARE = 1e-4
"""Smaller probabilities of a surrogate are only bounded, unless its error is negligible."""


def error_of_runs(surrogate: Surrogate) -> tuple[str, np.ndarray]:
    """Return which diagnostic tells what is missed of a run, and its values, (outputs …, times)."""
    source, error = error_of(surrogate.diagnostics, surrogate.labels, POINTWISE_ERRORS)
    return source, error / share(surrogate.space.interval_dimension)


def tails_are_judged(surrogate: Surrogate) -> bool:
    """Return whether the method of a surrogate has judged it, also at rare values."""
    return is_judged(surrogate) and not BandRecord.read(surrogate.diagnostics).judged_by


def allowance(estimate: Estimate) -> np.ndarray:
    """Return by which factors what may be missed moves the ends of an interval, (2,)."""
    if not estimate.probability:
        return np.ones(2)
    ends = [estimate.looser, max(estimate.tighter, estimate.probability)]
    return np.array(ends) / estimate.probability


def with_bounds(result: xr.Dataset, exact: xr.DataArray, *groups: Sequence[str]) -> xr.Dataset:
    """Return a result with 0, and bounds, for rare probabilities of surrogates not `exact`.

    A group has the names of a probability and of the ends of its interval.
    """
    for names in groups:
        value, low, high = (result[name] for name in names)
        rare = ~exact & (value < RARE)
        bounds = (0.0, 0.0, np.maximum(high, RARE))
        for name, array, bound in zip(names, (value, low, high), bounds, strict=True):
            result = result.assign({name: array.where(~rare, bound).transpose(*value.dims)})
    return result


def withheld(
    result: xr.Dataset, names: Iterable[str], where: xr.DataArray | bool = True
) -> xr.Dataset:
    """Return a result with NaN in the place of these variables, where that is so."""
    dims = {name: result[name].dims for name in names}
    blank = {name: xr.where(where, np.nan, result[name]) for name in dims}
    return result.assign({name: blank[name].transpose(*dims[name]) for name in dims})
