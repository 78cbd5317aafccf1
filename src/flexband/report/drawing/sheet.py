"""Sheets: how large the drawing of a mechanism is, and at which scale."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np

from flexband.basics.warning import warn
from flexband.errors import AssemblyError
from flexband.mechanics.configuration import (
    Configuration,
    assembled_configuration,
    given_configuration,
)
from flexband.mechanics.model.mechanism import Mechanism
from flexband.report.drawing.canvas import Canvas, Surface
from flexband.report.drawing.words import write
from flexband.report.shapes.mechanism import extent, sketch_mechanism
from flexband.report.shapes.scene import Scene
from flexband.report.shapes.tracks import Tracks

S = TypeVar("S", bound=Surface)

POINTS_PER_INCH = 72.0

BEFORE = np.array([54.0, 39.6])
AFTER = np.array([10.8, 10.8])
"""Margins of a sheet [pt], for the numbers of its axes: left and below, right and above."""


class Sheet(NamedTuple):
    """Where a mechanism is drawn."""

    box: np.ndarray  # lower left and upper right corner [m], shape (2, 2)
    unit: float  # metres per point
    space: np.ndarray  # width and height between the margins [pt]


def sheet_for(extremes: np.ndarray, space: np.ndarray | None = None) -> Sheet:
    """Return a sheet for extremes (2, 2) [m] and symbols, as large as needed or as `space` [pt]."""
    smallest, largest = POINTS_PER_INCH * np.array([[2.5, 1.8], [8.0, 6.0]])
    max_size = largest - BEFORE - AFTER if space is None else space
    margin = min(60.0, 0.2 * max_size.min())
    lowest, highest = extremes
    unit = ((highest - lowest) / (max_size - 2 * margin)).max() or 1.0 / POINTS_PER_INCH
    natural_size = np.maximum((highest - lowest) / unit + 2 * margin, smallest)
    size = natural_size if space is None else space
    middle = (lowest + highest) / 2
    half = unit * size / 2
    return Sheet(np.array([middle - half, middle + half]), unit, size)


def draw_on(
    surface_for: Callable[[np.ndarray], tuple[S, Sheet]],
    mechanism: Mechanism,
    sample: int = 0,
    *,
    names: bool = True,
    dimensions: bool = True,
) -> S:
    """Draw a mechanism at its start on a surface of its extremes, and return it; see `draw`."""
    scene = Scene(mechanism, _start(mechanism, sample))
    tracks = Tracks(mechanism)
    first = sketch_mechanism(scene, tracks)
    surface, (box, unit, _) = surface_for(extent(first, *tracks.at_start(scene.start)))
    sketch = sketch_mechanism(scene, tracks, unit, gaps=48)
    start_tracks = tracks.at_start(scene.start)
    canvas = Canvas(surface, box, unit, *start_tracks, names=names, dimensions=dimensions)
    canvas.draw(sketch)
    write(canvas)
    return surface


def _start(mechanism: Mechanism, sample: int) -> Configuration:
    try:
        return assembled_configuration(mechanism, sample)
    except AssemblyError as error:
        warn(f"the bodies are drawn as they are given, since they cannot be assembled: {error}")
        return given_configuration(mechanism, sample)
