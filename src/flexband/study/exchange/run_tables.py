"""Tables of runs that exist: columns of files, data frames, datasets and stores."""

from __future__ import annotations

import os
import re
from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.execution.names import RunStatus
from flexband.execution.store import open_runs
from flexband.study.exchange.columns import read_csv
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import GivenInputs, cases, choices_of

Columns = dict[str, np.ndarray]


def columns_of(
    table: Any, inputs: set[str], outputs: Sequence[str] | None, units: Mapping[str, str]
) -> Mapping[str, Any]:
    """Return the columns of a table by name, without their units, which must be those given."""
    if isinstance(table, str | os.PathLike):
        table = _read(Path(table))
    if isinstance(table, xr.Dataset):
        columns: dict[str, Any] = _of_dataset(table, inputs, outputs)
        column_units = {str(k): str(v.attrs.get("units", "")) for k, v in columns.items()}
    else:
        if not isinstance(table, Mapping | pd.DataFrame):
            raise InputError(
                "table must be a path, a DataFrame, a Dataset or a mapping of columns; "
                f"got {value_text(table)}"
            )
        columns = {}
        column_units = {}
        for header in table:
            match = re.fullmatch(r"\s*(.*?)\s+\[([^\]=]*)\]\s*", str(header))
            name, unit = match.groups() if match else (str(header).strip(), "")
            columns[name] = _numbers(name, table[header])
            column_units[name] = unit
    for name, unit in units.items():
        if name not in columns:
            continue
        if column_units[name] not in ("", unit):
            raise InputError(
                f"table: {name} must be in {unit!r}, as given; it is in {column_units[name]!r}"
            )
    return columns


def _read(path: Path) -> Any:
    if path.suffix.lower() == ".csv":
        header, rows = read_csv(path)
        return {name: np.array([row[name] for row in rows]) for name in header}
    if path.suffix.lower() in (".nc", ".nc4"):
        try:
            with xr.open_dataset(path, engine="scipy", decode_timedelta=False) as opened:
                return opened.load()
        except Exception as error:  # whatever the reader raises for other files
            raise InputError(f"{path} cannot be read as NetCDF: {error}") from None
    if path.is_dir():
        return open_runs(path).load()
    raise InputError(f"table must be a .csv or .nc file, or a folder with runs; got {str(path)!r}")


def _of_dataset(
    table: xr.Dataset, inputs: set[str], outputs: Sequence[str] | None
) -> dict[str, xr.DataArray]:
    """Return the variables of a Dataset by name; those of a store are taken apart."""
    if {"inputs", "outputs", "status", "setting"} <= set(table.variables):
        done_mask = (table["status"].values == RunStatus.DONE) & (
            table["setting"].values.astype(str) == ""
        )
        table = table.isel(run=np.flatnonzero(done_mask))
        columns = {str(k): table["inputs"].sel(input=k, drop=True) for k in table["input"].values}
        return columns | {"outputs": table["outputs"].drop_vars("input", errors="ignore")}
    names = set(table.variables) if outputs is None else {*inputs, *outputs}
    dims = {table[name].dims[0] for name in inputs if name in table and table[name].dims}
    runs = next(iter(dims)) if len(dims) == 1 else "sample"
    return {str(k): table[k] for k in table.variables if k in names and runs in table[k].dims}


def _numbers(name: str, values: Any) -> np.ndarray:
    """Return a column as numbers, or as texts, if none is a number."""
    array = np.asarray(values)
    if array.dtype.kind in "biuf":
        return array.astype(float)
    texts = [str(value).strip() for value in array.ravel()]
    numbers = []
    for row, text in enumerate(texts):
        try:
            numbers.append(float(text or "nan"))
        except ValueError:
            if row == 0 or not numbers:
                return np.array(texts)
            raise InputError(
                f"table: {name} must have numbers; row {row + 1} has {text!r}"
            ) from None
    return np.array(numbers)


