"""The surrogate of some outputs and times of a response."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.basics.checks import check_instance
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.surrogates.choices import SurrogateOfChoices
from flexband.uncertainty.surrogates.surrogate import Surrogate

AnySurrogate = Surrogate | SurrogateOfChoices
"""What `expand` returns."""

Labels = Mapping[str, ArrayLike]
"""Dimension of a response -> one of its labels, or several."""


def surrogates_of(surrogate: AnySurrogate) -> dict[str, Surrogate]:
    """Return the surrogate of every combination of options; the label is "" without choices.

    Raise `InputError` if it is no surrogate.
    """
    check_instance("surrogate", surrogate, AnySurrogate, "one that `expand` returns")
    has_choices = isinstance(surrogate, SurrogateOfChoices)
    return dict(surrogate.surrogates) if has_choices else {"": surrogate}


def labels_of(surrogate: AnySurrogate) -> xr.DataArray:
    """Return a response without runs, for its dims and coordinates."""
    return next(iter(surrogates_of(surrogate).values())).labels


def select_places(surrogate: Surrogate, at: Labels | None) -> Surrogate:
    """Return the surrogate at chosen places of the response's dimensions.

    `at` maps dimensions to one of their labels, or a list; of numbers, such as times, the nearest
    ones that the response has are taken. Where a dimension has no labels, they are positions from
    0. A dimension with a single label is dropped. Raise `InputError` if there is no such dimension
    or label.
    """
    if at is None:
        return surrogate
    check_instance("at", at, Mapping, "a mapping from dimensions to labels")
    labels = surrogate.labels
    # Find the positions of the labels along each dimension.
    indexers: dict[str, int | np.ndarray] = {}
    for dim, dim_labels in at.items():
        if dim not in labels.dims[1:]:
            dims = ", ".join(map(str, labels.dims[1:])) or "none"
            raise InputError(
                f"at must name dimensions of the response, {dims}; got {value_text(dim)}"
            )
        indices = _positions(labels, dim, dim_labels)
        indexers[dim] = int(indices[0]) if np.ndim(dim_labels) == 0 else np.unique(indices)
    # Select the outputs and times of the expansions that are left.
    numbers = np.arange(int(np.prod(labels.shape[1:], dtype=int)))
    times = surrogate.times
    grid = (
        xr.DataArray(numbers.reshape(labels.shape[1:]), dims=labels.dims[1:]).isel(indexers).values
    )
    outputs, at_times = np.unique(grid // times), np.unique(grid % times)

    def parts(expansions: Sequence[Expansion]) -> tuple[Expansion, ...]:
        chosen_parts = []
        for expansion in expansions:
            indices = np.intersect1d(expansion.outputs, outputs)
            if len(indices):
                part: Any = expansion.select(indices, at_times)
                chosen_parts.append(replace(part, outputs=np.searchsorted(outputs, indices)))
        return tuple(chosen_parts)

    diagnostics = surrogate.diagnostics.isel(indexers, missing_dims="ignore")
    return replace(
        surrogate,
        labels=labels.isel(indexers),
        expansions=parts(surrogate.expansions),
        correction=parts(surrogate.correction),
        diagnostics=diagnostics,
    )


def _positions(labels: xr.DataArray, dim: str, dim_labels: ArrayLike) -> np.ndarray:
    """Return the positions of labels along a dimension, shape (labels,)."""
    count = labels.sizes[dim]
    argument_name = f"at: {dim}"
    try:
        targets = np.atleast_1d(np.asarray(dim_labels))
    except (TypeError, ValueError):
        raise InputError(f"{argument_name} must be labels; got {value_text(dim_labels)}") from None
    if targets.ndim > 1 or not targets.size:
        raise InputError(
            f"{argument_name} must be a label or a list of them; got {value_text(dim_labels)}"
        )
    if dim not in labels.coords:
        are_integers = targets.dtype.kind in "iuf" and (targets == np.round(targets)).all()
        if not are_integers or targets.min() < 0 or targets.max() >= count:
            allowed = f"positions from 0 to {count - 1}, since {dim} has no labels"
            raise InputError(f"{argument_name} must be {allowed}; got {value_text(dim_labels)}")
        return targets.astype(int)
    coordinate = labels[dim].values
    are_names = dim == "output" and targets.dtype.kind == "U"  # outputs may be numbered
    if coordinate.dtype.kind in "iuf" and not are_names:
        if targets.dtype.kind not in "iuf" or not np.isfinite(targets).all():
            raise InputError(
                f"{argument_name} must be finite numbers; got {value_text(dim_labels)}"
            )
        slack = 1e-9 * (np.ptp(coordinate) or abs(coordinate[0]))  # rounding, at the ends
        if targets.min() < coordinate.min() - slack or targets.max() > coordinate.max() + slack:
            ends = f"from {coordinate.min():g} to {coordinate.max():g}"
            raise InputError(f"{argument_name} must be {ends}; got {value_text(dim_labels)}")
        return np.abs(targets[:, None].astype(float) - coordinate).argmin(axis=1)
    positions = {str(name): k for k, name in enumerate(coordinate.tolist())}
    for name in targets.tolist():
        if str(name) not in positions:
            raise InputError(
                f"{argument_name} must be one of {', '.join(positions)}; got {value_text(name)}"
            )
    return np.array([positions[str(name)] for name in targets.tolist()])
