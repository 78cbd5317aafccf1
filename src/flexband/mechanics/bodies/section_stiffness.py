"""Integration of the strain energy over a beam's section, with and without locking.

With p = r₀′, w = d′ and d, the position gradients are r_x = p + y w and r_y = d, and the
Green–Lagrange strains of Eq. (22) are

    E_xx = a₀ + y a₁ + y² a₂    a₀ = (p·p − 1)/2,  a₁ = p·w,  a₂ = w·w/2
    E_yy = b                    b  = (d·d − 1)/2
    2E_xy = g₀ + y g₁           g₀ = p·d,  g₁ = w·d

so that the energy of a section per length, ½∫ Eᵀ D E dA, is a quadratic form in these six
generalized strains with the nine coefficients of `SectionStiffness`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_numbers, check_positive


class SectionStiffness(NamedTuple):
    """Coefficients of the energy of a section per length [J/m].

    The energy is ½c00 a₀² + c02 a₀a₂ + ½c22 a₂² + ½c11 a₁² + c0b a₀b + c2b a₂b + ½cbb b² + ½s0 g₀²
    + ½s1 g₁². Each has shape (n or 1, …); c00, c0b, cbb and s0 are in N, c02, c11, c2b and s1 in
    N m², c22 in N m⁴.
    """

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
"""The generalized strains a₀, a₁ [1/m], a₂ [1/m²], b, g₀, g₁ [1/m], arrays of one shape."""


class Elasticity(NamedTuple):
    """E [Pa], ν and the shear correction factor k of a section, each of shape (n or 1, …)."""

    E: np.ndarray
    nu: np.ndarray
    k: np.ndarray


@runtime_checkable
class SectionIntegration(Protocol):
    """A rule for the integrals over the section, and the material law that it stands for."""

    def stiffness(self, material: Elasticity, moments: Sequence[np.ndarray]) -> SectionStiffness:
        """Return the stiffness for the moments ∫dA [m²], ∫y²dA [m⁴] and ∫y⁴dA [m⁶]."""
        ...

    def stress(self, material: Elasticity, strain: Strains, y: np.ndarray) -> Sequence[np.ndarray]:
        """Return the second Piola–Kirchhoff stresses S_xx, S_yy and S_xy [Pa] at y [m]."""
        ...


@frozen()
class FullIntegration:
    """The element of Omar and Shabana (2001): plane stress, integrated over the whole section.

    It suffers from Poisson locking: its bending stiffness is too high by a factor of about
    1/(1−ν²), however fine the mesh. The shear correction factor does not enter.
    """

    def stiffness(self, material: Elasticity, moments: Sequence[np.ndarray]) -> SectionStiffness:
        (E, nu, _), (m0, m2, m4) = material, moments
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

    def stress(self, material: Elasticity, strain: Strains, y: np.ndarray) -> Sequence[np.ndarray]:
        (E, nu, _), (a0, a1, a2, b, g0, g1) = material, strain
        xx = a0 + y * a1 + y**2 * a2
        D = E / (1 - nu**2)
        return D * (xx + nu * b), D * (b + nu * xx), E / (2 * (1 + nu)) * (g0 + y * g1)


@frozen()
class SelectiveIntegration:
    """The element without Poisson locking: Poisson's coupling acts on the centre line only.

    The elasticity matrix is split, D = diag(E, E, k G) + Dν. The first part is integrated over the
    section, Dν only on the axis (Gerstmayr, Matikainen and Mikkola 2008).

    Parameters
    ----------
    shear_factor : shear correction factor k, or None for that of the beam's section.

    Raises
    ------
    InputError
        If the shear factor is not positive.
    """

    shear_factor: float | None = None

    def __post_init__(self) -> None:
        if self.shear_factor is not None:
            check_positive("shear_factor", check_numbers("shear_factor", self.shear_factor))

    def stiffness(self, material: Elasticity, moments: Sequence[np.ndarray]) -> SectionStiffness:
        E, k, (_, m2, m4) = material.E, self._factor(material), moments
        full = FullIntegration().stiffness(material, moments)  # as E + ν² E/(1−ν²) = E/(1−ν²)
        bending = full._replace(c02=E * m2, c22=E * m4, c11=E * m2, c2b=0.0 * full.c2b)
        return bending._replace(s0=k * full.s0, s1=k * full.s1)

    def stress(self, material: Elasticity, strain: Strains, y: np.ndarray) -> Sequence[np.ndarray]:
        (E, nu, _), (a0, a1, a2, b, g0, g1) = material, strain
        coupling = nu * E / (1 - nu**2)
        kG = self._factor(material) * E / (2 * (1 + nu))
        xx = E * (a0 + y * a1 + y**2 * a2) + coupling * (nu * a0 + b)
        return xx, E * b + coupling * (nu * b + a0), kG * (g0 + y * g1)

    def _factor(self, material: Elasticity) -> ArrayLike:
        return material.k if self.shear_factor is None else self.shear_factor
