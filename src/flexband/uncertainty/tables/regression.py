"""The surrogate of a table: sparse regression, judged by cross-validation.

Terms and carriers are chosen again in every fold, without the rows that it predicts. What is missed
of these rows is the error at places that were not fitted. Repeated rows are one row, their mean, so
that they are in one fold; what they scatter by is no error of the surrogate.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from flexband.errors import InputError
from flexband.execution.store import versions
from flexband.uncertainty.adaptive.fits import PartsFit
from flexband.uncertainty.adaptive.regression import fitted_parts
from flexband.uncertainty.expansions.families import Family, existing
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.index_sets import bounded_terms
from flexband.uncertainty.expansions.regression.sparse_fit import candidates
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import in_words
from flexband.uncertainty.phases.decomposition import Stage, decompose
from flexband.uncertainty.surrogates.axes import axes_of, names_of_outputs, units_of
from flexband.uncertainty.surrogates.diagnostics import (
    diagnostics,
    least_error,
    missed_part,
    share,
    step,
    trust,
    varying,
)
from flexband.uncertainty.surrogates.extrapolation import reached
from flexband.uncertainty.surrogates.held_out import HeldOut
from flexband.uncertainty.surrogates.sigmas import bars_vary, growth, relative_errors
from flexband.uncertainty.surrogates.surrogate import Surrogate
from flexband.uncertainty.tables.growth import growth_beyond_rows
from flexband.uncertainty.tables.places import (
    beyond_rows,
    coordinates_of,
    folds,
    levels_within,
    shares,
    target_places,
    too_few_levels,
)
from flexband.uncertainty.tables.table import Table

FOLDS = 10
"""Most folds."""

JUDGING = 16
"""Fewest different rows that judge their surrogate."""

MOST = 1e6
"""Error of what varies, but whose error bar has no width, in parts of this width."""

CARRIER_GAIN = 0.8
"""A further carrier is used for an output if it brings the error below this part."""


@dataclass(frozen=True)
class TableDesign:
    """The rows of a table, as a `Design`."""

    xi: np.ndarray
    eta: np.ndarray
    families: Sequence[Family]
    index: np.ndarray  # orders of the terms to choose from

    def __len__(self) -> int:
        return len(self.xi)

    def fit(self, stage: Stage) -> HybridExpansion:
        return fitted_parts(self.index, (self.xi, self.eta), self.families, stage)

    def which(self, rows: np.ndarray) -> TableDesign:
        """Return the design of some rows, with fewer terms to choose from."""
        few = terms_of(self.eta.shape[1], self.families, int(np.count_nonzero(rows)))
        return replace(self, xi=self.xi[rows], eta=self.eta[rows], index=few)


def terms_of(m: int, families: Sequence[Family], rows: int) -> np.ndarray:
    """Return the orders of terms to choose from: those of the highest total order there may be."""
    highest, per_row = 8, 2
    dimension = m + len(families)
    index = candidates(dimension)
    for order in range(4, highest + 1):
        try:
            more = bounded_terms(dimension, order, 1.0, max(per_row * rows, len(index)))
        except InputError:
            break
        index = more
    return index[existing(index, families)]


def surrogate_of_rows(table: Table, space: Space, seed: int) -> Surrogate:
    """Return the surrogate of a table with values of all inputs of a space."""
    table.check(list(space.uncertain))
    xi, eta = space.standardized({name: table.inputs[name] for name in space.uncertain})
    xi, eta, F = xi[table.first], eta[table.first], table.means
    labels, m = table.response[:0], space.interval_dimension
    design = TableDesign(xi, eta, space.families, terms_of(m, space.families, len(F)))
    at, targets = coordinates_of(xi, eta), target_places(space)
    fold = folds(at, targets, min(FOLDS, len(F)), seed)
    dt = _step(table.response)
    stages = [Stage([], F)] if dt is None else list(decompose(F, dt))
    missed = [_missed(design, stage, F, fold) for stage in stages]
    for level in levels_within(at):  # what vanishes at all of few levels, no other fold shows
        own = level >= 0
        for of_stage, stage in zip(missed, stages, strict=True):
            new = _missed(design, stage, F, level)
            larger = np.mean(new[own] ** 2, axis=-1) > np.mean(of_stage[own] ** 2, axis=-1)
            of_stage[own] = np.where(larger[..., None], new[own], of_stage[own])
    weight = shares(at, targets)
    chosen = _chosen(missed, weight)
    fits = [PartsFit.of(design, stages[k]) for k in np.unique(chosen)]
    expansions = tuple(
        fit.of_outputs(np.flatnonzero(chosen == k)).expansion
        for k, fit in zip(np.unique(chosen), fits, strict=True)
    )
    own = _of_other_folds(missed, weight, fold)
    for fit in fits:
        outputs = chosen == len(fit.frequencies)
        own[:, outputs] *= growth_beyond_rows(
            fit.formed.index, (xi, eta), space.families, fold, weight
        )
    attrs = {
        "runs": len(table.response),
        "method": f"regression of a table of {len(table.response)} rows",
        "inputs": in_words(space.given),
        "versions": versions(),
        **reached(xi),
    }
    if doubts := [*beyond_rows(space, xi, eta), *too_few_levels(space, xi, eta)]:
        attrs["beyond_runs"] = "; ".join(doubts)
    surrogate = Surrogate(space, labels, expansions, xr.Dataset(attrs=attrs))
    if len(F) < JUDGING:
        return surrogate
    return _judged(surrogate, table, (xi, eta, F), own, weight, chosen)


def _step(response: xr.DataArray) -> float | None:
    """Return the step of time; None if it is not the same everywhere, or there is no time."""
    if axes_of(response).times < 2:
        return None
    try:
        return step(response)
    except InputError:
        return None


def _missed(design: TableDesign, stage: Stage, F: np.ndarray, fold: np.ndarray) -> np.ndarray:
    """Return what is missed of rows by the fits to the rows of all other folds, 0 in none."""
    missed = np.zeros_like(F)
    for rows, others in _splits(fold):
        part = design.which(others)
        fit = PartsFit.of(part, stage.part(runs=others))  # pyright: ignore[reportArgumentType]
        missed[rows] = F[rows] - fit.evaluate(design.xi[rows], design.eta[rows])
    return missed


def _splits(fold: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield which rows are in each fold, and which are not; those below 0 are in none."""
    for k in np.unique(fold[fold >= 0]):
        yield fold == k, fold != k


