"""Integration of strain energy over a beam's section: the plain element, and one without locking.

With p = r₀', w = d' and d, the position gradients are r_x = p + y w and r_y = d, and the
Green–Lagrange strains of Eq. (22) are

    E_xx = a₀ + y a₁ + y² a₂    a₀ = (p·p − 1)/2,  a₁ = p·w,  a₂ = w·w/2
    E_yy = b                    b  = (d·d − 1)/2
    2E_xy = g₀ + y g₁           g₀ = p·d,  g₁ = w·d

so that the energy of a section, ½∫ Eᵀ D E dA, is a quadratic form in these six with the nine
numbers of `SectionStiffness`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from flexband.errors import positive


class SectionStiffness(NamedTuple):
    """Energy of a section: ½c00 a₀² + c02 a₀a₂ + ½c22 a₂² + ½c11 a₁² + c0b a₀b + c2b a₂b
    + ½cbb b² + ½s0 g₀² + ½s1 g₁².
    """  # noqa: D205

    c00: np.ndarray
    c02: np.ndarray
    c22: np.ndarray
    c11: np.ndarray
    c0b: np.ndarray
    c2b: np.ndarray
    cbb: np.ndarray
    s0: np.ndarray
    s1: np.ndarray


Strains = Sequence[np.ndarray]
"""a₀, a₁, a₂, b, g₀, g₁."""


class SectionIntegration(Protocol):
    """A rule that turns material and section into `SectionStiffness`."""

    def section_stiffness(
        self, E: np.ndarray, nu: np.ndarray, moments: Sequence[np.ndarray], k: np.ndarray
    ) -> SectionStiffness:
        """Return the stiffness for E [Pa], ν, moments ∫dA, ∫y²dA, ∫y⁴dA and shear factor k."""
        ...

    def stress(
        self, E: np.ndarray, nu: np.ndarray, k: np.ndarray, strain: Strains, y: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return S_xx, S_yy and S_xy [Pa] at y [m] of the strains a₀, a₁, a₂, b, g₀, g₁."""
        ...


@dataclass(frozen=True)
class FullIntegration:
    """The plain element: plane stress, everything integrated over the whole section.

    It is the element of the continuum law. It locks: with Poisson's ratio ν its bending stiffness
    is about 1/(1−ν²) too high, however fine the mesh.
    """

    def section_stiffness(
        self, E: np.ndarray, nu: np.ndarray, moments: Sequence[np.ndarray], k: np.ndarray
    ) -> SectionStiffness:
        """Return ∫ D over the section with D of plane stress, which knows no shear factor."""
        m0, m2, m4 = moments
        D = E / (1 - nu**2)
        G = E / (2 * (1 + nu))
        return SectionStiffness(
            c00=D * m0,
            c02=D * m2,
            c22=D * m4,
            c11=D * m2,
            c0b=nu * D * m0,
            c2b=nu * D * m2,
            cbb=D * m0,
            s0=G * m0,
            s1=G * m2,
        )

    def stress(
        self, E: np.ndarray, nu: np.ndarray, k: np.ndarray, strain: Strains, y: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the stresses of plane stress."""
        a0, a1, a2, b, g0, g1 = strain
        xx, D = a0 + y * a1 + y**2 * a2, E / (1 - nu**2)
        return D * (xx + nu * b), D * (b + nu * xx), E / (2 * (1 + nu)) * (g0 + y * g1)


@dataclass(frozen=True)
class SelectiveIntegration:
    """The element that does not lock: Poisson's coupling acts at the centre line only.

    D = diag(E, E, k G) + Dν; the first part is integrated over the section, Dν on the axis
    (Gerstmayr, Matikainen and Mikkola 2008).

    Parameters
    ----------
    shear_factor : k, or None for that of the beam's section.

    Raises
    ------
    InputError
        Where the shear factor is not positive.
    """

    shear_factor: float | None = None

    def __post_init__(self) -> None:
        if self.shear_factor is not None:
            positive("shear_factor", self.shear_factor)

    def section_stiffness(
        self, E: np.ndarray, nu: np.ndarray, moments: Sequence[np.ndarray], k: np.ndarray
    ) -> SectionStiffness:
        """Return the stiffness with D over the section and Dν on the axis."""
        m0, m2, m4 = moments
        D = E / (1 - nu**2)  # = E + ν² E/(1−ν²), the diagonal of D + Dν
        kG = (k if self.shear_factor is None else self.shear_factor) * E / (2 * (1 + nu))
        return SectionStiffness(
            c00=D * m0,
            c02=E * m2,
            c22=E * m4,
            c11=E * m2,
            c0b=nu * D * m0,
            c2b=np.zeros_like(D * m0),
            cbb=D * m0,
            s0=kG * m0,
            s1=kG * m2,
        )

    def stress(
        self, E: np.ndarray, nu: np.ndarray, k: np.ndarray, strain: Strains, y: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return D times the strains, and Dν times those on the axis."""
        a0, a1, a2, b, g0, g1 = strain
        coupled = nu * E / (1 - nu**2)
        kG = (k if self.shear_factor is None else self.shear_factor) * E / (2 * (1 + nu))
        xx = E * (a0 + y * a1 + y**2 * a2) + coupled * (nu * a0 + b)
        return xx, E * b + coupled * (nu * b + a0), kG * (g0 + y * g1)
