"""Draw a mechanism at its assembled start, with its joints, loads and dimensions."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexband.mechanics.configuration import assembled
from flexband.mechanics.joints.gears import Rack
from flexband.mechanics.loads.loads import Gravity
from flexband.mechanics.mechanism import Mechanism
from flexband.report.drawing.bodies import draw_body
from flexband.report.drawing.canvas import GREY, Canvas
from flexband.report.drawing.joints import draw_joint
from flexband.report.drawing.loads import draw_load
from flexband.report.drawing.round_symbols import circle
from flexband.report.drawing.scene import Scene
from flexband.report.drawing.words import write

LARGEST, SMALLEST = np.array([8.0, 6.0]), np.array([2.5, 1.8])
"""Size of a figure, and of the axes in it [in]."""
LEFT_BOTTOM, RIGHT_TOP = np.array([0.75, 0.55]), np.array([0.15, 0.15])
"""Room beside the axes, for their numbers [in]."""
MARGIN = 60.0
"""From what is drawn to the edge of the axes [pt]."""
POINTS_AN_INCH = 72.0


def draw(
    mechanism: Mechanism,
    *,
    sample: int = 0,
    dimensions: bool = True,
    names: bool = True,
    axes: Axes | None = None,
) -> Figure:
    """Draw a mechanism where it starts, its joints assembled.

    Rigid bodies are links or plates through their named points with the centre of mass marked, or
    dashed circles of their radius of gyration where they have one point only. Beams are as high as
    they are. Arrows show which way forces act and drives move at the start, not how much. What
    is of a kind not known here is a diamond at the first point it names.

    Parameters
    ----------
    sample : which sample to draw, where parameters are arrays.
    dimensions : whether to write the lengths of bodies and rods.
    names : whether to write the names of bodies, joints and loads.
    axes : where to draw; a figure of its own, at most 8 by 6 inches, where None.

    Returns
    -------
    The figure. Its artists carry what they belong to as their gid: "body 'crank'", "joint 'A'",
    "load 'gravity'".

    Raises
    ------
    InputError
        Where the mechanism has no such sample or numbers of samples do not fit each other.
    AssemblyError
        Where the constraints of this sample cannot be met.
    """
    scene = Scene(mechanism, assembled(mechanism, sample))
    canvas = _canvas(scene, axes, names=names, dimensions=dimensions)
    for name in mechanism.bodies:
        draw_body(scene, canvas, name)
    for name in mechanism.joints:
        draw_joint(scene, canvas, name)
    fields = [name for name, load in mechanism.loads.items() if isinstance(load, Gravity)]
    for name in (*(name for name in mechanism.loads if name not in fields), *fields):
        draw_load(scene, canvas, name)  # gravity last: it goes where there is room
    write(canvas)
    canvas.axes.update_datalim(canvas.box)  # what is drawn there later leaves room for the names
    canvas.axes.margins(0.0)
    canvas.axes.autoscale_view()
    canvas.axes.set_aspect("equal", adjustable="datalim")
    return canvas.axes.figure.figure


def _canvas(scene: Scene, axes: Axes | None, *, names: bool, dimensions: bool) -> Canvas:
    """Return paper on which the mechanism fits."""
    mechanism = scene.mechanism
    parts = (*mechanism.joints.values(), *mechanism.loads.values())
    named = [scene.at(point) for part in parts for point in part.points]
    named += [end for part in parts if isinstance(part, Rack) for end in scene.rack_line(part)]
    circles = [circle(*pitch) for part in parts for pitch in scene.pitch_circles(part)]
    outlines = [*map(scene.outline, mechanism.bodies), *circles]
    points = np.concatenate([*outlines, np.reshape(named, (-1, 2))])
    lowest, highest = points.min(axis=0), points.max(axis=0)
    own, axes = axes is None, Figure().add_subplot() if axes is None else axes
    figure = axes.figure.figure
    axes.set(xlabel="X [m]", ylabel="Y [m]")
    axes.spines[:].set_color(GREY)
    axes.tick_params(color=GREY, labelsize=8)
    if own:
        room = POINTS_AN_INCH * (LARGEST - LEFT_BOTTOM - RIGHT_TOP)
    else:
        figure.draw_without_rendering()  # so that its layout is known
        room = np.array(axes.get_window_extent().size) * POINTS_AN_INCH / figure.dpi
    margin = min(MARGIN, 0.2 * room.min())
    unit = ((highest - lowest) / (room - 2 * margin)).max() or 1.0 / POINTS_AN_INCH
    if own:
        room = np.maximum((highest - lowest) / unit + 2 * margin, SMALLEST * POINTS_AN_INCH)
        size = room / POINTS_AN_INCH
        width, height = LEFT_BOTTOM + size + RIGHT_TOP
        figure.set_size_inches(width, height)
        axes.set_position((*(LEFT_BOTTOM / (width, height)), *(size / (width, height))))
    middle, half = (lowest + highest) / 2, unit * room / 2
    box = np.array([middle - half, middle + half])
    return Canvas(axes, box, unit, names=names, dimensions=dimensions)
