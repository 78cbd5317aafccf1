"""The base class of beams and cables: a centre line of Hermite cubics with named points.

The centre line r₀ of an element is the Hermite cubic through the r and r_x of its two nodes.
Integrals along it use `GAUSS_POINTS` points per element. A position along the line is measured in
elements from its start; inside an element ξ in [0, 1] is the local coordinate.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.checks import (
    check_angle,
    check_finite,
    check_integer,
    check_non_negative,
    check_positive,
    check_same_samples,
)
from flexband.errors import InputError
from flexband.mechanics.bodies.body import Body, MassEntries, Point, add_pairs, point
from flexband.mechanics.bodies.curves import Path, arc, drawn, measure_path
from flexband.mechanics.bodies.mesh import Mesh, divided_mesh
from flexband.mechanics.bodies.properties import Along, Property, evaluate_property
from flexband.mechanics.kernels.elements.hermite import POSITIONS, WEIGHTS, hermite, hermite_slope
from flexband.mechanics.kernels.forms import Form, PlanarFrame, Vector, add, scale, subtract


class ElementState(NamedTuple):
    """A place in elements of a member."""

    q: np.ndarray  # coordinates of the elements, shape (element coordinates, …)
    xi: float  # the place ξ
    length: np.ndarray  # of the elements [m], shape (…)
    initial: np.ndarray  # their `element_strains` at the start
    section: Sequence[np.ndarray] | np.ndarray  # the `section_stiffness` at ξ
    inertia: np.ndarray  # −μ r̈ at both nodes [N/m], shape (2, 2, …)


@dataclass(frozen=True, kw_only=True)
class CentreLine(Body):
    """A flexible line of elements.

    See `Beam` and `Cable` for the parameters that they share: `length`, `elements`, `start`,
    `angle`, `velocity`, `rate`, `curvature` and both retardation times.

    `elements_per_node` is the number of elements between two named nodes. It is more than one if
    the mesh was refined, so that "node 2" stays where it was. `elements_left_out` tells whether
    no number of elements was given.

    `divisions` are the places, as fractions of the length, where loads and joints act between the
    ends. The line is divided there: it has a node at each, and its elements are shared among the
    parts so that the longest one is as short as possible, all elements of a part being equal. Such
    a node is doubled, and `constraints` join the two as far as section forces do not jump.
    """

    length: ArrayLike
    elements: int = None  # pyright: ignore[reportAssignmentType]: None is replaced at once
    start: Point = (0.0, 0.0)
    angle: ArrayLike = 0.0
    velocity: Point = (0.0, 0.0)
    rate: ArrayLike = 0.0
    curvature: Property = 0.0
    retardation_time: ArrayLike = 0.0
    bending_retardation_time: ArrayLike | None = None
    elements_per_node: int = 1
    elements_left_out: bool = False
    divisions: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        name = type(self).__name__
        check_positive(f"{name} length [m]", self.length)
        if self.elements is None:
            object.__setattr__(self, "elements", 4)
            object.__setattr__(self, "elements_left_out", True)
        elements = check_integer(f"{name} elements", self.elements, 1, 100_000)
        object.__setattr__(self, "elements", elements)
        check_integer(f"{name} elements_per_node", self.elements_per_node, 1, elements)
        # Divisions are increasing fractions.
        places = [0.0, *self.divisions, 1.0] if isinstance(self.divisions, tuple) else [0.0]
        numeric = all(isinstance(place, float) for place in places)
        if not (numeric and np.all(np.diff(places) > 0) and len(places) > 1):
            raise InputError(
                f"{name} divisions must be a tuple of increasing numbers between 0 and 1; got "
                f"{self.divisions!r}"
            )
        start = point(f"{name} start", self.start)
        check_angle(f"{name} angle", self.angle)
        velocity = point(f"{name} velocity", self.velocity)
        check_finite(f"{name} rate [rad/s]", self.rate)
        check_non_negative(f"{name} retardation_time [s]", self.retardation_time)
        if self.bending_retardation_time is not None:
            check_non_negative(
                f"{name} bending_retardation_time [s]", self.bending_retardation_time
            )
        curvature = (f"{name} curvature [1/m]", self.curvature, check_finite)
        for quantity, value, check in (curvature, *self.properties()):
            if not callable(value):
                check(quantity, value)
        curvatures = [] if callable(self.curvature) else [self.curvature]
        motion = self.angle, self.rate, *start, *velocity
        check_same_samples(name, self.length, *self.retardation_times, *curvatures, *motion)

    @classmethod
    def along(cls, path: Path, **properties: Any) -> Self:
        """Return a body that lies along a path and is free of stress there.

        Parameters
        ----------
        path : a function that maps u, shape (m,), from 0 to 1 to points (X, Y) [m], shape (m, 2),
            or an array of points, shape (m, 2), which a cubic spline interpolates.
        **properties : all parameters except `length`, `start`, `angle` and `curvature`, which are
            those of the path.

        Raises
        ------
        InputError
            If the path has no tangent somewhere, or a number is out of its range.
        """
        return cls(**measure_path(path)._asdict(), **properties)

    @abstractmethod
    def properties(self) -> Sequence[tuple[str, Property, Callable]]:
        """Return the name, the value and the check of each material property."""

    @abstractmethod
    def node_frame(self, first: int) -> PlanarFrame:
        """Return the frame of the node whose coordinates start at z_first."""

    @abstractmethod
    def section_jumps(self, before: PlanarFrame, after: PlanarFrame) -> Sequence[Form]:
        """Return what else than r both frames of a doubled node must agree in, as forms."""

    @abstractmethod
    def section_direction(self, xi: float, a: PlanarFrame, b: PlanarFrame, slope: Vector) -> Vector:
        """Return r_y at ξ between the nodes a and b, where r_x of the axis is `slope`."""

    @abstractmethod
    def line_mass(self, along: Along) -> np.ndarray:
        """Return the mass per length μ [kg/m] at the positions of `along`."""

    @abstractmethod
    def section_stiffness(self, along: Along) -> Sequence[np.ndarray]:
        """Return the stiffness numbers of the section at the positions of `along`."""

    @abstractmethod
    def element_strains(self, q: np.ndarray, length: np.ndarray) -> np.ndarray:
        """Return the strains of elements at q, as in `strains`, or what determines them.

        The member is free of stress at those of the undeformed elements, which contain the
        curvature and the error of the Hermite cubics.
        """

    @abstractmethod
    def strains(self, state: ElementState) -> Sequence[np.ndarray]:
        """Return the generalized strains of the section less those at the start, each (…)."""

    @abstractmethod
    def section_forces(self, state: ElementState) -> Sequence[np.ndarray]:
        """Return the axial force, the shear force [N] and the bending moment [N m], each (…)."""

    def across(self, along: Along) -> np.ndarray | None:
        """Return the height of the section [m] at the positions of `along`, if there is one."""
        return None

    def fibre(self, y: ArrayLike, along: Along) -> Sequence[ArrayLike]:
        """Return the numbers that strains and stresses at y [m] depend on, the first being y."""
        return [y]

    @abstractmethod
    def fibre_strains(self, state: ElementState, fibre: np.ndarray) -> Sequence[np.ndarray]:
        """Return E_xx, E_yy and 2E_xy at the place of a `fibre`, each (…)."""

    def fibre_stresses(self, state: ElementState, fibre: np.ndarray) -> Sequence[np.ndarray]:
        """Return S_xx, S_yy and S_xy [Pa] at the place of a `fibre`, if there is one."""
        raise NotImplementedError

    @property
    @abstractmethod
    def element_table(self) -> str:
        """Field of the assembled `Structure` that the elements belong to."""

    @abstractmethod
    def element_stiffness(self) -> list[np.ndarray]:
        """Return the stiffness by the `element_strains` [J], numbers of shape (n or 1, elements).

        Continuum elements have that of their sections instead.
        """

    def initial_strains(self, points: np.ndarray) -> list[np.ndarray]:
        """Return the strains of continuum elements at these ξ at the start; others have none."""
        return []

    @property
    @abstractmethod
    def counts(self) -> tuple[int, int]:
        """How many `element_strains` and numbers of `section_stiffness` there are."""

    @property
    def retardation_times(self) -> list[ArrayLike]:
        """Those of all strains but bending, and of bending [s]."""
        bending = self.bending_retardation_time
        return [self.retardation_time, self.retardation_time if bending is None else bending]

    @property
    def size(self) -> int:
        return self.per_node * (self.elements + 1 + len(self.mesh.doubled))

    @cached_property
    def mesh(self) -> Mesh:
        """Where the nodes are."""
        return divided_mesh(self.elements, self.elements_per_node, self.divisions)

    @property
    def element_coordinates(self) -> int:
        """Number of coordinates of an element, those of its two nodes."""
        return 2 * self.per_node

    @property
    def element_rows(self) -> np.ndarray:
        """Index of the first coordinate of each element, counted from the line's first one."""
        e = np.arange(self.elements)
        return self.per_node * (e + np.searchsorted(self.mesh.doubled, e, side="right"))

    @property
    def even_length(self) -> np.ndarray:
        """Length of an element [m], shape () or (n,), if all are equal; else the mean."""
        return np.asarray(self.length, dtype=float) / self.elements

    def length_of(self, element: int) -> np.ndarray:
        """Return the length of an element [m], shape () or (n,)."""
        return self.even_length * np.diff(self.mesh.nodes)[element]

    @property
    def element_lengths(self) -> np.ndarray:
        """Length of each element [m], shape (n or 1, elements)."""
        return np.atleast_1d(self.even_length)[:, None] * np.diff(self.mesh.nodes)

    def doubled_frames(self, first: int) -> list[tuple[PlanarFrame, PlanarFrame]]:
        """Return the frames before and after each doubled node; `first` is as in `constraints`."""
        nodes = [first + int(self.element_rows[e]) for e in self.mesh.doubled]
        return [(self.node_frame(n - self.per_node), self.node_frame(n)) for n in nodes]

    def constraints(self, first: int) -> list[Form]:
        """Return the differences of both frames of each doubled node; see `section_jumps`."""
        return [
            row
            for a, b in self.doubled_frames(first)
            for row in (*subtract(a.position, b.position), *self.section_jumps(a, b))
        ]

    def coordinates(self) -> list[np.ndarray]:  # r, r_x and, of a beam, r_y of each node
        nodes = []
        for x, y, angle in zip(*(column.T for column in self.node_axes()), strict=True):
            c = np.cos(angle)
            s = np.sin(angle)
            nodes += [x, y, c, s, -s, c][: self.per_node]
        return nodes

    def angles(self) -> Sequence[ArrayLike]:
        return list(self.node_axes()[2].T)

    def node_axes(self) -> list[np.ndarray]:
        """Return X [m], Y [m] and angle [rad] of `axis`, with the nodes that are doubled."""
        twice = np.sort(np.append(np.arange(self.elements + 1), self.mesh.doubled))
        return [column[:, twice] for column in self.axis()]

    def axis(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return X [m], Y [m] and angle [rad] of the undeformed nodes, shape (n or 1, nodes)."""
        angle, x0, y0 = (
            np.atleast_1d(np.asarray(v, dtype=float))[:, None] for v in (self.angle, *self.start)
        )
        length = np.atleast_1d(self.even_length)[:, None]
        if callable(self.curvature):
            panels = 64  # of Simpson's rule between two nodes
            places = np.arange(self.elements * panels + 1) / panels
            curvature = self.evaluate_at(places, "curvature [1/m]", self.curvature, check_finite)
            steps = None if self.mesh.even else panels * self.mesh.at(places)
            curve = drawn(curvature, length / panels, steps)
            x, y, turn = (column[:, ::panels] for column in curve)
        else:
            curvature = np.asarray(self.curvature, dtype=float)[..., None]
            x, y, turn = arc(curvature, length * self.mesh.nodes)
        c = np.cos(angle)
        s = np.sin(angle)
        return x0 + c * x - s * y, y0 + s * x + c * y, angle + turn

    def velocities(self) -> list[np.ndarray]:  # those of a rigid body
        q = self.coordinates()
        rate = np.asarray(self.rate, dtype=float)
        vx, vy = (np.asarray(v, dtype=float) for v in self.velocity)
        rates = []
        for k in self.nodes:
            rates += [vx - rate * (q[k + 1] - q[1]), vy + rate * (q[k] - q[0])]
            for d in range(k + 2, k + self.per_node, 2):
                rates += [-rate * q[d + 1], rate * q[d]]
        return rates

    def refine_mesh(self, parts: int) -> Self:
        elements = parts * self.elements
        per_node = parts * self.elements_per_node
        return replace(self, elements=elements, elements_per_node=per_node, elements_left_out=False)

    def divide_at(self, points: Iterable[str]) -> Self:
        places = set()
        for name in points:
            with suppress(InputError):  # it is refused where the point is used
                places.add(self._place(name) / self.elements)
        divisions = tuple(sorted(places - {0.0, 1.0}))
        return self if divisions == self.divisions else replace(self, divisions=divisions)

    def element_position(self, name: str) -> float:
        """Return the position of a named point, in elements from the start; refuse others."""
        return self.mesh.element_position(self._place(name))

    def _place(self, name: str) -> float:
        """Return the place of a named point in lengths of an element, if all were equal."""
        count = self.elements
        per_node = self.elements_per_node
        places = {"start": 0.0, "end": count, "middle": count / 2, "center": count / 2}
        places |= {f"node {k}": k * per_node for k in range(count // per_node + 1)}
        try:
            place = places[name] if name in places else float(name) * count
        except (TypeError, ValueError, OverflowError):
            place = np.nan
        if not 0 <= place <= count:
            raise InputError(
                f"point must be 'start', 'middle', 'center', 'end', 'node 0' to "
                f"'node {count // per_node}', or a fraction of the length from '0' to '1'; "
                f"got {name!r}"
            )
        return place

    def frame(self, name: str, first: int) -> PlanarFrame:
        place = self.element_position(name)
        rows = first + self.element_rows
        # At a node the frame is that of the node.
        if place == self.elements:
            return self.node_frame(int(rows[-1]) + self.per_node)
        element = int(place)
        a = self.node_frame(int(rows[element]))
        b = self.node_frame(int(rows[element]) + self.per_node)
        if element in self.mesh.doubled and place == element:
            before = self.node_frame(int(rows[element]) - self.per_node)
            return replace(a, axes=(scale(0.5, add(before.x, a.x)), a.y))
        if place == element:
            return a
        # Within an element it is interpolated between those of its nodes.
        xi = place - element
        length = self.length_of(element)

        def combine(h, position, slope):
            ends = add(scale(h[0] * position, a.position), scale(h[2] * position, b.position))
            return add(ends, add(scale(h[1] * slope, a.x), scale(h[3] * slope, b.x)))

        x = combine(hermite_slope(xi), 1 / length, 1.0)
        axes = x, self.section_direction(xi, a, b, x)
        return PlanarFrame(combine(hermite(xi), 1.0, length), axes)

    def fractions(self, parts: int) -> np.ndarray:
        """Return fractions of the length that divide each element into this many equal parts."""
        count = parts * self.elements
        places = np.arange(count + 1) / count
        return places if self.mesh.even else self.mesh.at(self.elements * places) / self.elements

    def at_gauss_points(self, name: str, value: Property, check: Callable) -> np.ndarray:
        """Return a property at the Gauss points, shape (n or 1, elements, GAUSS_POINTS)."""
        places = np.arange(self.elements)[:, None] + POSITIONS
        values = self.evaluate_at(
            np.append(places.ravel(), (0.0, self.elements)), name, value, check
        )
        return values[:, :-2].reshape(-1, *places.shape)  # the ends were checked as well

    def evaluate_at(
        self, places: np.ndarray, name: str, value: Property, check: Callable
    ) -> np.ndarray:
        """Evaluate a property at `places`, in elements from the start, shape (n or 1, places)."""
        return evaluate_property(
            self.even_length[..., None] * self.mesh.at(places), name, value, check
        )

    @property
    def weights(self) -> np.ndarray:
        """Weights of the Gauss points in integrals [m], shape (n or 1, elements, points)."""
        return self.element_lengths[..., None] * WEIGHTS

    def stiffness(self) -> list[np.ndarray]:
        """Return each number of `section_stiffness` at the Gauss points, times their `weights`."""
        return [self.weights * c for c in self.section_stiffness(self.at_gauss_points)]

    @property
    def straight(self) -> bool:
        """Whether the undeformed axis is straight."""
        return not callable(self.curvature) and not np.any(np.asarray(self.curvature))

    @property
    def at_start(self) -> np.ndarray:
        """Coordinates of the undeformed elements, shape (element coordinates, elements, n or 1)."""
        q = np.stack(np.broadcast_arrays(*self.coordinates()))
        return q[np.arange(self.element_coordinates)[:, None] + self.element_rows]

    @property
    def _shapes(self) -> np.ndarray:
        """Factors of r and r_x of both ends in r₀, (n or 1, 4, elements, points)."""
        length = self.element_lengths
        factors = np.stack([np.ones_like(length), length] * 2, axis=1)
        return factors[..., None] * hermite(POSITIONS)[:, None]

    def _axis_places(self, element: int) -> list[int]:
        """Return the indices of the X components of r and r_x of both ends of an element."""
        first = int(self.element_rows[element])
        return [first, first + 2, first + self.per_node, first + self.per_node + 2]

    def line_load(self, x: Property, y: Property) -> dict[int, np.ndarray]:
        """Return the force ∫ f · ∂r/∂q ds on each coordinate of a line load f = (x, y) [N/m]."""
        force: dict[int, np.ndarray] = {}
        for axis, value in enumerate((x, y)):
            at_points = self.at_gauss_points(f"load {'xy'[axis]} [N/m]", value, check_finite)
            parts = np.einsum("neg,nieg->nei", at_points * self.weights, self._shapes)
            for e in range(self.elements):
                for k, place in enumerate(self._axis_places(e)):
                    force[place + axis] = force.get(place + axis, 0.0) + parts[:, e, k]
        return force

    def axis_mass(self, mass: np.ndarray) -> MassEntries:
        """Return ∫ μ S₀ᵀS₀ ds with r₀ = S₀ q; μ [kg/m] has the shape of `at_gauss_points`."""
        shapes = self._shapes
        blocks = np.einsum("neg,nieg,njeg->nije", mass * self.weights, shapes, shapes)
        entries: MassEntries = {}
        for e in range(self.elements):
            add_pairs(entries, self._axis_places(e), blocks[..., e])
        return entries
