"""All shapes of a mechanism."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexband.report.shapes.bodies import add_body
from flexband.report.shapes.joints import add_joint
from flexband.report.shapes.loads import add_load
from flexband.report.shapes.scene import Scene
from flexband.report.shapes.sketch import Sketch
from flexband.report.shapes.tracks import Tracks


def sketch_mechanism(
    scene: Scene,
    tracks: Tracks,
    unit: float = 1.0,
    *,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    gaps: int = 24,
) -> Sketch:
    """Return the shapes of a mechanism; see `Sketch` for the parameters."""
    sketch = Sketch(scene, tracks, unit, ranges or {}, gaps)
    mechanism = scene.mechanism
    for name, body in mechanism.bodies.items():
        add_body(body, sketch, name)
    for name, joint in mechanism.joints.items():
        add_joint(joint, sketch, name)
    for name, load in mechanism.loads.items():
        add_load(load, sketch, name)
    return sketch


def extent(sketch: Sketch, position: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return extremes of shapes [m], (2, 2), from positions and directions (tracks, 2, ...)."""
    places = [np.moveaxis(position, 1, -1).reshape(-1, 2)]
    for stroke in (stroke for line in sketch.lines for stroke in line.strokes):
        places.append(np.moveaxis(stroke.places(position, direction), 1, -1).reshape(-1, 2))
    everything = np.concatenate(places)
    return np.array([np.nanmin(everything, axis=0), np.nanmax(everything, axis=0)])
