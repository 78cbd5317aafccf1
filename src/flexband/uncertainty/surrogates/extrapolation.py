"""Where a surrogate extrapolates: random inputs beyond all runs of the response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexband.basics.warning import warn
from flexband.uncertainty.inputs.space import Space

NAMES = ("lowest_xi", "highest_xi")
"""Attributes of the range of ξ in runs."""


def reached_range(xi: np.ndarray) -> dict[str, list[float]]:
    """Return the range of each ξ in runs, shape (runs, n), as attributes."""
    if not xi.size:
        return {}
    return dict(zip(NAMES, (xi.min(axis=0).tolist(), xi.max(axis=0).tolist()), strict=True))


def warn_of_extrapolation(space: Space, xi: np.ndarray, attrs: Mapping[str, Any]) -> None:
    """Warn of the random input at points ξ farthest beyond the runs, as `reached_range` tells."""
    usual = 5.0  # values of |ξ| up to which an expansion may be evaluated, wherever the runs are
    n = space.random_dimension
    low, high = (
        np.asarray(attrs.get(name, n * [end]))
        for name, end in zip(NAMES, (-usual, usual), strict=True)
    )
    beyond = np.maximum(xi - np.maximum(high, usual), np.minimum(low, -usual) - xi)
    if not beyond.size or beyond.max() <= 0:
        return
    point, variable = (int(k) for k in np.unravel_index(beyond.argmax(), beyond.shape))
    random = space.of_kind(random=True).items()
    owners = [(name, k) for name, input_ in random for k in range(input_.dimension)]
    name, term = owners[variable]
    input_ = space.inputs[name]
    at = xi[point, variable]
    standard = [at, *(end[variable] for end in (low, high))]
    values = [""] * 3
    alone = input_.dimension == 1 and not input_.intervals and space.factor is None
    numbers = input_.as_numbers(name, np.reshape(standard, (-1, 1))) if alone else {}
    if name in numbers:
        values = [f"{value:.6g}, " for value in numbers[name]]
    point_texts = [f"{v}ξ = {x:.3g}" for v, x in zip(values, standard, strict=True)]
    label = name if input_.dimension == 1 else f"{name}[{term}]"
    warn(
        f"the surrogate extrapolates: {label} ({point_texts[0]}) is beyond its runs, which are "
        f"between ({point_texts[1]}) and ({point_texts[2]})"
    )
