"""Names and dimensions, written where there is little ink."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from flexband.report.drawing.canvas import Canvas, Dimension, Label, Lettering
from flexband.report.shapes.shapes import Line


def write(canvas: Canvas) -> None:
    """Write dimensions, names and notes; the longest names come first."""
    short = [d for d in canvas.measured if not _write_dimension(canvas, d)]
    grey = Lettering("length")
    labels = canvas.labels + [Label(p.mean(axis=0), text, False, grey) for p, text, _ in short]
    for placed in place_labels(canvas, labels):
        write_label(canvas, placed)
    if canvas.notes:
        canvas.surface.note("without a place: " + ", ".join(canvas.notes))


class PlacedLabel(NamedTuple):
    """A label, and where it is written."""

    label: Label
    centre: np.ndarray  # of the text [m]
    with_leader: bool  # whether a line connects the text with its place


def place_labels(canvas: Canvas, labels: list[Label]) -> Iterator[PlacedLabel]:
    """Give labels, those of the same place joined, each where it covers the least ink so far."""
    boxes: list[tuple[np.ndarray, np.ndarray]] = []
    merged = sorted(_merge_labels(canvas, labels), key=lambda label: -len(label.text))
    yield from (_place_label(canvas, label, boxes) for label in merged)


def write_label(canvas: Canvas, placed: PlacedLabel) -> None:
    """Write a name, and the line to its place."""
    label, centre, with_leader = placed
    if with_leader:
        half = canvas.surface.extent(label.text, label.lettering) * canvas.unit / 2
        anchor = np.clip(label.place, centre - half, centre + half)
        leader = Line(strokes=(), color="length", width=0.5, layer=2.0)
        canvas.line(np.array([label.place, anchor]), leader)
    canvas.surface.text(centre, label.text, label.lettering)
    half = canvas.surface.extent(label.text, label.lettering) * canvas.unit / 2
    canvas.add_ink(np.array([centre - half, centre + half]))


def _write_dimension(canvas: Canvas, dimension: Dimension) -> bool:
    """Draw a length beside its line; return False if the line is too short for the text."""
    # Distances [pt] of a dimension from its line that are tried
    dimension_distances = (20.0, 32.0, 44.0)
    points, text, beside = dimension
    width, height = canvas.surface.extent(text, Lettering())
    if np.linalg.norm(np.diff(points, axis=0), axis=1).sum() < (width + 12.0) * canvas.unit:
        return False
    slopes = np.gradient(points, axis=0)
    slopes /= np.linalg.norm(slopes, axis=1)[:, None]
    normals = np.stack([-slopes[:, 1], slopes[:, 0]], axis=1)
    offsets = [beside + distance * canvas.unit for distance in dimension_distances]
    lines = [points + side * offset * normals for offset in offsets for side in (1, -1)]
    ink = canvas.all_ink()[::3]
    best = lines[
        int(np.argmin([_count_ink(canvas, ink, line) + k for k, line in enumerate(lines)]))
    ]
    thin = Line(strokes=(), color="length", width=0.6, layer=1.5, head=6.0)
    first, second = np.array_split(_resample(best), 2)
    for half in (first[::-1], second):
        canvas.arrow(half, thin)
    for a, b in ((points[0], best[0]), (points[-1], best[-1])):
        reach = float(np.linalg.norm(b - a)) / canvas.unit
        canvas.line(canvas.local(a, b - a, [(6.0, 0.0), (reach + 3.0, 0.0)]), thin)
    along = second[1] - first[-1]
    angle = (np.degrees(np.arctan2(along[1], along[0])) + 89.9) % 180.0 - 89.9  # never upside down
    lettering = Lettering("length", size=8.0, angle=angle, backed=True, layer=9.0)
    canvas.surface.text(second[0], text, lettering)
    for side in (-0.5, 0.0, 0.5):
        ends = [(-width / 2, side * height), (width / 2, side * height)]
        canvas.add_ink(canvas.local(second[0], along, ends))
    return True


def _count_ink(canvas: Canvas, ink: np.ndarray, line: np.ndarray) -> int:
    """Count the points of ink near a line."""
    differences = ink[:, None] - canvas.dense(line)[None, ::4]
    return int(
        (np.hypot(differences[..., 0], differences[..., 1]).min(axis=1) < 9.0 * canvas.unit).sum()
    )


def _resample(line: np.ndarray) -> np.ndarray:
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    even = np.linspace(0.0, way[-1], 100)
    return np.stack([np.interp(even, way, axis) for axis in line.T], axis=1)


def _merge_labels(canvas: Canvas, labels: list[Label]) -> list[Label]:
    """Return the labels, with those of the same place and style joined."""
    merged: dict[Any, Label] = {}
    for label in labels:
        key = (*np.round(label.place / canvas.unit), label.lettering)
        text = f"{merged[key].text}, {label.text}" if key in merged else label.text
        merged[key] = label._replace(text=text)
    return list(merged.values())


def _place_label(
    canvas: Canvas, label: Label, boxes: list[tuple[np.ndarray, np.ndarray]]
) -> PlacedLabel:
    """Place a name where it covers least, and add its centre and size [m] to the boxes."""
    # Cost of a distance of 1 pt, and of text on text or outside the axes, in points of covered ink
    distance_cost = 0.1
    overlap_cost = 100.0
    leader_distance = 20.0  # distance [pt] from which on a line connects a name with its place
    label_padding = 3.0  # free space [pt] around a name
    turns = np.arange(0.0, 2.0, 0.125) * np.pi
    label_directions = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    # Distances [pt] of a name from its place that are tried
    label_distances = np.array([7.0, 11.0, 16.0, 22.0, 30.0, 40.0, 55.0])
    size = canvas.surface.extent(label.text, label.lettering) * canvas.unit
    low, high = canvas.box
    distances = np.repeat(label_distances, len(turns))
    directions = np.tile(label_directions, (len(label_distances), 1))
    centres = label.place + directions * (distances[:, None] * canvas.unit + size / 2)
    if label.inside:
        distances = np.append(0.0, distances)
        centres = np.vstack([label.place, centres])
    half = size / 2 + label_padding * canvas.unit
    ink = canvas.all_ink()
    ink = ink[np.all(np.abs(ink - label.place) < np.ptp(centres, axis=0) + half, axis=1)]
    cost = distance_cost * distances + _within(ink, centres, half).sum(axis=1)
    cost += overlap_cost * np.any((centres - half < low) | (centres + half > high), axis=1)
    for middle, extent in boxes:
        cost += overlap_cost * _within(middle[None], centres, half + extent / 2)[:, 0]
    best = int(np.argmin(cost))
    boxes.append((centres[best], size))
    return PlacedLabel(label, centres[best], bool(distances[best] > leader_distance))


def _within(points: np.ndarray, centres: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Return which points are in boxes of half a size, shape (centres, points)."""
    x, y = (np.abs(points[:, k] - centres[:, k, None]) < half[k] for k in range(2))
    return x & y
