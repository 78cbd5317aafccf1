"""What is in the plane: a mechanism, and the path of a point."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from flexband.basics.rounding import unit_of_variable
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.mechanics.model.mechanism import Mechanism
from flexband.report.drawing.draw import draw
from flexband.report.plot.series import literal, with_unit
from flexband.report.plot.style import LIGHT, LINES, MIDDLE, axes_of


def mechanism(
    mechanism: Mechanism,
    *,
    sample: int = 0,
    dimensions: bool = False,
    names: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw a mechanism at its start, with its joints assembled, as `draw` does.

    Parameters
    ----------
    sample : number of the sample to draw if parameters are arrays.
    dimensions : whether to write the lengths of bodies and rods.
    names : whether to write the names of bodies, joints and loads.
    ax : axes to draw on, those of a new figure by default.

    Returns
    -------
    The axes, with the same scale along X and Y.

    Raises
    ------
    InputError, AssemblyError
        As `draw`.
    """
    ax = axes_of(ax)
    draw(mechanism, sample=sample, dimensions=dimensions, names=names, axes=ax)
    return ax


def path(found: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw the nominal path of a point, and the regions in which the point can be.

    Parameters
    ----------
    found : result of `path`.
    ax : axes to draw on, those of a new figure by default.

    Returns
    -------
    The axes, with the same scale along both coordinates.

    Raises
    ------
    InputError
        If `found` is no result of `path`.
    """
    max_drawn = 400  # regions in a figure
    if not isinstance(found, xr.Dataset) or not {"x", "y", "x_nominal", "y_nominal"} <= set(found):
        raise InputError(f"found must be a result of path; got {value_text(found)}")
    vertices = np.stack([found[name].transpose("vertex", ...).values.T for name in "xy"], axis=-1)
    some = vertices[:: max(1, len(vertices) // max_drawn)]
    ax = axes_of(ax)
    ax.add_collection(
        PolyCollection(list(some), facecolor=LIGHT, edgecolor=MIDDLE, linewidth=0.4, alpha=0.6)
    )
    ax.plot(found["x_nominal"], found["y_nominal"], **LINES[0])
    ax.autoscale_view()
    ax.set_aspect("equal", adjustable="datalim")
    names = [found[axis].attrs["output"] for axis in "xy"]
    unit = unit_of_variable(found["x"])
    ax.set(xlabel=with_unit(literal(names[0]), unit), ylabel=with_unit(literal(names[1]), unit))
    return ax