def _chosen(missed: Sequence[np.ndarray], weight: np.ndarray) -> np.ndarray:
    """Return the number of carriers with which least is missed of each output, (outputs,)."""
    square = [np.einsum("p,pot->o", weight, values**2) for values in missed]
    handicap = CARRIER_GAIN ** (-2.0 * np.arange(len(missed)))
    return np.argmin(np.array(square) * handicap[:, None], axis=0)


def _of_other_folds(
    missed: Sequence[np.ndarray], weight: np.ndarray, fold: np.ndarray
) -> np.ndarray:
    """Return what is missed of rows with as many carriers as the other folds choose."""
    own = np.empty_like(missed[0])
    for rows, others in _splits(fold):
        which = _chosen([values[others] for values in missed], weight[others])
        for o, k in enumerate(which):
            own[rows, o] = missed[k][rows, o]
    return own


def _judged(
    surrogate: Surrogate,
    table: Table,
    runs: tuple[np.ndarray, np.ndarray, np.ndarray],
    missed: np.ndarray,
    weight: np.ndarray,
    carriers: np.ndarray,
) -> Surrogate:
    """Return the surrogate with the error that its cross-validation tells."""
    (xi, eta, F), labels, space = runs, surrogate.labels, surrogate.space
    units = units_of(table.response)
    count = max(1, round(1 / np.sum(weight**2)))  # as many rows of equal weight tell as much
    which = np.searchsorted(np.cumsum(weight), (np.arange(count) + 0.5) / count)
    which = np.minimum(which, len(F) - 1)
    of_means = table.noise**2 / np.bincount(table.group).mean()
    known = np.mean(missed[which] ** 2, axis=0)
    without_noise = np.sqrt(np.maximum(1 - of_means / np.maximum(known, 1e-300), 1 / len(F)))
    missed = missed * without_noise
    window = max(1, round(0.02 * F.shape[-1]))
    held = HeldOut(xi[which], eta[which], missed[which], np.zeros(F.shape[1:]), window)
    # bounds rest at corners of the intervals, where what is missed of each of them adds up
    error = held.expected_error(1) / share(1) * max(1, space.interval_dimension) ** 0.5
    error = np.maximum(error, least_error(F, units)[:, None])
    of_mean = growth(0) if space.random_dimension else 1.0
    both = np.stack([of_mean * error, error])
    trusted = trust(labels, missed_part(missed[which], F, units), "its variation in rows left out")
    zeros = np.zeros(len(carriers))
    dataset = diagnostics(labels, both, zeros, carriers, trusted, [])
    for band, band_error in zip(("mean", "error_bar"), both, strict=True):
        dataset[f"{band}_expansion_error"] = labels.dims[1:], band_error.reshape(labels.shape[1:])
    dataset = dataset.assign_attrs(surrogate.diagnostics.attrs)
    judged = replace(surrogate, diagnostics=dataset, held_out=held)
    bar = judged.bands()["error_bar"].transpose("bound", *labels.dims[1:])
    relative = relative_errors(dataset, "expected_error", bar)
    hidden = varying(F, units).reshape(relative.shape) & ~bars_vary(bar)
    relative = np.where(hidden, MOST, relative)
    dataset["relative_expected_error"] = axes_of(labels).dims, relative
    attrs = {
        "expected_error": float(np.max(relative)),
        "expansion_error": float(np.max(relative)),
        "discretization_error": "not estimated",
        "runs_checked": count,
        "runs_generic": count,
        "runs_fitted": len(F),
    }
    if table.groups < len(table.response):
        noise = np.sqrt(np.mean(table.noise**2, axis=1))
        names = names_of_outputs(labels)
        attrs["noise"] = [f"{name}: {size:.3g}" for name, size in zip(names, noise, strict=True)]
    return replace(judged, diagnostics=dataset.assign_attrs(attrs))
