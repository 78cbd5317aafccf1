"""The surrogate of a table: sparse regression, judged by cross-validation."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.errors import InputError
from flexband.execution.store import versions
from flexband.uncertainty.adaptive.fits import PartsFit
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import in_words
from flexband.uncertainty.phases.decomposition import Stage, decompose
from flexband.uncertainty.surrogates.axes import axes_of
from flexband.uncertainty.surrogates.diagnostics import step
from flexband.uncertainty.surrogates.extrapolation import reached_range
from flexband.uncertainty.surrogates.surrogate import Surrogate
from flexband.uncertainty.tables.cross_validation import (
    carriers_of,
    cross_validated,
    missed_with_carriers,
)
from flexband.uncertainty.tables.design import TableDesign, terms_of
from flexband.uncertainty.tables.growth import growth_beyond_rows
from flexband.uncertainty.tables.judgement import judge_by_rows
from flexband.uncertainty.tables.places import (
    beyond_rows,
    coordinates_of,
    folds,
    shares,
    target_places,
    too_few_levels,
)
from flexband.uncertainty.tables.table import RunTable


def surrogate_of_rows(
    table: RunTable, space: Space, seed: int, *, most_folds: int = 10, fewest_judging: int = 16
) -> Surrogate:
    """Return the surrogate of a table with values of all inputs of a space.

    Repeated rows are one row, their mean, so that they are in one fold; what they scatter by is no
    error of the surrogate. Fewer different rows than `fewest_judging` do not judge it.
    """
    table.check(list(space.uncertain))
    xi, eta = space.standardize({name: table.inputs[name] for name in space.uncertain})
    xi = xi[table.first]
    eta = eta[table.first]
    F = table.means
    terms = terms_of(space.interval_dimension, space.families, len(F))
    design = TableDesign(xi, eta, space.families, terms)
    # Cross-validate fits with all numbers of carriers.
    at = coordinates_of(xi, eta)
    targets = target_places(space)
    fold = folds(at, targets, min(most_folds, len(F)), seed)
    weight = shares(at, targets)
    dt = _step(table.response)
    stages = [Stage([], F)] if dt is None else list(decompose(F, dt))
    of_stages = cross_validated(design, stages, F, fold, at)
    carriers = carriers_of(of_stages, weight)
    missed = missed_with_carriers(of_stages, weight, fold)
    # Fit all rows with the best number of carriers of each output.
    expansions = []
    for k in np.unique(carriers):
        fit = PartsFit.from_design(design, stages[k])
        outputs = np.flatnonzero(carriers == k)
        expansions.append(fit.of_outputs(outputs).expansion)
        arguments = (xi, eta), space.families, fold, weight
        missed[:, outputs] *= growth_beyond_rows(fit.hybrid.index, *arguments)
    attrs = {
        "runs": len(table.response),
        "method": f"regression of a table of {len(table.response)} rows",
        "inputs": in_words(space.user_inputs),
        "versions": versions(),
        **reached_range(xi),
    }
    if doubts := [*beyond_rows(space, xi, eta), *too_few_levels(space, xi, eta)]:
        attrs["beyond_runs"] = "; ".join(doubts)
    diagnostics = xr.Dataset(attrs=attrs)
    surrogate = Surrogate(space, table.response[:0], tuple(expansions), diagnostics)
    if len(F) < fewest_judging:
        return surrogate
    return judge_by_rows(surrogate, table, (xi, eta, F), missed, weight, carriers)


def _step(response: xr.DataArray) -> float | None:
    """Return the step of time; None if it is not the same everywhere, or there is no time."""
    if axes_of(response).times < 2:
        return None
    try:
        return step(response)
    except InputError:
        return None
