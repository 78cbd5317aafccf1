"""Flexible beams of planar shear-deformable ANCF elements, Eq. (22).

The element of Omar and Shabana (2001) is cubic along its axis and linear across it:
r(x, y) = r₀(x) + y d(x), with r₀ the Hermite cubic through the nodes' r and r_x, and d linear
between the nodes' r_y. Integrals across the section are therefore exact in its moments ∫dA, ∫y²dA
and ∫y⁴dA; integrals along the axis use `GAUSS_POINTS` points, exact for uniform properties.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError, non_negative, poissons_ratio, positive
from flexband.mechanics.bodies.centre_line import CentreLine, Property, add_pairs
from flexband.mechanics.bodies.rigid import MassEntries
from flexband.mechanics.bodies.section_stiffness import (
    SectionIntegration,
    SectionStiffness,
    SelectiveIntegration,
)
from flexband.mechanics.bodies.sections import Along, Rectangle, Section
from flexband.mechanics.forms import Frame, Vector, add, scale
from flexband.mechanics.kernels.beam_strains import strains
from flexband.mechanics.kernels.hermite import POSITIONS, WEIGHTS, hermite_slope


@dataclass(frozen=True, kw_only=True)
class Beam(CentreLine):
    """A flexible beam, straight or curved, free of stress at the start.

    Every number may be an array of shape (n,), one value a sample; material, section and curvature
    may also be functions of the position along the axis, from 0 to `length`. `Beam.along` makes one
    along a given path.

    Parameters
    ----------
    length : along the axis [m].
    height, width : of a rectangular section, across the axis in the plane and out of the plane [m].
    section : any other, in place of height and width: `Circle`, `GeneralSection`.
    density : kg/m³.
    youngs_modulus : E [Pa].
    poissons_ratio : ν, in (−1, 0.5). The law is plane stress.
    elements : number of elements.
    retardation : τ [s] of a Kelvin–Voigt solid, whose stresses are those of the strains
        E + τ Ė; a vibration of angular frequency ω is damped by the ratio τω/2.
    start : where the beam starts [m]. A guess will do: assembly corrects it.
    angle : from the X axis to the beam's axis at the start [rad], a guess as well.
    curvature : κ₀ of the axis at the start [1/m], positive to the left. The beam is thin against
        its radius: terms of the size of height times κ₀ are left out.
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

    height: Property | None = None
    width: Property | None = None
    section: Section | None = None
    density: Property
    youngs_modulus: Property
    poissons_ratio: Property
    retardation: ArrayLike = 0.0
    integration: SectionIntegration = field(default_factory=SelectiveIntegration)

    per_node: ClassVar[int] = 6

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.profile
        non_negative("Beam retardation [s]", self.retardation)
        for name, value, check in self._material():
            if not callable(value):
                check(name, value)

    @property
    def profile(self) -> Section:
        """The section, a `Rectangle` where the beam has height and width."""
        if self.section is None and self.height is not None and self.width is not None:
            return Rectangle(self.height, self.width)
        if self.section is None or self.height is not None or self.width is not None:
            raise InputError("a Beam must have either height and width or a section")
        return self.section

    def _material(self):
        return (
            ("Beam density [kg/m³]", self.density, positive),
            ("Beam youngs_modulus [Pa]", self.youngs_modulus, positive),
            ("Beam poissons_ratio", self.poissons_ratio, poissons_ratio),
        )

    def coordinates(self) -> list[np.ndarray]:
        """Return the coordinates at the start, node by node, each of shape (n or 1,)."""
        nodes = []
        for x, y, angle in zip(*(column.T for column in self.axis()), strict=True):
            c, s = np.cos(angle), np.sin(angle)
            nodes += [x, y, c, s, -s, c]
        return nodes

    def node_frame(self, first: int) -> Frame:
        """Return the frame of the node whose six coordinates start at z_first."""
        return Frame.of_node(first)

    def section_direction(self, xi: float, a: Frame, b: Frame, slope: Vector) -> Vector:
        """Return r_y at ξ, linear between the nodes'."""
        return add(scale(1 - xi, a.y), scale(xi, b.y))

    def section_stiffness(self, along: Along) -> SectionStiffness:
        """Return the nine stiffness numbers of `integration` where `along` evaluates properties."""
        E, nu = self.elasticity(along)
        moments, k = self.profile.moments(along), self.profile.shear_factor(nu, along)
        return self.integration.section_stiffness(E, nu, moments, k)

    def elasticity(self, along: Along) -> tuple[np.ndarray, np.ndarray]:
        """Return E [Pa] and ν where `along` evaluates properties."""
        _, modulus, ratio = self._material()
        return along(*modulus), along(*ratio)

    def stiffness(self) -> list[np.ndarray]:
        """Return the nine stiffness numbers of every Gauss point, times its weight in the integral.

        Each has shape (elements, GAUSS_POINTS, n or 1).
        """
        weights = self.element_length[..., None, None] * WEIGHTS
        numbers = self.section_stiffness(self._at_gauss_points)
        return [np.moveaxis(weights * number, 0, -1) for number in numbers]

    def strains(self, q: np.ndarray, xi: float, length: np.ndarray) -> Sequence[np.ndarray]:
        """Return a₀, a₁, a₂, b, g₀, g₁ of `integration` at ξ in elements of this length [m].

        q holds their coordinates, shape (12, …).
        """
        return strains.py_func(*self.vectors(q, xi, length))

    def vectors(
        self, q: np.ndarray, xi: float, length: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return p = r₀′, w = d′ and d, each of shape (2, …)."""
        ri, gi, di, rj, gj, dj = q.reshape(6, 2, *q.shape[1:])
        _, hi, h, hj = hermite_slope(xi)
        p = h / length * (rj - ri) + hi * gi + hj * gj
        return p, (dj - di) / length, (1 - xi) * di + xi * dj

    def mass_entries(self) -> MassEntries:
        """Return the consistent mass matrix ∫ρ SᵀS dV, constant in time."""
        area, second, _ = self.profile.moments(self._at_gauss_points)
        density = self._at_gauss_points(*self._material()[0])
        entries = self.axis_mass(density * area)
        weights = density * second * self.element_length[..., None, None] * WEIGHTS
        across = np.stack([1 - POSITIONS, POSITIONS])
        blocks = np.einsum("neg,ig,jg->nije", weights, across, across)
        for e in range(self.elements):
            add_pairs(entries, [6 * e + 4, 6 * e + 10], blocks[..., e])
        return entries
