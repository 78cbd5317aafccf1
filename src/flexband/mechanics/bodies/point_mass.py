"""Point masses, bodies with a position and no axes."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_non_negative, check_option
from flexband.mechanics.bodies.body import Body, MassEntries, Point, point
from flexband.mechanics.kernels.forms import Form, PlanarFrame, constant_vector


@frozen(kw_only=True)
class PointMass(Body):
    """A mass without extent; its only point is "center", whose axes do not rotate.

    Parameters
    ----------
    mass : mass [kg], a number or an array of shape (n,), one value per sample. It may be zero where
        joints and the masses of other bodies determine the motion.
    position, velocity : at the start [m], [m/s]. They are guesses: assembly corrects them until
        the joints are satisfied.

    Raises
    ------
    InputError
        If the mass is negative or a number is not finite.
    """

    mass: ArrayLike
    position: Point = (0.0, 0.0)
    velocity: Point = (0.0, 0.0)

    per_node: ClassVar[int] = 2
    """Those of r."""

    def __post_init__(self) -> None:
        check_non_negative("PointMass mass [kg]", self.mass)
        point("PointMass position", self.position)
        point("PointMass velocity", self.velocity)

    def coordinates(self) -> list[np.ndarray]:
        return [np.asarray(p, dtype=float) for p in self.position]

    def velocities(self) -> list[np.ndarray]:
        return [np.asarray(p, dtype=float) for p in self.velocity]

    def mass_entries(self) -> MassEntries:
        return {(i, i): np.asarray(self.mass, dtype=float) for i in range(2)}

    def frame(self, name: str, first: int) -> PlanarFrame:
        check_option("point", name, ["center"])
        position = Form.variable(first), Form.variable(first + 1)
        return PlanarFrame(
            position, (constant_vector((1.0, 0.0)), constant_vector((0.0, 1.0))), rigid=True
        )
