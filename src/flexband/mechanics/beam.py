"""Flexible beams of planar shear-deformable ANCF elements, Eq. (22).

The element of Omar and Shabana (2001) is cubic along its axis and linear across it:
r(x, y) = r₀(x) + y d(x), with r₀ the Hermite cubic through the nodes' r and r_x, and d linear
between the nodes' r_y. Integrals across the section are therefore exact in its moments ∫dA, ∫y²dA
and ∫y⁴dA; integrals along the axis use `GAUSS_POINTS` points, exact for uniform properties.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError, finite, known, poissons_ratio, positive, whole
from flexband.mechanics.bodies import MassEntries, Point, point
from flexband.mechanics.forms import Form, Frame, add, scale
from flexband.mechanics.integration import SectionIntegration, SelectiveIntegration

GAUSS_POINTS = 5
"""Points along an element: (r_x·r_x)² has degree 8, and five points are exact up to degree 9."""

POSITIONS, WEIGHTS = (a / 2 for a in np.polynomial.legendre.leggauss(GAUSS_POINTS))
POSITIONS = POSITIONS + 0.5  # on [0, 1]

Property = ArrayLike | Callable[[np.ndarray], ArrayLike]
"""A number, an array of shape (n,), or a function of the position along the axis [m]. The function
takes positions of shape (points,) or (n, points) and returns values of shape (points,) or
(n, points)."""


@dataclass(frozen=True, kw_only=True)
class Beam:
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

    length: ArrayLike
    height: ArrayLike
    width: ArrayLike
    density: Property
    youngs_modulus: Property
    poissons_ratio: Property
    elements: int
    start: Point = (0.0, 0.0)
    angle: ArrayLike = 0.0
    velocity: Point = (0.0, 0.0)
    rate: ArrayLike = 0.0
    integration: SectionIntegration = field(default_factory=SelectiveIntegration)

    def __post_init__(self) -> None:
        positive("Beam length [m]", self.length)
        positive("Beam height [m]", self.height)
        positive("Beam width [m]", self.width)
        for name, value, check in self._material():
            if not callable(value):
                check(name, value)
        whole("Beam elements", self.elements, 1)
        point("Beam start", self.start)
        finite("Beam angle [rad]", self.angle)
        point("Beam velocity", self.velocity)
        finite("Beam rate [rad/s]", self.rate)

    def _material(self):
        return (
            ("Beam density [kg/m³]", self.density, positive),
            ("Beam youngs_modulus [Pa]", self.youngs_modulus, positive),
            ("Beam poissons_ratio", self.poissons_ratio, poissons_ratio),
        )

    # --- what assembly asks of every body ---------------------------------------------------

    @property
    def size(self) -> int:
        """Number of coordinates, six a node."""
        return 6 * (self.elements + 1)

    @property
    def nodes(self) -> range:
        """Places of the nodes' positions among the coordinates."""
        return range(0, self.size, 6)

    def coordinates(self) -> list[np.ndarray]:
        """Return the coordinates of the straight beam, node by node, each of shape () or (n,)."""
        turn, x0, y0 = (np.asarray(v, dtype=float) for v in (self.angle, *self.start))
        c, s = np.cos(turn), np.sin(turn)
        nodes = []
        for node in range(self.elements + 1):
            x = np.asarray(self.length, dtype=float) * (node / self.elements)
            nodes += [x0 + x * c, y0 + x * s, c, s, -s, c]
        return nodes

    def velocities(self) -> list[np.ndarray]:
        """Return the rates of the coordinates at the start: those of a rigid bar."""
        q, rate = self.coordinates(), np.asarray(self.rate, dtype=float)
        vx, vy = (np.asarray(v, dtype=float) for v in self.velocity)
        rates = []
        for k in range(0, self.size, 6):
            rates += [vx - rate * (q[k + 1] - q[1]), vy + rate * (q[k] - q[0])]
            for d in (k + 2, k + 4):
                rates += [-rate * q[d + 1], rate * q[d]]
        return rates

    def frame(self, name: str, first: int) -> Frame:
        """Return the frame of a named point; the body's coordinates start at z_first."""
        count = self.elements
        places = {"start": 0.0, "end": count, "middle": count / 2, "center": count / 2}
        places |= {f"node {k}": k for k in range(count + 1)}
        try:
            place = places[name] if name in places else float(name) * count
        except ValueError:
            place = np.nan
        if not 0 <= place <= count:
            known("point", name, [*places, "a part of the length from 0 to 1"])
        return self._frame_at(place, first)

    def _frame_at(self, place: float, first: int) -> Frame:
        """Return the frame at `place` elements from the start."""
        if place == round(place):
            return Frame.of_node(first + 6 * round(place))
        element = int(place)
        a = Frame.of_node(first + 6 * element)
        b = Frame.of_node(first + 6 * (element + 1))
        xi, length = place - element, self.element_length

        def combined(h, position, slope):
            ends = add(scale(h[0] * position, a.position), scale(h[2] * position, b.position))
            return add(ends, add(scale(h[1] * slope, a.x), scale(h[3] * slope, b.x)))

        return Frame(
            combined(hermite(xi), 1.0, length),
            combined(hermite_slope(xi), 1 / length, 1.0),
            add(scale(1 - xi, a.y), scale(xi, b.y)),
        )

    def constraints(self, first: int) -> list[Form]:
        """Return none: a beam is free to deform."""
        return []

    # --- integrals over the elements --------------------------------------------------------

    @property
    def element_length(self) -> np.ndarray:
        """Length of an element [m], shape () or (n,)."""
        return np.asarray(self.length, dtype=float) / self.elements

    def _section_moments(self) -> list[np.ndarray]:
        """Return ∫dA, ∫y²dA and ∫y⁴dA of the rectangle, each of shape () or (n, 1, 1)."""
        h, w = (np.asarray(a, dtype=float)[..., None, None] for a in (self.height, self.width))
        return [w * h, w * h**3 / 12, w * h**5 / 80]

    def _at_gauss_points(self, name: str, value: Property, check: Callable) -> np.ndarray:
        """Return a property at the Gauss points, shape (n or 1, elements, GAUSS_POINTS)."""
        place = np.arange(self.elements)[:, None] + POSITIONS
        x = self.element_length[..., None] * np.append(place.ravel(), (0.0, self.elements))
        values = value(x) if callable(value) else np.asarray(value, dtype=float)[..., None]
        try:
            shape = np.broadcast_shapes(np.shape(values), x.shape)
            values = np.atleast_2d(np.broadcast_to(values, shape))
        except ValueError:
            if not callable(value):
                raise InputError(
                    f"{name} has {np.size(value)} samples, the beam's length {len(x)}"
                ) from None
            raise InputError(
                f"{name} as a function of positions of shape {x.shape} must return values of that "
                f"shape or (n, {x.shape[-1]}); got shape {np.shape(values)}"
            ) from None
        check(name, values)  # at the Gauss points and at both ends
        return values[:, :-2].reshape(-1, *place.shape)

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

    def line_load(self, x: Property, y: Property) -> dict[int, np.ndarray]:
        """Return ∫ f · ∂r/∂q ds of a load f = (x, y) [N/m] by coordinate of the beam."""
        force: dict[int, np.ndarray] = {}
        one = np.ones_like(self.element_length)
        along = np.stack([one, self.element_length, one, self.element_length], axis=-1)
        weights = self.element_length[..., None] * WEIGHTS
        for axis, value in enumerate((x, y)):
            at_points = self._at_gauss_points(f"load {'xy'[axis]} [N/m]", value, finite)
            for e in range(self.elements):
                weighted = at_points[:, e, None, :] * weights[..., None, :]
                products = (weighted * hermite(POSITIONS)).sum(axis=-1)
                for k, place in enumerate((0, 2, 6, 8)):
                    j = 6 * e + place + axis
                    force[j] = force.get(j, 0.0) + products[..., k] * along[..., k]
        return force

    def mass_entries(self) -> MassEntries:
        """Return the consistent mass matrix ∫ρ SᵀS dV, constant in time."""
        area, second, _ = self._section_moments()
        density = self._at_gauss_points(*self._material()[0])
        weights = density * self.element_length[..., None, None] * WEIGHTS
        length = np.broadcast_to(self.element_length[..., None], (weights.shape[0], 1))
        one = np.ones_like(length)
        along = np.stack([one, length, one, length], axis=1) * hermite(POSITIONS)
        across = np.stack([1 - POSITIONS, POSITIONS])
        axis_mass = np.einsum("neg,nig,njg->nije", weights * area, along, along)
        section_mass = np.einsum("neg,ig,jg->nije", weights * second, across, across)

        entries: MassEntries = {}
        for e in range(self.elements):
            blocks = ((axis_mass, (0, 2, 6, 8)), (section_mass, (4, 10)))
            for block, slots in blocks:
                for a, i in enumerate(slots):
                    for b, j in enumerate(slots[a:], start=a):
                        for axis in range(2):
                            key = (6 * e + i + axis, 6 * e + j + axis)
                            entries[key] = entries.get(key, 0.0) + block[:, a, b, e]
        return entries


def hermite(xi: ArrayLike) -> np.ndarray:
    """Return the Hermite cubics on [0, 1]: value and slope at 0, value and slope at 1."""
    x = np.asarray(xi, dtype=float)
    return np.stack(
        [1 - 3 * x**2 + 2 * x**3, x - 2 * x**2 + x**3, 3 * x**2 - 2 * x**3, x**3 - x**2]
    )


def hermite_slope(xi: ArrayLike) -> np.ndarray:
    """Return the derivatives of `hermite`."""
    x = np.asarray(xi, dtype=float)
    return np.stack([6 * x**2 - 6 * x, 1 - 4 * x + 3 * x**2, 6 * x - 6 * x**2, 3 * x**2 - 2 * x])
