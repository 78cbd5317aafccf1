"""Thin flexible members of gradient-deficient ANCF elements, after Gerstmayr and Irschik (2008).

A node carries r and r_x only: the section stays normal to the axis, without shear and without
rotary inertia. So nothing locks, however thin the member is. With p = r′ and w = r″ the energy a
length is ½ EA (|p| − 1)² + ½ EI (κ − κ₀)², with the curvature κ = p × w / p·p.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import finite, positive
from flexband.mechanics.bodies import MassEntries
from flexband.mechanics.centre_line import (
    POSITIONS,
    WEIGHTS,
    CentreLine,
    Property,
    hermite_curvature,
    hermite_slope,
)
from flexband.mechanics.forms import Frame, Vector


@dataclass(frozen=True, kw_only=True)
class Cable(CentreLine):
    """A thin flexible member, straight or an arc, free of stress at the start.

    Every number may be an array of shape (n,), one value a sample; mass and stiffness may also be
    functions of the position along the axis, from 0 to `length`.

    Parameters
    ----------
    length : along the axis [m].
    mass_per_length : kg/m.
    axial_stiffness : EA [N].
    bending_stiffness : EI [N m²].
    elements : number of elements.
    start : where it starts [m]. A guess will do: assembly corrects it.
    angle : from the X axis to its axis at the start [rad], a guess as well.
    curvature : κ₀ of the stress-free axis [1/m], positive to the left.
    velocity, rate : of the start [m/s] and of the angle [rad/s], as for a rigid body. What the
        joints do not allow is left out.

    Points are named as those of a `Beam`.

    Raises
    ------
    InputError
        Where a number is out of its range; for functions, when the mechanism is assembled.
    """

    mass_per_length: Property
    axial_stiffness: Property
    bending_stiffness: Property
    curvature: ArrayLike = 0.0

    per_node: ClassVar[int] = 4

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value in self._properties():
            if not callable(value):
                positive(name, value)
        finite("Cable curvature [1/m]", self.curvature)

    def _properties(self):
        return (
            ("Cable mass_per_length [kg/m]", self.mass_per_length),
            ("Cable axial_stiffness [N]", self.axial_stiffness),
            ("Cable bending_stiffness [N m²]", self.bending_stiffness),
        )

    def coordinates(self) -> list[np.ndarray]:
        """Return the coordinates of the arc, node by node, each of shape () or (n,)."""
        angle, curvature, x0, y0 = (
            np.asarray(v, dtype=float) for v in (self.angle, self.curvature, *self.start)
        )
        nodes = []
        for node in range(self.elements + 1):
            s = np.asarray(self.length, dtype=float) * (node / self.elements)
            half = curvature * s / 2
            chord = s * np.sinc(half / np.pi)
            x, y = x0 + chord * np.cos(angle + half), y0 + chord * np.sin(angle + half)
            nodes += [x, y, np.cos(angle + 2 * half), np.sin(angle + 2 * half)]
        return nodes

    def node_frame(self, first: int) -> Frame:
        """Return the frame of the node whose coordinates [r, r_x] start at z_first."""
        return Frame.of_rigid_node(first)

    def section(self, xi: float, a: Frame, b: Frame, slope: Vector) -> Vector:
        """Return r_x turned by 90°."""
        return -slope[1], slope[0]

    def mass_entries(self) -> MassEntries:
        """Return the mass matrix of the axis."""
        return self.axis_mass(self._at_gauss_points(*self._properties()[0], positive))

    def section_stiffness(self) -> np.ndarray:
        """Return EA, EI, both times the weight, and ε and κ at the start, of every Gauss point.

        Shape (elements, GAUSS_POINTS, 4, n or 1).
        """
        weights = self.element_length[..., None, None] * WEIGHTS
        EA, EI = (weights * self._at_gauss_points(*p, positive) for p in self._properties()[1:])
        numbers = np.stack(np.broadcast_arrays(EA, EI, *self._initial_strains()), axis=-1)
        return np.moveaxis(numbers, 0, -1)

    def _initial_strains(self) -> tuple[np.ndarray, np.ndarray]:
        """Return |p| − 1 and κ of the elements at the start, each (n or 1, elements, points).

        The Hermite cubics follow an arc closely but not exactly; what is left is free of stress.
        """
        q = np.stack(np.broadcast_arrays(*map(np.atleast_1d, self.coordinates())), axis=-1)
        places = np.array([self._axis_places(e) for e in range(self.elements)])
        length = np.atleast_1d(self.element_length)[:, None, None]
        px, py, wx, wy = (
            np.einsum("nei,ig->neg", q[:, places + axis] * self._along[:, None], shape(POSITIONS))
            / length**order
            for order, shape in ((1, hermite_slope), (2, hermite_curvature))
            for axis in range(2)
        )
        squared = px**2 + py**2
        return np.sqrt(squared) - 1, (px * wy - py * wx) / squared
