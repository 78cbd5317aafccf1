"""All shapes of a mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from flexband.mechanics.loads.loads import Gravity
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
    sketch, mechanism = Sketch(scene, tracks, unit, ranges or {}, gaps), scene.mechanism
    for name, body in mechanism.bodies.items():
        add_body(body, sketch, name)
    for name, joint in mechanism.joints.items():
        add_joint(joint, sketch, name)
    loads = mechanism.loads
    for name in sorted(loads, key=lambda name: isinstance(loads[name], Gravity)):
        add_load(loads[name], sketch, name)  # gravity comes last, since it may be anywhere
    return sketch


def extent(sketch: Sketch, position: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return the lowest and the highest coordinates of shapes [m], shape (2, 2).

    Parameters
    ----------
    position, direction : those of all numbers, shape (tracks, 2, ...).
    """
    places = [np.moveaxis(position, 1, -1).reshape(-1, 2)]
    for shape in sketch.shapes:
        for stroke in shape.extremes():
            vertices = stroke.vertices[np.isfinite(stroke.vertices).all(axis=1)]
            frames = stroke.frames if len(vertices) == len(stroke.vertices) else stroke.frames[:1]
            part = replace(stroke, frames=frames, vertices=vertices)
            places.append(np.moveaxis(part.places(position, direction), 1, -1).reshape(-1, 2))
    everything = np.concatenate(places)
    return np.array([everything.min(axis=0), everything.max(axis=0)])
