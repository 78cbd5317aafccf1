"""Flexible beams of planar shear-deformable ANCF elements, Eq. (22).

The element of Omar and Shabana (2001) is cubic along its axis and linear across it:
r(x, y) = r₀(x) + y d(x), with r₀ the Hermite cubic through the nodes' r and r_x, and d linear
between the nodes' r_y. Integrals across the section are therefore exact in its moments ∫dA, ∫y²dA
and ∫y⁴dA; integrals along the axis use `GAUSS_POINTS` points, exact for uniform properties.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import non_negative, poissons_ratio, positive
from flexband.mechanics.bodies import MassEntries
from flexband.mechanics.centre_line import (
    POSITIONS,
    WEIGHTS,
    CentreLine,
    Property,
    add_pairs,
)
from flexband.mechanics.forms import Frame, Vector, add, scale
from flexband.mechanics.integration import SectionIntegration, SelectiveIntegration


@dataclass(frozen=True, kw_only=True)
class Beam(CentreLine):
    """A flexible beam, straight and free of stress at the start.

    Every number may be an array of shape (n,), one value a sample; the material may also be a
    function of the position along the axis, from 0 to `length`.

    Parameters
    ----------
    length, height, width : size along the axis, across it in the plane, and out of the plane [m].
    density : kg/m³.
    youngs_modulus : E [Pa].
    poissons_ratio : ν, in (−1, 0.5). The law is plane stress.
    elements : number of elements.
    retardation : τ [s] of a Kelvin–Voigt solid, whose stresses are those of the strains
        E + τ Ė; a vibration of angular frequency ω is damped by the ratio τω/2.
    start : where the beam starts [m]. A guess will do: assembly corrects it.
    angle : from the X axis to the beam's axis at the start [rad], a guess as well.
    velocity, rate : of the start [m/s] and of the angle [rad/s], as for a rigid bar. What the
        joints do not allow is left out.
    integration : `SelectiveIntegration` (does not lock) or `FullIntegration` (the plain element).

    Points are named "start", "end", "middle" (or "center"), "node 0", "node 1", …, and by the part
    of the length from the start, "0.25".

    Raises
    ------
    InputError
        Where a number is out of its range; for functions, when the mechanism is assembled.
    """

    height: ArrayLike
    width: ArrayLike
    density: Property
    youngs_modulus: Property
    poissons_ratio: Property
    retardation: ArrayLike = 0.0
    integration: SectionIntegration = field(default_factory=SelectiveIntegration)

    per_node: ClassVar[int] = 6

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("Beam height [m]", self.height)
        positive("Beam width [m]", self.width)
        non_negative("Beam retardation [s]", self.retardation)
        for name, value, check in self._material():
            if not callable(value):
                check(name, value)

    def _material(self):
        return (
            ("Beam density [kg/m³]", self.density, positive),
            ("Beam youngs_modulus [Pa]", self.youngs_modulus, positive),
            ("Beam poissons_ratio", self.poissons_ratio, poissons_ratio),
        )

    def coordinates(self) -> list[np.ndarray]:
        """Return the coordinates of the straight beam, node by node, each of shape () or (n,)."""
        turn, x0, y0 = (np.asarray(v, dtype=float) for v in (self.angle, *self.start))
        c, s = np.cos(turn), np.sin(turn)
        nodes = []
        for node in range(self.elements + 1):
            x = np.asarray(self.length, dtype=float) * (node / self.elements)
            nodes += [x0 + x * c, y0 + x * s, c, s, -s, c]
        return nodes

    def node_frame(self, first: int) -> Frame:
        """Return the frame of the node whose six coordinates start at z_first."""
        return Frame.of_node(first)

    def section(self, xi: float, a: Frame, b: Frame, slope: Vector) -> Vector:
        """Return r_y at ξ, linear between the nodes'."""
        return add(scale(1 - xi, a.y), scale(xi, b.y))

    def _section_moments(self) -> list[np.ndarray]:
        """Return ∫dA, ∫y²dA and ∫y⁴dA of the rectangle, each of shape () or (n, 1, 1)."""
        h, w = (np.asarray(a, dtype=float)[..., None, None] for a in (self.height, self.width))
        return [w * h, w * h**3 / 12, w * h**5 / 80]

    def section_stiffness(self) -> np.ndarray:
        """Return the nine stiffness numbers of every Gauss point, times its weight in the integral.

        Shape (elements, GAUSS_POINTS, 9, n or 1); their meaning is in `integration`.
        """
        _, modulus, ratio = self._material()
        stiffness = self.integration.section_stiffness(
            self._at_gauss_points(*modulus), self._at_gauss_points(*ratio), self._section_moments()
        )
        weights = self.element_length[..., None, None] * WEIGHTS
        numbers = np.stack(np.broadcast_arrays(*(weights * c for c in stiffness)), axis=-1)
        return np.moveaxis(numbers, 0, -1)

    def mass_entries(self) -> MassEntries:
        """Return the consistent mass matrix ∫ρ SᵀS dV, constant in time."""
        area, second, _ = self._section_moments()
        density = self._at_gauss_points(*self._material()[0])
        entries = self.axis_mass(density * area)
        weights = density * second * self.element_length[..., None, None] * WEIGHTS
        across = np.stack([1 - POSITIONS, POSITIONS])
        blocks = np.einsum("neg,ig,jg->nije", weights, across, across)
        for e in range(self.elements):
            add_pairs(entries, [6 * e + 4, 6 * e + 10], blocks[..., e])
        return entries
