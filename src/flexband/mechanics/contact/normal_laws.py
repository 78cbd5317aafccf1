"""Normal laws of contacts, F = K δⁿ (1 + a δ̇/δ̇₀).

δ is the depth of the contact, δ̇₀ the speed with which it began, and a a number that depends on the
coefficient of restitution e alone. Two free bodies that meet with δ̇₀ part with e′ δ̇₀, where

    a (1 + e′) = ln((1 + a)/(1 − a e′)),

whatever K, n, the masses and δ̇₀ are: with the work K δⁿ dδ as a variable, the equation of their
motion is separable. `KeepsRestitution` chooses a such that e′ = e; the other laws are
approximations of the literature.

Once the contact is pressed in again without having opened, its damping is at most that of a small
vibration, see `contact_law.damping_coefficient` and docs/decisions/closed-contacts.md.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import (
    check_finite,
    check_non_negative,
    check_pair,
    check_poissons_ratio,
    check_positive,
    check_same_samples,
)
from flexband.basics.words import value_text
from flexband.errors import InputError


def kept_restitution(damping: ArrayLike) -> np.ndarray:
    """Return e′ of a law with these numbers a ≥ 0, by bisection; from a series where a is small."""
    a = np.asarray(damping, dtype=float)
    low = np.zeros_like(a)
    high = np.minimum(1.0, 1.0 / np.maximum(a, 1e-300))
    for _ in range(60):
        e = (low + high) / 2
        with np.errstate(divide="ignore"):
            over = a * (1 + e) < np.log1p(a) - np.log1p(-np.minimum(a * e, 1.0))
        low = np.where(over, low, e)
        high = np.where(over, e, high)
    return np.where(a < 1e-4, 1.0 - 2.0 * a / 3.0 + 4.0 * a**2 / 9.0, (low + high) / 2)


@frozen(kw_only=True)
class NormalLaw(ABC):
    """The force of a contact along its normal.

    It never pulls: where F would be negative, it is zero.

    Parameters
    ----------
    stiffness : K [N/mⁿ], or [N m/radⁿ] of an angular stop.
    restitution : e, from 0 to 1.
    exponent : n, at least 1; 1.5 is Hertz's for balls, 1 that of a linear spring.
    least_speed : δ̇₀ counts as at least this [m/s] or [rad/s]. In slower contacts e is larger, up to
        1.

    Raises
    ------
    InputError
        If a number is out of its range.
    """

    stiffness: ArrayLike
    restitution: ArrayLike = 1.0
    exponent: ArrayLike = 1.5
    least_speed: ArrayLike = 1e-3
    least_restitution: ClassVar[float] = 0.0
    """The smallest e of a law."""

    def __post_init__(self) -> None:
        name = type(self).__name__
        check_positive(f"{name} stiffness", self.stiffness)
        e = check_non_negative(f"{name} restitution", self.restitution)
        minimum = self.least_restitution
        if np.any((e < minimum) | (e > 1)):
            worst = np.max(e) if np.max(e) > 1 else np.min(e)
            raise InputError(f"{name} restitution must be from {minimum:g} to 1; got {worst:g}")
        n = check_positive(f"{name} exponent", self.exponent)
        if np.any(n < 1):
            raise InputError(f"{name} exponent must be 1 or more; got {np.min(n):g}")
        check_positive(f"{name} least_speed", self.least_speed)
        check_same_samples(name, self.stiffness, self.restitution, self.exponent, self.least_speed)

    @abstractmethod
    def damping(self, restitution: np.ndarray) -> np.ndarray:
        """Return the number a for e."""

    @property
    def parameters(self) -> tuple[ArrayLike, ...]:
        """K, n, a, the least speed and ζ, as `contact_law` takes them."""
        a = self.damping(np.asarray(self.restitution, dtype=float))
        return self.stiffness, self.exponent, a, self.least_speed, self.damping_ratio

    @property
    def effective_restitution(self) -> np.ndarray:
        """The ratio e′ with which free bodies part."""
        return kept_restitution(self.damping(np.asarray(self.restitution, dtype=float)))

    @property
    def damping_ratio(self) -> np.ndarray:
        """ζ = −ln e/√(π² + ln² e) of a small vibration about a closed state, at most."""
        with np.errstate(divide="ignore"):
            decay = -np.log(np.asarray(self.restitution, dtype=float))
            return 1.0 / np.hypot(1.0, np.pi / decay)


@frozen(kw_only=True)
class KeepsRestitution(NormalLaw):
    """The law whose e′ is e, at least `least_restitution`, since a is about 1/e.

    Examples
    --------
    >>> law = fb.contact.KeepsRestitution(stiffness=1e9, restitution=0.5)
    >>> float(law.effective_restitution.round(6))
    0.5
    """

    least_restitution = 0.01

    def damping(self, restitution: np.ndarray) -> np.ndarray:
        low = np.zeros_like(restitution)
        high = 1.0 / restitution
        for _ in range(60):
            a = (low + high) / 2
            soft = kept_restitution(a) > restitution
            low = np.where(soft, a, low)
            high = np.where(soft, high, a)
        return np.where(restitution == 1.0, 0.0, (low + high) / 2)


@frozen(kw_only=True)
class HuntCrossley(NormalLaw):
    """a = 3 (1 − e)/2 (Hunt and Crossley 1975); e′ is 0.909, 0.663, 0.516 for e = 0.9, 0.5, 0.1."""

    def damping(self, restitution: np.ndarray) -> np.ndarray:
        return 1.5 * (1.0 - restitution)


@frozen(kw_only=True)
class LankaraniNikravesh(NormalLaw):
    """a = 3 (1 − e²)/4 (Lankarani and Nikravesh 1990); e′ is 0.913, 0.725, 0.665 for these e."""

    def damping(self, restitution: np.ndarray) -> np.ndarray:
        return 0.75 * (1.0 - restitution**2)


@frozen(kw_only=True)
class Flores(NormalLaw):
    """a = 8 (1 − e)/5e (Flores et al. 2011), e ≥ `least_restitution`; e′ is 0.894, 0.470, 0.069."""

    least_restitution = 0.01

    def damping(self, restitution: np.ndarray) -> np.ndarray:
        return 1.6 * (1.0 - restitution) / restitution


def hertz_stiffness(
    *,
    radii: tuple[ArrayLike, ArrayLike],
    youngs_moduli: tuple[ArrayLike, ArrayLike],
    poissons_ratios: tuple[ArrayLike, ArrayLike],
) -> np.ndarray:
    """Return K [N/m^1.5] of two balls, (4/3) E* √R* (Johnson 1985, Eq. 4.23).

    1/E* is the sum of (1 − ν²)/E, and 1/R* that of 1/R.

    Parameters
    ----------
    radii : of the balls [m]; infinity for a plane, negative for the hollow of a socket.
    youngs_moduli, poissons_ratios : E [Pa] and ν of both.

    Raises
    ------
    InputError
        If a modulus is not positive, ν is not between −1 and 0.5, or the balls do not touch
        in a point: 1/R* must be positive.

    Examples
    --------
    >>> K = fb.contact.hertz_stiffness(
    ...     radii=(0.0095, -0.01), youngs_moduli=(207e9, 207e9), poissons_ratios=(0.3, 0.3)
    ... )
    >>> f"{float(K):.3g}"
    '6.61e+10'
    """
    compliance = np.zeros(())
    curvature = np.zeros(())
    for E, nu, R in zip(
        check_pair("youngs_moduli [Pa]", youngs_moduli),
        check_pair("poissons_ratios", poissons_ratios),
        check_pair("radii [m]", radii),
        strict=True,
    ):
        modulus = check_positive("youngs_moduli [Pa]", E)
        ratio = check_poissons_ratio("poissons_ratios", nu)
        infinite = np.ndim(R) == 0 and R in (math.inf, -math.inf)
        radius = np.asarray(R) if infinite else check_finite("radii [m]", R)
        if np.any(radius == 0):
            raise InputError(f"radii [m] must be numbers other than 0; got {value_text(R)}")
        compliance = compliance + (1.0 - ratio**2) / modulus
        curvature = curvature + 1.0 / radius
    if np.any(curvature <= 0):
        raise InputError(
            f"radii [m] must be those of balls that touch in a point; got {radii}, with "
            f"1/R₁ + 1/R₂ = {np.min(curvature):g}"
        )
    return 4.0 / (3.0 * compliance * np.sqrt(curvature))
