"""The distribution over the parts, in words and as a table."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.analysis.labelled_answers import AnswerRecord
from flexband.basics.rounding import Units, unit_of_variable
from flexband.basics.words import number_of
from flexband.report.text.band_tables import Table
from flexband.report.text.numbers import number
from flexband.uncertainty.surrogates.axes import names_of_outputs


def horizon_line(parts: xr.Dataset, max_outputs: int = 3) -> str:
    """Return from when on the motion of a part is not predictable, and what holds then."""
    low = parts["horizon_low"]
    low = low.min("choice") if "choice" in low.dims else low
    names = names_of_outputs(low.expand_dims("sample").expand_dims("time", -1))
    unit = unit_of_variable(parts["horizon"])
    ends = sorted((end, name) for end, name in zip(low.values.ravel(), names, strict=True))
    ends = [f"{name} after {number(end, 3)} {unit}".rstrip() for end, name in ends if end < np.inf]
    remainder = f" and {len(ends) - max_outputs} more" if len(ends) > max_outputs else ""
    samples = number_of(AnswerRecord.read(parts).samples, "sampled part")
    return (
        "Impacts make the motion of a single part unpredictable: "
        f"{', '.join(ends[:max_outputs])}{remainder}. "
        f"Bands hold until then at most; {samples} show how peaks and counts are distributed."
    )


def sampling_line(parts: xr.Dataset) -> str:
    """Return which parts were sampled, as a sentence without its full stop."""
    scatter = AnswerRecord.read(parts).scatter
    tolerances = f" with {scatter}" if scatter else ""
    return f"{number_of(parts.attrs['samples'], 'sampled part')}{tolerances}"


def parts_table(parts: xr.Dataset) -> Table:
    """Return quantiles of each number that varies, with their intervals, and what it depends on."""
    if "choice" in parts.dims:
        tables = {
            str(label): parts_table(parts.sel(choice=label)) for label in parts["choice"].values
        }
        rows = [
            [f"{row[0]}, {label}", *row[1:]] for label, table in tables.items() for row in table[1]
        ]
        return next(iter(tables.values()))[0], rows
    header = ["", "unit", *(f"{100 * p:g} % below" for p in parts["probability"].values)]
    ends = np.concatenate([parts["quantile_low"].values, parts["quantile_high"].values])
    size = np.abs(parts["quantile"].values).max(axis=0)
    spread = np.ptp(ends, axis=0)
    rows = []
    for k in np.flatnonzero(Units.along(parts, ["quantity"]).varies(spread, size)):
        of_number = parts.isel(quantity=k)
        values = [of_number[f"quantile{end}"].values for end in ("", "_low", "_high")]
        scale = float(np.abs(values[0]).max())
        texts = ([number(v, 4, scale) for v in column] for column in values)
        cells = [f"{v} ({low} to {high})" for v, low, high in zip(*texts, strict=True)]
        shares = of_number["first_order"]
        best = shares.values.argmax()
        share = float(shares[best])
        error = float(of_number["first_order_error"][best])
        cause = f"{shares['input'].values[best]} {100 * share:.0f} ± {100 * error:.0f} %"
        names = [str(of_number[name].values) for name in ("quantity", "unit")]
        rows.append([*names, *cells, cause])
    return [*header, "most of the variance"], rows
