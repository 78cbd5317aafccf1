"""Sheets: how large the drawing of a mechanism is, and at which scale."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

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

POINTS_PER_INCH = 72.0

BEFORE = np.array([54.0, 39.6])
AFTER = np.array([10.8, 10.8])
"""Margins of a sheet [pt], for the numbers of its axes: left and below, right and above."""

LARGEST = POINTS_PER_INCH * np.array([8.0, 6.0])
"""Width and height [pt] of a sheet with its margins, at most."""


class Sheet(NamedTuple):
    """Where a mechanism is drawn."""

    box: np.ndarray  # lower left and upper right corner [m], shape (2, 2)
    unit: float  # metres per point
    space: np.ndarray  # width and height between the margins [pt]


def sheet_for(
    extremes: np.ndarray,
    space: np.ndarray | None = None,
    *,
    largest: np.ndarray = LARGEST,
    around: np.ndarray | None = None,
) -> Sheet:
    """Return a sheet for extremes [m], shape (2, 2), and the symbols and names around them.

    Parameters
    ----------
    space : width and height between the margins [pt]; None for as large as needed.
    largest : width and height with the margins [pt], at most.
    around : space from the extremes on [pt], shape (2, 2): left and below, right and above; None
        for what suits any mechanism.
    """
    smallest = POINTS_PER_INCH * np.array([2.5, 1.8])
    max_size = largest - BEFORE - AFTER if space is None else space
    if around is None:
        around = np.full((2, 2), min(60.0, 0.2 * max_size.min()))
    lowest, highest = extremes
    symbols = around.sum(axis=0)
    unit = ((highest - lowest) / (max_size - symbols)).max() or 1.0 / POINTS_PER_INCH
    natural_size = np.maximum((highest - lowest) / unit + symbols, smallest)
    size = natural_size if space is None else space
    middle = (lowest + highest + unit * (around[1] - around[0])) / 2
    half = unit * size / 2
    return Sheet(np.array([middle - half, middle + half]), unit, size)


def space_around(canvas: Canvas, extremes: np.ndarray) -> np.ndarray:
    """Return how far [pt] ink reaches beyond extremes [m], with a little space, shape (2, 2)."""
    space = 8.0
    ink = canvas.all_ink()
    reach = np.array([extremes[0] - ink.min(axis=0), ink.max(axis=0) - extremes[1]])
    return np.maximum(reach / canvas.unit, 0.0) + space


@dataclass(frozen=True)
class Drawing:
    """A mechanism at its start, which can be drawn on any sheet."""

    scene: Scene
    tracks: Tracks
    extremes: np.ndarray  # lowest and highest coordinates of its shapes [m], shape (2, 2)

    @classmethod
    def at_start(cls, mechanism: Mechanism, sample: int = 0) -> Drawing:
        """Return the drawing of a sample; see `draw`."""
        scene = Scene(mechanism, _start(mechanism, sample))
        tracks = Tracks(mechanism)
        first = sketch_mechanism(scene, tracks)
        return cls(scene, tracks, extent(first, *tracks.at_start(scene.start)))

    def draw_on(
        self,
        surface: Surface,
        sheet: Sheet,
        *,
        names: bool = True,
        dimensions: bool = True,
        fields: bool = True,
    ) -> Canvas:
        """Draw on a surface, with or without names, lengths and the arrows of fields."""
        sketch = sketch_mechanism(self.scene, self.tracks, sheet.unit, gaps=48)
        start = self.tracks.at_start(self.scene.start)
        canvas = Canvas(surface, sheet.box, sheet.unit, *start, names=names, dimensions=dimensions)
        canvas.draw(sketch if fields else replace(sketch, fields=[]))
        write(canvas)
        return canvas


def _start(mechanism: Mechanism, sample: int) -> Configuration:
    try:
        return assembled_configuration(mechanism, sample)
    except AssemblyError as error:
        warn(f"the bodies are drawn as they are given, since they cannot be assembled: {error}")
        return given_configuration(mechanism, sample)
