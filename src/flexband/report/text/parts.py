"""The distribution over the parts, in words and as a table."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.report.text.numbers import number
from flexband.report.text.tables import Table
from flexband.rounding import Units
from flexband.words import number_of


def horizon_line(parts: xr.Dataset) -> str:
    """Return from when on the motion of a part is not predictable, and what holds then."""
    low = parts["horizon_low"]
    first = low[np.unravel_index(low.values.argmin(), low.shape)]
    time = f"{number(float(first), 3)} {parts['horizon'].attrs.get('units', '')}".rstrip()
    output = f" ({first['output'].values} first)" if "output" in first.coords else ""
    samples = number_of(parts.attrs["samples"], "sampled part")
    return (
        f"Impacts make the motion of a single part unpredictable after {time}{output}: the bands "
        f"tell nothing later. How peaks and counts are distributed is told by {samples}."
    )


def sampling_line(parts: xr.Dataset) -> str:
    """Return which parts were sampled, as a sentence."""
    scatter = parts.attrs["scatter"]
    tolerances = f" with {scatter}" * bool(scatter)
    return f"{number_of(parts.attrs['samples'], 'sampled part')}{tolerances}."


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
    size, spread = np.abs(parts["quantile"].values).max(axis=0), np.ptp(ends, axis=0)
    rows = []
    for k in np.flatnonzero(Units.along(parts, ["quantity"]).varies(spread, size)):
        of_number = parts.isel(quantity=k)
        values = [of_number[f"quantile{end}"].values for end in ("", "_low", "_high")]
        scale = float(np.abs(values[0]).max())
        texts = ([number(v, 4, scale) for v in column] for column in values)
        cells = [f"{v} ({low} to {high})" for v, low, high in zip(*texts, strict=True)]
        shares = of_number["first_order"]
        best = shares.values.argmax()
        share, error = float(shares[best]), float(of_number["first_order_error"][best])
        cause = f"{shares['input'].values[best]} {100 * share:.0f} ± {100 * error:.0f} %"
        names = [str(of_number[name].values) for name in ("quantity", "unit")]
        rows.append([*names, *cells, cause])
    return [*header, "most of the variance"], rows
