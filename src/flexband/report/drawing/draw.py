"""Draw a mechanism at its assembled start, with its joints, loads and dimensions."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexband.errors import AssemblyError, check_flag, check_instance, warn
from flexband.mechanics.assembly.mechanism import Mechanism
from flexband.mechanics.configuration import Configuration, assembled, given
from flexband.report.drawing.canvas import COLORS, Canvas
from flexband.report.drawing.words import write
from flexband.report.shapes.mechanism import extent, sketch_mechanism
from flexband.report.shapes.scene import Scene
from flexband.report.shapes.tracks import Tracks


def draw(
    mechanism: Mechanism,
    *,
    sample: int = 0,
    dimensions: bool = True,
    names: bool = True,
    axes: Axes | None = None,
) -> Figure:
    """Draw a mechanism at its start, with its joints assembled.

    If they cannot be assembled, the bodies are drawn as they are given, and a warning says why.

    Rigid bodies are links or plates through their named points, with the centre of mass marked; a
    body with a single point is a dashed circle of its radius of gyration. Beams have their true
    height. Arrows show the directions of forces and drives at the start, not their sizes. A part of
    unknown type is a diamond at its first point.

    Parameters
    ----------
    sample : number of the sample to draw if parameters are arrays.
    dimensions : whether to write the lengths of bodies and rods.
    names : whether to write the names of bodies, joints and loads.
    axes : axes to draw on; by default those of a new figure of at most 8 by 6 inches.

    Returns
    -------
    The figure. The gid of an artist is its part: "body 'crank'", "joint 'A'", "load 'gravity'".

    Raises
    ------
    InputError
        If the mechanism does not have this sample, or if parameters have different numbers of
        samples.
    """
    check_flag("dimensions", dimensions)
    check_flag("names", names)
    if axes is not None:
        check_instance("axes", axes, Axes, "axes of matplotlib")
    scene, tracks = Scene(mechanism, _start(mechanism, sample)), Tracks(mechanism)
    first = sketch_mechanism(scene, tracks)
    box, unit, axes = _layout(extent(first, *tracks.at_start(scene.start)), axes)
    sketch = sketch_mechanism(scene, tracks, unit, gaps=48)
    canvas = Canvas(
        axes, box, unit, *tracks.at_start(scene.start), names=names, dimensions=dimensions
    )
    canvas.draw(sketch)
    write(canvas)
    axes.update_datalim(box)  # keeps space for the names
    axes.margins(0.0)
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    return axes.figure.figure


def _start(mechanism: Mechanism, sample: int) -> Configuration:
    try:
        return assembled(mechanism, sample)
    except AssemblyError as error:
        warn(f"the bodies are drawn as they are given, since they cannot be assembled: {error}")
        return given(mechanism, sample)


def _layout(extremes: np.ndarray, axes: Axes | None) -> tuple[np.ndarray, float, Axes]:
    """Return the corners of the drawing [m], its metres per point, and axes for it.

    Without axes, those of a new figure are as large as the drawing needs, in the limits of `draw`.
    """
    lowest, highest = extremes
    new, axes = axes is None, axes or Figure().add_subplot()
    figure = axes.figure.figure
    axes.set(xlabel="X [m]", ylabel="Y [m]")
    axes.spines[:].set_color(COLORS["muted"])
    axes.tick_params(color=COLORS["muted"], labelsize=8)
    points_per_inch = 72.0
    before, after = np.array([0.75, 0.55]), np.array([0.15, 0.15])  # [in], for the axes' numbers
    if new:
        space = points_per_inch * (np.array([8.0, 6.0]) - before - after)
    else:
        figure.draw_without_rendering()  # computes the layout
        space = np.array(axes.get_window_extent().size) * points_per_inch / figure.dpi
    margin = min(60.0, 0.2 * space.min())
    unit = ((highest - lowest) / (space - 2 * margin)).max() or 1.0 / points_per_inch
    if new:
        smallest = points_per_inch * np.array([2.5, 1.8])
        space = np.maximum((highest - lowest) / unit + 2 * margin, smallest)
        size = space / points_per_inch
        width, height = before + size + after
        figure.set_size_inches(width, height)
        axes.set_position((*(before / (width, height)), *(size / (width, height))))
    middle, half = (lowest + highest) / 2, unit * space / 2
    return np.array([middle - half, middle + half]), unit, axes
