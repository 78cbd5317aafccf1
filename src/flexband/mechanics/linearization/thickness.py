"""Modes of thickness: vibrations of the length of the sections' directions d.

Timoshenko's beam has no such motion, since its sections are rigid. In the default element |d| may
change: at the nodes with r_y, between them with r_x as well.
"""

from __future__ import annotations

import numpy as np

from flexband.mechanics.bodies.beam import DIRECTION, Beam
from flexband.mechanics.model.mechanism import Mechanism


class Thickness:
    """The sections of all beams without an integration rule."""

    def __init__(self, mechanism: Mechanism):
        self._beams = [
            (mechanism.model.first_coordinates[name] + body.element_rows, body.direction_shapes,
             body.rotary_weights)
            for name, body in mechanism.bodies.items()
            if isinstance(body, Beam) and body.integration is None
        ]  # fmt: skip

    def share(self, sample: int, z: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """Return the share of kinetic energy in changes of |d|, of modes (q, modes) of 1 kg."""
        share = np.zeros(vectors.shape[1])
        for rows, *numbers in self._beams:
            shapes, inertia = (a[min(sample, len(a) - 1)] for a in numbers)
            d = _directions(shapes, z[:, None], rows)
            d = d / np.hypot(*d)
            for part in (np.real(vectors), np.imag(vectors)):
                longer = (d * _directions(shapes, part, rows - 1)).sum(axis=0)
                share += np.einsum("eg,egm->m", inertia, longer**2)
        return share


def _directions(shapes: np.ndarray, q: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return d of coordinates (rows, …) at the Gauss points, shape (2, elements, points, …)."""
    components = []
    for places, sign in DIRECTION:
        signs = np.where(np.arange(6) < 4, sign, 1)
        coordinates = signs[:, None, None] * q[rows + np.array(places)[:, None]]
        components.append(np.einsum("aeg,aem->egm", shapes, coordinates))
    return np.stack(components)
