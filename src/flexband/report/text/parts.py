"""The distribution over the parts, in words and as a table."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.report.text.numbers import number
from flexband.report.text.tables import Table
from flexband.words import number_of


def parts_line(parts: xr.Dataset) -> str:
    """Return from when on a motion is not predictable, and what holds then, as a sentence."""
    low = parts["horizon_low"]
    first = low[np.unravel_index(low.values.argmin(), low.shape)]
    time = f"{number(float(first), 3)} {parts['horizon'].attrs.get('units', '')}".rstrip()
    output = f" ({first['output'].values})" if "output" in first.coords else ""
    return (
        f"Impacts make single motions unpredictable after {time}{output}: peaks and counts are "
        f"those of {number_of(parts.attrs['samples'], 'sampled part')} ({parts.attrs['scatter']})."
    )


def parts_table(parts: xr.Dataset) -> Table:
    """Return quantiles of each number that varies, with their intervals, and what it depends on."""
    header = ["", "unit", *(f"{100 * p:g} % below" for p in parts["probability"].values)]
    rows = []
    for k, name in enumerate(parts["quantity"].values):
        of_number = parts.isel(quantity=k)
        values = [of_number[f"quantile{end}"].values for end in ("", "_low", "_high")]
        if np.ptp(values[0]) == 0 and len(values[0]) > 1:
            continue
        scale = float(np.abs(values[0]).max())
        texts = ([number(v, 3, scale) for v in column] for column in values)
        cells = [f"{v} ({low} to {high})" for v, low, high in zip(*texts, strict=True)]
        shares = of_number["first_order"]
        best = shares.values.argmax()
        share, error = float(shares[best]), float(of_number["first_order_error"][best])
        cause = f"{shares['input'].values[best]} {100 * share:.0f} ± {100 * error:.0f} %"
        rows.append([str(name), str(of_number["unit"].values), *cells, cause])
    return [*header, "most of the variance"], rows
