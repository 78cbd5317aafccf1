"""Masses and moments of inertia as matrices have them, where they are zero or small as well."""

from __future__ import annotations

from functools import reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexband.mechanics.assembly.stacking import stack
from flexband.mechanics.bodies.body import MassEntries
from flexband.mechanics.model.model import Model


class MassOptions(NamedTuple):
    """Masses and inertias of rigid bodies in place of those that are small."""

    turning: float = 1e3
    """How much more assembly minds turning a rigid body by 1 rad than moving it by the size of
    all."""
    massless: float = 1e-12
    """What counts as none, relative to the whole model."""
    regular: float = 1e-4
    """What matrices have instead, relative to the smallest that is not zero …"""
    min_regular: float = 1e-10
    """… and to the whole mechanism at least; see `projection.refine`."""
    min_sharing: float = 1e-6
    """Redundant constraints share forces by at least this part of the whole mechanism's."""


class Inertia:
    """The mass matrices of a model.

    `inverse_scale` is 1/size of the whole for positions in [1, q], else 1; `regular_mass` has small
    masses of rigid bodies in place of zeros.
    """

    def __init__(self, model: Model, options: MassOptions = MassOptions()):
        self._model = model
        self._options = options
        self._mass = model.mass
        self.inverse_scale = self._inverse_scale()
        self._rigid_rows = [
            model.first_coordinates[name] + k
            for name, body in model.bodies.items()
            for k in range(0 if body.elements else body.size)
        ]
        self.regular_mass = self._regular()

    def _inverse_scale(self) -> list[ArrayLike]:
        """Return 1/size for positions, of the nodes' box and the largest gyration, and 1 else."""
        start = self._model.guess
        places = self._model.places
        mass = self._mass
        axes = [node[:, 0] for nodes in self._model.axes.values() for node in nodes]
        extents = (np.ptp(stack([start[row] for row in rows]), axis=0) for rows in places.T)
        masses = [mass[n, n] for n in places[:, 0]]
        min_mass = self._options.massless * sum(masses)
        massive = [np.where(m > min_mass, m, np.inf) for m in masses]
        none = np.zeros(())
        inertia = [sum((mass.get((n, n), none) for n in rows), none) for rows in axes]
        gyration = [np.sqrt(j / m) for j, m in zip(inertia, massive, strict=True)]
        size = reduce(np.hypot, extents) + stack(gyration).max(axis=0)
        size = np.where(size > 0, size, 1.0)  # a single point mass has none
        scale: list[ArrayLike] = [1.0] * len(start)
        for row in places.ravel():
            scale[row] = 1 / size
        return scale

    def _of_rows(self, mass: MassEntries) -> tuple[dict[int, np.ndarray], np.ndarray]:
        """Return the inertia [kg m²] of each row of z, and the sum of those of all nodes or 1."""
        rows = [i for i, j in mass if i == j]
        sizes = stack([mass[i, i] / np.square(self.inverse_scale[i]) for i in rows])
        inertia = dict(zip(rows, sizes, strict=True))
        total = np.sum([inertia[i] for i in self._model.places[:, 0]], axis=0)
        return inertia, np.where(total > 0, total, 1.0)

    def _regular(self) -> MassEntries:
        options, (inertia, total) = self._options, self._of_rows(self._mass)
        none = {i: m <= options.massless * total for i, m in inertia.items()}
        smallest_mass = np.minimum.reduce([np.where(none[i], total, m) for i, m in inertia.items()])
        smallest_mass = np.maximum(options.regular * smallest_mass, options.min_regular * total)
        regular = dict(self._mass)
        for i in self._rigid_rows:
            if none[i].any():
                instead = smallest_mass * np.square(self.inverse_scale[i])
                regular[i, i] = np.where(none[i], instead, self._mass[i, i])
        return regular

    def sharing_mass(self) -> MassEntries:
        """Return the regular mass matrix with larger masses and inertias of light rigid bodies."""
        inertia, total = self._of_rows(self.regular_mass)
        min_mass = self._options.min_sharing * total
        heavier = dict(self.regular_mass)
        for i in self._rigid_rows:
            if np.any(inertia[i] < min_mass):
                instead = min_mass * np.square(self.inverse_scale[i])
                heavier[i, i] = np.maximum(self.regular_mass[i, i], instead)
        return heavier

    def metric(self) -> list[np.ndarray]:
        """Return the regular mass matrix with moments of inertia that outweigh all masses."""
        model = self._model
        mass = self.regular_mass
        nodes = self._model.places[:, 0]
        rigid = [name for name, body in model.bodies.items() if body.rigid]
        axis_rows = {row for name in rigid for row in model.node_vectors[name][:, 1:].flat}
        masses = sum(mass[n, n] for n in nodes)
        inertia = self._options.turning * masses / np.square(self.inverse_scale[nodes[0]])
        return [m + inertia if i == j and i in axis_rows else m for (i, j), m in mass.items()]
