"""Quadratic forms in the state z of a mechanism, in which joints, loads and sensors are written.

A node carries an affine frame, so the position of any point and the direction of any axis are
linear in the coordinates, and every joint is at most quadratic. Joints and sensors are therefore
written as algebra, ``dot(a.x, b.y)``, and the engine evaluates one table of products for all of
them. See `kernels.state` for the rows of z.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.user_functions import evaluate_function
from flexband.errors import InputError

TimeFunction = Callable[[float], ArrayLike]
"""A function of the time [s], which returns a number or an array of shape (n,)."""

COEFFICIENTS = 8
"""Of the polynomial of a function of time in a round of free steps, see `time_functions`."""


@dataclass(frozen=True)
class Composed:
    """The function outer(inner(t)) of the time; `name` is that of inner(t), for messages."""

    outer: Callable[[np.ndarray], np.ndarray]
    inner: TimeFunction
    name: str

    def __call__(self, time: float) -> np.ndarray:
        return self.outer(evaluate_function(self.inner, time, self.name))


def during_impulse(time: float) -> float:
    """Stand for the function that is 1 while an impulse acts, which a run knows; return 0."""
    return 0.0


Key = tuple[int, int, TimeFunction | None]


class Polar(NamedTuple):
    """The term c f(t) θ with the angle θ of a vector that is at most quadratic, or c f(t) ℓ.

    ℓ is the length of a linear vector.
    """

    vector: Vector
    c: np.ndarray
    f: TimeFunction | None = None
    length: bool = False


@dataclass(frozen=True)
class Form:
    """The function Σ c f(t) z_i z_j + Σ c f(t) θ + Σ c f(t) ℓ.

    The angles θ and the lengths ℓ are those of vectors, see `Polar`. `terms` maps (i, j, f), i ≤ j,
    to c of shape () or (n,).
    """

    terms: Mapping[Key, np.ndarray]
    polar: tuple[Polar, ...] = ()

    @staticmethod
    def constant(value: ArrayLike) -> Form:
        """Return the constant form of a number or an array of shape (n,)."""
        c = np.asarray(value, dtype=float)
        return Form({(0, 0, None): c} if c.ndim or c != 0 else {})

    @staticmethod
    def variable(index: int) -> Form:
        """Return the form z_index."""
        return Form({(0, index, None): np.asarray(1.0)})

    @staticmethod
    def function(function: TimeFunction) -> Form:
        """Return the form f(t)."""
        return Form({(0, 0, function): np.asarray(1.0)})

    def shift(self, rows: int) -> Form:
        """Return the linear form with z_{rows + j} in place of every z_j.

        With the row where [0, v] or [0, a] starts this is the first or second rate of the form.
        """
        return Form({(0, rows + j, None): c for (_, j, _), c in self.terms.items() if j > 0})

    def __add__(self, other: Form) -> Form:
        terms = dict(self.terms)
        for key, value in other.terms.items():
            terms[key] = terms[key] + value if key in terms else value
        return Form(terms, self.polar + other.polar)

    def __sub__(self, other: Form | ArrayLike) -> Form:
        return self + (other if isinstance(other, Form) else Form.constant(other)) * -1.0

    def __neg__(self) -> Form:
        return self * -1.0

    def __mul__(self, other: Form | ArrayLike) -> Form:
        if not isinstance(other, Form):
            other = Form.constant(other)
        terms: dict[Key, np.ndarray] = {}
        for (i, j, f), a in self.terms.items():
            for (k, m, g), b in other.terms.items():
                c = a * b
                if c.ndim or c != 0:  # a zero that is not an array is zero for all samples
                    key = _key((i, j, k, m), f, g)
                    terms[key] = terms[key] + c if key in terms else c
        return Form(terms, self._scaled_polar(other))

    __rmul__ = __mul__

    def _scaled_polar(self, other: Form) -> tuple[Polar, ...]:
        """Return the angles and lengths of a product, which may have a factor c f(t)."""
        if not (self.polar or other.polar):
            return ()
        factor, scaled = (other, self) if self.polar else (self, other)
        if factor.polar or any((i, j) != (0, 0) for i, j, _ in factor.terms):
            raise ValueError("an angle or length in a form can be multiplied by c f(t) only")
        return tuple(
            term._replace(c=term.c * c, f=_key((), f, term.f)[2])
            for term in scaled.polar
            for (_, _, f), c in factor.terms.items()
        )

    def with_variables(self, numbers: Iterator[int]) -> Form:
        """Return the form with variables of these numbers in place of its angles and lengths."""
        variables = (Form({(0, next(numbers), term.f): term.c}) for term in self.polar)
        return sum(variables, Form(self.terms))

    def at(self, z: Sequence[ArrayLike]) -> np.ndarray:
        """Return the value at t = 0 for z, numbers or arrays."""
        value = np.zeros(())
        for (i, j, f), c in self.terms.items():
            value = value + c * (1.0 if f is None else evaluate_function(f, 0.0)) * np.multiply(
                z[i], z[j]
            )
        for (x, y), c, f, length in self.polar:
            polar = np.hypot(x.at(z), y.at(z)) if length else np.arctan2(y.at(z), x.at(z))
            value = value + c * (1.0 if f is None else evaluate_function(f, 0.0)) * polar
        return value


def _key(indices: tuple[int, ...], f: TimeFunction | None, g: TimeFunction | None) -> Key:
    variables = sorted(i for i in indices if i != 0)
    if len(variables) > 2 or (f is not None and g is not None):
        raise ValueError("a term of a form has at most two variables and one function of time")
    i, j = [0] * (2 - len(variables)) + variables
    return i, j, f if f is not None else g


Vector = tuple[Form, ...]
"""A form for each component: X and Y in the plane."""


def moves(vector: Vector) -> bool:
    """Return whether a vector depends on the coordinates."""
    return any(j > 0 for form in vector for _, j, _ in form.terms)


def constant_vector(vector: Sequence[ArrayLike]) -> Vector:
    """Return a vector that does not depend on the state."""
    return tuple(map(Form.constant, vector))


def add(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return tuple(p + q for p, q in zip(a, b, strict=True))


def subtract(a: Vector, b: Vector) -> Vector:
    """Return a − b."""
    return tuple(p - q for p, q in zip(a, b, strict=True))


def scale(factor: Form | ArrayLike, a: Vector) -> Vector:
    """Return `factor` times a."""
    return tuple(component * factor for component in a)


def angle(a: Vector) -> Form:
    """Return the angle from the X axis to a vector of the plane [rad], with turns counted."""
    return Form({}, (Polar(a, np.asarray(1.0)),))


def length(a: Vector) -> Form:
    """Return the length of a linear vector."""
    return Form({}, (Polar(a, np.asarray(1.0), length=True),))


def dot(a: Vector, b: Vector) -> Form:
    """Return the scalar product a · b."""
    first, *others = (p * q for p, q in zip(a, b, strict=True))
    return sum(others, first)


def cross(a: Vector, b: Vector) -> Form:
    """Return the out-of-plane component of a × b, of vectors of the plane."""
    return a[0] * b[1] - a[1] * b[0]


def rotate(a: Vector, angle: ArrayLike) -> Vector:
    """Return `a` rotated by an angle [rad]."""
    c, s = (f(np.asarray(angle, dtype=float)) for f in (np.cos, np.sin))
    return a[0] * c - a[1] * s, a[0] * s + a[1] * c


GeneralizedForce = dict[int, Form]
"""Row of z -> the generalized force on this coordinate."""


def at_point(force: Vector, position: Vector) -> GeneralizedForce:
    """Return the generalized force of a force F at a position r, from its virtual work F · δr."""
    return _work(zip(force, position, strict=True))


def about(moment: Form | ArrayLike, direction: Vector) -> GeneralizedForce:
    """Return the generalized force of a moment on a unit vector d, from M d × δd.

    The section of a flexible member has no unit vector; see `Entries.moments`.
    """
    x, y = direction
    return _work([(y * moment * -1.0, x), (x * moment, y)])


def constraint_force(rows: Sequence[Form], multipliers: Sequence[Form]) -> GeneralizedForce:
    """Return −Φ_qᵀλ."""
    force: GeneralizedForce = {}
    for row, multiplier in zip(rows, multipliers, strict=True):
        for (i, j, f), c in row.terms.items():
            for variable, other in ((i, j), (j, i)):
                if variable > 0:
                    part = multiplier * Form({(0, other, f): -c})
                    force[variable] = force[variable] + part if variable in force else part
    return force


def _work(products) -> GeneralizedForce:
    force: GeneralizedForce = {}
    for factor, displaced in products:
        for (_, j, _), c in displaced.terms.items():
            if j > 0:
                part = factor * c
                force[j] = force[j] + part if j in force else part
    return force


@dataclass(frozen=True)
class Frame:
    """A point of a body and the axes that the body carries there, forms of as many components."""

    position: Vector  # r
    axes: tuple[Vector, ...]
    rigid: bool = False  # whether the axes are perpendicular unit vectors

    @property
    def x(self) -> Vector:
        """The first axis, r_x of Eq. (22)."""
        return self.axes[0]

    @property
    def y(self) -> Vector:
        """The second axis, r_y of Eq. (23)."""
        return self.axes[1]

    def is_on_body_of(self, other: Frame) -> bool:
        """Return whether both frames are on one rigid body, or on the ground."""
        same = all(
            a.terms.keys() == b.terms.keys()
            for axis, other_axis in zip(self.axes, other.axes, strict=True)
            for a, b in zip(axis, other_axis, strict=True)
        )
        return self.rigid and other.rigid and same

    def shift(self, rows: int) -> Self:
        """Return the rates of the frame, or its second rates; see `Form.shift`."""
        position, *axes = (
            tuple(form.shift(rows) for form in vector) for vector in (self.position, *self.axes)
        )
        return replace(self, position=position, axes=tuple(axes))

    def direction(self, *components: Form | ArrayLike) -> Vector:
        """Return the vector with these components in the axes of the body, 0 where left out."""
        parts = zip(components, self.axes[: len(components)], strict=True)
        return reduce(add, (scale(component, axis) for component, axis in parts))

    def translate(self, *components: ArrayLike) -> Self:
        """Return the frame at local coordinates [m] on the same rigid body, Eq. (25)."""
        return replace(self, position=add(self.position, self.direction(*components)))

    @staticmethod
    def ground(position: Sequence[ArrayLike]) -> Frame:
        """Return the global frame moved to `position` [m]."""
        kind = PlanarFrame if len(position) == 2 else Frame
        axes = np.eye(len(position)).tolist()
        return kind(constant_vector(position), tuple(map(constant_vector, axes)), rigid=True)


class PlanarFrame(Frame):
    """A frame of the plane: r, r_x and r_y.

    Where a flexible member is deformed, the axes are neither unit vectors nor perpendicular to each
    other.
    """

    @property
    def normal(self) -> Vector:
        """The normal of the section: r_y rotated by −90°, which is r_x on a rigid body.

        Its angle is that of the section; its length is one if the frame is rigid.
        """
        return self.y[1], -self.y[0]

    def direction(self, *components: Form | ArrayLike) -> Vector:
        """Return x times the normal and y times the normal turned by 90°.

        If the frame is rigid, (x, y) are the components of this vector in the axes of the body.
        """
        x, y = components
        return add(scale(x, self.normal), scale(y, self.y))

    @staticmethod
    def of_node(first: int) -> PlanarFrame:
        """Return the frame of the node whose six coordinates start at z_first."""
        v = [Form.variable(first + k) for k in range(6)]
        return PlanarFrame((v[0], v[1]), ((v[2], v[3]), (v[4], v[5])))

    @staticmethod
    def of_rigid_node(first: int) -> PlanarFrame:
        """Return the frame of the node whose coordinates [r, r_x] start at z_first."""
        return replace(PlanarFrame.of_slope_node(first), rigid=True)

    @staticmethod
    def of_slope_node(first: int) -> PlanarFrame:
        """Return the frame of a cable's node, whose coordinates [r, r_x] start at z_first."""
        v = [Form.variable(first + k) for k in range(4)]
        return PlanarFrame((v[0], v[1]), ((v[2], v[3]), (-v[3], v[2])))


def section_normal(frame: Frame) -> Vector:
    """Return the normal of a section of the plane, whose angle is that of the section.

    Raise `InputError` if the frame is one of space.
    """
    if not isinstance(frame, PlanarFrame):
        raise InputError("a body of space has no angle; a joint or load that needs one is planar")
    return frame.normal
