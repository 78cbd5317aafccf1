"""The path of a point, and the region in which the point is at every time.

The support function of a region is how far it reaches in a direction. That of the region of a point
(X, Y) is the upper bound of cos φ X + sin φ Y, a combination of outputs whose bounds are found as
those of the outputs are. The half-planes of all directions make a convex polygon around the region.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import numpy as np
import xarray as xr

from flexband.analysis.intervals import over_intervals
from flexband.analysis.labelled_answers import (
    AnswerRecord,
    answer,
    check_free,
    expected_error,
    places,
)
from flexband.analysis.quantities import output_of
from flexband.analysis.selection import AnySurrogate, Labels
from flexband.analysis.value_ranges import checked_probability, range_of
from flexband.basics.checks import check_instance, check_integer
from flexband.errors import InputError
from flexband.uncertainty.expansions.expansion import extremes_of
from flexband.uncertainty.phases.combination import combine
from flexband.uncertainty.surrogates.sigmas import checked_sigmas
from flexband.uncertainty.surrogates.surrogate import Surrogate


def path(
    surrogate: AnySurrogate,
    x: str,
    y: str,
    *,
    sigmas: float = 1.0,
    probability: float | None = None,
    directions: int = 32,
    at: Labels | None = None,
) -> xr.Dataset:
    """Return the path of a point, and polygons around the region of the point at every time.

    In each direction, the region reaches to the highest μ + kσ over the interval inputs of the
    distance in this direction; with `probability`, to the highest value over all intervals and a
    box of the random inputs, as in `value_range`. The polygon contains the region, and touches it
    in all directions.

    Parameters
    ----------
    surrogate : what `expand` or `load_surrogate` returns. No runs are made.
    x, y : names of the outputs that are the coordinates of the point, in the same unit.
    sigmas : k of μ ± kσ.
    probability : of the random inputs in the box, between 0 and 1; None for μ ± kσ.
    directions : number of directions, and of vertices of a polygon, a multiple of 4.
    at : dimension of the response -> its labels, as for `quantiles`; a point must be left at each
        time.

    Returns
    -------
    Dataset with the dims "direction", "vertex" and that of the response, such as "time":

    - `x_nominal` and `y_nominal`, the path: μ at the midpoints of the interval inputs;
    - `x` and `y` of the vertices of the polygon, counter-clockwise;
    - `support`, the reach in each direction from the origin, `support_at`, with a further dim
      "input", the values of the interval inputs there, and `support_choice` the options;
    - `radius`, the largest distance of a vertex from the path;
    - `expected_error` of the support, if the method gives one.

    Raises
    ------
    InputError
        If `surrogate` is not a surrogate, x or y is not one of its outputs, a number is out of its
        range, or more than one point is left at a time.
    """
    for name, output in (("x", x), ("y", y)):
        check_instance(name, output, str, "the name of an output")
    k = checked_sigmas(sigmas)
    count = check_integer("directions", directions, 8, 4096)
    if count % 4:
        raise InputError(f"directions must be a multiple of 4; got {count}")
    part = None if probability is None else checked_probability(probability)
    angle = 2 * np.pi * np.arange(count) / count
    result = over_intervals(
        lambda case: _supports(case, (x, y), k, part, angle), surrogate, at, highest="support"
    )
    if "support_choice" in result:
        result["support_choice"].attrs.update(long_name=LONG_NAMES["support_choice"])
    support = result["support"].values
    # a vertex is where the lines of two neighbouring directions meet
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    step = 2 * np.pi / count
    along = (np.roll(support, -1, axis=0) - support * np.cos(step)) / np.sin(step)
    vertices = np.einsum("ijk,jk...->ik...", turn, np.stack([support, along]))
    dims = ("vertex", *result["support"].dims[1:])
    for name, values in zip("xy", vertices, strict=True):
        result[name] = dims, values
    offsets = [result[name].values - result[f"{name}_nominal"].values for name in "xy"]
    result["radius"] = dims[1:], np.hypot(*offsets).max(axis=0)
    unit_attrs = {k: v for k, v in result["support"].attrs.items() if k == "units"}
    for name in ("x", "y", "radius"):
        result[name].attrs = {"long_name": LONG_NAMES[name]} | unit_attrs
    result["x"].attrs["output"] = x
    result["y"].attrs["output"] = y
    return result


def _supports(
    surrogate: Surrogate,
    outputs: tuple[str, str],
    sigmas: float,
    probability: float | None,
    angle: np.ndarray,
) -> xr.Dataset:
    """Return the support function and the path, for one combination of options."""
    labels = surrogate.labels
    space = surrogate.space
    check_free(labels, *LONG_NAMES, "vertex", "input")
    pair = [output_of(labels, name) for name in outputs]
    if labels.dims[1:-1] != ("output",):
        raise InputError(
            "path requires a response with the dims output and, last, time or another one; at may "
            f"choose places of others. Got {', '.join(map(str, labels.dims[1:]))}"
        )
    # Project the outputs on half of the directions: their lower bounds serve the others.
    output_names = labels["output"].values.astype(str).tolist()
    numbers_of = [output_names.index(name) for name in outputs]
    half = angle[: len(angle) // 2]
    weights = np.zeros((len(half), len(output_names)))
    for number, factor in zip(numbers_of, (np.cos(half), np.sin(half)), strict=True):
        weights[:, number] += factor
    frame = _frame(pair, len(half))
    diagnostics = xr.Dataset(attrs=surrogate.diagnostics.attrs)
    projection = Surrogate(space, frame, (combine(surrogate.expansions, weights),), diagnostics)
    dims = ("direction", frame.dims[2])
    deviations = sigmas
    if probability is None:
        low, high = extremes_of(projection.expansions, sigmas=sigmas, of=(-1.0, 1.0))
        support = np.concatenate([high.values[1], -low.values[0]])
        eta = np.concatenate([high.places[1], low.places[0]])
        data = places("support_at", space, eta, dims, support.shape)
        attrs: dict[str, Any] = {"sigmas": sigmas}
    else:
        bounds = range_of(projection, probability)
        deviations = AnswerRecord.read(bounds).standard_deviations * space.random_dimension**0.5
        support = np.concatenate([bounds["range"].values[1], -bounds["range"].values[0]])
        data = {}
        if "range_at" in bounds:
            at = bounds["range_at"].transpose("input", "bound", *dims).values
            support_places = np.concatenate([at[:, 1], at[:, 0]], axis=1)
            data = {
                "support_at": (("input", *dims), support_places),
                "input": bounds["input"].variable,
            }
        attrs = {"probability": probability}
    # Add the path and the errors.
    data["support"] = dims, support
    mean, _ = surrogate.standard_moments(np.zeros((1, space.interval_dimension)))
    for name, number in zip("xy", numbers_of, strict=True):
        data[f"{name}_nominal"] = dims[1:], mean[0, number]
    if (error := expected_error(surrogate, deviations)) is not None:
        sizes = np.abs([np.cos(angle), np.sin(angle)])
        data["expected_error"] = dims, np.einsum("od,ot->dt", sizes, error[numbers_of])
    attrs |= {"outputs": list(outputs)}
    degrees = xr.Variable("direction", np.rad2deg(angle), {"units": "°"})
    return answer(surrogate, data, {"direction": degrees}, attrs, LONG_NAMES, frame)


def _frame(pair: list[xr.DataArray], directions: int) -> xr.DataArray:
    """Return labels of distances in some directions, with the unit of both coordinates."""
    units = {str(coordinate["unit"].values) for coordinate in pair if "unit" in coordinate.coords}
    if len(units) > 1:
        raise InputError(f"x and y must have the same unit; got {' and '.join(sorted(units))}")
    last = pair[0].dims[-1]
    coords: dict[Hashable, xr.Variable] = (
        {last: pair[0][last].variable} if last in pair[0].coords else {}
    )
    values = np.zeros((0, directions, pair[0].sizes[last]))
    frame = xr.DataArray(values, coords, ("sample", "direction", last))
    return frame.assign_coords(unit=units.pop()) if units else frame


LONG_NAMES = {
    "x": "first coordinate of the vertices around the region of the point",
    "y": "second coordinate of the vertices around the region of the point",
    "x_nominal": "first coordinate of the path at the midpoints of the intervals",
    "y_nominal": "second coordinate of the path at the midpoints of the intervals",
    "support": "how far the region reaches in a direction",
    "support_at": "values of the inputs at the reach",
    "support_choice": "options at the reach",
    "radius": "largest distance of a vertex from the path",
    "direction": "angle of the direction from x",
    "expected_error": "error expected of the reach",
}
