"""Strains without stress: thermal expansion, prestrain, shrinkage."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from flexband.arguments import frozen
from flexband.errors import InputError, check_finite, check_function, returned
from flexband.mechanics.bodies.assumed_strains import AXIAL
from flexband.mechanics.bodies.properties import Property
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.kernels.forms import Form, TimeFunction
from flexband.mechanics.loads.load import Entries, FreeStrainEntry, LoadModel


@frozen()
class FreeStrain:
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
    history: Callable[[np.ndarray, float], ArrayLike] | None = None

    def __post_init__(self) -> None:
        if not callable(self.strain):
            check_finite("FreeStrain strain", self.strain)
        if self.factor is not None:
            check_function("FreeStrain factor", self.factor, " of time")
        if self.history is not None:
            check_function("FreeStrain history", self.history, " of position and time")

    @property
    def points(self) -> Sequence[PointName]:
        """The ends of the member, between which it acts."""
        return [f"{self.member}.start", f"{self.member}.end"]

    def enters(self, model: LoadModel) -> Entries:
        """Return the strain at the places of each element."""
        member, _ = model.member(self.member)
        if member.element_table == "continua":
            raise InputError("a FreeStrain must be that of a Cable, or a Beam without integration")
        places = (np.arange(member.elements)[:, None] + AXIAL).ravel()
        steady = member.evaluated(places, "FreeStrain strain", self.strain, check_finite)
        factor = Form.constant(1.0) if self.factor is None else Form.function(self.factor)
        forms = [Form.constant(np.squeeze(column)) * factor for column in steady.T]
        if self.history is not None:
            positions = member.even_length[..., None] * member.mesh.at(places)
            at = {x.tobytes(): _At(self.history, x[()]) for x in np.moveaxis(positions, -1, 0)}
            histories = [at[x.tobytes()] for x in np.moveaxis(positions, -1, 0)]
            forms = [f + Form.function(h) for f, h in zip(forms, histories, strict=True)]
        count = len(AXIAL)
        strains = [forms[k : k + count] for k in range(0, len(forms), count)]
        return Entries(strains=[FreeStrainEntry(self.member, strains)])


@dataclass(frozen=True, eq=False)
class _At:
    """A function of position and time at one position [m], as a function of time."""

    history: Callable[[np.ndarray, float], ArrayLike]
    x: np.ndarray

    def __call__(self, time: float) -> np.ndarray:
        return returned(partial(self.history, self.x), time, "FreeStrain history")
