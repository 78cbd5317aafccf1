"""Cross-sections of beams: their moments, shear factor and height.

A section is symmetric to the beam's axis, so that ∫y dA = ∫y³ dA = 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flexband.errors import InputError, positive
from flexband.mechanics.bodies.centre_line import Property

Along = Callable[[str, Property, Callable], np.ndarray]
"""Evaluates a property, given its name and its check, where it is wanted along the beam."""


class Section(Protocol):
    """What a beam asks of its section; its sizes may be functions of the position along it."""

    def moments(self, along: Along) -> list[np.ndarray]:
        """Return ∫dA, ∫y²dA and ∫y⁴dA."""
        ...

    def across(self, along: Along) -> np.ndarray:
        """Return the size across the beam, in the plane [m]."""
        ...

    def shear_factor(self, nu: np.ndarray, along: Along) -> np.ndarray:
        """Return k, the part of the section that carries shear, for Poisson's ratio ν."""
        ...


def _check(section: object, *names: str) -> None:
    for name in names:
        if not callable(getattr(section, name)):
            positive(f"{type(section).__name__} {name}", getattr(section, name))


@dataclass(frozen=True)
class Rectangle:
    """A rectangle of `height` (in the plane) by `width` [m].

    Raises
    ------
    InputError
        Where a size is not positive.
    """

    height: Property
    width: Property

    def __post_init__(self) -> None:
        _check(self, "height", "width")

    def moments(self, along: Along) -> list[np.ndarray]:
        """Return w h, w h³/12 and w h⁵/80."""
        h, w = self.across(along), along("width [m]", self.width, positive)
        return [w * h, w * h**3 / 12, w * h**5 / 80]

    def across(self, along: Along) -> np.ndarray:
        """Return h."""
        return along("height [m]", self.height, positive)

    def shear_factor(self, nu: np.ndarray, along: Along) -> np.ndarray:
        """Return 10(1+ν)/(12+11ν) (Cowper 1966)."""
        return 10 * (1 + nu) / (12 + 11 * nu)


@dataclass(frozen=True)
class Circle:
    """A circle, or a tube where it has an inner diameter [m].

    Raises
    ------
    InputError
        Where the diameter is not positive, or the inner one not below it.
    """

    diameter: Property
    inner_diameter: Property | None = None

    def __post_init__(self) -> None:
        _check(self, "diameter", *(() if self.inner_diameter is None else ("inner_diameter",)))

    def moments(self, along: Along) -> list[np.ndarray]:
        """Return π D²/4, π D⁴/64 and π D⁶/512, less those of the hole."""
        full, hole = self.across(along), self._hole(along)
        if np.any(hole >= full):
            raise InputError("Circle inner_diameter must be below its diameter")
        return [np.pi / c * (full**k - hole**k) for c, k in ((4.0, 2), (64.0, 4), (512.0, 6))]

    def across(self, along: Along) -> np.ndarray:
        """Return the diameter."""
        return along("diameter [m]", self.diameter, positive)

    def _hole(self, along: Along) -> np.ndarray:
        if self.inner_diameter is None:
            return np.zeros(1)
        return along("inner_diameter [m]", self.inner_diameter, positive)

    def shear_factor(self, nu: np.ndarray, along: Along) -> np.ndarray:
        """Return 6(1+ν)(1+m²)²/((7+6ν)(1+m²)² + (20+12ν)m²), m = d/D (Cowper 1966)."""
        m = (self._hole(along) / self.across(along)) ** 2
        return 6 * (1 + nu) * (1 + m) ** 2 / ((7 + 6 * nu) * (1 + m) ** 2 + (20 + 12 * nu) * m)


@dataclass(frozen=True)
class GeneralSection:
    """Any symmetric section, by its moments.

    Parameters
    ----------
    area : ∫dA [m²].
    second_moment : ∫y²dA [m⁴].
    fourth_moment : ∫y⁴dA [m⁶]; that of the rectangle of the same area and second moment where None.
        It matters for large strains only.
    shear : k, the part of the section that carries shear.

    Raises
    ------
    InputError
        Where a number is not positive.
    """

    area: Property
    second_moment: Property
    fourth_moment: Property | None = None
    shear: float = 5 / 6

    def __post_init__(self) -> None:
        given = ("area", "second_moment", "shear")
        _check(self, *given, *(() if self.fourth_moment is None else ("fourth_moment",)))

    def moments(self, along: Along) -> list[np.ndarray]:
        """Return what was given."""
        area = along("area [m²]", self.area, positive)
        second = along("second_moment [m⁴]", self.second_moment, positive)
        if self.fourth_moment is None:
            return [area, second, 1.8 * second**2 / area]
        return [area, second, along("fourth_moment [m⁶]", self.fourth_moment, positive)]

    def across(self, along: Along) -> np.ndarray:
        """Return the height of the rectangle of the same area and second moment."""
        area, second, _ = self.moments(along)
        return np.sqrt(12 * second / area)

    def shear_factor(self, nu: np.ndarray, along: Along) -> np.ndarray:
        """Return what was given."""
        return np.broadcast_to(self.shear, nu.shape)
