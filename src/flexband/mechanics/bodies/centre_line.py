"""What beams and cables share: a centre line of Hermite cubics with named points.

The centre line is the Hermite cubic through the nodes' r and r_x. Integrals along it use
`GAUSS_POINTS` points an element.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError, finite, known, positive, whole
from flexband.mechanics.bodies.curves import PANELS, Path, drawn, measured
from flexband.mechanics.bodies.rigid import MassEntries, Point, point
from flexband.mechanics.forms import Form, Frame, Vector, add, scale
from flexband.mechanics.kernels.hermite import POSITIONS, WEIGHTS, hermite, hermite_slope

Property = ArrayLike | Callable[[np.ndarray], ArrayLike]
"""A number, an array of shape (n,), or a function of the position along the axis [m]. The function
takes positions of shape (points,) or (n, points) and returns values of shape (points,) or
(n, points)."""


@dataclass(frozen=True, kw_only=True)
class CentreLine:
    """A flexible line of elements; see `Beam` and `Cable` for the parameters."""

    length: ArrayLike
    elements: int
    start: Point = (0.0, 0.0)
    angle: ArrayLike = 0.0
    velocity: Point = (0.0, 0.0)
    rate: ArrayLike = 0.0
    curvature: Property = 0.0

    per_node: ClassVar[int]
    """Coordinates of a node; the first four are r and r_x."""

    def __post_init__(self) -> None:
        name = type(self).__name__
        positive(f"{name} length [m]", self.length)
        whole(f"{name} elements", self.elements, 1)
        point(f"{name} start", self.start)
        finite(f"{name} angle [rad]", self.angle)
        point(f"{name} velocity", self.velocity)
        finite(f"{name} rate [rad/s]", self.rate)
        if not callable(self.curvature):
            finite(f"{name} curvature [1/m]", self.curvature)

    @classmethod
    def along(cls, path: Path, **properties: Any) -> Self:
        """Return one that lies along a path, free of stress there.

        Parameters
        ----------
        path : a function that takes u, shape (m,), from 0 to 1 to points, shape (m, 2), or points
            (m, 2) that a cubic spline is laid through [m].
        properties : all but length, start, angle and curvature, which the path tells.

        Raises
        ------
        InputError
            Where the path has no tangent somewhere, or another number is out of its range.
        """
        return cls(**measured(path)._asdict(), **properties)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.per_node * (self.elements + 1)

    @property
    def nodes(self) -> range:
        """Places of the nodes' positions among the coordinates."""
        return range(0, self.size, self.per_node)

    @property
    def element_coordinates(self) -> int:
        """Number of coordinates of an element, those of two nodes."""
        return 2 * self.per_node

    def axis(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return X, Y and angle of the nodes at the start, each of shape (n or 1, nodes)."""
        angle, x0, y0 = (
            np.atleast_1d(np.asarray(v, dtype=float))[:, None] for v in (self.angle, *self.start)
        )
        length = np.atleast_1d(self.element_length)[:, None]
        nodes = np.arange(self.elements + 1)
        if callable(self.curvature):
            places = np.arange(self.elements * PANELS + 1) / PANELS
            curvature = self.evaluated(places, "curvature [1/m]", self.curvature, finite)
            x, y, turned = drawn(curvature, length / PANELS)
        else:
            half = np.asarray(self.curvature, dtype=float)[..., None] * length * nodes / 2
            chord, turned = length * nodes * np.sinc(half / np.pi), 2 * half
            x, y = chord * np.cos(half), chord * np.sin(half)
        c, s = np.cos(angle), np.sin(angle)
        return x0 + c * x - s * y, y0 + s * x + c * y, angle + turned

    def coordinates(self) -> list[np.ndarray]:
        """Return the coordinates at the start, node by node, each of shape () or (n,)."""
        raise NotImplementedError

    def velocities(self) -> list[np.ndarray]:
        """Return the rates of the coordinates at the start: those of a rigid body."""
        q, rate = self.coordinates(), np.asarray(self.rate, dtype=float)
        vx, vy = (np.asarray(v, dtype=float) for v in self.velocity)
        rates = []
        for k in self.nodes:
            rates += [vx - rate * (q[k + 1] - q[1]), vy + rate * (q[k] - q[0])]
            for d in range(k + 2, k + self.per_node, 2):
                rates += [-rate * q[d + 1], rate * q[d]]
        return rates

    def node_frame(self, first: int) -> Frame:
        """Return the frame of the node whose coordinates start at z_first."""
        raise NotImplementedError

    def section_direction(self, xi: float, a: Frame, b: Frame, slope: Vector) -> Vector:
        """Return r_y at ξ between two nodes, where the axis has this slope."""
        raise NotImplementedError

    def frame(self, name: str, first: int) -> Frame:
        """Return the frame of a named point; the body's coordinates start at z_first."""
        return self._frame_at(self.located(name), first)

    def located(self, name: str) -> float:
        """Return how many elements from the start a named point is.

        Raises
        ------
        InputError
            Where there is no such point.
        """
        count = self.elements
        places = {"start": 0.0, "end": count, "middle": count / 2, "center": count / 2}
        places |= {f"node {k}": k for k in range(count + 1)}
        try:
            place = places[name] if name in places else float(name) * count
        except ValueError:
            place = np.nan
        if not 0 <= place <= count:
            known("point", name, [*places, "a part of the length from 0 to 1"])
        return place

    def _frame_at(self, place: float, first: int) -> Frame:
        """Return the frame at `place` elements from the start."""
        if place == round(place):
            return self.node_frame(first + self.per_node * round(place))
        element = int(place)
        a = self.node_frame(first + self.per_node * element)
        b = self.node_frame(first + self.per_node * (element + 1))
        xi, length = place - element, self.element_length

        def combined(h, position, slope):
            ends = add(scale(h[0] * position, a.position), scale(h[2] * position, b.position))
            return add(ends, add(scale(h[1] * slope, a.x), scale(h[3] * slope, b.x)))

        x = combined(hermite_slope(xi), 1 / length, 1.0)
        return Frame(combined(hermite(xi), 1.0, length), x, self.section_direction(xi, a, b, x))

    def constraints(self, first: int) -> list[Form]:
        """Return none: it is free to deform."""
        return []

    # --- integrals over the elements --------------------------------------------------------

    @property
    def element_length(self) -> np.ndarray:
        """Length of an element [m], shape () or (n,)."""
        return np.asarray(self.length, dtype=float) / self.elements

    def _at_gauss_points(self, name: str, value: Property, check: Callable) -> np.ndarray:
        """Return a property at the Gauss points, shape (n or 1, elements, GAUSS_POINTS)."""
        places = np.arange(self.elements)[:, None] + POSITIONS
        values = self.evaluated(np.append(places.ravel(), (0.0, self.elements)), name, value, check)
        return values[:, :-2].reshape(-1, *places.shape)  # the ends were checked as well

    def evaluated(
        self, places: np.ndarray, name: str, value: Property, check: Callable
    ) -> np.ndarray:
        """Return a property at so many elements from the start, shape (n or 1, places).

        Raises
        ------
        InputError
            Where a value is not allowed, or there is not one for each sample and place.
        """
        x = self.element_length[..., None] * places
        values = value(x) if callable(value) else np.asarray(value, dtype=float)[..., None]
        try:
            shape = np.broadcast_shapes(np.shape(values), x.shape)
            values = np.atleast_2d(np.broadcast_to(values, shape))
        except ValueError:
            if not callable(value):
                raise InputError(
                    f"{name} has {np.size(value)} samples, its length {len(x)}"
                ) from None
            raise InputError(
                f"{name} as a function of positions of shape {x.shape} must return values of that "
                f"shape or (n, {x.shape[-1]}); got shape {np.shape(values)}"
            ) from None
        check(name, values)
        return values

    def strains(self, q: np.ndarray, xi: float, length: np.ndarray) -> Sequence[np.ndarray]:
        """Return the strains at ξ in elements of this length; q is (element coordinates, …)."""
        raise NotImplementedError

    @property
    def straight(self) -> bool:
        """Whether the axis is straight at the start."""
        return not callable(self.curvature) and not np.any(np.asarray(self.curvature))

    def initial_strains(self, points: np.ndarray) -> list[np.ndarray]:
        """Return the strains at these ξ at the start, each of shape (elements, points, n or 1).

        The Hermite cubics follow a curve closely but not exactly; all this is free of stress.
        """
        q = self.by_element(np.stack(np.broadcast_arrays(*self.coordinates())))
        at_points = [self.strains(q, xi, self.element_length) for xi in points]
        return [np.stack(column, axis=1) for column in zip(*at_points, strict=True)]

    def by_element(self, q: np.ndarray) -> np.ndarray:
        """Return coordinates (size, …) as (element coordinates, elements, …)."""
        own = np.arange(self.element_coordinates)[:, None]
        return q[own + self.per_node * np.arange(self.elements)]

    @property
    def _factors(self) -> np.ndarray:
        """Factors of the Hermite cubics for r and r_x of both ends, shape (n or 1, 4)."""
        length = np.atleast_1d(self.element_length)
        return np.stack([np.ones_like(length), length, np.ones_like(length), length], axis=1)

    def _axis_places(self, element: int) -> list[int]:
        """Return the places of X of r and r_x of both ends of an element."""
        first = self.per_node * element
        return [first, first + 2, first + self.per_node, first + self.per_node + 2]

    def line_load(self, x: Property, y: Property) -> dict[int, np.ndarray]:
        """Return ∫ f · ∂r/∂q ds of a load f = (x, y) [N/m] by coordinate."""
        force: dict[int, np.ndarray] = {}
        weights = np.atleast_1d(self.element_length)[:, None, None] * WEIGHTS
        for axis, value in enumerate((x, y)):
            at_points = self._at_gauss_points(f"load {'xy'[axis]} [N/m]", value, finite)
            products = np.einsum("neg,ig->nei", at_points * weights, hermite(POSITIONS))
            for e in range(self.elements):
                for k, place in enumerate(self._axis_places(e)):
                    part = products[:, e, k] * self._factors[:, k]
                    force[place + axis] = force.get(place + axis, 0.0) + part
        return force

    def axis_mass(self, mass: np.ndarray) -> MassEntries:
        """Return ∫ μ S₀ᵀS₀ ds of r₀, μ [kg/m] at the Gauss points as of `_at_gauss_points`."""
        weights = mass * self.element_length[..., None, None] * WEIGHTS
        along = self._factors[:, :, None] * hermite(POSITIONS)
        blocks = np.einsum("neg,nig,njg->nije", weights, along, along)
        entries: MassEntries = {}
        for e in range(self.elements):
            add_pairs(entries, self._axis_places(e), blocks[..., e])
        return entries


def add_pairs(entries: MassEntries, places: list[int], block: np.ndarray) -> None:
    """Add a symmetric block (n, i, j) for X and Y of the vectors at these places."""
    for a, i in enumerate(places):
        for b, j in enumerate(places[a:], start=a):
            for axis in range(2):
                key = (i + axis, j + axis)
                entries[key] = entries.get(key, 0.0) + block[:, a, b]
