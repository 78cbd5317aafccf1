"""Force laws of contacts: a geometry and a normal law put together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from flexband.errors import InputError, check_finite, shown
from flexband.mechanics.contact.normal_laws import NormalLaw
from flexband.mechanics.kernels.laws.forces import GAP

LAW_PARAMETERS = 4
"""K, n, a and the least δ̇₀ come before the parameters of a geometry."""


class PairContact(NamedTuple):
    """A contact between two points.

    Attributes
    ----------
    law : compiled as a force law, see `loads.compiled_laws`.
    parameters : of the normal law, then of the geometry.
    kind : what the gap is of, see `kernels.laws.forces`.
    """

    law: Callable[..., None]
    parameters: Sequence[ArrayLike]
    kind: int = GAP.length


def touching(
    kernel: Callable[..., tuple], normal_law: NormalLaw, *parameters: ArrayLike
) -> PairContact:
    """Return a contact with the kernel of a `Geometry` and its parameters."""
    return PairContact(_law_of(kernel), (*normal_law.parameters, *parameters))


def turning(normal_law: NormalLaw, sign: float, limit: ArrayLike) -> PairContact:
    """Return a contact that keeps ± the angle of the first body less that of the second below."""
    return PairContact(angular_law, (*normal_law.parameters, sign, limit), GAP.angle)


@njit(error_model="numpy")
def normal_force(depth, rate, mode, p):
    """Return F of a contact; `mode` is negative where it is closed, of the size of δ̇₀."""
    if mode > 0.0 or depth <= 0.0:
        return 0.0
    return max(p[0] * depth ** p[1] * (1.0 + p[2] * rate / max(-mode, p[3])), 0.0)


@cache
def _law_of(kernel: Callable[..., tuple]) -> Callable[..., None]:
    """Return the force law of the kernel of a geometry."""

    def law(t, x, v, p, force, mode, gap):
        gap[0], nx, ny, ax, ay, bx, by = kernel(x, p[LAW_PARAMETERS:])
        ax, ay, bx, by = ax - x[0, 0], ay - x[0, 1], bx - x[1, 0], by - x[1, 1]
        vx = v[0, 0] - v[0, 2] * ay - v[1, 0] + v[1, 2] * by
        vy = v[0, 1] + v[0, 2] * ax - v[1, 1] - v[1, 2] * bx
        gap[1] = normal_force(-gap[0], -(nx * vx + ny * vy), mode[0], p)
        force[0, 0], force[0, 1] = gap[1] * nx, gap[1] * ny
        force[0, 2] = gap[1] * (ax * ny - ay * nx)
        force[1, 0], force[1, 1] = -gap[1] * nx, -gap[1] * ny
        force[1, 2] = -gap[1] * (bx * ny - by * nx)

    return law


def angular_law(t, x, v, p, force, mode, gap):
    """Fill in the moments of an angular stop; its parameters end with a sign and the limit."""
    sign, limit = p[4], p[5]
    gap[0] = limit - sign * (x[0, 2] - x[1, 2])
    gap[1] = normal_force(-gap[0], sign * (v[0, 2] - v[1, 2]), mode[0], p)
    force[0, 2], force[1, 2] = -sign * gap[1], sign * gap[1]


def check_law(name: str, value: object) -> NormalLaw:
    """Return a normal law; raise `InputError` if it is something else."""
    if not isinstance(value, NormalLaw):
        raise InputError(
            f"{name} must be a normal law, such as fb.contact.KeepsRestitution; got {shown(value)}"
        )
    return value


def checked_limits(
    name: str, lower: ArrayLike | None, upper: ArrayLike | None
) -> list[tuple[float, np.ndarray]]:
    """Return a sign and a limit for each of the limits that are given.

    Raises
    ------
    InputError
        If none is given, one is not finite, or the lower is not below the upper one.
    """
    limits = {-1.0: lower, 1.0: upper}
    given = {
        sign: check_finite(f"{name} {'upper' if sign > 0 else 'lower'}", value)
        for sign, value in limits.items()
        if value is not None
    }
    if not given:
        raise InputError(f"{name} needs finite limits, lower, upper or both; got {lower}, {upper}")
    if len(given) == 2 and np.any(given[-1.0] >= given[1.0]):
        raise InputError(f"{name} lower limit must be below the upper one; got {lower}, {upper}")
    return [(sign, sign * value) for sign, value in given.items()]
