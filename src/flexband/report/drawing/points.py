"""Points whose paths an animation draws, and the regions in which they may be."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import xarray as xr

from flexband.analysis.paths import path
from flexband.analysis.selection import AnySurrogate, surrogates_of
from flexband.basics.checks import check_instance
from flexband.basics.rounding import unit_of_variable
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.sensors.motion import Position
from flexband.report.drawing.film import Region
from flexband.report.drawing.recording import nearest_places
from flexband.report.text.band_tables import outputs_of
from flexband.uncertainty.surrogates.choices import SurrogateOfChoices
from flexband.uncertainty.surrogates.surrogate import Surrogate


def checked_names(points: str | Sequence[str]) -> list[str]:
    """Return names of points; raise `InputError` if they are none."""
    names = [points] if isinstance(points, str) else points
    if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
        raise InputError(f"points must be names of points; got {value_text(points)}")
    return list(names)


def places_of(
    mechanism: Mechanism, names: Sequence[str], surrogate: AnySurrogate | None
) -> dict[str, PointName]:
    """Return the points of names; raise `InputError` if one is none, or no output of a surrogate.

    Without names, they are all positions that are outputs of the surrogate.
    """
    positions = {
        name: sensor.point
        for name, sensor in mechanism.sensors.items()
        if isinstance(sensor, Position)
    }
    if surrogate is None:
        return {name: _place_of(mechanism, positions, name) for name in names}
    check_instance("surrogate", surrogate, Surrogate | SurrogateOfChoices, "a Surrogate")
    alternatives = surrogates_of(surrogate)
    outputs = set(outputs_of(next(iter(alternatives.values())).labels))
    known = [name for name in positions if outputs.issuperset(_pair(name))]
    for name in names:
        _place_of(mechanism, positions, name)
        if name not in known:
            raise InputError(
                f"points: {' and '.join(_pair(name))} must be outputs of the surrogate; "
                f"points that are so: {', '.join(known) or 'none'}"
            )
    if not known:
        raise InputError(
            "surrogate has no region to draw: none of its outputs are the coordinates of a "
            "Position sensor of the mechanism"
        )
    return {name: positions[name] for name in names or known}


def _place_of(mechanism: Mechanism, positions: Mapping[str, PointName], name: str) -> PointName:
    """Return the point of a name, that of a sensor or of a body's point."""
    if name in positions:
        return positions[name]
    if name in mechanism.sensors:
        kind = type(mechanism.sensors[name]).__name__
        raise InputError(
            f"points: {name!r} is a sensor of the kind {kind}, which is no point; sensors of the "
            f"kind Position: {', '.join(positions) or 'none'}"
        )
    try:
        mechanism.model.frame(name)
    except InputError as error:
        raise InputError(f"points: {error}") from None
    return name


def _pair(name: str) -> tuple[str, str]:
    return f"{name}_X", f"{name}_Y"


def regions_of(
    surrogate: AnySurrogate,
    names: Iterable[str],
    times: np.ndarray,
    *,
    sigmas: float,
    magnification: float,
) -> dict[str, Region]:
    """Return the regions of points at times of pictures [s], drawn larger about nominal paths."""
    return {
        name: _region(path(surrogate, *_pair(name), sigmas=sigmas), times, magnification)
        for name in names
    }


def _region(tube: xr.Dataset, times: np.ndarray, magnification: float) -> Region:
    """Return the region of a point, about the nominal path, at times of pictures [s]."""
    nominal = np.stack([tube[f"{name}_nominal"].values for name in "xy"], axis=-1)
    if "time" not in tube.dims or nominal.ndim != 2:
        raise InputError("surrogate: the outputs of a point must be over time alone")
    if unit_of_variable(tube["x"]) not in ("m", ""):
        raise InputError(
            f"surrogate: the outputs of a point must be in m; got {unit_of_variable(tube['x'])}"
        )
    instants = tube["time"].values
    vertices = np.stack([tube[name].transpose("time", "vertex").values for name in "xy"], axis=-1)
    nearest = nearest_places(instants, times)
    centre = nominal[nearest][:, None]
    outlines = centre + magnification * (vertices[nearest] - centre)
    gap = np.diff(instants).max(initial=0.0)
    outlines[np.abs(instants[nearest] - times) > 0.51 * gap] = np.nan
    return Region(nominal, outlines)
