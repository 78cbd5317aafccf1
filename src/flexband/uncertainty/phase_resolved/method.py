"""The phase-resolved method: a hybrid expansion of phases, envelopes and the slow part."""

from __future__ import annotations

from functools import partial

import numpy as np
import xarray as xr

from flexband.basics.arguments import frozen
from flexband.uncertainty.adaptive.adaptive_surrogate import expectations
from flexband.uncertainty.adaptive.choice import BestFits
from flexband.uncertainty.adaptive.expected_error import ExpectedError
from flexband.uncertainty.adaptive.fits import PartsFit
from flexband.uncertainty.adaptive.held_out_points import generic_points
from flexband.uncertainty.adaptive.rare_values import RareValueOptions, RareValues
from flexband.uncertainty.adaptive.response_runs import RareRuns, ResponseRuns
from flexband.uncertainty.inputs.space import Space, check_no_play
from flexband.uncertainty.methods.method import HELD, Evaluate, quantities
from flexband.uncertainty.methods.pcci import ImprovedPCCI, Order
from flexband.uncertainty.phase_resolved.bands_error import (
    TensorDesign,
    error_of_bands,
    largest_error,
)
from flexband.uncertainty.phase_resolved.design_correction import corrected_choice, of_choice
from flexband.uncertainty.phases.decomposition import decompose
from flexband.uncertainty.surrogates.axes import series, units_of
from flexband.uncertainty.surrogates.diagnostics import least_error, step
from flexband.uncertainty.surrogates.sigmas import AT_ONE_TIME
from flexband.uncertainty.surrogates.surrogate import Surrogate


@frozen()
class PhaseResolvedPCCI(ImprovedPCCI):
    """Improved PCCI of vibrating responses: it expands phases and envelopes rather than values.

    If the frequency of a vibration depends on the inputs, its value at a fixed time is a
    rapidly oscillating function of them; its phase, its envelopes and its slow part are smooth
    functions. Every run is split into these along the last dimension of the response, which must be
    equidistant times. Four further runs at generic points are never fitted, and of random inputs
    two at rare values, where a stop may be that others do not reach. Each output gets as many
    vibration frequencies as predict these runs best, and none if it does not vibrate; the error of
    the expansion is what it misses of them. See docs/explanation/phase.md.

    Parameters
    ----------
    random_order, interval_order : as of `PCCI`. Orders of 1 or 2 suffice for most responses.
    correct : whether the error of step and elements is corrected, for vibrating outputs by phases
        and envelopes; this takes the runs that `PCCI` takes, without further check runs.

    Raises
    ------
    InputError
        As `PCCI` does; in `propagate`, if the times are not equidistant.

    Examples
    --------
    >>> time = np.linspace(0.0, 1.0, 400)
    >>> def vibration(frequency, size):
    ...     return size[:, None] * np.sin(2 * np.pi * frequency[:, None] * time)
    ...
    >>> inputs = {"frequency": fb.Interval(19.0, 21.0), "size": fb.Normal(2.0, 0.1)}
    >>> bands = fb.propagate(vibration, inputs, fb.methods.PhaseResolvedPCCI(1, 1))
    >>> bands["mean"].values[:, -1].round(2)
    array([-2.,  2.])
    """

    random_order: Order = 1
    interval_order: Order = 1

    name = "phase-resolved PCCI"
    copies = 3.5
    copies_per_carrier = 7.5

    def runs(self, space: Space) -> int:
        """Return Π (k+1) Π (q+1) + 4, and with random inputs 2 more."""
        return super().runs(space) + HELD * (not self.correct) + 2 * (space.random_dimension > 0)

    def expand(self, space: Space, evaluate: Evaluate) -> Surrogate:
        """Return the surrogate, the expected error of its bands, and the carriers of each output.

        All are told as by `AdaptivePCCI`. Bounds often rest on nodes, where nothing is missed;
        `pointwise_error` is that of μ ± σ at any values of the interval inputs, as the worst of
        the check runs tells it. The error of step and elements is not estimated without
        `correct`.
        """
        check_no_play(space, "PhaseResolvedPCCI")
        random_orders, interval_orders = self.orders(space)
        nodes = [self.interval_nodes(q) for q in interval_orders]
        design = TensorDesign(nodes, space.families, random_orders)
        holdout = generic_points(0, HELD, len(nodes), space.families)
        xi, eta = (np.concatenate(pair) for pair in zip(design.points, holdout, strict=True))
        values = evaluate(xi, eta)
        runs, dt = ResponseRuns(xi, eta, series(values)), step(values)
        fitted, holdout = (runs.which(rows) for rows in np.s_[: len(design), len(design) :])
        rare = RareRuns.none(holdout)

        def best(rare: RareRuns) -> BestFits:
            fits = map(
                partial(PartsFit.from_design, design), decompose(runs.values, dt)
            )  # one by one
            return BestFits.from_fits(fits, fitted, holdout, HELD, rare)

        # Runs at rare values follow from a first choice of fits, and may change it.
        choice = best(rare)
        components = quantities(evaluate, runs.values.shape[1])
        of_runs = HELD, runs.values, dt, len(nodes), units_of(values), components
        error = ExpectedError.from_choice(choice, *of_runs)
        units = units_of(values)
        if space.families:
            rare = _rare_runs(error, space, evaluate)
            choice = best(rare)
            error = ExpectedError.from_choice(choice, *of_runs)
        # The error of the bands, and the worst one at any place.
        min_error = least_error(runs.values, units)[:, None]
        band_errors = np.maximum(error_of_bands(design, holdout, error), min_error)
        dataset = xr.Dataset()
        worst = np.maximum(largest_error(error, len(nodes)), min_error) + error.of_integration[1]
        worst *= AT_ONE_TIME
        dataset["pointwise_error"] = values.dims[1:], worst.reshape(values.shape[1:])
        made = fitted, holdout
        labels = values[:0]
        if self.correct:
            surrogate = corrected_choice(
                space, labels, error, band_errors, made, evaluate, dataset, dt
            )
        else:
            of_all = expectations(labels, error, band_errors, {}, evaluate, 0).merge(dataset)
            surrogate = of_choice(space, labels, error, made, of_all)
        return surrogate.with_attrs(runs_checked=len(holdout.values) + len(rare.weight))


def _rare_runs(error: ExpectedError, space: Space, evaluate: Evaluate) -> RareRuns:
    """Return runs at rare values to both sides in the direction in which the response varies most.

    Those that fail tell nothing.
    """
    slopes = error.slopes(space.families)
    m = space.interval_dimension
    options = RareValueOptions(max_slopes=1)
    rare = RareValues.along_slopes(slopes, space.families, m, options=options)
    runs = ResponseRuns(rare.xi, rare.eta, series(evaluate(rare.xi, rare.eta)))
    finite_mask = np.isfinite(runs.values).all(axis=(1, 2))
    return RareRuns(ResponseRuns(*(v[finite_mask] for v in runs)), rare.weight[finite_mask])
