"""Friction with presliding: the bristles of LuGre."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_non_negative, check_positive
from flexband.errors import InputError
from flexband.mechanics.joints.joint import PointName, check_axis
from flexband.mechanics.loads.force_laws import ForceLaw
from flexband.mechanics.loads.load import Entries, LoadModel, PairLoad


@frozen()
class LuGre(PairLoad):
    """Friction along a line that gives way before it slides (Canudas de Wit et al. 1995).

    Bristles with the deflection z carry the force σ₀ z + σ₁ ż + σ₂ u, where u is the sliding speed,

        ż = u − σ₀ |u| z/g(u),   g(u) = F_c + (F_s − F_c) exp(−(u/v)²).

    It is smooth and needs no events, and `LawState(name, "z", "m")` reads z. Unlike `Coulomb` it
    creeps: under a load that changes, what should stick moves a little in every cycle.

    Parameters
    ----------
    first : the point that slides.
    second : a point of the line.
    kinetic, static : F_c and F_s [N], more than zero, F_s at least F_c.
    stiffness : σ₀ [N/m].
    damping : σ₁ [N s/m].
    viscous : σ₂ [N s/m].
    stribeck_speed : v [m/s].
    axis : direction of the line in the axes of the second body; any length but zero.

    Raises
    ------
    InputError
        If a number is out of its range, or the axis has no length.

    Examples
    --------
    >>> block = fb.Mechanism(
    ...     bodies={"m": fb.PointMass(mass=1.0)},
    ...     joints={"guide": fb.Slot("m", (0.0, 0.0))},
    ...     loads={
    ...         "pull": fb.Force("m", fb.ramp(0.5, 0.5), 0.0),
    ...         "felt": fb.contact.LuGre("m", (0.0, 0.0), 1.0, 1.5, stiffness=1e4, damping=200.0),
    ...     },
    ...     sensors={"x": fb.Position("m")},
    ... )
    >>> moved = fb.simulate(block, duration=1.0, step=1e-3).sel(output="x_X")[-1]
    >>> f"{float(moved):.1e}"  # [m]: the bristles bend by F/σ₀ = 5e-5, and creep
    '6.1e-05'
    """

    first: PointName
    second: PointName
    kinetic: ArrayLike
    static: ArrayLike
    stiffness: ArrayLike
    damping: ArrayLike = 0.0
    viscous: ArrayLike = 0.0
    stribeck_speed: ArrayLike = 1e-3
    axis: tuple[float, float] = (1.0, 0.0)

    def __post_init__(self) -> None:
        kinetic = check_positive("LuGre kinetic [N]", self.kinetic)
        static = check_finite("LuGre static [N]", self.static)
        if np.any(static < kinetic):
            raise InputError(
                f"LuGre static [N] must be at least kinetic; got {self.static} and {self.kinetic}"
            )
        check_positive("LuGre stiffness [N/m]", self.stiffness)
        check_non_negative("LuGre damping [N s/m]", self.damping)
        check_non_negative("LuGre viscous [N s/m]", self.viscous)
        check_positive("LuGre stribeck_speed [m/s]", self.stribeck_speed)
        check_axis("LuGre axis", self.axis)

    def enters(self, model: LoadModel) -> Entries:
        numbers = self.kinetic, self.static, self.stribeck_speed
        numbers += self.stiffness, self.damping, self.viscous
        axis = np.asarray(self.axis, dtype=float) / np.linalg.norm(self.axis)
        law = ForceLaw(self.points, bristles, (*numbers, *axis), states={"z": 0.0}, within=[(0, 1)])
        return law.enters(model)


def bristles(t, x, v, s, p, force, rate):
    """Fill in the forces of a `LuGre` and the rate of its deflection."""
    kinetic, static, speed, stiffness, damping, viscous, ax, ay = p
    u = ax * v[2, 0] + ay * v[2, 1]
    level = kinetic + (static - kinetic) * math.exp(-((u / speed) ** 2))
    rate[0] = u - stiffness * abs(u) / level * s[0]
    F = stiffness * s[0] + damping * rate[0] + viscous * u
    force[2, 0] = -ax * F
    force[2, 1] = -ay * F
