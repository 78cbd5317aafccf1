"""What a store's arrays are: one entry a run of what is known of it, and its outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from flexband.errors import InputError
from flexband.execution.chunks import Array, described
from flexband.execution.growing import GrowingArrays
from flexband.execution.journal import Finished
from flexband.execution.names import AGAIN, DONE, FAILED, LOST

OWN = (
    "setting",
    "inputs",
    "input",
    "outputs",
    "status",
    "reason",
    "seconds",
    "finished",
    "session",
)
"""Names of the arrays."""


def add_columns(arrays: GrowingArrays, inputs: Sequence[str]) -> None:
    """Add the arrays that every store has."""
    names = np.array(inputs, dtype=object)
    flags = {
        "flag_values": [LOST, DONE, FAILED, AGAIN],
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


def check_recordable(labels: xr.DataArray) -> None:
    """Raise `InputError` if a response has names or coordinates that cannot be recorded."""
    taken = [name for name in (*labels.dims[1:], *labels.coords) if name in (*OWN, "run")]
    if taken:
        raise InputError(
            f"dims and coordinates of a response that is recorded must have other names than "
            f"{', '.join(OWN)} and run; got {taken[0]!r}"
        )
    for name, one in labels.coords.items():
        described(str(name), one.values)


def add_outputs(arrays: GrowingArrays, labels: xr.DataArray) -> None:
    """Add the outputs and their coordinates."""
    dims = ("run", *map(str, labels.dims[1:]))
    of_runs = {
        "attrs of outputs": _plain(labels.attrs),
        "name of outputs": labels.name if isinstance(labels.name, str) else None,
        "coordinates": list(map(str, labels.coords)),
    }
    arrays.attrs |= of_runs
    for name, one in labels.coords.items():
        kind, values, since = described(str(name), one.values)
        own = Array(kind, tuple(map(str, one.dims)), values.shape, _plain(one.attrs) | since)
        arrays.add(str(name), own, values)
    attrs = _plain(labels.attrs) | {"coordinates": " ".join(map(str, labels.coords))}
    arrays.add("outputs", Array("float64", dims, (0, *labels.shape[1:]), attrs))


def stored_labels(arrays: GrowingArrays) -> xr.DataArray | None:
    """Return no runs with the dims and coordinates of the outputs, None without outputs."""
    if "outputs" not in arrays.arrays:
        return None
    outputs, attrs = arrays.arrays["outputs"], arrays.attrs
    coords = {}
    for name in attrs["coordinates"]:
        own = arrays.arrays[name]
        values, about = arrays.read(name), dict(own.attrs)
        units = str(about.get("units", ""))
        if own.kind == "int64" and units.startswith("nanoseconds"):
            values = values.astype("M8[ns]" if "since" in units else "m8[ns]")
            del about["units"]
        elif own.kind == "string":
            values = values.astype(str)
        coords[name] = (own.dims, values, about)
    empty = np.empty((0, *outputs.shape[1:]))
    dims = ("sample", *outputs.dims[1:])
    return xr.DataArray(empty, coords, dims, attrs["name of outputs"], attrs["attrs of outputs"])


def columns(batch: Sequence[Finished], session: int, shape: Sequence[int] | None) -> dict[str, Any]:
    """Return the entries of finished runs; `shape` is that of one run's outputs, if known."""
    counts = [len(one.inputs) for one in batch]

    def repeated(values: Sequence[Any], dtype: Any) -> np.ndarray:
        return np.repeat(np.array(values, dtype=dtype), counts)

    found = {
        "inputs": np.concatenate([one.inputs for one in batch]),
        "setting": repeated([one.setting for one in batch], object),
        "reason": repeated([one.reason for one in batch], object),
        "seconds": repeated([one.seconds for one in batch], float),
        "finished": repeated([one.time for one in batch], float),
        "session": np.full(sum(counts), session),
        "status": repeated([FAILED if one.values is None else DONE for one in batch], np.int8),
    }
    if shape is not None:
        found["outputs"] = np.concatenate(
            [
                np.full((count, *shape), np.nan) if one.values is None else one.values
                for count, one in zip(counts, batch, strict=True)
            ]
        )
    return found


def _plain(attrs: Mapping[Any, Any]) -> dict[str, Any]:
    """Return attributes that JSON can hold; others as text."""
    plain = (str, bool, int, float, type(None))
    values = {k: v.item() if isinstance(v, np.generic) else v for k, v in attrs.items()}
    return {str(k): v if isinstance(v, plain) else str(v) for k, v in values.items()}
