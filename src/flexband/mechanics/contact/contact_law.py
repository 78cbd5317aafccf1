"""Force laws of contacts: a geometry and a normal law put together.

A law is called for all lanes with the address of its memory, see `kernels.laws.forces`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.checks import check_finite, check_instance
from flexband.errors import InputError
from flexband.mechanics.contact.friction import FrictionEntry
from flexband.mechanics.contact.normal_laws import NormalLaw
from flexband.mechanics.kernels.lanes import (
    any_true,
    compiled,
    less,
    load,
    load_rows,
    magnitude,
    maximum,
    minimum,
    power,
    splat,
    sqrt,
    store_rows,
    where,
)
from flexband.mechanics.kernels.laws.forces import AXES, GAP
from flexband.mechanics.kernels.laws.states import MARK

LAW_PARAMETERS = 5
"""K, n, a, the least δ̇₀ and ζ come before the parameters of a geometry."""

IMPACT_REACH = 2.0
"""Depth of an impact, as the speed that it takes, over its speed: more is due to other forces."""


class PairContact(NamedTuple):
    """A contact between two points."""

    law: Callable[..., None]  # of the memory of all lanes; `loads.compiled_laws` compiles it
    parameters: Sequence[ArrayLike]  # of the normal law, then of the geometry
    kind: int = GAP.length  # what the gap is of
    friction: FrictionEntry | None = None  # along the surfaces


def pair_contact(
    kernel: Callable[..., tuple],
    normal_law: NormalLaw,
    *parameters: ArrayLike,
    friction: FrictionEntry | None = None,
) -> PairContact:
    """Return a contact with the kernel of a `Geometry` and its parameters."""
    numbers = (*normal_law.parameters, *parameters)
    return PairContact(_law_of(kernel, len(numbers)), numbers, friction=friction)


def angle_contact(normal_law: NormalLaw, sign: float, limit: ArrayLike) -> PairContact:
    """Return a contact that keeps ± the angle of the first body less that of the second below."""
    return PairContact(angular_law, (*normal_law.parameters, sign, limit), GAP.angle)


@compiled
def elastic_force(depth, p):
    """Return K δⁿ of the parameters `LAW_PARAMETERS`."""
    n = p[1]
    depth_power = where(n - 1.5, depth, depth * sqrt(depth))
    others = (n - 1.5) * (n - 1.0)
    if any_true(others):
        depth_power = where(others, power(depth, n), depth_power)
    return p[0] * depth_power


@compiled
def damping_coefficient(depth, elastic, mode, mass, p):
    """Return c [N s/m] of a closed contact, whose force is K δⁿ + c δ̇; see `normal_laws`.

    `mode` is minus δ̇₀. `mass` is the effective one, negative where the impact is over.
    """
    none = splat(0.0)
    n = p[1]
    speed = maximum(-mode, p[3])
    impact_over = less(mass, none)
    mass = magnitude(mass)
    # From the restitution of the impact, and from the damping of vibrations.
    of_impact = p[2] * elastic / speed
    tangent = n * elastic / maximum(depth, splat(1e-300))
    of_vibration = 2.0 * p[4] * sqrt(tangent * mass)
    reach = 2.0 * elastic * depth / ((n + 1.0) * maximum(mass, splat(1e-300)) * speed * speed)
    reach = where(impact_over, splat(1e300), reach / (IMPACT_REACH * IMPACT_REACH))
    damping = maximum(of_impact / maximum(reach, splat(1.0)), of_vibration)
    c = where(less(splat(1.0), reach), minimum(damping, of_impact), of_impact)
    return where(less(none, depth), where(less(-mode, splat(MARK.at_rest)), c, none), none)


@compiled
def normal_force(depth, rate, mode, mass, p):
    """Return F of a contact and the power that it takes, (F − K δⁿ) δ̇.

    `mode` is negative where the contact is closed, of the size of δ̇₀.
    """
    d = maximum(depth, splat(0.0))
    none = splat(0.0)
    open_ = less(splat(0.0), mode)
    elastic = elastic_force(d, p)
    force = elastic + damping_coefficient(d, elastic, mode, mass, p) * rate
    force = maximum(force, none)
    loss = where(open_, none, (force - elastic) * rate)
    force = where(open_, none, force)
    return where(less(mode, splat(-0.5 * MARK.unit)), splat(1.0), force), loss


@cache
def _law_of(kernel: Callable[..., tuple], count: int) -> Callable[[int], None]:
    """Return the law of the kernel of a geometry, with so many parameters of both."""
    x, v, force, mode = accumulate((1 + count, 2 * AXES, 2 * AXES, 2 * AXES))
    second_x = x + AXES
    second_v = v + AXES

    def law(memory):
        p = load_rows(memory, 1, count)
        x1 = load_rows(memory, x, AXES)
        x2 = load_rows(memory, second_x, AXES)
        v1 = load_rows(memory, v, AXES)
        v2 = load_rows(memory, second_v, AXES)
        # The gap, its normal, and where the bodies touch, from their centres.
        gap, nx, ny, ax, ay, bx, by = kernel((x1, x2), p[LAW_PARAMETERS:])
        ax = ax - x1[0]
        ay = ay - x1[1]
        bx = bx - x2[0]
        by = by - x2[1]
        # Rate of the gap.
        vx = v1[0] - v1[2] * ay - v2[0] + v2[2] * by
        vy = v1[1] + v1[2] * ax - v2[1] - v2[2] * bx
        rate = nx * vx + ny * vy
        # The force, and its moments on both bodies.
        F, loss = normal_force(-gap, -rate, load(memory, mode), load(memory, mode + 5), p)
        first = F * (ax * ny - ay * nx)
        second = F * (by * nx - bx * ny)
        store_rows(memory, force, (F * nx, F * ny, first, -F * nx, -F * ny, second))
        store_rows(memory, mode + 1, (gap, F, rate, loss))

    return law


def angular_law(memory):
    """Fill in the moments of an angular stop; its parameters end with a sign and the limit."""
    p = load_rows(memory, 1, 7)
    none = splat(0.0)
    sign = p[5]
    limit = p[6]
    x = 8
    v = 14
    force = 20
    mode = 26  # rows after the time and seven parameters
    gap = limit - sign * (load(memory, x + 2) - load(memory, x + 5))
    rate = sign * (load(memory, v + 5) - load(memory, v + 2))
    M, loss = normal_force(-gap, -rate, load(memory, mode), load(memory, mode + 5), p)
    store_rows(memory, force, (none, none, -sign * M, none, none, sign * M))
    store_rows(memory, mode + 1, (gap, M, rate, loss))


def check_law(name: str, value: NormalLaw | None) -> None:
    """Raise `InputError` if a value is not a normal law."""
    check_instance(name, value, NormalLaw, "a normal law, such as fb.contact.KeepsRestitution")


def checked_limits(
    name: str, lower: ArrayLike | None, upper: ArrayLike | None
) -> list[tuple[float, np.ndarray]]:
    """Return a sign and a limit for each of the limits that are given."""
    if lower is None and upper is None:
        raise InputError(f"{name} needs finite limits, lower, upper or both; got {lower}, {upper}")
    limits = []
    if lower is not None:
        limits.append((-1.0, -check_finite(f"{name} lower", lower)))
    if upper is not None:
        limits.append((1.0, check_finite(f"{name} upper", upper)))
    if len(limits) == 2 and np.any(-limits[0][1] >= limits[1][1]):
        raise InputError(f"{name} lower limit must be below the upper one; got {lower}, {upper}")
    return limits
