"""Which input matters most, in one sentence: for a limit, or for each output."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.report.page.inputs import averaging
from flexband.report.text import tables
from flexband.report.text.numbers import number
from flexband.study.results.verdicts import largest_around

MOST = 4
"""Outputs or limits of which the input that matters most is told."""


def what_matters(contributions: xr.Dataset, limits: xr.Dataset | None) -> str:
    """Return which uncertain input matters most, for each of the checked limits if any."""
    if limits is not None and "width" in contributions:
        return _for_limit(contributions, limits)
    share = contributions["mean_share"]
    names = [name for name in tables.outputs_of(share) if varies(contributions, name)]
    if not names:
        return "No input matters: all outputs are constant."
    largest = [_largest(tables.select(share, name)) for name in names]
    first, part = largest[0]
    words = (
        f"without its uncertainty, the error bar would be {tables.percent(part)} narrower"
        f"{averaging(contributions)}"
    )
    if len(names) == 1:
        return f"What matters most is {first}: {words}."
    some = [
        f"{input_} for {name} ({tables.percent(part)})"
        for name, (input_, part) in list(zip(names, largest, strict=True))[1:MOST]
    ]
    others = "; the report has the other outputs" if len(names) > MOST else ""
    return f"What matters most is {first} for {names[0]} ({words}), {', '.join(some)}{others}."


def varies(contributions: xr.Dataset, name: str) -> bool:
    """Return whether an output is not constant, as far as contributions tell it."""
    if "varies" not in contributions:
        return True
    return bool(tables.select(contributions["varies"], name).values.any())


def _for_limit(contributions: xr.Dataset, limits: xr.Dataset) -> str:
    """Return which input matters most for each limit, least margin in parts of a width first."""
    margins = []
    outputs = tables.outputs_of(contributions["mean_share"])
    count = limits.sizes["limit"]
    names = limits["output"].values if "output" in limits.coords else outputs[0]
    for k, name in enumerate(np.broadcast_to(names, count).astype(str).tolist()):
        if not varies(contributions, name if len(outputs) > 1 else outputs[0]):
            continue
        width = tables.select(contributions["width"], name)
        size = float(width.mean()) or np.inf
        margins.append((float(limits["least_margin"][k]) / size, k, name))
    if not margins:
        return "No input matters for the limits: their outputs are constant."
    largest = [
        (str(limits["limit"].values[k]), *_around(contributions, limits.isel(limit=k), name))
        for _, k, name in sorted(margins)[:MOST]
    ]
    (limit, first, part, where), *rest = largest
    others = "".join(
        f"; for {name}, it is {input_} ({tables.percent(part)})" for name, input_, part, _ in rest
    )
    more = "; there are further limits" if len(margins) > MOST else ""
    return (
        f"What matters most for the limit {limit} is {first}: without its uncertainty, the error "
        f"bar would be {tables.percent(part)} narrower{where}{others}{more}."
    )


def _around(contributions: xr.Dataset, limit: xr.Dataset, name: str) -> tuple[str, float, str]:
    """Return the input that matters most around a limit's least margin, its share, and where."""
    input_, share, at = largest_around(contributions, limit, name)
    if at is None:
        return input_, share, averaging(contributions)
    last = contributions["width"][contributions["width"].dims[-1]]
    unit = last.attrs.get("units", "s" * (last.name == "time"))
    where = f" around {f'{last.name} {number(at)} {unit}'.rstrip()}, where its margin is least"
    return input_, share, where


def _largest(share: xr.DataArray) -> tuple[str, float]:
    largest = share.max([dim for dim in share.dims if dim != "name"])
    best = int(np.argmax(largest.values))
    return str(share["name"].values[best]), float(largest[best])
