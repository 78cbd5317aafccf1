"""The correction of expansions with given runs, judged by runs that are held out.

A few runs of the design, and held-out ones, are made again on finer discretizations. Their change
is expanded linearly, as that of the runs of the adaptive method (`adaptive/refinement`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from flexband.basics.warning import warn
from flexband.uncertainty.adaptive.adaptive_surrogate import corrected_surrogate, expectations
from flexband.uncertainty.adaptive.expected_error import ExpectedError
from flexband.uncertainty.adaptive.refinement.fit_correction import DiscretizationCorrection
from flexband.uncertainty.adaptive.refinement.refinement import CoarseRuns, Refinement
from flexband.uncertainty.adaptive.response_runs import ResponseRuns
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods.method import Evaluate
from flexband.uncertainty.phase_resolved.linear_design import LinearDesign
from flexband.uncertainty.surrogates.sigmas import AT_ONE_TIME
from flexband.uncertainty.surrogates.surrogate import Surrogate


def corrected_choice(
    space: Space,
    labels: xr.DataArray,
    error: ExpectedError,
    of_expansion: np.ndarray,
    runs: tuple[ResponseRuns, ResponseRuns],
    evaluate: Evaluate,
    diagnostics: xr.Dataset,
    dt: float = 1.0,
) -> Surrogate:
    """Return the surrogate of the chosen fits, corrected, with the error it expects.

    Parameters
    ----------
    labels : the response without runs, shape (0, …).
    error : what is known of the fits.
    of_expansion : the error of mean and error bar that is due to them, (2, outputs, times).
    runs : those that are fitted, and those held out.
    diagnostics : those that are known already.
    dt : step of the times, if there are carriers.
    """
    fitted, holdout = runs
    design = LinearDesign.from_runs(fitted, space.families)
    refinement = Refinement(evaluate, 0.0)
    few = ResponseRuns(*(v[design.rows] for v in fitted))
    corrections = refinement.corrections(CoarseRuns(few, holdout, design.small), error, dt)
    dataset = expectations(
        labels, error, of_expansion, corrections, evaluate, refinement.fine_run_count
    )
    if "corrected" not in dataset.attrs:
        warn(
            "correct=True corrects nothing: in check runs, a correction must remove at least three "
            "quarters of the error of step and elements. The error is estimated instead"
        )
    if {"pointwise_error", "error_bar_discretization_error"} <= {*diagnostics, *dataset}:
        discretization_error = AT_ONE_TIME * dataset["error_bar_discretization_error"]
        diagnostics = diagnostics.assign(
            pointwise_error=diagnostics["pointwise_error"] + discretization_error
        )
    dataset = dataset.merge(diagnostics.drop_vars(list(dataset.data_vars), errors="ignore"))
    dataset = dataset.assign_attrs(diagnostics.attrs | dataset.attrs)
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
    fitted, holdout = runs
    count = len(holdout.values)
    dataset = dataset.assign_attrs(
        runs_fitted=len(fitted.values), runs_checked=count, runs_generic=count
    )
    return corrected_surrogate(space, labels, error, holdout, dataset, corrections)
