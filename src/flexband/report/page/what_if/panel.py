"""The data of the what-if panel: bands for tighter tolerances and less scatter, without runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from flexband.analysis.selection import AnySurrogate, surrogates_of
from flexband.report.page.arrays import JsonRecord
from flexband.report.page.what_if.inputs import RELATIVE, intervals_of, sizes_of
from flexband.report.page.what_if.models import model
from flexband.report.text.numbers import percent
from flexband.study.presentation.display import Display
from flexband.uncertainty.surrogates.axes import names_of_outputs
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.surrogate import Surrogate

SCRIPTS = (
    "what_if_polynomials.js", "what_if_direct.js", "what_if_phases.js", "what_if_descent.js",
    "what_if_bounds.js", "what_if_worker.js", "what_if_inputs.js", "what_if_limits.js",
    "what_if_panel.js",
)  # fmt: skip
"""The scripts of the panel, in the order in which a page has them."""


def what_if(
    surrogate: AnySurrogate | None,
    bands: xr.Dataset,
    display: Display = Display(),
    *,
    max_coefficients: int = 1_500_000,
) -> tuple[JsonRecord | None, list[str]]:
    """Return the data of the panel, or None, and sentences that tell why there is none.

    A page takes a surrogate of `max_coefficients`, by default some 4 MB; coefficients and Python
    keep the units that `display` changes.
    """
    if surrogate is None:
        return None, ["Other inputs need new runs here, since the method makes no surrogate."]
    alternatives = list(surrogates_of(surrogate).values())
    space = alternatives[0].space
    expansions = [expansion for alternative in alternatives for expansion in alternative.expansions]
    if alternatives[0].time is None:
        return None, ["Other inputs need new runs here, since the outputs are not series in time."]
    # A model of each expansion, unless they are too large for a page.
    size = sum(expansion.arrays()["coefficients"].size for expansion in expansions)
    if size > max_coefficients:
        return None, ["Use Python for other inputs: the surrogate is too large for a page."]
    outputs = _outputs(alternatives[0].labels, bands)
    scale = np.array(outputs["scale"])
    outputs = _outputs(alternatives[0].labels, display.data(bands))
    models: list[JsonRecord] = [
        model(expansion, scale[expansion.outputs])
        | {"scale": [outputs["scale"][k] for k in expansion.outputs]}
        for expansion in expansions
    ]
    resolved = all(
        model_data["kind"] == "direct" or "points" in model_data for model_data in models
    )
    # The inputs that can be changed, in display units.
    intervals, remarks = intervals_of(space)
    python_inputs = "surrogate." + ("space.inputs" if isinstance(surrogate, Surrogate) else "given")
    sizes, why = sizes_of(space, python_inputs, resolved=resolved)
    if not intervals and not sizes:
        return None, remarks + why
    for input_ in intervals + sizes:
        name = input_["name"]
        relative = input_.get("of") == RELATIVE
        input_["unit"] = "" if relative else display.input_units().get(name, "")
        input_["scale"] = 1.0 if relative else display.scale(name)
    why += _with_differences(outputs, models)
    panel = {
        "intervals": intervals,
        "sizes": sizes,
        "discs": list(space.discs),
        "remarks": remarks + why,
        "interval_dimension": space.interval_dimension,
        "random_dimension": space.random_dimension,
        "models": models,
        **outputs,
    }
    return panel, []


def _with_differences(outputs: JsonRecord, models: Sequence[JsonRecord]) -> list[str]:
    """Add how far a page's bounds are from Python's to the errors; return what is to be said."""
    visible = 1e-4  # relative to the width
    errors = outputs["expected_error"]
    largest = 0.0
    for record in models:
        for output, error, scale in zip(
            record["outputs"], record["error"], record["scale"], strict=True
        ):
            largest = max(largest, error)
            if errors is not None and errors[output] is not None:
                errors[output] += error * scale
    if largest < visible:
        return []
    return [
        f"Bounds on this page differ by up to {percent(largest)} of an error bar's largest width "
        "from those of Python, since moments are integrated by fewer points; the expected errors "
        "include this."
    ]


def _outputs(labels: xr.DataArray, bands: xr.Dataset) -> JsonRecord:
    """Return the outputs, and how wide their bands are."""
    # Bands that are narrower, relative to their values, are constant but for rounding
    min_width = 1e-9
    times = labels.shape[-1]
    lower, upper = (v.reshape(-1, times) for v in bands["error_bar"].values)
    width = (upper - lower).max(axis=1)
    size = np.maximum(abs(lower), abs(upper)).max(axis=1)
    width = np.where(width > min_width * size, width, 0.0)
    scale = np.where(width > 0, width, np.where(size > 0, min_width * size, 1.0))
    names = names_of_outputs(labels)
    units = [""] * len(width)
    error = None
    if "unit" in labels.coords:
        first = bands["error_bar"].isel({"bound": 0, labels.dims[-1]: 0})
        units = [str(unit) for unit in np.ravel(bands["unit"].broadcast_like(first))]
    variables = ("pointwise_error", "error_bar_expected_error")  # narrowed bounds may rest anywhere
    if variable := next((variable for variable in variables if variable in bands), None):
        expected = bands[variable].values
        largest = np.reshape(expected, (len(width), -1)).max(axis=1)
        error = [float(value) if np.isfinite(value) else None for value in largest]
    return {
        "sigmas": float(BandRecord.read(bands).sigmas),
        "outputs": [{"name": n, "unit": u} for n, u in zip(names, units, strict=True)],
        "width": width.tolist(),
        "scale": scale.tolist(),
        "expected_error": error,
        "times": times,
    }
