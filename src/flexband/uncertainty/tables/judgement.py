"""The error of the surrogate of a table, from its cross-validation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexband.uncertainty.surrogates.axes import axes_of, names_of_outputs, units_of
from flexband.uncertainty.surrogates.diagnostics import (
    diagnostics,
    least_error,
    missed_part,
    share,
    trust,
)
from flexband.uncertainty.surrogates.held_out import HeldOut
from flexband.uncertainty.surrogates.sigmas import growth, relative_to_bars
from flexband.uncertainty.surrogates.surrogate import Surrogate
from flexband.uncertainty.tables.table import RunTable


def judge_by_rows(
    surrogate: Surrogate,
    table: RunTable,
    runs: tuple[np.ndarray, np.ndarray, np.ndarray],
    missed: np.ndarray,
    weight: np.ndarray,
    carriers: np.ndarray,
) -> Surrogate:
    """Return the surrogate with the error that its cross-validation tells.

    Parameters
    ----------
    runs : ξ and η of the rows, and their means.
    missed : what is missed of them, (rows, outputs, times).
    weight : the part of the inputs for which each row speaks, (rows,).
    carriers : of each output.
    """
    (xi, eta, F), labels, space = runs, surrogate.labels, surrogate.space
    units = units_of(table.response)
    count = max(1, round(1 / np.sum(weight**2)))  # as many rows of equal weight tell as much
    which = np.searchsorted(np.cumsum(weight), (np.arange(count) + 0.5) / count)
    which = np.minimum(which, len(F) - 1)
    # Leave out the noise of repeated rows.
    of_means = table.noise**2 / np.bincount(table.group).mean()
    mean_square = np.mean(missed[which] ** 2, axis=0)
    without_noise = np.sqrt(np.maximum(1 - of_means / np.maximum(mean_square, 1e-300), 1 / len(F)))
    missed = missed * without_noise
    window = max(1, round(0.02 * F.shape[-1]))
    judges = HeldOut(xi[which], eta[which], missed[which], np.zeros(F.shape[1:]), window)
    # bounds rest at corners of the intervals, where what is missed of each of them adds up
    error = judges.expected_error(1) / share(1) * max(1, space.interval_dimension) ** 0.5
    error = np.maximum(error, least_error(F, units)[:, None])
    of_mean = growth(0) if space.random_dimension else 1.0
    band_errors = np.stack([of_mean * error, error])
    trusted = trust(
        labels, missed_part(missed[which], F, units), "its variation in rows that were not fitted"
    )
    zeros = np.zeros(len(carriers))
    dataset = diagnostics(labels, band_errors, zeros, carriers, trusted, [])
    for band, band_error in zip(("mean", "error_bar"), band_errors, strict=True):
        dataset[f"{band}_expansion_error"] = labels.dims[1:], band_error.reshape(labels.shape[1:])
    dataset = dataset.assign_attrs(surrogate.diagnostics.attrs)
    # Errors relative to the bars' width need the bands.
    surrogate = replace(surrogate, diagnostics=dataset, held_out=judges)
    bar = surrogate.bands()["error_bar"].transpose("bound", *labels.dims[1:])
    relative = relative_to_bars(dataset, bar, F, units)
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
    return replace(surrogate, diagnostics=dataset.assign_attrs(attrs))
