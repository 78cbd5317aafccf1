"""Runs of a store that serve another study: at generic points inside its intervals.

A run is at a generic point if no other run shares one of its coordinates, as those of grids, axes
and corners do. Runs at generic points may judge an expansion, or be fitted by regression, wherever
they are; runs at other points serve where a design has the same points.
"""

from __future__ import annotations

import numpy as np

from flexband.errors import InputError
from flexband.execution.record import Record
from flexband.uncertainty.inputs.constants import Constant
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.space import Space

MOST = 10_000
"""Runs that are looked at."""


def generic_runs(
    record: Record, space: Space, setting: str, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ξ, η and values of up to `most` runs of studies with other intervals.

    They are within the intervals of this space, and the random inputs were the same. There are none
    for spaces with fields, nor where no input is an interval.
    """
    none = np.zeros((0, space.random_dimension)), np.zeros((0, space.interval_dimension))
    fields = any(isinstance(one, Field) for one in space.inputs.values())
    runs = record.of_other_intervals(setting, texts(space, random=False), texts(space, random=True))
    if fields or record.labels is None or not len(runs) or not space.interval_dimension:
        return *none, np.zeros((0,))
    runs = runs[:MOST]
    names = list(space.recorded_at(*space.nominal()))
    numbers = record.inputs(runs)
    chosen, points = [], []
    for k in np.flatnonzero(_alone(numbers)):
        try:
            found = space.standardized(dict(zip(names, numbers[k], strict=True)))
        except InputError:  # it is outside
            continue
        points.append(found)
        chosen.append(k)
        if len(chosen) == most:
            break
    if not chosen:
        return *none, np.zeros((0,))
    xi, eta = (np.concatenate(parts) for parts in zip(*points, strict=True))
    return xi, eta, record.read(runs[chosen])[0]


def texts(space: Space, *, random: bool) -> str:
    """Return the random inputs, or all others but constants, as text."""
    kinds = {name: one for name, one in space.inputs.items() if not isinstance(one, Constant)}
    own = [f"{name} = {one!r}" for name, one in sorted(kinds.items()) if one.random == random]
    return "; ".join(own)


def _alone(numbers: np.ndarray) -> np.ndarray:
    """Return which rows share no value with another row, in any column that varies."""
    alone = np.ones(len(numbers), bool)
    for column in numbers.T:
        _, place, count = np.unique(column, return_inverse=True, return_counts=True)
        if len(count) > 1:
            alone &= count[place.ravel()] == 1
    return alone
