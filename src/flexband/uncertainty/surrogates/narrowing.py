"""Surrogates of a part of their inputs, from the same runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr

from flexband.uncertainty.inputs.narrowing import NarrowedInputs
from flexband.uncertainty.inputs.unfolding import in_words
from flexband.uncertainty.surrogates.axes import units_of
from flexband.uncertainty.surrogates.bands import attributes_for_inputs
from flexband.uncertainty.surrogates.diagnostics import trust
from flexband.uncertainty.surrogates.extrapolation import NAMES
from flexband.uncertainty.surrogates.held_out import HeldOut
from flexband.uncertainty.surrogates.sigmas import growth


def runs_in(part: NarrowedInputs, held_out_runs: HeldOut) -> HeldOut:
    """Return the check runs that judge a part of the inputs, in its variables."""
    old = np.concatenate([held_out_runs.eta, held_out_runs.xi], axis=1)
    nearest = held_out_runs.nearest(part.distance(old))
    xi, eta = part.points(old[nearest])
    weight = held_out_runs.weight[nearest] if held_out_runs.verifies else held_out_runs.weight
    return replace(
        held_out_runs, xi=xi, eta=eta, missed=held_out_runs.missed[nearest], weight=weight
    )


def narrowed_diagnostics(
    diagnostics: xr.Dataset,
    labels: xr.DataArray,
    part: NarrowedInputs,
    held_out_runs: HeldOut | None,
    values: np.ndarray,
) -> xr.Dataset:
    """Return the diagnostics of a surrogate for a part of its inputs, from those of the whole.

    Without check runs, and of discretization and integration, errors are those of the whole: in
    a part they are hardly more. `values` are those of the surrogate at the runs that judge it.
    """
    diagnostics = diagnostics.drop_vars(
        ["orders", "relative_expected_error"], errors="ignore"
    ).drop_dims("variable", errors="ignore")
    diagnostics.attrs = attributes_for_inputs(diagnostics, in_words(part.space.user_inputs))
    diagnostics = diagnostics.assign_attrs(_reached_range(diagnostics, part))
    if held_out_runs is None:
        return diagnostics
    # now that of the bands as well
    diagnostics = diagnostics.drop_vars("pointwise_error", errors="ignore")
    intervals = int(np.count_nonzero(part.radius[: held_out_runs.eta.shape[1]] > 0))
    error = held_out_runs.expected_error(intervals)
    rounding = np.finfo(float).eps * np.sqrt(np.mean(values**2, axis=(0, 2)))
    error = np.maximum(error, rounding[:, None]).reshape(labels.shape[1:])
    of_mean = growth(0) if part.space.random_dimension else 1.0
    new: dict[str, xr.Variable] = {}
    for band, factor in (("mean", of_mean), ("error_bar", 1.0)):
        expansion_error = xr.Variable(labels.dims[1:], factor * error)
        expansion_error += diagnostics.variables.get(f"{band}_integration_error", 0.0)
        discretization_error = diagnostics.variables.get(f"{band}_discretization_error", 0.0)
        new |= {
            f"{band}_expansion_error": expansion_error,
            f"{band}_expected_error": expansion_error + discretization_error,
        }
    diagnostics = diagnostics.assign(new)
    missed = np.sqrt(np.mean(held_out_runs.missed**2, axis=(0, 2)))
    variation = np.sqrt(np.mean((values - values.mean(axis=0)) ** 2, axis=(0, 2)))
    vary = units_of(labels).varies(variation, np.sqrt(np.mean(values**2, axis=(0, 2))))
    judgement = trust(labels, np.divide(missed, variation, out=np.zeros_like(missed), where=vary))
    diagnostics["trusted"] = judgement["trusted"]
    old = {name: value for name, value in diagnostics.attrs.items() if name != "not_trusted"}
    diagnostics.attrs = old | {"runs_inside": len(held_out_runs.missed)} | judgement.attrs
    return diagnostics


def _reached_range(dataset: xr.Dataset, part: NarrowedInputs) -> dict[str, list[float]]:
    """Return the range of ξ in runs, in the variables of a part."""
    n = len(dataset.attrs.get(NAMES[0], []))
    m = len(part.radius) - n
    return {
        name: part.points(np.concatenate([np.zeros(m), dataset.attrs[name]])[None])[0][0].tolist()
        for name in NAMES
        if n
    }
