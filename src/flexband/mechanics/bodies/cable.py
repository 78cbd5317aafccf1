"""Thin flexible members of gradient-deficient ANCF elements, after Gerstmayr and Irschik (2008).

A node carries r and r_x only: the section stays normal to the axis, without shear and without
rotary inertia. So nothing locks, however thin the member is. With p = r′ and w = r″ the energy a
length is ½ EA (|p| − 1)² + ½ EI (κ − κ₀)², with the curvature κ = p × w / p·p.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import non_negative, positive
from flexband.mechanics.bodies.centre_line import CentreLine, Property
from flexband.mechanics.bodies.rigid import MassEntries
from flexband.mechanics.forms import Frame, Vector
from flexband.mechanics.kernels.hermite import WEIGHTS, hermite_curvature, hermite_slope


@dataclass(frozen=True, kw_only=True)
class Cable(CentreLine):
    """A thin flexible member, straight or curved, free of stress at the start.

    Every number may be an array of shape (n,), one value a sample; mass, stiffness and curvature
    may also be functions of the position along the axis, from 0 to `length`. `Cable.along` makes
    one along a given path.

    Parameters
    ----------
    length : along the axis [m].
    mass_per_length : kg/m.
    axial_stiffness : EA [N].
    bending_stiffness : EI [N m²].
    elements : number of elements.
    start : where it starts [m]. A guess will do: assembly corrects it.
    angle : from the X axis to its axis at the start [rad], a guess as well.
    retardation : τ [s] of a Kelvin–Voigt solid, whose forces are those of the strains ε + τ ε̇ and
        κ + τ κ̇; a vibration of angular frequency ω is damped by the ratio τω/2.
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
    retardation: ArrayLike = 0.0

    per_node: ClassVar[int] = 4

    def __post_init__(self) -> None:
        super().__post_init__()
        non_negative("Cable retardation [s]", self.retardation)
        for name, value in self.properties():
            if not callable(value):
                positive(name, value)

    def properties(self) -> Sequence[tuple[str, Property]]:
        """Return name and value of mass, axial and bending stiffness."""
        return (
            ("Cable mass_per_length [kg/m]", self.mass_per_length),
            ("Cable axial_stiffness [N]", self.axial_stiffness),
            ("Cable bending_stiffness [N m²]", self.bending_stiffness),
        )

    def coordinates(self) -> list[np.ndarray]:
        """Return the coordinates at the start, node by node, each of shape (n or 1,)."""
        nodes = zip(*(column.T for column in self.axis()), strict=True)
        return [c for x, y, angle in nodes for c in (x, y, np.cos(angle), np.sin(angle))]

    def node_frame(self, first: int) -> Frame:
        """Return the frame of the node whose coordinates [r, r_x] start at z_first."""
        return Frame.of_rigid_node(first)

    def section_direction(self, xi: float, a: Frame, b: Frame, slope: Vector) -> Vector:
        """Return r_x turned by 90°."""
        return -slope[1], slope[0]

    def mass_entries(self) -> MassEntries:
        """Return the mass matrix of the axis."""
        return self.axis_mass(self._at_gauss_points(*self.properties()[0], positive))

    def stiffness(self) -> list[np.ndarray]:
        """Return EA and EI, both times the weight, of every Gauss point.

        Each has shape (elements, GAUSS_POINTS, n or 1).
        """
        weights = self.element_length[..., None, None] * WEIGHTS
        properties = self.properties()[1:]
        return [
            np.moveaxis(weights * self._at_gauss_points(*p, positive), 0, -1) for p in properties
        ]

    def strains(self, q: np.ndarray, xi: float, length: np.ndarray) -> Sequence[np.ndarray]:
        """Return |p| − 1 and κ at ξ in elements of this length [m]; q has shape (8, …)."""
        p, w = self.vectors(q, xi, length)
        squared = p[0] ** 2 + p[1] ** 2
        return np.sqrt(squared) - 1, (p[0] * w[1] - p[1] * w[0]) / squared

    def curvature_slope(self, q: np.ndarray, xi: float, length: np.ndarray) -> np.ndarray:
        """Return dκ/ds: κ = p × w / p·p, ds = |p| dx."""
        p, w = self.vectors(q, xi, length)
        ri, gi, rj, gj = q.reshape(4, 2, *q.shape[1:])
        third = (12 * (ri - rj) / length + 6 * (gi + gj)) / length**2
        squared = p[0] ** 2 + p[1] ** 2
        turning = p[0] * third[1] - p[1] * third[0]
        kappa = (p[0] * w[1] - p[1] * w[0]) / squared
        slope = (turning - 2 * kappa * (p[0] * w[0] + p[1] * w[1])) / squared
        return slope / np.sqrt(squared)

    def vectors(self, q: np.ndarray, xi: float, length: np.ndarray):
        """Return p = r₀′ and w = r₀″, each of shape (2, …)."""
        ri, gi, rj, gj = q.reshape(4, 2, *q.shape[1:])
        (_, hi, h, hj), (_, ki, k, kj) = hermite_slope(xi), hermite_curvature(xi)
        chord = (rj - ri) / length
        return h * chord + hi * gi + hj * gj, (k * chord + ki * gi + kj * gj) / length
