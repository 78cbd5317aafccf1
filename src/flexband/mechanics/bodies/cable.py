"""Thin flexible bodies of gradient-deficient ANCF elements, after Gerstmayr and Irschik (2008).

A node has the coordinates r and r_x only. The section stays normal to the axis, without shear
deformation and without rotary inertia, and the element does not lock, however thin it is. With
p = r′ and w = r″ the energy per length is ½ EA (|p| − 1)² + ½ EI (κ − κ₀)², where κ = p × w / p·p
is the curvature.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from flexband.errors import positive
from flexband.mechanics.bodies.body import MassEntries
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.properties import Along, Property
from flexband.mechanics.forms import Frame, Vector
from flexband.mechanics.kernels.hermite import hermite_curvature, hermite_slope


@dataclass(frozen=True, kw_only=True)
class Cable(CentreLine):
    """A thin flexible body without shear deformation, straight or curved.

    The element is the one of Gerstmayr and Irschik (2008). Every number may be an array of shape
    (n,), one value per sample. Mass, stiffness and curvature may also be functions of the position
    along the axis, from 0 to `length`. `Cable.along` builds a cable along a given path. `start`,
    `angle`, `velocity` and `rate` describe the cable at the start, free of stress, and are guesses:
    assembly corrects them until the joints are satisfied. Points are named as those of a `Beam`.

    Parameters
    ----------
    length : along the axis [m].
    mass_per_length : kg/m.
    axial_stiffness : EA [N].
    bending_stiffness : EI [N m²].
    elements : number of elements.
    retardation : τ [s] of a Kelvin–Voigt solid, whose section forces are those of the strains
        ε + τ ε̇ and κ + τ κ̇. A vibration of angular frequency ω has the damping ratio τω/2.
    start : position of the start [m].
    angle : from the X axis to the cable's axis at the start [rad].
    curvature : κ₀ of the undeformed axis [1/m], positive to the left.
    velocity, rate : velocity of the start [m/s] and rate of the angle [rad/s], as of a rigid bar.

    Raises
    ------
    InputError
        If a number is out of its range. Functions of the position are checked when the mechanism
        is assembled.
    """

    mass_per_length: Property
    axial_stiffness: Property
    bending_stiffness: Property

    per_node: ClassVar[int] = 4

    def properties(self) -> Sequence[tuple[str, Property, Callable]]:
        return (
            ("Cable mass_per_length [kg/m]", self.mass_per_length, positive),
            ("Cable axial_stiffness [N]", self.axial_stiffness, positive),
            ("Cable bending_stiffness [N m²]", self.bending_stiffness, positive),
        )

    def coordinates(self) -> list[np.ndarray]:  # r and r_x of each node
        nodes = zip(*(column.T for column in self.axis()), strict=True)
        return [c for x, y, angle in nodes for c in (x, y, np.cos(angle), np.sin(angle))]

    def node_frame(self, first: int) -> Frame:
        return Frame.of_slope_node(first)

    def section_direction(self, xi: float, a: Frame, b: Frame, slope: Vector) -> Vector:
        return -slope[1], slope[0]

    def section_stiffness(self, along: Along) -> Sequence[np.ndarray]:  # EA [N] and EI [N m²]
        return [along(*stiffness) for stiffness in self.properties()[1:]]

    def mass_entries(self) -> MassEntries:  # of the axis
        return self.axis_mass(self.at_gauss_points(*self.properties()[0]))

    def strains(self, q: np.ndarray, xi: float, length: np.ndarray) -> Sequence[np.ndarray]:
        # |p| − 1 and κ [1/m]
        p, w = self.vectors(q, xi, length)
        squared = p[0] ** 2 + p[1] ** 2
        return np.sqrt(squared) - 1, (p[0] * w[1] - p[1] * w[0]) / squared

    def curvature_slope(self, q: np.ndarray, xi: float, length: np.ndarray) -> np.ndarray:
        """Return dκ/ds [1/m²] at ξ with ds = |p| dx, shape (…); `q` as in `strains`."""
        p, w = self.vectors(q, xi, length)
        ri, gi, rj, gj = q.reshape(4, 2, *q.shape[1:])
        third = (12 * (ri - rj) / length + 6 * (gi + gj)) / length**2
        squared = p[0] ** 2 + p[1] ** 2
        turning = p[0] * third[1] - p[1] * third[0]
        kappa = (p[0] * w[1] - p[1] * w[0]) / squared
        slope = (turning - 2 * kappa * (p[0] * w[0] + p[1] * w[1])) / squared
        return slope / np.sqrt(squared)

    def vectors(
        self, q: np.ndarray, xi: float, length: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return p = r₀′ and w = r₀″ [1/m] at ξ, each of shape (2, …); `q` as in `strains`."""
        ri, gi, rj, gj = q.reshape(4, 2, *q.shape[1:])
        (_, hi, h, hj), (_, ki, k, kj) = hermite_slope(xi), hermite_curvature(xi)
        chord = (rj - ri) / length
        return h * chord + hi * gi + hj * gj, (k * chord + ki * gi + kj * gj) / length
