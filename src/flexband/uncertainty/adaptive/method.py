"""The adaptive method: it finds the orders of every input and stops where they are enough."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from flexband.errors import InputError, flag, numbers, positive, warn, whole
from flexband.uncertainty.adaptive.batches import BATCH, BatchModel
from flexband.uncertainty.adaptive.expected_error import diagnostics, series, step
from flexband.uncertainty.adaptive.interpolation import NestedModel
from flexband.uncertainty.adaptive.regression import LEAST_RUNS, RegressionModel
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods import Evaluate
from flexband.uncertainty.surrogates.surrogate import Surrogate

GROWTH = 0.25
"""Size of a batch, as a part of the runs there are."""

LARGE_TOLERANCE = 0.5
"""Error of the bands, in parts of the error bar's width, that is hardly meant."""

MOST_INTERPOLATED = 48
"""Runs that interpolation may start with; where it takes more, terms are found by regression."""


@dataclass(frozen=True)
class AdaptivePCCI:
    """A sparse hybrid expansion that finds its orders by itself, in phases and envelopes.

    Every term of the expansion has one run, at a point of nested sequences that contain the ends of
    the intervals (the paper's improvement, Eq. (19), carried over). After each batch of runs the
    terms that are expected to add most come next; it stops where the error expected of interval
    mean and error bar, in parts of the error bar's mean width, is below the tolerance for every
    output. Ringing responses are split as by `PhaseResolvedPCCI`. See docs/phase.md.

    With many variables, as those of a random field, where that would start with more than 48 runs
    or more than the budget, few terms out of all are found by sparse regression, from 16 runs on.

    Parameters
    ----------
    tolerance : error of the bands to stop at, in parts of the mean width of the error bar.
    max_runs : budget; it stops there, or where it has all terms up to order 20 of intervals and 8
        of random variables, and says which error it expects.
    phase_resolved : whether to look for carriers; without, values at fixed times are expanded.

    Raises
    ------
    InputError
        Where the tolerance is not positive or the budget no whole number; in `propagate`, where the
        budget is below 16 runs and below one a variable and one more, or times are not equidistant.
    """

    tolerance: float = 0.01
    max_runs: int = 200
    phase_resolved: bool = True

    name = "adaptive PCCI"

    def __post_init__(self) -> None:
        positive("tolerance", numbers("tolerance", self.tolerance))
        if self.tolerance >= LARGE_TOLERANCE:
            warn(
                f"tolerance is {self.tolerance:g} of the error bar's mean width, "
                f"{100 * self.tolerance:g} %; is it in per cent?"
            )
        flag("phase_resolved", self.phase_resolved)
        object.__setattr__(self, "max_runs", whole("max_runs", self.max_runs, 2))

    @property
    def label(self) -> str:
        """Name and tolerance."""
        return f"{self.name} ({100 * self.tolerance:g} %)"

    def runs(self, space: Space) -> int:
        """Return the most runs it takes.

        Raises
        ------
        InputError
            Where the budget is too small for the space.
        """
        variables = space.interval_dimension + space.random_dimension
        least = min(1 + variables, LEAST_RUNS)
        if self.max_runs < least:
            raise InputError(
                f"max_runs must be {least} or more for {variables} variables; got {self.max_runs}"
            )
        return self.max_runs

    def _model(self, first: int) -> type[BatchModel]:
        """Return what to fit where interpolation would start with so many runs."""
        many = first > min(self.max_runs, MOST_INTERPOLATED)
        return RegressionModel if many and self.max_runs >= LEAST_RUNS else NestedModel

    def expand(self, space: Space, evaluate: Evaluate) -> Surrogate:
        """Return the surrogate, the errors expected of its bands, and the orders of all variables.

        `mean_expected_error` and `error_bar_expected_error` have the response's dims, `carriers`
        and `trusted` those before the last, `orders` the dim "variable".
        ``attrs["expected_error"]`` is the relative one that ``attrs["tolerance"]`` is for, larger
        where the budget or the orders (20 of intervals, 8 of random variables) did not reach;
        ``attrs["carrier_frequencies"]`` are in cycles a unit of time.
        """
        m, n = space.interval_dimension, space.random_dimension
        fit = self._model(1 + m + 2 * n)
        design, batches = fit.start(m, space.families, self.runs(space))
        values = None
        while True:
            done = 0 if values is None else len(values)
            new = evaluate(*(points[done:] for points in design.points))
            values = new if values is None else _joined(values, new)
            dt = step(values) if self.phase_resolved else 1.0
            model = fit(series(values), dt, design, batches[-3:], self.phase_resolved)
            enough = model.relative_error <= self.tolerance and (model.tested or m + n < 3)
            if enough or len(design) >= self.max_runs:
                break
            count = max(BATCH, BATCH * round(GROWTH * len(design) / BATCH))
            known, design = len(design), model.extended(min(count, self.max_runs - len(design)))
            if len(design) == known:
                break
            if len(design) - known >= BATCH // 2:
                batches.append(len(design))
            else:
                batches[-1] = len(design)
        return _surrogate(space, values[:0], model, self.tolerance)

    def solve(self, space: Space, evaluate: Evaluate) -> xr.Dataset:
        """Return the bands and the diagnostics."""
        return self.expand(space, evaluate).bands()


def _joined(values: xr.DataArray, new: xr.DataArray) -> xr.DataArray:
    """Return all runs."""
    data = np.concatenate([values.values, new.values])
    return xr.DataArray(data, dims=new.dims, coords=new.coords)


def _surrogate(
    space: Space, labels: xr.DataArray, model: BatchModel, tolerance: float
) -> Surrogate:
    """Return the surrogate with what the model says of itself."""
    variables = [
        name if one.dimension == 1 else f"{name}[{k}]"
        for random in (False, True)
        for name, one in space.inputs.items()
        if one.random == random
        for k in range(one.dimension)
    ]
    told = diagnostics(
        labels, model.expected_error, model.carriers, model.trusted, model.frequencies
    )
    told = told.assign(orders=("variable", model.orders)).assign_coords(variable=variables)
    told = told.assign_attrs(expected_error=model.relative_error, tolerance=tolerance)
    return Surrogate(space, labels, tuple(model.expansions(len(model.F))), told)
