"""The elements of all beams or of all cables as arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flexband.mechanics.assembly.stacking import indices, stack
from flexband.mechanics.assembly.structure import Beams, BeamValues, Cables, CableValues
from flexband.mechanics.assembly.tables import Couples, Places, pairs_of
from flexband.mechanics.bodies.beam import Beam
from flexband.mechanics.bodies.cable import Cable
from flexband.mechanics.kernels.hermite import GAUSS_POINTS, POSITIONS

RIGIDITY = 1e10
"""Weight of the stiffness of beams against their inertia in the projections at the start."""


class ElementTable:
    """The elements of all bodies of one kind."""

    functions = ()

    def __init__(self):
        self.groups: list[range] = []
        self.inverse_length: list[ArrayLike] = []
        self.retardation: list[ArrayLike] = []
        self.stiffness: list[np.ndarray] = []

    def append(self, body: Beam | Cable, first: int, stiffness: list[np.ndarray]) -> None:
        """Append the elements of a body whose coordinates start in row `first` of z.

        `stiffness` has arrays of shape (elements, GAUSS_POINTS, n or 1).
        """
        starts = [first + body.per_node * e for e in range(body.elements)]
        self.groups += [range(start, start + body.element_coordinates) for start in starts]
        self.inverse_length += [1 / body.element_length] * body.elements
        self.retardation += [body.retardation] * body.elements
        self.stiffness += _by_element(stiffness)

    def couples(self) -> Couples:
        return pairs_of(self.groups)

    def first(self) -> np.ndarray:
        """Return the first coordinate of each element."""
        return indices(group[0] for group in self.groups)

    def damped(self) -> np.ndarray:
        """Return whether the material of each element is damped in any sample."""
        return np.array([np.any(np.asarray(t) > 0) for t in self.retardation], dtype=bool)


class BeamTable(ElementTable):
    """The elements of all beams."""

    def __init__(self):
        super().__init__()
        self.initial: list[np.ndarray] = []
        self.initial_row: list[int] = []

    def take(self, body: Beam, first: int) -> None:
        """Append the elements of a beam; only curved ones have strains at the start."""
        self.append(body, first, body.stiffness())
        rows = [] if body.straight else _by_element(body.initial_strains(POSITIONS))
        each, begin = len(rows) // body.elements, len(self.initial)
        self.initial_row += [begin + each * e if rows else -1 for e in range(body.elements)]
        self.initial += rows

    def structure(self, places: Places) -> Beams:
        return Beams(
            self.first(), self.damped(), indices(self.initial_row), places.square(self.groups)
        )

    def values(self) -> BeamValues:
        rows = (self.inverse_length, self.stiffness, self.initial, self.retardation)
        return BeamValues(*map(stack, rows))


class CableTable(ElementTable):
    """The elements of all cables."""

    def take(self, body: Cable, first: int) -> None:
        """Append the elements of a cable; the strains at the start are part of the stiffness."""
        self.append(body, first, body.stiffness() + body.initial_strains(POSITIONS))

    def structure(self, places: Places) -> Cables:
        return Cables(self.first(), self.damped(), places.square(self.groups))

    def values(self) -> CableValues:
        return CableValues(*map(stack, (self.inverse_length, self.stiffness, self.retardation)))


def _by_element(numbers: list[np.ndarray]) -> list[np.ndarray]:
    """Return numbers (elements, GAUSS_POINTS, n or 1) as rows, those of a point side by side."""
    together = np.stack(np.broadcast_arrays(*numbers), axis=2)
    return list(together.reshape(-1, together.shape[-1]))


def rigidity(beams: BeamTable, cables: CableTable, mass: dict) -> np.ndarray:
    """Return a weight [s²] that makes beams almost rigid: `RIGIDITY` over the highest ω².

    For a beam this is about the frequency of the section's breathing, ∫ c_bb dx over the inertia of
    r_y; for a cable that of a node on the axial stiffness, ∫ EA dx / l² over the node's inertia.
    """
    squares = []
    if beams.groups:
        breathing = stack(beams.stiffness)[6::9].reshape(len(beams.groups), GAUSS_POINTS, -1)
        inertia = stack([mass[e + 4, e + 4] for e, *_ in beams.groups])
        squares.append((breathing.sum(axis=1) / inertia).max(axis=0))
    if cables.groups:
        axial = stack(cables.stiffness)[0::4].reshape(len(cables.groups), GAUSS_POINTS, -1)
        inertia = stack([mass[e, e] for e, *_ in cables.groups])
        inverse_length = stack(cables.inverse_length)
        squares.append((axial.sum(axis=1) * inverse_length**2 / inertia).max(axis=0))
    return RIGIDITY / np.maximum.reduce(np.broadcast_arrays(*squares)) if squares else np.ones(1)
