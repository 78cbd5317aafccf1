"""Results of a study written into a folder: data, figures and a report."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from flexband.files import replaced
from flexband.report import figures, tables
from flexband.report.html import Drawing, file_name, write_report
from flexband.study.comparison import Comparison
from flexband.study.study import Study
from flexband.uncertainty.adaptive.method import AdaptivePCCI
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.fields.random_field import RandomField
from flexband.uncertainty.methods import PCCI, ImprovedPCCI

BANDS = "Interval mean and interval error bar"


def write_bands_report(
    folder: Path,
    title: str,
    label: str,
    bands: xr.Dataset,
    checked: xr.Dataset | None = None,
    fields: Mapping[str, Field] | None = None,
) -> Path:
    """Write a figure for every output and one of the fields, and report.html; return its path.

    Parameters
    ----------
    title, label : of the report, and of the method in legends.
    checked : result of `verify`.
    fields : inputs that are fields, with their domains.
    """
    drawn = [
        Drawing(
            f"bands_{name or 'response'}",
            f"{BANDS} of {name}",
            partial(figures.bands_figure, {label: bands}, name),
        )
        for name in figures.drawable_outputs(bands["mean"])
    ]
    drawn += _of_fields(fields or {})
    text = [*tables.remarks(bands, checked), *tables.field_remarks(fields or {})]
    text.append(figures.definitions(bands))
    return write_report(folder, title, tables.summary_table(bands, checked), drawn, text)


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
    if random := {k: one for k, one in fields.items() if isinstance(one, RandomField)}:
        caption = "Variance error of the random fields after discretization"
        draw = partial(figures.variance_error_figure, random)
        drawn.append(Drawing("variance_error", caption, draw))
    drawn += _of_fields(fields)
    if outputs := figures.drawable_outputs(response):
        draw = partial(figures.response_figure, response, outputs)
        drawn.append(Drawing("deterministic", "Response without uncertainty", draw))
    for name in outputs:
        called = name or "response"
        for k, q in dict.fromkeys(orders):
            compared = (results[0].method, PCCI(k, q), ImprovedPCCI(k, q), AdaptivePCCI())
            chosen = {r.method.label: r.bands for r in results if r.method in compared}
            caption = f"{BANDS} of {name}, k = {k}, q = {q}"
            draw = partial(figures.bands_figure, chosen, name)
            drawn.append(Drawing(f"bands_{called}_{k}_{q}", caption, draw))
        caption = f"Relative errors of {name} against runs"
        draw = partial(figures.errors_figure, results, name)
        drawn.append(Drawing(f"errors_{called}", caption, draw))
    text = [*tables.comparison_remarks(fields), figures.definitions(results[0].bands)]
    return write_report(folder, title, tables.error_table(results), drawn, text)


def _of_fields(fields: Mapping[str, Field]) -> list[Drawing]:
    """Return the drawing of realizations, if there are fields."""
    draw = partial(figures.fields_figure, fields)
    return [Drawing("fields", "Realizations of the fields", draw)] if fields else []


def data_file(folder: Path, result: Comparison) -> Path:
    """Return the file for the bands of one of several methods."""
    return folder / f"{file_name(result.method.label.lower())}.nc"


def write_netcdf(dataset: xr.Dataset, file: Path) -> None:
    """Write a dataset as a NetCDF 3 file, which appears only once it is complete.

    Numbers and attributes that the format does not have become floats and texts.
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
    with replaced(file) as partial_file:
        stored.to_netcdf(partial_file, engine="scipy", format="NETCDF3_64BIT")


def _attributes(attributes: Mapping[Hashable, Any]) -> dict[str, Any]:
    """Return attributes as numbers, lists of numbers, and texts."""

    def stored(value: Any) -> Any:
        plain = np.asarray(value)
        is_number = plain.dtype.kind == "f" or (
            plain.dtype.kind in "iu" and (not plain.size or np.abs(plain).max() < 2**31)
        )
        return value if isinstance(value, str) or (is_number and plain.ndim < 2) else str(value)

    return {str(name): stored(value) for name, value in attributes.items()}
