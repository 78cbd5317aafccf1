"""What a store's arrays are: one entry a run of what is known of it, and its outputs."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from flexband.errors import InputError
from flexband.execution.chunks import Array, describe_coordinate
from flexband.execution.growing import GrowingArrays
from flexband.execution.journal import Finished
from flexband.execution.names import RunStatus

OWN = (
    "setting", "inputs", "input", "outputs", "status", "reason", "seconds", "finished", "session",
    "remarks",
)  # fmt: skip
"""Names of the arrays."""


def add_columns(arrays: GrowingArrays, inputs: Sequence[str]) -> None:
    """Add the arrays that every store has."""
    names = np.array(inputs, dtype=object)
    flags = {
        "flag_values": [RunStatus.LOST, RunStatus.DONE, RunStatus.FAILED, RunStatus.AGAIN],
        "flag_meanings": "lost done failed failed_and_run_again",
    }
    since = {"units": "seconds since 1970-01-01"}
    add = arrays.add
    add("input", Array("string", ("input",), names.shape, {}), names)
    add("inputs", Array("float64", ("run", "input"), (0, len(names)), {}))
    add("setting", Array("string", ("run",), (0,), {"long_name": "options and discretization"}))
    add("status", Array("int8", ("run",), (0,), flags))
    add("reason", Array("string", ("run",), (0,), {}))
    add("seconds", Array("float64", ("run",), (0,), {"units": "s", "long_name": "wall time"}))
    add("finished", Array("float64", ("run",), (0,), since))
    add("session", Array("int64", ("run",), (0,), {"long_name": "number in attrs['sessions']"}))
    add_remarks(arrays)


def add_remarks(arrays: GrowingArrays) -> None:
    """Add the array of remarks, which stores of 0.2.0 do not have."""
    what = {"long_name": "what a run warns of, a list as JSON"}
    arrays.add("remarks", Array("string", ("run",), (0,), what))


def check_recordable(labels: xr.DataArray) -> None:
    """Raise `InputError` if a response has names or coordinates that cannot be recorded."""
    taken = [name for name in (*labels.dims[1:], *labels.coords) if name in (*OWN, "run")]
    if taken:
        raise InputError(
            f"dims and coordinates of a response that is recorded must have other names than "
            f"{', '.join(OWN)} and run; got {taken[0]!r}"
        )
    for name, coordinate in labels.coords.items():
        describe_coordinate(str(name), coordinate.values)


def add_outputs(arrays: GrowingArrays, labels: xr.DataArray) -> None:
    """Add the outputs and their coordinates."""
    dims = ("run", *map(str, labels.dims[1:]))
    of_runs = {
        "attrs of outputs": _plain(labels.attrs),
        "name of outputs": labels.name if isinstance(labels.name, str) else None,
        "coordinates": list(map(str, labels.coords)),
    }
    arrays.attrs |= of_runs
    for name, coordinate in labels.coords.items():
        kind, values, since = describe_coordinate(str(name), coordinate.values)
        array = Array(
            kind, tuple(map(str, coordinate.dims)), values.shape, _plain(coordinate.attrs) | since
        )
        arrays.add(str(name), array, values)
    attrs = _plain(labels.attrs) | {"coordinates": " ".join(map(str, labels.coords))}
    arrays.add("outputs", Array("float64", dims, (0, *labels.shape[1:]), attrs))


def stored_labels(arrays: GrowingArrays) -> xr.DataArray | None:
    """Return no runs with the dims and coordinates of the outputs, None without outputs."""
    if "outputs" not in arrays.arrays:
        return None
    outputs = arrays.arrays["outputs"]
    attrs = arrays.attrs
    coords = {}
    for name in attrs["coordinates"]:
        array = arrays.arrays[name]
        values = arrays.read(name)
        about = dict(array.attrs)
        units = str(about.get("units", ""))
        if array.kind == "int64" and units.startswith("nanoseconds"):
            values = values.astype("M8[ns]" if "since" in units else "m8[ns]")
            del about["units"]
        elif array.kind == "string":
            values = values.astype(str)
        coords[name] = (array.dims, values, about)
    empty = np.empty((0, *outputs.shape[1:]))
    dims = ("sample", *outputs.dims[1:])
    return xr.DataArray(empty, coords, dims, attrs["name of outputs"], attrs["attrs of outputs"])


def columns(
    batch: Sequence[Finished], session: int, shape: Sequence[int] | None
) -> dict[str, np.ndarray]:
    """Return the entries of finished runs; `shape` is that of one run's outputs, if known."""
    counts = [len(record.inputs) for record in batch]

    def repeat(values: Sequence[str | float], dtype: type) -> np.ndarray:
        return np.repeat(np.array(values, dtype=dtype), counts)

    entries = {
        "inputs": np.concatenate([record.inputs for record in batch]),
        "setting": repeat([record.setting for record in batch], object),
        "reason": repeat([record.reason for record in batch], object),
        "remarks": np.array(
            [text for record in batch for text in record.remarks or [""] * len(record.inputs)],
            dtype=object,
        ),
        "seconds": repeat([record.seconds for record in batch], float),
        "finished": repeat([record.time for record in batch], float),
        "session": np.full(sum(counts), session),
        "status": repeat(
            [RunStatus.FAILED if record.values is None else RunStatus.DONE for record in batch],
            np.int8,
        ),
    }
    if shape is not None:
        outputs = (
            np.full((count, *shape), np.nan) if record.values is None else record.values
            for count, record in zip(counts, batch, strict=True)
        )
        entries["outputs"] = np.concatenate(list(outputs))
    return entries


def _plain(attrs: Mapping[Hashable, Any]) -> dict[str, Any]:
    """Return attributes that JSON can hold; others as text."""
    plain = (str, bool, int, float, type(None))
    values = {k: v.item() if isinstance(v, np.generic) else v for k, v in attrs.items()}
    return {str(k): v if isinstance(v, plain) else str(v) for k, v in values.items()}
