"""Datasets as NetCDF 3 files that tell if they were altered."""

from __future__ import annotations

import json
from collections.abc import Hashable, Mapping
from contextlib import closing, suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import ScipyDataStore

from flexband.basics.computation import NUMBERING, check_numbering
from flexband.basics.files import checksum, read_unlinked, replace_file
from flexband.errors import InputError

SEAL = b"\nCRC-32C "
DIGITS = 8
"""What stands behind the data of a file, before the digits of its checksum."""

RESTORED = "`flexband run` restores it"
"""What can be done about a result that was altered."""


def write_netcdf(dataset: xr.Dataset, file: Path) -> None:
    """Write a dataset as a NetCDF 3 file, which appears only once it is complete.

    Numbers and attributes that the format does not have become floats and texts. The
    checksum of the file, which `read_netcdf` checks, stands behind what other programs read.
    """
    variables = {name: _storable_variable(variable) for name, variable in dataset.variables.items()}
    attributes = {**dataset.attrs, "numbering": np.array(NUMBERING)}
    stored = xr.Dataset(variables, attrs=_attributes(attributes)).set_coords(dataset.coords)
    with replace_file(file) as partial_file:  # `to_netcdf` would import all of Dask first
        target = ScipyDataStore(str(partial_file), mode="w", format="NETCDF3_64BIT", lock=False)
        with closing(target):
            stored.dump_to_store(target)
        digits = checksum(partial_file.read_bytes())
        with partial_file.open("ab") as opened:
            opened.write(SEAL + digits)


def _storable_variable(variable: xr.Variable) -> xr.Variable:
    """Return a variable of a kind of numbers or texts that the format has."""
    kind = variable.dtype.kind
    values = variable.values
    if kind == "O":
        values = values.astype(str)
    elif (kind in "iu" and values.size and np.abs(values.astype(float)).max() >= 2**31) or (
        kind == "f" and values.dtype.itemsize not in (4, 8)
    ):
        values = values.astype(float)
    return xr.Variable(variable.dims, values, _attributes(variable.attrs))


def read_netcdf(file: Path) -> xr.Dataset:
    """Return a dataset that `write_netcdf` has written.

    Raise `FileNotFoundError` if there is no such file, `InputError` if it cannot be read, is not as
    written, or is outdated.
    """
    try:
        data = read_unlinked(file)
    except FileNotFoundError:
        raise
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error}") from None
    content = data[: -len(SEAL) - DIGITS]
    seal = data[-len(SEAL) - DIGITS :]
    if seal != SEAL + checksum(content):
        raise InputError(f"{file} is not as written; {RESTORED}")
    with xr.open_dataset(BytesIO(content), engine="scipy", decode_times=False) as opened:
        dataset = opened.load()
    check_numbering(str(file), dataset.attrs.pop("numbering", None))
    return dataset.assign_attrs({k: _attribute(value) for k, value in dataset.attrs.items()})


def _attribute(value: Any) -> Any:
    """Return an attribute as it was before it was written: lists of texts are kept as JSON."""
    if isinstance(value, str) and value[:2] in ('["', "[]"):
        with suppress(ValueError):
            return json.loads(value)
    return value


def _attributes(attributes: Mapping[Hashable, Any]) -> dict[str, Any]:
    """Return attributes as numbers, lists of numbers, and texts."""

    def netcdf_value(value: Any) -> Any:
        if isinstance(value, list | tuple) and all(isinstance(text, str) for text in value):
            return json.dumps(value)
        plain = np.asarray(value)
        is_number = plain.dtype.kind == "f" or (
            plain.dtype.kind in "iu" and (not plain.size or np.abs(plain).max() < 2**31)
        )
        return value if isinstance(value, str) or (is_number and plain.ndim < 2) else str(value)

    return {str(name): netcdf_value(value) for name, value in attributes.items()}
