"""The pictures of a motion, drawn one after another on the same axes of Matplotlib."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from flexband.report.drawing.canvas import Canvas, Label
from flexband.report.drawing.draw import MatplotlibSurface, labelled_axes
from flexband.report.drawing.recording import Recording
from flexband.report.drawing.sheet import AFTER, BEFORE, POINTS_PER_INCH, Sheet, sheet_for
from flexband.report.drawing.words import PlacedLabel, place_labels, write_label
from flexband.report.shapes.motion import sketch_in_motion
from flexband.report.shapes.shapes import Line, Stroke
from flexband.report.shapes.sketch import Outline, Sketch, circle

OTHER = Line(color="realization", width=1.2, layer=8.5)
"""How bodies of other samples are drawn."""

REGION = Line(color="load", fill="load", width=0.8, alpha=0.4, layer=9.0)
"""How the region of a point is drawn."""

PATH = Line(color="load", width=0.8, layer=0.9)
"""How the path of a point is drawn."""


class Region(NamedTuple):
    """Where a point may be while it moves."""

    path: np.ndarray  # the nominal path [m], shape (instants, 2)
    outlines: np.ndarray  # polygon in each picture [m], (pictures, vertices, 2); NaN without one


class MovingLabel(NamedTuple):
    """A name that keeps its distance from what it belongs to."""

    placed: PlacedLabel  # at the first picture
    stroke: Stroke | None  # what it belongs to; None for a place that is fixed


@dataclass(frozen=True)
class Film:
    """Axes, and what is drawn on them in every picture."""

    axes: Axes
    canvas: Canvas  # at the first picture
    sketch: Sketch  # the shapes that move
    labels: Sequence[MovingLabel]
    recording: Recording
    regions: Mapping[str, Region]  # by the name of the point

    def pictures(self) -> Iterator[np.ndarray]:
        """Draw the pictures, each an array of RGB values of shape (height, width, 3)."""
        figure = self.axes.figure.figure
        surface = FigureCanvasAgg(figure)
        surface.draw()
        still = surface.copy_from_bbox(figure.bbox)
        for k, text in enumerate(_time_texts(self.recording.times)):
            surface.restore_region(still)
            with _removed_afterwards(self.axes) as moving:
                self._draw(k)
                self.axes.text(0.01, 0.985, text, fontsize=9.0, va="top", zorder=11.0,
                               transform=self.axes.transAxes)  # fmt: skip
                for artist in sorted(moving(), key=Artist.get_zorder):
                    self.axes.draw_artist(artist)
            yield np.array(np.asarray(surface.buffer_rgba())[..., :3])

    def _draw(self, k: int) -> None:
        """Draw what moves, as it is in the picture of a number."""
        recording = self.recording
        canvas = replace(
            self.canvas,
            position=recording.position[0, ..., k],
            direction=recording.direction[..., k],
            keeps_ink=False,
        )
        for other in recording.position[1:, ..., k]:
            for outline in self.sketch.outlines:
                _draw_outline(canvas, outline, other)
        canvas.draw(self.sketch)
        for region in self.regions.values():
            if np.isfinite(region.outlines[k]).all():
                canvas.area(region.outlines[k], REGION)
        for placed, stroke in self.labels:
            place = placed.label.place
            now = place if stroke is None else canvas.places(stroke).mean(axis=0)
            label = placed.label._replace(place=now)
            moved = placed._replace(label=label, centre=placed.centre + now - place)
            write_label(canvas, moved)


def film_of(
    recording: Recording, regions: Mapping[str, Region], dpi: float, *, names: bool
) -> Film:
    """Return a film whose sides and axes are the same in all pictures."""
    positions = recording.position[0]
    sheet = sheet_for(_extremes(recording, regions))
    sketch = sketch_in_motion(recording.sketch, positions, recording.direction, sheet.unit)
    axes = _fixed_axes(sheet, dpi)
    canvas = Canvas(
        MatplotlibSurface(axes), sheet.box, sheet.unit, positions[..., 0],
        recording.direction[..., 0], names=names, dimensions=False,
    )  # fmt: skip
    # What stays is drawn once, where the motion leaves space.
    paths = recording.paths | {name: region.path for name, region in regions.items()}
    for path in paths.values():
        canvas.line(path, PATH)
    canvas.add_ink(np.moveaxis(positions, 1, -1).reshape(-1, 2))
    for arrow in sketch.fields:
        canvas.draw_field(arrow)
    fixed = [(label, None) for label in canvas.labels]
    # Names are placed about the shapes of the first picture.
    moving = replace(
        sketch, lines=[line for line in sketch.lines if not line.start_only], names=[], fields=[]
    )
    with _removed_afterwards(axes):
        canvas.draw(moving)
    for name in sketch.names:
        canvas.draw_name(name)
    strokes = [name.stroke for name in sketch.names if names and name.stroke is not None]
    owners = [*fixed, *zip(canvas.labels[len(fixed) :], strokes, strict=True)]
    labels = [
        MovingLabel(placed, _owner(placed.label, owners))
        for placed in place_labels(canvas, canvas.labels)
    ]
    return Film(axes, canvas, moving, labels, recording, regions)


def _extremes(recording: Recording, regions: Mapping[str, Region]) -> np.ndarray:
    """Return the lowest and highest coordinates of all that is drawn [m], shape (2, 2)."""
    places = [recording.extremes()]
    for path, outlines in regions.values():
        places += [path, outlines.reshape(-1, 2)]
    everything = np.concatenate(places)
    return np.array([np.nanmin(everything, axis=0), np.nanmax(everything, axis=0)])


def _fixed_axes(sheet: Sheet, dpi: float) -> Axes:
    """Return axes of a new figure; its sides are even numbers of pixels, as films need them."""
    total = BEFORE + sheet.space + AFTER
    pixels = 2 * np.ceil(total * dpi / POINTS_PER_INCH / 2)
    width, height = pixels / dpi
    axes = labelled_axes(Figure(figsize=(width, height), dpi=dpi))
    axes.set_position((*(BEFORE / total), *(sheet.space / total)))
    (left, bottom), (right, top) = sheet.box
    axes.set(xlim=(left, right), ylim=(bottom, top), autoscale_on=False)
    axes.set_aspect("equal", adjustable="box")
    return axes


def _draw_outline(canvas: Canvas, outline: Outline, position: np.ndarray) -> None:
    """Draw a body of another sample, from the positions of its tracks [m], shape (tracks, 2)."""
    points = position[list(outline.points)]
    if outline.radius:
        canvas.line(points[0] + circle(outline.radius, 60), OTHER)
    elif len(points) == 1:
        canvas.line(points + circle(5.5 * canvas.unit, 24), OTHER)
    canvas.line(np.concatenate([points, points[: int(outline.closed)]]), OTHER)


def _owner(label: Label, owners: Sequence[tuple[Label, Stroke | None]]) -> Stroke | None:
    """Return the stroke of the label that is at the place of another one."""
    return next(stroke for own, stroke in reversed(owners) if own.place is label.place)


def _time_texts(times: np.ndarray) -> list[str]:
    """Return times [s] in words, in as many digits as tell them apart."""
    step = float(np.diff(times).max(initial=0.0)) or 1.0
    digits = max(0, int(np.ceil(1.0 - np.log10(step))))
    return [f"t = {time:.{digits}f} s".replace("-", "−") for time in times.tolist()]


@contextmanager
def _removed_afterwards(axes: Axes) -> Iterator[Callable[[], list[Artist]]]:
    """Remove what is drawn on axes inside the context; give the function that returns it."""

    def artists() -> list[Artist]:
        return [*axes.lines, *axes.patches, *axes.texts]

    before = set(artists())

    def new_artists() -> list[Artist]:
        return [artist for artist in artists() if artist not in before]

    try:
        yield new_artists
    finally:
        for artist in new_artists():
            artist.remove()
