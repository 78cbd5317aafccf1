"""How surfaces slide along each other."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import ArrayLike

from flexband.mechanics.kernels.forms import Form, Vector, fixed

NO_LEVER = fixed((0.0, 0.0))


class Action(NamedTuple):
    """Where friction acts on the two bodies of a contact."""

    along: Vector  # direction, of any length, in which it acts on the second body where λ > 0
    first: Vector  # from the first point to where it acts, or to the centre of the first circle
    second: Vector  # the same from the second point
    radius: ArrayLike  # from this centre to where it acts: θ₁ enters s with it


class Travel(NamedTuple):
    """How two surfaces slide: along s, whose rate is the sliding speed."""

    travel: Form  # s, of the coordinates and of angles
    action: Action | None = None  # of a contact
    orbit: Form | None = None  # φ, whose product with the length of ``action.second`` is added to s
