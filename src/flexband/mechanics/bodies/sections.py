"""Cross-sections of beams: moments, shear factor and height.

A section is symmetric about the beam's axis, so that ∫y dA = ∫y³ dA = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Protocol, runtime_checkable

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_positive
from flexband.errors import InputError
from flexband.mechanics.bodies.properties import Along, Property


@runtime_checkable
class Section(Protocol):
    """The cross-section of a beam; its dimensions may depend on the position along the beam.

    Each method evaluates the dimensions at the positions of `along` and returns arrays of shape
    (n or 1, …).
    """

    def moments(self, along: Along) -> list[np.ndarray]:
        """Return ∫dA [m²], ∫y²dA [m⁴] and ∫y⁴dA [m⁶]."""
        ...

    def across(self, along: Along) -> np.ndarray:
        """Return the height, across the beam in the plane [m]."""
        ...

    def shear_factor(self, nu: np.ndarray, along: Along) -> np.ndarray:
        """Return the shear correction factor k for Poisson's ratio ν."""
        ...


@dataclass(frozen=True)
class _Given:
    """A section whose fields are positive; those with the default None are optional."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (callable(value) or value is field.default is None):
                check_positive(f"{type(self).__name__} {field.name}", value)


@frozen()
class Rectangle(_Given):
    """A rectangle; its shear factor is 10(1+ν)/(12+11ν) (Cowper 1966).

    Parameters
    ----------
    height, width : in the plane and out of the plane [m], numbers, arrays of shape (n,), one value
        per sample, or functions of the position along the beam [m].

    Raises
    ------
    InputError
        If a dimension is not positive.
    """

    height: Property
    width: Property

    def moments(self, along: Along) -> list[np.ndarray]:
        h = self.across(along)
        w = along("width [m]", self.width, check_positive)
        return [w * h, w * h**3 / 12, w * h**5 / 80]

    def across(self, along: Along) -> np.ndarray:
        return along("height [m]", self.height, check_positive)

    def shear_factor(self, nu: np.ndarray, along: Along) -> np.ndarray:
        return 10 * (1 + nu) / (12 + 11 * nu)


@frozen()
class Circle(_Given):
    """A circle, or a tube if it has an inner diameter.

    The shear factor is 6(1+ν)(1+m²)²/((7+6ν)(1+m²)² + (20+12ν)m²), where m is the inner diameter
    over the outer one (Cowper 1966).

    Parameters
    ----------
    diameter, inner_diameter : outer and inner diameter [m], numbers, arrays of shape (n,), one
        value per sample, or functions of the position along the beam [m].

    Raises
    ------
    InputError
        If a diameter is not positive, or the inner one is not less than the outer one.
    """

    diameter: Property
    inner_diameter: Property | None = None

    def moments(self, along: Along) -> list[np.ndarray]:
        full, hole = np.broadcast_arrays(self.across(along), self._hole(along))
        if np.any(hole >= full):
            worst = np.argmax(hole - full)
            requirement = f"less than diameter, {full.flat[worst]:g}"
            raise InputError(
                f"Circle inner_diameter [m] must be {requirement}; got {hole.flat[worst]:g}"
            )
        return [np.pi / c * (full**k - hole**k) for c, k in ((4.0, 2), (64.0, 4), (512.0, 6))]

    def across(self, along: Along) -> np.ndarray:
        return along("diameter [m]", self.diameter, check_positive)

    def _hole(self, along: Along) -> np.ndarray:
        if self.inner_diameter is None:
            return np.zeros(1)
        return along("inner_diameter [m]", self.inner_diameter, check_positive)

    def shear_factor(self, nu: np.ndarray, along: Along) -> np.ndarray:
        m = (self._hole(along) / self.across(along)) ** 2
        return 6 * (1 + nu) * (1 + m) ** 2 / ((7 + 6 * nu) * (1 + m) ** 2 + (20 + 12 * nu) * m)


@frozen()
class GeneralSection(_Given):
    """A symmetric section of any shape, given by its moments.

    Area and moments are numbers, arrays of shape (n,), one value per sample, or functions of the
    position along the beam [m]. The height is that of the rectangle of the same area and second
    moment.

    Parameters
    ----------
    area : ∫dA [m²].
    second_moment : ∫y²dA [m⁴].
    fourth_moment : ∫y⁴dA [m⁶], or None for that of the rectangle of the same area and second
        moment. It matters for large strains only.
    shear : shear correction factor k.

    Raises
    ------
    InputError
        If a number is not positive.
    """

    area: Property
    second_moment: Property
    fourth_moment: Property | None = None
    shear: float = 5 / 6

    def moments(self, along: Along) -> list[np.ndarray]:
        area = along("area [m²]", self.area, check_positive)
        second = along("second_moment [m⁴]", self.second_moment, check_positive)
        if self.fourth_moment is None:
            return [area, second, 1.8 * second**2 / area]
        return [area, second, along("fourth_moment [m⁶]", self.fourth_moment, check_positive)]

    def across(self, along: Along) -> np.ndarray:
        area, second, _ = self.moments(along)
        return np.sqrt(12 * second / area)

    def shear_factor(self, nu: np.ndarray, along: Along) -> np.ndarray:
        return np.broadcast_to(self.shear, nu.shape)


def curved_second_moment(section: Section, curvature: np.ndarray, along: Along) -> np.ndarray:
    """Return ∫y²/(1 − κ₀y) dA / ∫y² dA, κ₀ [1/m]; of other shapes as of a rectangle."""
    x = curvature * section.across(along) / 2
    if not isinstance(section, Circle):
        small = np.abs(x) < 0.1
        series = 3 * sum(x ** (2 * k) / (2 * k + 3) for k in range(8))
        large = np.where(small, 0.5, x)
        return np.where(small, series, 3 * (np.arctanh(large) - large) / large**3)
    full = section.across(along) ** 4
    hole = section._hole(along) ** 4
    inside = curvature * section._hole(along) / 2
    full_part, hole_part = (4 / (1 + np.sqrt(1 - part**2)) ** 2 for part in (x, inside))
    return (full * full_part - hole * hole_part) / (full - hole)
