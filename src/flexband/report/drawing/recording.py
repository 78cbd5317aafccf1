"""The motion of a mechanism as an animation draws it: its shapes, and where they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from flexband.mechanics.configuration import assembled_configuration
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.model.mechanism import Mechanism
from flexband.report.shapes.mechanism import extent, sketch_mechanism
from flexband.report.shapes.motion import unit_directions
from flexband.report.shapes.scene import Scene
from flexband.report.shapes.sketch import Sketch
from flexband.report.shapes.tracks import Tracks


@dataclass(frozen=True)
class Recording:
    """The shapes of one sample, and the motion of all samples that are drawn."""

    sketch: Sketch  # of the first sample at its start
    times: np.ndarray  # of the pictures [s], shape (pictures,)
    position: np.ndarray  # [m], shape (samples, tracks, 2, pictures)
    direction: np.ndarray  # unit vectors of the first sample, shape (tracks, 2, pictures)
    paths: dict[str, np.ndarray]  # point -> its path [m], shape (times of the simulation, 2)

    def extremes(self) -> np.ndarray:
        """Return the lowest and highest coordinates of all that is drawn [m], shape (2, 2)."""
        low, high = extent(self.sketch, self.position[0], self.direction)
        places = np.moveaxis(self.position, 2, -1).reshape(-1, 2)
        if len(places):
            low, high = np.minimum(low, places.min(axis=0)), np.maximum(high, places.max(axis=0))
        return np.array([low, high])


def nearest_places(instants: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the place of the instant that is nearest to each time, among increasing instants."""
    after = np.clip(np.searchsorted(instants, times), 1, max(1, len(instants) - 1))
    before = after - 1
    after = np.minimum(after, len(instants) - 1)
    return np.where(times - instants[before] <= instants[after] - times, before, after)


def record(
    mechanism: Mechanism,
    samples: Sequence[int],
    points: dict[str, PointName],
    times: np.ndarray,
    simulated: Callable[[Mechanism], xr.DataArray],
) -> Recording:
    """Simulate a mechanism and return its motion at the outputs that are nearest to times [s].

    `points` are those whose paths are kept, by name; `simulated` returns the outputs of sensors.
    """
    scene = Scene(mechanism, assembled_configuration(mechanism, samples[0]))
    tracks = Tracks(mechanism)
    sketch = sketch_mechanism(scene, tracks, gaps=48)
    numbers = {name: tracks.point(point) for name, point in points.items()}
    motion = simulated(replace(mechanism, sensors=tracks.sensors))
    outputs = motion.values[list(samples)] if "sample" in motion.dims else motion.values[None]
    parts = tracks.split(outputs)
    output_times = motion["time"].values
    nearest = nearest_places(output_times, output_times[0] + times)
    return Recording(
        sketch,
        output_times[nearest],
        parts["position"][..., nearest],
        unit_directions(parts["direction"][0][..., nearest]),
        {name: parts["position"][0, number].T for name, number in numbers.items()},
    )
