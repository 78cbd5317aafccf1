"""Results written into a folder: data, and the report on a comparison of methods."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable, Mapping, Sequence
from contextlib import closing
from functools import partial
from io import BytesIO
from itertools import chain, count
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import ScipyDataStore

from flexband.errors import InputError
from flexband.files import checksum, read_unlinked, replaced
from flexband.report import figures, tables
from flexband.report.page.figures import Drawing, write_figures
from flexband.report.page.given import RESTORED, field_axes
from flexband.study.comparison import Comparison
from flexband.study.study import Study
from flexband.uncertainty.adaptive.method import AdaptivePCCI
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.fields.random_field import RandomField
from flexband.uncertainty.methods import PCCI, ImprovedPCCI

SEAL, DIGITS = b"\nCRC-32C ", 8
"""What stands behind the data of a file, before the digits of its checksum."""

BANDS = "Interval mean and interval error bar"

LONGEST_NAME = 100
"""Bytes of a file name, without its suffix."""


def write_comparison_report(
    folder: Path,
    title: str,
    study: Study,
    results: Sequence[Comparison],
    orders: Iterable[tuple[int, int]],
) -> Path:
    """Write figures and report.html on several methods; return the path of the report.

    Parameters
    ----------
    results : of `compare`, the reference first.
    orders : k and q for which the bands of PCCI and improved PCCI are drawn, together with those of
        the reference and of adaptive PCCI.
    """
    fields, response, drawn = study.fields(), study.nominal(), []
    along = field_axes(study.response, study.inputs) if fields else {}
    if random := {k: one for k, one in fields.items() if isinstance(one, RandomField)}:
        caption = "Variance error of the random fields after discretization"
        draw = partial(figures.variance_error_figure, random, along)
        drawn.append(Drawing(caption, draw))
    drawn += _of_fields(fields, along)
    if outputs := figures.drawable_outputs(response):
        draw = partial(figures.response_figure, response, outputs)
        drawn.append(Drawing("Response without uncertainty", draw))
    for name in outputs:
        for k, q in dict.fromkeys(orders):
            compared = (results[0].method, PCCI(k, q), ImprovedPCCI(k, q), AdaptivePCCI())
            chosen = {r.method.label: r.bands for r in results if r.method in compared}
            caption = f"{BANDS} of {name}, k = {k}, q = {q}"
            draw = partial(figures.bands_figure, chosen, name)
            drawn.append(Drawing(caption, draw))
        caption = f"Relative errors of {name} against runs"
        draw = partial(figures.errors_figure, results, name)
        drawn.append(Drawing(caption, draw))
    text = [*tables.comparison_remarks(fields), figures.definitions(results[0].bands)]
    about = f"{len(results)} methods, compared with {results[0].method.label}"
    file = folder / "report.html"
    return write_figures(file, title, about, tables.error_table(results), drawn, text)


def _of_fields(fields: Mapping[str, Field], along: Mapping[str, str]) -> list[Drawing]:
    """Return the drawing of realizations, if there are fields."""
    draw = partial(figures.fields_figure, fields, along)
    return [Drawing("Realizations of the fields", draw)] if fields else []


def file_name(name: str, taken: Collection[str] = ()) -> str:
    """Return a name as that of a file, other than those taken, which are in lower case."""
    words = "".join(c if c.isalnum() else " " for c in name).split()
    start = "_".join(words).encode()[:LONGEST_NAME].decode(errors="ignore") or "response"
    numbered = (f"{start}_{k}" for k in count(2))
    return next(own for own in chain([start], numbered) if own.casefold() not in taken)


def data_file(folder: Path, result: Comparison) -> Path:
    """Return the file for the bands of one of several methods."""
    return folder / f"{file_name(result.method.label.lower())}.nc"


def write_netcdf(dataset: xr.Dataset, file: Path) -> None:
    """Write a dataset as a NetCDF 3 file, which appears only once it is complete.

    Numbers and attributes that the format does not have become floats and texts. The
    checksum of the file, which `read_netcdf` checks, stands behind what other programs read.
    """
    stored = dataset.assign_attrs(_attributes(dataset.attrs))
    for name, values in stored.variables.items():
        kind, own = values.dtype.kind, values.copy(deep=False)
        if kind == "O":
            own = values.astype(str)
        elif (
            kind in "iu" and values.size and np.abs(values.values.astype(float)).max() >= 2**31
        ) or (kind == "f" and values.dtype.itemsize not in (4, 8)):
            own = values.astype(float)
        own.attrs, own.encoding = _attributes(values.attrs), {}
        stored[name] = own
    with replaced(file) as partial_file:  # `to_netcdf` would import all of Dask first
        target = ScipyDataStore(str(partial_file), mode="w", format="NETCDF3_64BIT", lock=False)
        with closing(target):
            stored.dump_to_store(target)
        digits = checksum(partial_file.read_bytes())
        with partial_file.open("ab") as opened:
            opened.write(SEAL + digits)


def read_netcdf(file: Path, restored: str = RESTORED) -> xr.Dataset:
    """Return a dataset that `write_netcdf` has written.

    Parameters
    ----------
    restored : what can be done about a file that was altered, for the message.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    InputError
        If it cannot be read, or is not as written.
    """
    try:
        data = read_unlinked(file)
    except FileNotFoundError:
        raise
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error}") from None
    content, seal = data[: -len(SEAL) - DIGITS], data[-len(SEAL) - DIGITS :]
    if seal != SEAL + checksum(content):
        raise InputError(f"{file} is not as written; {restored}")
    with xr.open_dataset(BytesIO(content), engine="scipy", decode_times=False) as found:
        return found.load()


def _attributes(attributes: Mapping[Hashable, Any]) -> dict[str, Any]:
    """Return attributes as numbers, lists of numbers, and texts."""

    def stored(value: Any) -> Any:
        plain = np.asarray(value)
        is_number = plain.dtype.kind == "f" or (
            plain.dtype.kind in "iu" and (not plain.size or np.abs(plain).max() < 2**31)
        )
        return value if isinstance(value, str) or (is_number and plain.ndim < 2) else str(value)

    return {str(name): stored(value) for name, value in attributes.items()}
