"""Vectors of a mechanism that shapes are placed by, at its start or over time."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flexband.mechanics.configuration import Configuration
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.kernels.forms import Form, Vector, section_normal
from flexband.mechanics.kernels.relation_forms import along
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.sensors.forces import Reaction
from flexband.mechanics.sensors.motion import Sensor, SensorModel

KINDS = ("position", "direction", "force")


@dataclass(frozen=True)
class Track(Sensor):
    """A vector in global axes: outputs "_X" and "_Y"."""

    vector: Callable[[SensorModel], Vector]
    units = (("_X", ""), ("_Y", ""))

    def rows(self, model: SensorModel) -> Vector:
        return self.vector(model)


class Tracks:
    """Positions [m], directions of any length, and forces [N], numbered as they are made."""

    def __init__(self, mechanism: Mechanism):
        self.mechanism = mechanism
        self._tracks: dict[str, dict[Hashable, Track]] = {kind: {} for kind in KINDS}

    def point(self, point: PointName) -> int:
        self.mechanism.model.frame(point)  # refuses points that do not exist
        return self.position(lambda model: model.frame(point).position, _key(point))

    def position(self, vector: Callable[[SensorModel], Vector], key: Hashable) -> int:
        """Return the number of a position; one of the same key is recorded once."""
        return self._number("position", vector, key)

    def turn(self, point: PointName) -> int:
        """Return the number of the normal of the section at a point, which turns with a body."""
        return self._number(
            "direction", lambda model: section_normal(model.frame(point)), _key(point)
        )

    def axis(self, point: PointName, axis: tuple[float, float]) -> int:
        """Return the number of a direction that is given in the frame of a point."""
        key = ("axis", _key(point), *axis)
        return self._number("direction", lambda model: along(model.frame(point), axis), key)

    def at_start(self, start: Configuration) -> tuple[np.ndarray, np.ndarray]:
        """Return positions [m] and directions at the start, each of shape (tracks, 2)."""
        model = self.mechanism.model
        tables = [
            np.reshape([start.vector(track.vector(model)) for track in tracks.values()], (-1, 2))
            for tracks in (self._tracks["position"], self._tracks["direction"])
        ]  # fmt: skip
        return tables[0], tables[1]

    def force(self, vector: Callable[[SensorModel], Vector], key: Hashable) -> int:
        return self._number("force", vector, key)

    def reaction(self, joint: str) -> int | None:
        """Return the number of the force that a joint exerts on its first body, if there is one."""
        constraint, multipliers = self.mechanism.model.joint(joint)
        if constraint.force(self.mechanism.model.frame, multipliers) is None:
            return None
        return self.force(lambda model: _pair(Reaction(joint).rows(model)), ("reaction", joint))

    def _number(self, kind: str, vector: Callable[[SensorModel], Vector], key: Hashable) -> int:
        tracks = self._tracks[kind]
        tracks.setdefault(key, Track(vector))
        return list(tracks).index(key)

    @property
    def sensors(self) -> dict[str, Sensor]:
        """All tracks as sensors of a mechanism."""
        return {
            f"{kind} {k}": track
            for kind, tracks in self._tracks.items()
            for k, track in enumerate(tracks.values())
        }

    def split(self, outputs: ArrayLike) -> dict[str, np.ndarray]:
        """Return outputs (samples, outputs, times) by kind, (samples, tracks, 2, times) each."""
        values = np.asarray(outputs, dtype=float)
        samples, rows, times = values.shape
        counts = [len(tracks) for tracks in self._tracks.values()]
        vectors = values.reshape(samples, rows // 2, 2, times)
        parts = np.split(vectors, np.cumsum(counts)[:-1], axis=1)
        return dict(zip(KINDS, parts, strict=True))


def _key(point: PointName) -> Hashable:
    """Return what is equal for the same points."""
    if isinstance(point, str):
        return point if "." in point else f"{point}.center"
    return tuple(np.asarray(coordinate).tobytes() for coordinate in point)


def _pair(rows: Sequence[Form]) -> Vector:
    x, y = rows
    return x, y
