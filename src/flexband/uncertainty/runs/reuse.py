"""What a store has for another study: runs at generic points inside its intervals, and domains.

A run is at a generic point if no other run shares one of its coordinates, as those of grids, axes
and corners do. Runs at generic points may judge an expansion, or be fitted by regression, wherever
they are; runs at other points serve where a design has the same points.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from flexband.errors import InputError
from flexband.execution.fingerprint import fingerprint
from flexband.execution.names import FileName
from flexband.execution.record import RunRecorder
from flexband.execution.store import Store
from flexband.files import read_json, write_json
from flexband.source_hash import source_hash
from flexband.uncertainty.inputs.constants import Constant
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.space import Response, Space, locate_fields

MOST = 10_000
"""Runs that are looked at."""


def generic_runs(
    record: RunRecorder, space: Space, setting: str, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ξ, η and values of up to `most` runs of studies with other intervals.

    They are within the intervals of this space, and the random inputs were the same. There are none
    for spaces with fields, nor where no input is an interval.
    """
    none = np.zeros((0, space.random_dimension)), np.zeros((0, space.interval_dimension))
    fields = any(isinstance(input_, Field) for input_ in space.inputs.values())
    runs = record.of_other_intervals(setting, texts(space, random=False), texts(space, random=True))
    if fields or record.labels is None or not len(runs) or not space.interval_dimension:
        return *none, np.zeros((0,))
    runs = runs[:MOST]
    names = list(space.recorded_at(*space.nominal()))
    numbers = record.inputs(runs)
    chosen, points = [], []
    for k in np.flatnonzero(_alone(numbers)):
        try:
            point = space.standardized(dict(zip(names, numbers[k], strict=True)))
        except InputError:  # it is outside
            continue
        points.append(point)
        chosen.append(k)
        if len(chosen) == most:
            break
    if not chosen:
        return *none, np.zeros((0,))
    xi, eta = (np.concatenate(parts) for parts in zip(*points, strict=True))
    return xi, eta, record.read(runs[chosen])[0]


def located(
    response: Response, inputs: Mapping[str, Any], store: Store | None
) -> tuple[dict[str, Any], int]:
    """Return what `locate_fields` does, or the domains that `keep_domains` has written."""
    loose = [k for k, field in inputs.items() if isinstance(field, Field) and field.domain is None]
    if store is not None and loose:
        with suppress(OSError, ValueError, TypeError, KeyError, InputError):
            content = read_json(Path(store.folder) / FileName.DOMAINS)
            if content["owner"] == _owner(response, store):
                domains = {name: tuple(content["domains"][name]) for name in loose}
                placed = {n: replace(inputs[n], domain=d) for n, d in domains.items()}
                return {**inputs, **placed}, 0
    return locate_fields(response, inputs)


def keep_domains(response: Response, inputs: Mapping[str, Any], record: RunRecorder | None) -> None:
    """Write the domains of the fields among the inputs into the folder of an open store."""
    if record is None:
        return
    domains = {name: field.domain for name, field in inputs.items() if isinstance(field, Field)}
    content = {"owner": _owner(response, record.store), "domains": domains}
    file = Path(record.store.folder) / FileName.DOMAINS
    with suppress(OSError):  # the store says what is wrong with it
        write_json(file, content)


def _owner(response: Response, store: Store) -> list[str]:
    return [fingerprint(response), source_hash("mechanics")[:16], store.version]


def texts(space: Space, *, random: bool) -> str:
    """Return the random inputs, or all others but constants, as text."""
    kinds = {
        name: input_ for name, input_ in space.inputs.items() if not isinstance(input_, Constant)
    }
    descriptions = [
        f"{name} = {input_!r}" for name, input_ in sorted(kinds.items()) if input_.random == random
    ]
    return "; ".join(descriptions)


def _alone(numbers: np.ndarray) -> np.ndarray:
    """Return which rows share no value with another row, in any column that varies."""
    alone = np.ones(len(numbers), bool)
    for column in numbers.T:
        _, place, count = np.unique(column, return_inverse=True, return_counts=True)
        if len(count) > 1:
            alone &= count[place.ravel()] == 1
    return alone
