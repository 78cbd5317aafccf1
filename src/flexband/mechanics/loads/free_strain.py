"""Strains and curvatures without stress: thermal expansion, prestrain, shrinkage."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_function
from flexband.basics.user_functions import evaluate_function
from flexband.errors import InputError
from flexband.mechanics.bodies.assumed_strains import AXIAL, GAUSS
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.properties import Property
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.kernels.forms import Form, TimeFunction
from flexband.mechanics.loads.load import Entries, FreeStrainEntry, LoadModel

History = Callable[[np.ndarray, float], ArrayLike]
"""A function of the position [m] and the time [s]."""


class _Free:
    """What a member is without stress, as a function of position and time."""

    member: str
    factor: TimeFunction | None
    history: History | None

    def _check(self, kind: str, value: Property) -> None:
        name = type(self).__name__
        if not callable(value):
            check_finite(f"{name} {kind}", value)
        if self.factor is not None:
            check_function(f"{name} factor", self.factor, " of time")
        if self.history is not None:
            check_function(f"{name} history", self.history, " of position and time")

    @property
    def points(self) -> Sequence[PointName]:
        """The ends of the member, between which it acts."""
        return [f"{self.member}.start", f"{self.member}.end"]

    def _along(
        self, model: LoadModel, kind: str, value: Property, xi: Sequence[float]
    ) -> tuple[CentreLine, list[list[Form]]]:
        """Return the member, and the values of each element at these ξ."""
        (member, _), name = model.member(self.member), type(self).__name__
        if member.element_table == "continua":
            raise InputError(f"a {name} must be that of a Cable, or a Beam without integration")
        places = (np.arange(member.elements)[:, None] + xi).ravel()
        steady = member.evaluate_at(places, f"{name} {kind}", value, check_finite)
        factor = Form.constant(1.0) if self.factor is None else Form.function(self.factor)
        forms = [Form.constant(np.squeeze(column)) * factor for column in steady.T]
        if self.history is not None:
            positions = np.moveaxis(member.even_length[..., None] * member.mesh.at(places), -1, 0)
            at = {x.tobytes(): _At(self.history, x[()], name) for x in positions}
            histories = [Form.function(at[x.tobytes()]) for x in positions]
            forms = [form + history for form, history in zip(forms, histories, strict=True)]
        return member, [forms[k : k + len(xi)] for k in range(0, len(forms), len(xi))]


@dataclass(frozen=True, eq=False)
class _At:
    """A function of position and time at one position [m], as a function of time."""

    history: History
    x: np.ndarray
    name: str

    def __call__(self, time: float) -> np.ndarray:
        return evaluate_function(partial(self.history, self.x), time, f"{self.name} history")


@frozen()
class FreeStrain(_Free):
    """An axial strain of a beam or cable without stress, such as the thermal strain α ΔT.

    Stresses, section forces, elastic energy and the sensor `Strain` are those of the remaining
    strain, without this one. Damping acts on the rate of the whole strain.

    Parameters
    ----------
    member : name of the beam or cable.
    strain : a number, an array of shape (n,), a function of the position [m] or a field. It is
        negative for a tendon that is mounted stretched.
    factor : function of the time [s] that multiplies it, or None.
    history : function of the position [m] and the time [s] that is added, or None.

    Raises
    ------
    InputError
        If a number is not finite, an argument is no function or, when the mechanism is made, if the
        member has an `integration` or is none.

    Examples
    --------
    >>> rail = fb.Mechanism(
    ...     bodies={"rail": fb.Cable(length=2.0, mass_per_length=1.0, axial_stiffness=1e6,
    ...                              bending_stiffness=10.0, elements=1)},
    ...     joints={"wall": fb.Weld("rail.start", (0.0, 0.0))},
    ...     loads={"heat": fb.loads.FreeStrain("rail", 12e-6 * 50.0)},  # α ΔT
    ...     sensors={"end": fb.Position("rail.end")},
    ... )
    >>> float(fb.equilibrium(rail).sel(output="end_X").round(6))  # [m]
    2.0012
    """

    member: str
    strain: Property = 0.0
    factor: TimeFunction | None = None
    history: History | None = None

    def __post_init__(self) -> None:
        self._check("strain", self.strain)

    def enters(self, model: LoadModel) -> Entries:
        _, strains = self._along(model, "strain", self.strain, AXIAL)
        return Entries(strains=[FreeStrainEntry(self.member, strains)])


@frozen()
class FreeCurvature(_Free):
    """A curvature of a beam or cable without stress, as of a bimetal, or of one warm side.

    A temperature that changes by ΔT across the height h, warmer to the right of the axis, gives the
    curvature α ΔT/h. It is added to that of the undeformed axis; moments are those of the remaining
    curvature. Between the nodes it is a line through its values at two places.

    Parameters
    ----------
    member : name of the beam or cable.
    curvature : κ [1/m], positive to the left: a number, an array of shape (n,), a function of the
        position [m] or a field.
    factor, history : as in `FreeStrain`.

    Raises
    ------
    InputError
        As `FreeStrain`.

    Examples
    --------
    >>> strip = fb.Mechanism(
    ...     bodies={"strip": fb.Cable(length=2.0, mass_per_length=1.0, axial_stiffness=1e6,
    ...                               bending_stiffness=10.0, elements=4)},
    ...     joints={"wall": fb.Weld("strip.start", (0.0, 0.0))},
    ...     loads={"sun": fb.loads.FreeCurvature("strip", 12e-6 * 50.0 / 0.01)},  # α ΔT/h
    ...     sensors={"end": fb.Angle("strip.end"), "M": fb.SectionForces("strip")},
    ... )
    >>> rest = fb.equilibrium(strip)
    >>> rest.sel(output=["end", "M_M"]).values.round(6) + 0.0  # κL [rad], no moment [N m]
    array([0.12, 0.  ])
    """

    member: str
    curvature: Property = 0.0
    factor: TimeFunction | None = None
    history: History | None = None

    def __post_init__(self) -> None:
        self._check("curvature [1/m]", self.curvature)

    def enters(self, model: LoadModel) -> Entries:
        """Return the angle between the ends of each element, and the change of its curvature."""
        member, curvatures = self._along(model, "curvature [1/m]", self.curvature, GAUSS)
        strains = []
        for element, (first, second) in enumerate(curvatures):
            length = member.length_of(element)
            straight = [Form({})] * len(AXIAL)
            angle = (first + second) * (0.5 * length)
            change = (second - first) * length
            strains.append([*straight, angle, change])
        return Entries(strains=[FreeStrainEntry(self.member, strains)])
