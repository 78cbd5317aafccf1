"""Relations between two frames, in the plane and in space, in which joints are written.

An axis has its components in the second frame, and those of `first_axis` in the first one, by
default the same. In the plane bodies turn about the Z axis, which is parallel whatever they do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.mechanics.kernels.forms import (
    Form,
    Frame,
    GeneralizedForce,
    PlanarFrame,
    Vector,
    about,
    angle,
    at_point,
    cross,
    dot,
    scale,
    section_normal,
    subtract,
)

Axis = Sequence[float]

Z: Axis = (0.0, 0.0, 1.0)


def meet(first: Frame, second: Frame) -> list[Form]:
    """Return the components of r_first − r_second."""
    return list(subtract(first.position, second.position))


def along(frame: Frame, axis: Axis) -> Vector:
    """Return a direction given in the axes of a frame, a unit vector if the frame is rigid."""
    return frame.direction(*(np.asarray(axis, dtype=float) / np.linalg.norm(axis)))


def across(frame: Frame, axis: Axis) -> list[Vector]:
    """Return unit vectors across an axis: that to its left in the plane, two in space.

    Those of space are X and Y for the Z axis, and vary smoothly with the axis on either side of the
    plane z = 0 (Duff et al., J. Computer Graphics Techniques 6 (2017) 1).
    """
    if isinstance(frame, PlanarFrame):
        x, y = axis
        return [along(frame, (-y, x))]
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    side = np.copysign(1.0, z)
    a = -1.0 / (side + z)
    first = 1.0 + side * x * x * a, side * x * y * a, -side * x
    second = x * y * a, side + y * y * a, -y
    return [frame.direction(*first), frame.direction(*second)]


def parallel(
    first: Frame,
    second: Frame,
    axis: Axis = Z,
    first_axis: Axis | None = None,
) -> list[Form]:
    """Return rows u · v that keep an axis of both bodies parallel: none in the plane."""
    if isinstance(first, PlanarFrame):
        return []
    carried = along(first, axis if first_axis is None else first_axis)
    return [dot(vector, carried) for vector in across(second, axis)]


def turn(
    first: Frame,
    second: Frame,
    axis: Axis = Z,
    first_axis: Axis | None = None,
) -> Form:
    """Return the angle by which the first body is turned against the second about an axis [rad]."""
    if isinstance(first, PlanarFrame):
        return angle(section_normal(first)) - angle(section_normal(second))
    return angle(_arm(first, second, axis, first_axis))


def alignment(
    first: Frame,
    second: Frame,
    cosine: Form | ArrayLike,
    sine: Form | ArrayLike,
    axis: Axis = Z,
    first_axis: Axis | None = None,
) -> tuple[Form, Form]:
    """Return the sine and the cosine of the angle about an axis, less a given one.

    In the plane these are products of the normals of both sections. A joint that keeps the angle
    has the first as a row of Φ, and the second as a condition.
    """
    if isinstance(first, PlanarFrame):
        x, y = section_normal(second)
        reference = x * cosine - y * sine, x * sine + y * cosine
        normal = section_normal(first)
        return cross(reference, normal), dot(reference, normal)
    x, y = _arm(first, second, axis, first_axis)
    return y * cosine - x * sine, x * cosine + y * sine


def _arm(first: Frame, second: Frame, axis: Axis, first_axis: Axis | None) -> Vector:
    """Return a vector across the axis of the first body, in those across the axis of the second."""
    arm, _ = across(first, axis if first_axis is None else first_axis)
    x, y = across(second, axis)
    return dot(arm, x), dot(arm, y)


def moment(frame: Frame, *components: Form | ArrayLike) -> GeneralizedForce:
    """Return the generalized force of a moment [N m] on a rigid body: one component in the plane.

    In space it is the force ½ M × g on each axis g, whose virtual work is M · δφ.
    """
    if isinstance(frame, PlanarFrame):
        (component,) = components
        return about(component, section_normal(frame))
    x, y, z = (c if isinstance(c, Form) else Form.constant(c) for c in components)
    force: GeneralizedForce = {}
    for axis in frame.axes:
        a, b, c = axis
        product = y * c - z * b, z * a - x * c, x * b - y * a
        for row, part in at_point(scale(0.5, product), axis).items():
            force[row] = force.get(row, Form({})) + part
    return force
