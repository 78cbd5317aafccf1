"""Draw a mechanism at its assembled start, with its joints, loads and dimensions."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexband.errors import AssemblyError, check_flag, check_instance, warn
from flexband.mechanics.assembly.mechanism import Mechanism
from flexband.mechanics.configuration import Configuration, assembled, given
from flexband.mechanics.joints.gears import Rack
from flexband.mechanics.loads.loads import Gravity
from flexband.report.drawing.bodies import draw_body
from flexband.report.drawing.canvas import GREY, Canvas
from flexband.report.drawing.joints import draw_joint
from flexband.report.drawing.loads import draw_load
from flexband.report.drawing.scene import Scene
from flexband.report.drawing.symbols import circle
from flexband.report.drawing.words import write

MAX_FIGURE, MIN_AXES = np.array([8.0, 6.0]), np.array([2.5, 1.8])
"""Largest size of a figure, smallest size of its axes [in]."""
LEFT_BOTTOM, RIGHT_TOP = np.array([0.75, 0.55]), np.array([0.15, 0.15])
"""Space around the axes for their numbers [in]."""
MAX_MARGIN = 60.0
"""Largest distance of the mechanism from the edges of the axes [pt]."""
POINTS_PER_INCH = 72.0


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
    scene = Scene(mechanism, _start(mechanism, sample))
    canvas = _canvas(scene, axes, names=names, dimensions=dimensions)
    for name in mechanism.bodies:
        draw_body(scene, canvas, name)
    for name in mechanism.joints:
        draw_joint(scene, canvas, name)
    loads = mechanism.loads
    for name in sorted(loads, key=lambda name: isinstance(loads[name], Gravity)):
        draw_load(scene, canvas, name)  # gravity comes last, since it may be anywhere
    write(canvas)
    canvas.axes.update_datalim(canvas.box)  # keeps space for the names
    canvas.axes.margins(0.0)
    canvas.axes.autoscale_view()
    canvas.axes.set_aspect("equal", adjustable="datalim")
    return canvas.axes.figure.figure


def _start(mechanism: Mechanism, sample: int) -> Configuration:
    try:
        return assembled(mechanism, sample)
    except AssemblyError as error:
        warn(f"the bodies are drawn as they are given, since they cannot be assembled: {error}")
        return given(mechanism, sample)


def _canvas(scene: Scene, axes: Axes | None, *, names: bool, dimensions: bool) -> Canvas:
    """Return a canvas that the mechanism fits on."""
    lowest, highest = _extent(scene)
    new, axes = axes is None, axes or Figure().add_subplot()
    figure = axes.figure.figure
    axes.set(xlabel="X [m]", ylabel="Y [m]")
    axes.spines[:].set_color(GREY)
    axes.tick_params(color=GREY, labelsize=8)
    if new:
        space = POINTS_PER_INCH * (MAX_FIGURE - LEFT_BOTTOM - RIGHT_TOP)
    else:
        figure.draw_without_rendering()  # computes the layout
        space = np.array(axes.get_window_extent().size) * POINTS_PER_INCH / figure.dpi
    margin = min(MAX_MARGIN, 0.2 * space.min())
    unit = ((highest - lowest) / (space - 2 * margin)).max() or 1.0 / POINTS_PER_INCH
    if new:
        space = np.maximum((highest - lowest) / unit + 2 * margin, MIN_AXES * POINTS_PER_INCH)
        size = space / POINTS_PER_INCH
        width, height = LEFT_BOTTOM + size + RIGHT_TOP
        figure.set_size_inches(width, height)
        axes.set_position((*(LEFT_BOTTOM / (width, height)), *(size / (width, height))))
    middle, half = (lowest + highest) / 2, unit * space / 2
    box = np.array([middle - half, middle + half])
    return Canvas(axes, box, unit, names=names, dimensions=dimensions)


def _extent(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest coordinates of the mechanism [m]."""
    mechanism = scene.mechanism
    shapes = [scene.outline(name) for name in mechanism.bodies]
    for part in (*mechanism.joints.values(), *mechanism.loads.values()):
        shapes += [scene.at(point)[None] for point in part.points]
        shapes += [circle(*pitch) for pitch in scene.pitch_circles(part)]
        if isinstance(part, Rack):
            shapes += [np.array(scene.rack_line(part))]
    points = np.concatenate(shapes)
    return points.min(axis=0), points.max(axis=0)
