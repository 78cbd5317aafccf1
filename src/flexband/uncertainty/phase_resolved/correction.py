"""The correction of expansions with given runs, judged by runs that are held out.

A few runs of the design, and held-out ones, are made again on finer discretizations. Their change
is expanded linearly, as that of the runs of the adaptive method (`adaptive/refinement`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from flexband.errors import RunError, warn
from flexband.uncertainty.adaptive.choice import BestFits, in_place_of_runs
from flexband.uncertainty.adaptive.expected_error import ExpectedError
from flexband.uncertainty.adaptive.fits import PartsFit
from flexband.uncertainty.adaptive.held_out import generic_points
from flexband.uncertainty.adaptive.refinement.correction import DiscretizationCorrection, corrected
from flexband.uncertainty.adaptive.refinement.refinement import CoarseRuns, Refinement
from flexband.uncertainty.adaptive.results import judged
from flexband.uncertainty.adaptive.runs import MIN_HELD, RareRuns, ResponseRuns, succeeded
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.index_sets import first_terms
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods.method import HELD, Evaluate, quantities
from flexband.uncertainty.phase_resolved.bands_error import TensorDesign, error_of_bands
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.surrogates.axes import series, units_of
from flexband.uncertainty.surrogates.diagnostics import least_error, share
from flexband.uncertainty.surrogates.held_out import HeldOut
from flexband.uncertainty.surrogates.sigmas import AT_ONE_TIME
from flexband.uncertainty.surrogates.surrogate import Surrogate


@dataclass(frozen=True)
class LinearDesign:
    """The runs of a design that tell a linear function of its variables.

    Attributes
    ----------
    families : the polynomials of each ξ.
    index : the terms, (terms, variables): 1, and one of order 1 in each variable that varies.
    rows : numbers of the runs.
    matrix : the terms in these runs, (runs, terms).
    """

    families: tuple[Family, ...]
    index: np.ndarray
    rows: np.ndarray
    matrix: np.ndarray

    @staticmethod
    def of(runs: ResponseRuns, families: Sequence[Family]) -> LinearDesign:
        """Choose runs that differ in one variable from the one nearest to the middle.

        Of a design in which there are none, these are the first ones, two for each term.
        """
        xi, eta, _ = runs
        x = np.concatenate([eta, xi], axis=1)
        size = np.ptp(x, axis=0)
        which = np.flatnonzero(size > 0)
        scaled = (x - (x.max(axis=0) + x.min(axis=0)) / 2)[:, which] / size[which]
        center = int(np.argmin(np.sum(scaled**2, axis=1).round(9)))
        away = np.abs(scaled - scaled[center])
        rows = [center]
        for v in range(len(which)):
            alone = away[:, v] * (np.delete(away, v, axis=1) < 1e-9).all(axis=1)
            rows += [int(np.argmax(alone.round(9)))] * bool(alone.max() > 0)
        if len(rows) <= len(which):
            rows = list(range(min(len(x), 2 * (1 + len(which)))))
        index = first_terms(eta.shape[1], xi.shape[1], 1 + x.shape[1])[[0, *(1 + which)]]
        terms = HybridExpansion(tuple(families), index, np.zeros((len(index), 0)))
        chosen = np.array(rows)
        matrix = terms.terms(xi[chosen], eta[chosen])
        return LinearDesign(tuple(families), index, chosen, matrix)

    def small(self, series: np.ndarray) -> HybridExpansion:
        """Return the linear expansion of series in these runs, (runs, series)."""
        terms = np.linalg.lstsq(self.matrix, series, rcond=None)[0]
        return HybridExpansion(self.families, self.index, terms)


def corrected_expansion(
    surrogate: Surrogate,
    fitted: ResponseRuns,
    evaluate: Evaluate,
    nodes: Sequence[np.ndarray] | None = None,
) -> Surrogate:
    """Return the surrogate of a method that expands values, corrected, with the error it expects.

    The error of the expansion is what the method expects, if it does, or what it misses in runs
    that are made and held out here.

    Parameters
    ----------
    fitted : the runs of the surrogate.
    nodes : of each interval variable, if the runs are at the tensor product with Gauss points of
        the random variables.
    """
    space, labels = surrogate.space, surrogate.labels
    m, families = space.interval_dimension, space.families
    points = generic_points(0, HELD, m, families)
    held = succeeded(ResponseRuns(*points, series(evaluate(*points))), 0)
    if len(held.values) < MIN_HELD:
        raise RunError("most of the runs that are held out of the correction failed", {})
    (expansion,) = surrogate.expansions
    count = len(expansion.outputs)
    columns, parts = PartColumns.of(count, 0), expansion.hybrid
    fit = PartsFit(np.arange(count), parts, columns, [], len(fitted.values))
    choice = BestFits.of([fit], fitted, held, len(held.values), RareRuns.none(held))
    F, units = np.concatenate([fitted.values, held.values]), units_of(labels)
    of_one = quantities(evaluate, count)
    error = ExpectedError.of(choice, len(held.values), F, 1.0, m, units, of_one)
    own, bands = surrogate.diagnostics, ("mean_expected_error", "error_bar_expected_error")
    if bands[0] in own:
        both = np.stack([own[band].values.reshape(count, -1) for band in bands])
    elif nodes is not None:
        both = error_of_bands(TensorDesign(nodes, families, parts.random_orders), held, error)
    else:
        both = np.stack([error.values, error.values])
    both = np.maximum(both, least_error(F, units)[:, None])
    return corrected_choice(space, labels, error, both, (fitted, held), evaluate, own)


def corrected_choice(
    space: Space,
    labels: xr.DataArray,
    error: ExpectedError,
    of_expansion: np.ndarray,
    runs: tuple[ResponseRuns, ResponseRuns],
    evaluate: Evaluate,
    more: xr.Dataset,
    dt: float = 1.0,
) -> Surrogate:
    """Return the surrogate of the chosen fits, corrected, with the error it expects.

    Parameters
    ----------
    labels : the response without runs, shape (0, …).
    error : what is known of the fits.
    of_expansion : the error of mean and error bar that is due to them, (2, outputs, times).
    runs : those that are fitted, and those held out.
    more : further diagnostics.
    dt : step of the times, if there are carriers.
    """
    fitted, held = runs
    design, refinement = LinearDesign.of(fitted, space.families), Refinement(evaluate, 0.0)
    few = ResponseRuns(*(v[design.rows] for v in fitted))
    corrections = refinement.corrections(CoarseRuns(few, held, design.small), error, dt)
    dataset = judged(labels, error, of_expansion, corrections, evaluate, refinement.finer)
    if "corrected" not in dataset.attrs:
        warn(
            "correct=True corrects nothing: no more than a quarter of the error of step and "
            "elements must be left in held-out runs; it is estimated"
        )
    if {"pointwise_error", "error_bar_discretization_error"} <= {*more, *dataset}:
        further = AT_ONE_TIME * dataset["error_bar_discretization_error"]
        more = more.assign(pointwise_error=more["pointwise_error"] + further)
    dataset = dataset.merge(more.drop_vars(list(dataset.data_vars), errors="ignore"))
    dataset = dataset.assign_attrs(more.attrs | dataset.attrs)
    return of_choice(space, labels, error, runs, dataset, list(corrections.values()))


def of_choice(
    space: Space,
    labels: xr.DataArray,
    error: ExpectedError,
    runs: tuple[ResponseRuns, ResponseRuns],
    dataset: xr.Dataset,
    corrections: Sequence[DiscretizationCorrection] = (),
) -> Surrogate:
    """Return the surrogate of the chosen fits; parameters are those of `corrected_choice`."""
    choice, (fitted, held) = error.choice, runs
    fits, changes = corrected(choice.fits, corrections)
    expansions, correction = in_place_of_runs(fits, changes)
    overshoot = share(space.interval_dimension) * choice.overshoot
    judges = HeldOut(held.xi, held.eta, choice.missed, overshoot, error.window)
    count = len(held.values)
    dataset = dataset.assign_attrs(
        runs_fitted=len(fitted.values), runs_checked=count, runs_generic=count
    )
    return Surrogate(space, labels, expansions, dataset, judges, correction)
