"""How surfaces slide along each other."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import ArrayLike

from flexband.mechanics.kernels.forms import Form, Vector, fixed

NO_LEVER = fixed((0.0, 0.0))


class Action(NamedTuple):
    """Where friction acts on the two bodies of a contact.

    Attributes
    ----------
    along : the direction, of any length, in which it acts on the second body where λ > 0.
    first, second : from the first and the second point to where it acts, or to the centre of the
        first circle.
    radius : from this centre to where it acts: the angle of the first body enters s with it.
    """

    along: Vector
    first: Vector
    second: Vector
    radius: ArrayLike


class Travel(NamedTuple):
    """How two surfaces slide: along s, whose rate is the sliding speed.

    Attributes
    ----------
    travel : s, a form of the coordinates and of angles.
    action : of a contact.
    orbit : an angle φ, whose product with the length of ``action.second`` is added to s.
    """

    travel: Form
    action: Action | None = None
    orbit: Form | None = None
