"""Distribution functions of all outputs at some times, for their chart."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.analysis.labelled_answers import AnswerRecord
from flexband.analysis.p_boxes import VALUES, p_box
from flexband.analysis.selection import AnySurrogate, surrogates_of
from flexband.report.page.arrays import JsonRecord, pack
from flexband.report.text.band_tables import outputs_of
from flexband.study.presentation.display import Display


def p_boxes(surrogate: AnySurrogate, bands: xr.Dataset, count: int) -> xr.Dataset | None:
    """Return the bounds of the distribution function of every output at some times.

    These are those of the widest error bars, and `count` equally spaced ones. The result has
    `distribution` (output, place, bound, number) at `value` (output, place, number), and
    `sampling_error` (output, place); None without random inputs or series.
    """
    samples = 1024  # of the random inputs
    first_surrogate = next(iter(surrogates_of(surrogate).values()))
    domain_dims = [str(d) for d in bands["mean"].dims if d not in ("output", "bound")]
    if not first_surrogate.space.random_dimension or len(domain_dims) != 1:
        return None
    (dim,) = domain_dims
    bar = bands["error_bar"].transpose("bound", ..., dim).values
    widest = np.unique(np.argmax(bar[1] - bar[0], axis=-1))
    regular = np.linspace(0, bands.sizes[dim] - 1, count).round().astype(int)
    places = bands[dim].values[np.union1d(widest, regular)]
    rows = []
    for name in outputs_of(bands["mean"]):
        output = {"output": name} if "output" in bands["mean"].dims else {}
        boxes = [p_box(surrogate, at={**output, dim: x}, samples=samples) for x in places]
        rows.append([_row(box) for box in boxes])
    value, distribution, error = (
        np.array([[row[k] for row in output_rows] for output_rows in rows]) for k in range(3)
    )
    dims = "output", "place"
    data = {
        "value": ((*dims, "number"), value),
        "distribution": ((*dims, "bound", "number"), distribution),
        "sampling_error": (dims, error),
    }
    return xr.Dataset(data, {"place": places}, {"samples": samples})


def p_box_data(boxes: xr.Dataset | None, bands: xr.Dataset, display: Display) -> JsonRecord | None:
    """Return what p_boxes.js draws; the bands have the units of the outputs."""
    if boxes is None:
        return None
    if {"output", "unit"} <= set(bands.coords) and bands["unit"].dims == ("output",):
        values = boxes[["value"]].assign_coords(output=bands["output"], unit=bands["unit"])
        boxes = boxes.assign(value=display.data(values)["value"].variable)
    return {
        "places": boxes["place"].values.tolist(),
        "samples": int(AnswerRecord.read(boxes).samples),
        "values": [pack(output.values) for output in boxes["value"]],
        "distribution": [pack(output.values, 1e-6) for output in boxes["distribution"]],
        "error": boxes["sampling_error"].values.tolist(),
    }


def _row(box: xr.Dataset) -> tuple[np.ndarray, np.ndarray, float]:
    """Return values, bounds of probabilities, and their error; a single value is a step."""
    value = box["value"].values
    distribution = box["distribution"].transpose("bound", "value").values
    if len(value) == 1:
        value = np.repeat(value, VALUES)
        distribution = np.repeat(distribution, VALUES, axis=1)
    return value, distribution, float(box["sampling_error"].max())
