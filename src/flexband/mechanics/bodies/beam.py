"""Flexible beams of planar shear-deformable ANCF elements, Eq. (22).

The element of Omar and Shabana (2001) is cubic along its axis and linear across it:
r(x, y) = r₀(x) + y d(x), where r₀ is the Hermite cubic through the nodes' r and r_x, and d is
linear between the nodes' r_y. The section enters through its moments ∫dA, ∫y²dA and ∫y⁴dA, which
makes integrals across it exact. Integrals along the axis use `GAUSS_POINTS` points, which is exact
for uniform properties.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from flexband.errors import InputError, poissons_ratio, positive
from flexband.mechanics.bodies.body import MassEntries, add_pairs
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.properties import Along, Property
from flexband.mechanics.bodies.section_stiffness import (
    Elasticity,
    SectionIntegration,
    SectionStiffness,
    SelectiveIntegration,
)
from flexband.mechanics.bodies.sections import Rectangle, Section
from flexband.mechanics.forms import Frame, Vector, add, scale
from flexband.mechanics.kernels.beam_strains import strains
from flexband.mechanics.kernels.hermite import POSITIONS, hermite_slope


@dataclass(frozen=True, kw_only=True)
class Beam(CentreLine):
    """A flexible beam with shear deformation, straight or curved, Eq. (22).

    Every number may be an array of shape (n,), one value per sample. Material, section and
    curvature may also be functions of the position along the axis, from 0 to `length`. `Beam.along`
    builds a beam along a given path. `start`, `angle`, `velocity` and `rate` describe the beam at
    the start, free of stress, and are guesses: assembly corrects them until the joints are
    satisfied.

    Points are named "start", "end", "middle" (or "center"), "node 0", "node 1", …, or by the
    fraction of the length from the start, "0.25".

    Parameters
    ----------
    length : along the axis [m].
    height, width : of a rectangular section, across the axis in the plane and out of the plane [m].
    section : another section instead of `height` and `width`: `Circle` or `GeneralSection`.
    density : ρ [kg/m³].
    youngs_modulus : E [Pa].
    poissons_ratio : ν, in (−1, 0.5). The material is in plane stress.
    elements : number of elements.
    retardation : τ [s] of a Kelvin–Voigt solid, whose stresses are those of the strains E + τ Ė.
        A vibration of angular frequency ω has the damping ratio τω/2.
    start : position of the start [m].
    angle : from the X axis to the beam's axis at the start [rad].
    curvature : κ₀ of the undeformed axis [1/m], positive to the left. Terms of the order of height
        times κ₀ are neglected.
    velocity, rate : velocity of the start [m/s] and rate of the angle [rad/s], as of a rigid bar.
    integration : `SelectiveIntegration`, which does not lock, or `FullIntegration`, the element of
        Omar and Shabana.

    Raises
    ------
    InputError
        If a number is out of its range. Functions of the position are checked when the mechanism
        is assembled.
    """

    height: Property | None = None
    width: Property | None = None
    section: Section | None = None
    density: Property
    youngs_modulus: Property
    poissons_ratio: Property
    integration: SectionIntegration = field(default_factory=SelectiveIntegration)

    per_node: ClassVar[int] = 6

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.profile  # refuses a beam without a section

    @property
    def profile(self) -> Section:
        """The section, a `Rectangle` if the beam has a height and a width."""
        if self.section is None and self.height is not None and self.width is not None:
            return Rectangle(self.height, self.width)
        if self.section is None or self.height is not None or self.width is not None:
            raise InputError("a Beam must have either height and width or a section")
        return self.section

    def properties(self) -> Sequence[tuple[str, Property, Callable]]:
        return (
            ("Beam density [kg/m³]", self.density, positive),
            ("Beam youngs_modulus [Pa]", self.youngs_modulus, positive),
            ("Beam poissons_ratio", self.poissons_ratio, poissons_ratio),
        )

    def coordinates(self) -> list[np.ndarray]:  # r, r_x and r_y of each node
        nodes = []
        for x, y, angle in zip(*(column.T for column in self.axis()), strict=True):
            c, s = np.cos(angle), np.sin(angle)
            nodes += [x, y, c, s, -s, c]
        return nodes

    def node_frame(self, first: int) -> Frame:
        return Frame.of_node(first)

    def section_direction(self, xi: float, a: Frame, b: Frame, slope: Vector) -> Vector:
        return add(scale(1 - xi, a.y), scale(xi, b.y))

    def section_stiffness(self, along: Along) -> SectionStiffness:
        return self.integration.stiffness(self.elasticity(along), self.profile.moments(along))

    def elasticity(self, along: Along) -> Elasticity:
        """Return E [Pa], ν and k at the positions of `along`."""
        E, nu = (along(*given) for given in self.properties()[1:])
        return Elasticity(E, nu, self.profile.shear_factor(nu, along))

    def strains(self, q: np.ndarray, xi: float, length: np.ndarray) -> Sequence[np.ndarray]:
        return strains.py_func(self.vectors(q, xi, length))

    def vectors(
        self, q: np.ndarray, xi: float, length: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return p = r₀′, w = d′ [1/m] and d at ξ, each of shape (2, …); `q` as in `strains`."""
        ri, gi, di, rj, gj, dj = q.reshape(6, 2, *q.shape[1:])
        _, hi, h, hj = hermite_slope(xi)
        p = h / length * (rj - ri) + hi * gi + hj * gj
        return p, (dj - di) / length, (1 - xi) * di + xi * dj

    def mass_entries(self) -> MassEntries:  # ∫ρ SᵀS dV with r = S q
        area, second, _ = self.profile.moments(self.at_gauss_points)
        density = self.at_gauss_points(*self.properties()[0])
        entries = self.axis_mass(density * area)
        across = np.stack([1 - POSITIONS, POSITIONS])
        blocks = np.einsum("neg,ig,jg->nije", density * second * self.weights, across, across)
        for e in range(self.elements):
            add_pairs(entries, [6 * e + 4, 6 * e + 10], blocks[..., e])
        return entries
