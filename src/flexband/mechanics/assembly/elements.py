"""The elements of all beams or of all cables, gathered from their bodies."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flexband.mechanics.assembly.stacking import stack
from flexband.mechanics.bodies.beam import Beam
from flexband.mechanics.bodies.cable import Cable
from flexband.mechanics.kernels.hermite import GAUSS_POINTS, POSITIONS

RIGIDITY = 1e10
"""Weight of the beams' stiffness against their inertia in the projections at the start."""


class Elements:
    """Elements of one kind, of all bodies."""

    def __init__(self, coordinates: int):
        self.coordinates = coordinates
        self.first: list[int] = []
        self.inverse_length: list[np.ndarray] = []
        self.stiffness: list[np.ndarray] = []
        self.initial: list[np.ndarray] = []
        self.initial_row: list[int] = []
        self.retardation: list[ArrayLike] = []

    def take(self, body: Beam | Cable, first: int) -> None:
        """Append the elements of a body whose coordinates start at z_first."""
        self.first += [first + body.per_node * e for e in range(body.elements)]
        self.inverse_length += [1 / body.element_length] * body.elements
        self.retardation += [body.retardation] * body.elements
        numbers = body.stiffness()
        if isinstance(body, Cable):
            numbers += body.initial_strains(POSITIONS)
        elif body.straight:
            self.initial_row += [-1] * body.elements
        else:
            rows = _by_element(body.initial_strains(POSITIONS))
            each = len(rows) // body.elements
            self.initial_row += [len(self.initial) + each * e for e in range(body.elements)]
            self.initial += rows
        self.stiffness += _by_element(numbers)

    def damped(self) -> np.ndarray:
        """Return whether the material of each element is damped in any sample."""
        return np.array([np.any(np.asarray(t) > 0) for t in self.retardation], dtype=bool)

    @property
    def groups(self) -> list[range]:
        """The coordinates of each."""
        return [range(e, e + self.coordinates) for e in self.first]


def _by_element(numbers: list[np.ndarray]) -> list[np.ndarray]:
    """Return numbers (elements, GAUSS_POINTS, n or 1) as rows, those of a point together."""
    together = np.stack(np.broadcast_arrays(*numbers), axis=2)
    return list(together.reshape(-1, together.shape[-1]))


def rigidity(beams: Elements, cables: Elements, mass: dict) -> ArrayLike:
    """Return a weight [s²] that makes beams all but rigid, `RIGIDITY` over the highest ω².

    For a beam that is about the frequency of the section's breathing, ∫ c_bb dx over the inertia of
    r_y, for a cable that of a node on the axial stiffness, ∫ EA dx / l² over the node's inertia.
    """
    squares = []
    if beams.first:
        breathing = stack(beams.stiffness)[6::9].reshape(len(beams.first), GAUSS_POINTS, -1)
        inertia = stack([mass[e + 4, e + 4] for e in beams.first])
        squares.append((breathing.sum(axis=1) / inertia).max(axis=0))
    if cables.first:
        axial = stack(cables.stiffness)[0::4].reshape(len(cables.first), GAUSS_POINTS, -1)
        inertia = stack([mass[e, e] for e in cables.first])
        inverse_length = stack(cables.inverse_length)
        squares.append((axial.sum(axis=1) * inverse_length**2 / inertia).max(axis=0))
    return RIGIDITY / np.maximum.reduce(np.broadcast_arrays(*squares)) if squares else 1.0
