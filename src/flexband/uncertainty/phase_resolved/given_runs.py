"""The correction of methods that expand values at given runs, with runs that are held out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.errors import RunError
from flexband.uncertainty.adaptive.choice import BestFits
from flexband.uncertainty.adaptive.expected_error import ExpectedError
from flexband.uncertainty.adaptive.fits import PartsFit
from flexband.uncertainty.adaptive.held_out_points import generic_points
from flexband.uncertainty.adaptive.response_runs import (
    MIN_HELD,
    RareRuns,
    ResponseRuns,
    evaluate_runs,
)
from flexband.uncertainty.inputs.space import check_no_play
from flexband.uncertainty.methods.method import HELD, Evaluate, quantities
from flexband.uncertainty.phase_resolved.bands_error import TensorDesign, error_of_bands
from flexband.uncertainty.phase_resolved.design_correction import corrected_choice
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.surrogates.axes import units_of
from flexband.uncertainty.surrogates.diagnostics import least_error
from flexband.uncertainty.surrogates.surrogate import Surrogate


def corrected_expansion(
    surrogate: Surrogate,
    runs: tuple[np.ndarray, np.ndarray, np.ndarray],
    evaluate: Evaluate,
    nodes: Sequence[np.ndarray] | None = None,
) -> Surrogate:
    """Return the surrogate of a method that expands values, corrected, with the error it expects.

    The error of the expansion is what the method expects, if it does, or what it misses in runs
    that are made and held out here. Runs and nodes are as of `Evaluate.correct_surrogate`.
    """
    space = surrogate.space
    labels = surrogate.labels
    fitted = ResponseRuns(*runs)
    m = space.interval_dimension
    families = space.families
    check_no_play(space, "correct=True")
    holdout = evaluate_runs(evaluate, *generic_points(0, HELD, m, families))
    if len(holdout.values) < MIN_HELD:
        raise RunError("most of the runs that check the correction failed", {})
    (expansion,) = surrogate.expansions
    count = len(expansion.outputs)
    columns = PartColumns.from_outputs(count, 0)
    parts = expansion.hybrid
    fit = PartsFit(np.arange(count), parts, columns, [], len(fitted.values))
    choice = BestFits.from_fits([fit], fitted, holdout, len(holdout.values), RareRuns.none(holdout))
    F = np.concatenate([fitted.values, holdout.values])
    units = units_of(labels)
    components = quantities(evaluate, count)
    error = ExpectedError.from_choice(choice, len(holdout.values), F, 1.0, m, units, components)
    # The error of the bands is that of the method, or follows from the check runs.
    diagnostics = surrogate.diagnostics
    bands = ("mean_expected_error", "error_bar_expected_error")
    if bands[0] in diagnostics:
        band_errors = np.stack([diagnostics[band].values.reshape(count, -1) for band in bands])
    elif nodes is not None:
        band_errors = error_of_bands(
            TensorDesign(nodes, families, parts.random_orders), holdout, error
        )
    else:
        band_errors = np.stack([error.values, error.values])
    band_errors = np.maximum(band_errors, least_error(F, units)[:, None])
    return corrected_choice(
        space, labels, error, band_errors, (fitted, holdout), evaluate, diagnostics
    )
