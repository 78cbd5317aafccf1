"""Runs as columns of a table: names of outputs, and rows as text with all digits."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from flexband.basics.files import replace_file
from flexband.errors import InputError


def column_names(labels: xr.DataArray) -> list[str]:
    """Return the name of every value of a run: ``u``, or ``u[time=0.5]``.

    The first dim of `labels` is that of the runs.
    """
    dims = [str(dim) for dim in labels.dims[1:]]
    texts = [
        [_text(value) for value in (labels[dim].values if dim in labels.coords else range(size))]
        for dim, size in zip(dims, labels.shape[1:], strict=True)
    ]
    names = []
    for place in np.ndindex(*labels.shape[1:]):
        coordinates = {dim: texts[k][place[k]] for k, dim in enumerate(dims)}
        name = coordinates.pop("output", str(labels.name or "response"))
        other = ", ".join(f"{dim}={text}" for dim, text in coordinates.items())
        names.append(f"{name}[{other}]" if other else name)
    return names


def _text(value: Any) -> str:
    return repr(float(value)) if isinstance(value, float | np.floating) else str(value)


def different(names: Sequence[str]) -> list[str]:
    """Return names that all differ: later ones that are taken get an underscore."""
    unique_names: list[str] = []
    for name in names:
        while name in unique_names:
            name += "_"  # noqa: PLW2901
        unique_names.append(name)
    return unique_names


def write_csv(file: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table; numbers have all their digits."""
    with replace_file(file) as partial, partial.open("w", encoding="utf-8", newline="") as opened:
        writer = csv.writer(opened, lineterminator="\n")
        writer.writerow(header)
        writer.writerows([_cell(value) for value in row] for row in rows)


def _cell(value: Any) -> str:
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else repr(float(value))
    return str(value)


def read_csv(file: Path) -> tuple[list[str], list[dict[str, str]]]:
    """Return the header and the rows of a table; raise `InputError` if it is none."""
    try:
        with file.open(encoding="utf-8-sig", newline="") as opened:
            lines = [line for line in csv.reader(opened) if any(cell.strip() for cell in line)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{file} cannot be read as a table: {error}") from None
    if len(lines) < 2:
        raise InputError(f"{file} must have a header and at least one row")
    header = [cell.strip() for cell in lines[0]]
    if len(set(header)) < len(header):
        twice = next(name for name in header if header.count(name) > 1)
        raise InputError(f"{file} must have different columns; {twice!r} is there twice")
    for number, line in enumerate(lines[1:], start=2):
        if len(line) != len(header):
            raise InputError(
                f"{file}, row {number}: there must be {len(header)} cells, separated by commas; "
                f"got {len(line)}"
            )
    return header, [dict(zip(header, line, strict=True)) for line in lines[1:]]