def inputs_and_response(
    columns: Mapping[str, Any], inputs: GivenInputs, outputs: Sequence[str] | None, time: str | None
) -> tuple[Columns, xr.DataArray]:
    """Return the columns of inputs, and the outputs as a response."""
    space = Space(next(iter(cases(inputs).values())))
    input_names = [*space.uncertain, *choices_of(inputs)]
    lacking = [
        name
        for name in [*input_names, *(outputs or ()), *([time] if time else [])]
        if name not in columns and not any(k.startswith(f"{name}[") for k in columns)
    ]
    if lacking:
        raise InputError(
            f"table must have the columns {', '.join(lacking)}; it has {', '.join(columns)}"
        )
    input_columns = {
        name: np.asarray(columns[name])
        for name in (*input_names, *space.constants)
        if name in columns
    }
    names = [
        name
        for name in columns
        if name not in inputs
        and name != time
        and (outputs is None or name.partition("[")[0] in outputs)
    ]
    if not names:
        raise InputError(f"table must have an output besides {', '.join(input_columns)}")
    if any(isinstance(columns[name], xr.DataArray) for name in names):
        return input_columns, _join_variables([columns[name] for name in names], names)
    if time is not None:
        return _of_times(
            input_columns, {name: columns[name] for name in names}, np.asarray(columns[time])
        )
    return input_columns, _wide({name: columns[name] for name in names})


def _join_variables(variables: Sequence[xr.DataArray], names: Sequence[str]) -> xr.DataArray:
    """Return variables of a Dataset as one response."""
    renamed = [
        variable.rename({str(variable.dims[0]): "sample"}).reset_coords(drop=True)
        for variable in variables
    ]
    if len(renamed) == 1:
        return renamed[0]
    if len({variable.dims for variable in renamed}) > 1:
        shapes = ", ".join(
            f"{n} {variable.dims[1:]}" for n, variable in zip(names, renamed, strict=True)
        )
        raise InputError(f"table: outputs must have the same dims; got {shapes}")
    joint = xr.concat(renamed, "output", join="exact", combine_attrs="drop")
    dims: list[Hashable] = ["sample", "output", *renamed[0].dims[1:]]
    return joint.assign_coords(output=list(names)).transpose(*dims)


def _wide(columns: Columns) -> xr.DataArray:
    """Return columns such as ``u``, or ``u[time=0.5]``, as a response."""
    series: dict[str, dict[float, np.ndarray]] = {}
    dim = ""
    for name, values in columns.items():
        match = re.fullmatch(r"(.*)\[(\w+)=([^\]]+)\]", name)
        if match:
            dim = match.group(2)
            series.setdefault(match.group(1), {})[float(match.group(3))] = values
        else:
            series[name] = {np.nan: values}
    for name, values in series.items():
        if {v.dtype.kind for v in values.values()} - set("biuf"):
            raise InputError(f"table: {name} must have numbers; leave texts out by `outputs`")
    places = [sorted(values) for values in series.values()]
    if dim and any(place != places[0] for place in places):
        raise InputError(f"table: all outputs must have the same values of {dim}")
    values = np.stack(
        [
            np.stack([by_place[place] for place in sorted(by_place)], axis=-1)
            for by_place in series.values()
        ],
        axis=1,
    )
    if not dim:
        return xr.DataArray(values[..., 0], {"output": list(series)}, ("sample", "output"))
    coords = {"output": list(series), dim: places[0]}
    return xr.DataArray(values, coords, ("sample", "output", dim))


def _of_times(
    input_columns: Columns, outputs: Columns, time: np.ndarray
) -> tuple[Columns, xr.DataArray]:
    """Return inputs and outputs of a table with a row for each run and time."""
    starts = np.flatnonzero(np.diff(time, prepend=np.inf) <= 0)
    counts = np.diff(np.append(starts, len(time)))
    if len(set(counts.tolist())) > 1 or counts[0] < 2:
        raise InputError(
            f"table: all runs must have the same times, which increase; got from {counts.min()} to "
            f"{counts.max()} rows of a run"
        )
    times = time.reshape(len(starts), -1)
    if not np.allclose(times, times[0], rtol=1e-9, atol=0):
        raise InputError("table: all runs must have the same times; they differ")
    for name, values in input_columns.items():
        by_run = values.reshape(len(starts), -1)
        if np.any(by_run != by_run[:, :1]):
            row = int(np.flatnonzero(np.any(by_run != by_run[:, :1], axis=1))[0])
            raise InputError(f"table: {name} must be the same at all times of run {row + 1}")
    values = np.stack([v.reshape(len(starts), -1) for v in outputs.values()], axis=1)
    coords = {"output": list(outputs), "time": times[0]}
    response = xr.DataArray(values, coords, ("sample", "output", "time"))
    return {name: values[starts] for name, values in input_columns.items()}, response
