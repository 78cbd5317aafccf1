"""How surfaces slide along each other."""

from __future__ import annotations

from typing import NamedTuple

from flexband.mechanics.kernels.forms import Form, Vector


class Travel(NamedTuple):
    """How two surfaces slide: along s, whose rate is the sliding speed.

    Attributes
    ----------
    travel : s, a form of the coordinates and of angles.
    orbit, centres : an angle φ and a vector d, of which |d| φ is added to s.
    """

    travel: Form
    orbit: Form | None = None
    centres: Vector | None = None
