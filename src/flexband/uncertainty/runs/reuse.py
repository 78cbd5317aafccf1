"""What a store has for another study: runs at generic points inside its intervals, and domains.

A run is at a generic point if no other run shares one of its coordinates, as those of grids, axes
and corners do. Runs at generic points may judge an expansion, or be fitted by regression, wherever
they are; runs at other points serve where a design has the same points.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np

from flexband.basics.files import read_json, write_json
from flexband.basics.response import ResponseFunction
from flexband.errors import InputError
from flexband.execution.fingerprint import fingerprint
from flexband.execution.names import FileName
from flexband.execution.record import RunRecorder
from flexband.execution.store import Owner, Store, mechanics_hash
from flexband.remarks.collection import remarks_in
from flexband.uncertainty.inputs.fields.field import fields_of
from flexband.uncertainty.inputs.space import Space, locate_fields
from flexband.uncertainty.inputs.unfolding import GivenInput, GivenInputs, in_words
from flexband.uncertainty.methods.method import EarlierRuns
from flexband.uncertainty.runs.evaluated import collected_remarks


def recorder(store: Store, response: ResponseFunction, space: Space) -> RunRecorder:
    """Return a store as it is open for the runs of a response."""
    names = list(space.recorded_at(*space.nominal()))
    fields = fields_of(space.inputs).items()
    fingerprints = ", ".join(f"{name}: {fingerprint(field)}" for name, field in fields)
    about = {"intervals": texts(space, random=False), "random": texts(space, random=True)}
    return RunRecorder(
        store, Owner.from_response(response, store.version, names, fingerprints), about
    )


def generic_runs(record: RunRecorder, space: Space, setting: str, max_runs: int) -> EarlierRuns:
    """Return up to `max_runs` runs of studies with other intervals.

    They are within the intervals of this space, and the random inputs were the same. There are none
    for spaces with fields, nor where no input is an interval.
    """
    intervals = texts(space, random=False)
    random = texts(space, random=True)
    runs = record.of_other_intervals(setting, intervals, random)
    if (
        fields_of(space.inputs)
        or record.labels is None
        or not (len(runs) and space.interval_dimension)
    ):
        return EarlierRuns()
    runs = runs[:10_000]  # comparing more takes longer than making some
    names = list(space.recorded_at(*space.nominal()))
    numbers = record.inputs(runs)
    rows = []
    points = []
    for k in np.flatnonzero(_alone(numbers)):
        try:
            point = space.standardize(dict(zip(names, numbers[k], strict=True)))
        except InputError:  # it is outside
            continue
        points.append(point)
        rows.append(k)
        if len(rows) == max_runs:
            break
    if not rows:
        return EarlierRuns()
    xi, eta = (np.concatenate(parts) for parts in zip(*points, strict=True))
    values = record.read(runs[rows])[0]
    remark_texts = record.remarks(runs[rows])
    remarks = {k: remarks_in(text) for k, text in enumerate(remark_texts) if text}
    return EarlierRuns(xi, eta, values, collected_remarks(space, (xi, eta), remarks))


def locate_domains(
    response: ResponseFunction, inputs: GivenInputs, store: Store | None
) -> tuple[dict[str, GivenInput], int]:
    """Return what `locate_fields` does, or the domains that `keep_domains` has written."""
    loose_fields = {k: field for k, field in fields_of(inputs).items() if field.domain is None}
    if store is not None and loose_fields:
        with suppress(OSError, ValueError, TypeError, KeyError, InputError):
            content = read_json(Path(store.folder) / FileName.DOMAINS)
            if content["owner"] == _owner(response, store):
                domains = content["domains"]
                new_fields = {
                    n: field.with_domain(tuple(domains[n])) for n, field in loose_fields.items()
                }
                return {**inputs, **new_fields}, 0
    return locate_fields(response, inputs)


def keep_domains(
    response: ResponseFunction, inputs: GivenInputs, record: RunRecorder | None
) -> None:
    """Write the domains of the fields among the inputs into the folder of an open store."""
    if record is None:
        return
    domains = {name: field.domain for name, field in fields_of(inputs).items()}
    content = {"owner": _owner(response, record.store), "domains": domains}
    file = Path(record.store.folder) / FileName.DOMAINS
    with suppress(OSError):  # the store says what is wrong with it
        write_json(file, content)


def _owner(response: ResponseFunction, store: Store) -> list[str]:
    return [fingerprint(response), mechanics_hash(), store.version]


def texts(space: Space, *, random: bool) -> str:
    """Return the random inputs, or all others but constants, as text."""
    return in_words({k: input_ for k, input_ in space.uncertain.items() if input_.random == random})


def _alone(numbers: np.ndarray) -> np.ndarray:
    """Return which rows share no value with another row, in any column that varies."""
    alone = np.ones(len(numbers), bool)
    for column in numbers.T:
        _, place, count = np.unique(column, return_inverse=True, return_counts=True)
        if len(count) > 1:
            alone &= count[place.ravel()] == 1
    return alone
