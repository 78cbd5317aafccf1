"""The shapes of a mechanism over its whole motion."""

from __future__ import annotations

import numpy as np

from flexband.report.shapes.mechanism import sketch_mechanism
from flexband.report.shapes.sketch import Sketch


def unit_directions(direction: np.ndarray) -> np.ndarray:
    """Return directions (..., tracks, 2, times) of length 1; those of length 0 stay so."""
    length = np.sqrt((direction**2).sum(axis=-2, keepdims=True))
    return direction / np.where(length > 0, length, 1.0)


def sketch_in_motion(
    start: Sketch, position: np.ndarray, direction: np.ndarray, unit: float
) -> Sketch:
    """Return the shapes of a sketch for all instants, with guides as long as their sliders need.

    Parameters
    ----------
    start : the shapes at the start.
    position, direction : places [m] and unit vectors, shape (tracks, 2, times).
    unit : metres per point.
    """
    along = {
        name: ((position[slider] - position[guide]) * direction[turn]).sum(axis=0)
        for name, (slider, guide, turn) in start.guides.items()
    }
    ranges = {name: (float(x.min()), float(x.max())) for name, x in along.items()}
    return sketch_mechanism(start.scene, start.tracks, unit, ranges=ranges, gaps=start.gaps)
