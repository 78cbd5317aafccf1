"""The surrogate of some outputs and times of a response."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from flexband.errors import InputError, instance, shown
from flexband.uncertainty.surrogates.choices import SurrogateOfChoices
from flexband.uncertainty.surrogates.surrogate import Surrogate

SIZE_OF_ROUNDING = 1e-9
"""A number this much beyond the ends of a coordinate, relative to its range, is at the end."""


def surrogates_of(surrogate: Any) -> dict[str, Surrogate]:
    """Return the surrogate of every combination of options; the label is "" without choices.

    Raises
    ------
    InputError
        If it is no surrogate.
    """
    instance("surrogate", surrogate, Surrogate | SurrogateOfChoices, "one that `expand` returns")
    if isinstance(surrogate, SurrogateOfChoices):
        return dict(surrogate.surrogates)
    return {"": surrogate}


def selected(surrogate: Surrogate, at: Mapping[str, Any] | None) -> Surrogate:
    """Return the surrogate at chosen places of the response's dimensions.

    Parameters
    ----------
    at : dimension -> one of its labels, or a list of them; for numbers, such as times, the nearest
        ones that the response has. Positions, from 0, where a dimension has no labels. A dimension
        for which a single label is given is dropped.

    Raises
    ------
    InputError
        If there is no such dimension or label.
    """
    if at is None:
        return surrogate
    instance("at", at, Mapping, "a mapping from dimensions to labels")
    labels = surrogate.labels
    chosen: dict[str, Any] = {}
    for dim, wanted in at.items():
        if dim not in labels.dims[1:]:
            dims = ", ".join(map(str, labels.dims[1:])) or "none"
            raise InputError(f"at must name dimensions of the response, {dims}; got {shown(dim)}")
        own = _positions(labels, dim, wanted)
        chosen[dim] = int(own[0]) if np.ndim(wanted) == 0 else np.unique(own)
    numbers = np.arange(int(np.prod(labels.shape[1:], dtype=int)))
    times = surrogate.times
    grid = xr.DataArray(numbers.reshape(labels.shape[1:]), dims=labels.dims[1:]).isel(chosen).values
    outputs, at_times = np.unique(grid // times), np.unique(grid % times)
    expansions = []
    for one in surrogate.expansions:
        own = np.intersect1d(one.outputs, outputs)
        if len(own):
            part: Any = one.of(own, at_times)
            expansions.append(replace(part, outputs=np.searchsorted(outputs, own)))
    diagnostics = surrogate.diagnostics
    kept = {dim: k for dim, k in chosen.items() if dim in diagnostics.dims}
    new_labels = labels.isel(chosen)
    return replace(
        surrogate,
        labels=new_labels,
        expansions=tuple(expansions),
        diagnostics=diagnostics.isel(kept),
    )


def _positions(labels: xr.DataArray, dim: str, wanted: Any) -> np.ndarray:
    """Return the positions of labels along a dimension, shape (labels,)."""
    count, several = labels.sizes[dim], f"at: {dim}"
    try:
        asked = np.atleast_1d(np.asarray(wanted))
    except ValueError:
        raise InputError(f"{several} must be labels; got {shown(wanted)}") from None
    if asked.ndim > 1 or not asked.size:
        raise InputError(f"{several} must be a label or a list of them; got {shown(wanted)}")
    if dim not in labels.coords:
        whole = asked.dtype.kind in "iuf" and (asked == np.round(asked)).all()
        if not whole or asked.min() < 0 or asked.max() >= count:
            allowed = f"positions from 0 to {count - 1}, since {dim} has no labels"
            raise InputError(f"{several} must be {allowed}; got {shown(wanted)}")
        return asked.astype(int)
    own = labels[dim].values
    named = dim == "output" and asked.dtype.kind == "U"  # outputs may be numbered
    if own.dtype.kind in "iuf" and not named:
        if asked.dtype.kind not in "iuf" or not np.isfinite(asked).all():
            raise InputError(f"{several} must be finite numbers; got {shown(wanted)}")
        slack = SIZE_OF_ROUNDING * (np.ptp(own) or abs(own[0]))
        if asked.min() < own.min() - slack or asked.max() > own.max() + slack:
            ends = f"from {own.min():g} to {own.max():g}"
            raise InputError(f"{several} must be {ends}; got {shown(wanted)}")
        return np.abs(asked[:, None].astype(float) - own).argmin(axis=1)
    found = {str(name): k for k, name in enumerate(own.tolist())}
    for name in asked.tolist():
        if str(name) not in found:
            raise InputError(f"{several} must be one of {', '.join(found)}; got {shown(name)}")
    return np.array([found[str(name)] for name in asked.tolist()])
