"""Sensors inside beams and cables: section forces, strains and stresses.

They follow from the material law in one element, so they converge more slowly with the mesh than
displacements do. They jump where a force or joint acts. At such a point, as at every node, they are
those of the element that starts there, on the side of the member's end; those on the other side are
found a little before it, at "0.499999" for a point "0.5".
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite
from flexband.basics.words import with_article
from flexband.errors import InputError
from flexband.mechanics.bodies.centre_line import CentreLine, ElementState
from flexband.mechanics.bodies.properties import Along, Property
from flexband.mechanics.kernels.forms import Form
from flexband.mechanics.sensors.motion import Sensor, SensorModel


class LocalSensor(Sensor):
    """A sensor at a place of a beam or cable, which reads the coordinates of one element."""

    body: str
    place: str

    def _locate(self, model: SensorModel) -> tuple[CentreLine, int, int, float]:
        """Locate the place: return the member, the row of its first coordinate, element and ξ."""
        member, first = model.member(self.body)
        place = member.element_position(self.place)
        element = min(int(place), member.elements - 1)
        return member, first, element, place - element

    def rows(self, model: SensorModel) -> Sequence[Form]:
        """Return the element's coordinates, inertia forces, length, first strains and numbers."""
        member, first, element, xi = self._locate(model)
        first = first + int(member.element_rows[element])
        at = np.array([element + xi])

        def along(name: str, value: Property, check: Callable) -> np.ndarray:
            return member.evaluate_at(at, name, value, check)[:, 0]

        inertia = []
        for node, place in ((first, element), (first + member.per_node, element + 1)):
            end = np.array([place], dtype=float)
            mass = member.line_mass(lambda *value, end=end: member.evaluate_at(end, *value)[:, 0])
            inertia += [
                Form.variable(model.state.acceleration + node + k) * -mass for k in range(2)
            ]
        initial = [
            Form.constant(strain[element])
            for strain in member.element_strains(member.at_start, member.element_lengths.T)
        ]
        for free_strain in (
            entry for entries in model.entries.values() for entry in entries.strains
        ):
            strains = free_strain.strains[element] if free_strain.member == self.body else []
            for k, strain in enumerate(strains):
                initial[k] = initial[k] + strain
        return [
            *(Form.variable(first + k) for k in range(member.element_coordinates)),
            *inertia,
            Form.constant(member.length_of(element)),
            *initial,
            *map(Form.constant, member.section_stiffness(along)),
            *map(Form.constant, self._numbers(member, along)),
        ]

    def _numbers(self, member: CentreLine, along: Along) -> Sequence[ArrayLike]:
        """Return what the sensor needs beside the stiffness of the section."""
        return []

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        member, _, _, xi = self._locate(model)
        parts = (member.element_coordinates, 4, 1, *member.counts)
        q, inertia, (length,), initial, section, numbers = np.split(rows, np.cumsum(parts))
        inertia = inertia.reshape(2, 2, *q.shape[1:])
        state = ElementState(q, xi, length, initial, section, inertia)
        return np.stack(self._outputs(member, state, numbers))

    @abstractmethod
    def _outputs(
        self, member: CentreLine, state: ElementState, numbers: np.ndarray
    ) -> Sequence[np.ndarray]:
        """Return the outputs, each of shape (times, lanes)."""


@frozen()
class SectionForces(LocalSensor):
    """Axial force, shear force and bending moment: outputs "_N" [N], "_Q" [N], "_M" [N m].

    They are what the part behind the section (towards the end) exerts on the part before it: N
    along the section's normal, Q along the section to the left, and M about the axis. A cable has
    no shear strain; its Q is −dM/ds.

    Parameters
    ----------
    body : name of the beam or cable.
    place : a point of it: "start", "middle", "node 2", or the fraction of the length, "0.25".

    Examples
    --------
    >>> steel = {"density": 7800.0, "youngs_modulus": 2e11, "poissons_ratio": 0.3}
    >>> cantilever = fb.Mechanism(
    ...     bodies={"beam": fb.Beam(length=2.0, height=0.01, width=0.01, elements=2, **steel)},
    ...     joints={"clamp": fb.Weld("beam.start", (0.0, 0.0))},
    ...     loads={"force": fb.Force("beam.end", y=0.1)},
    ...     sensors={"beam": fb.SectionForces("beam", "start")},
    ... )
    >>> fb.equilibrium(cantilever).values[1:].round(3)  # Q [N] and M [N m]
    array([0.1, 0.2])
    """

    body: str
    place: str = "middle"
    units = (("_N", "N"), ("_Q", "N"), ("_M", "N m"))

    def _outputs(
        self, member: CentreLine, state: ElementState, numbers: np.ndarray
    ) -> Sequence[np.ndarray]:
        return member.section_forces(state)


@frozen()
class Strain(LocalSensor):
    """Strains at a point of a section: outputs "_xx", "_yy", "_xy".

    They are E_xx, E_yy and 2E_xy in the section's axes. Those of a beam are ε − y (κ − κ₀), or
    Winkler's in an arc (see `Stress`), −ν times this, since the section contracts freely, and the
    shear strain. Those of a beam with an `integration` are Green–Lagrange strains. Those of a cable
    are ε − y (κ − κ₀), 0 and 0.

    Parameters
    ----------
    body, place : as in `SectionForces`.
    y : distance from the axis [m], positive to the left.

    Raises
    ------
    InputError
        If y is not finite or, when the mechanism is made, outside the beam.
    """

    body: str
    place: str = "middle"
    y: ArrayLike = 0.0

    def __post_init__(self) -> None:
        check_finite(f"{type(self).__name__} y [m]", self.y)

    units = (("_xx", "1"), ("_yy", "1"), ("_xy", "1"))
    tensor = True

    def _numbers(self, member: CentreLine, along: Along) -> Sequence[ArrayLike]:
        height = member.across(along)
        if height is not None:
            half = np.min(height) / 2
            if np.any(np.abs(self.y) > half * (1 + 1e-12)):
                worst = np.ravel(self.y)[np.argmax(np.abs(self.y))]
                raise InputError(f"y [m] must be from {-half:g} to {half:g}; got {worst:g}")
        return member.fibre(self.y, along)

    def _outputs(
        self, member: CentreLine, state: ElementState, numbers: np.ndarray
    ) -> Sequence[np.ndarray]:
        return member.fibre_strains(state, numbers)


@frozen()
class Stress(Strain):
    """Stresses at a point of a beam's section [Pa]: outputs "_xx", "_yy", "_xy".

    They are stresses in the section's axes, without damping: E times the axial strain, 0 (apart
    from vibrations of the thickness), and kG times the shear strain, which is the mean over the
    section. Those of a beam with an `integration` are second Piola–Kirchhoff stresses from its law.

    A study that chooses step and elements judges the components together, by the width of the
    widest one. The bands of "_yy" of a slender beam, and often those of "_xy", are therefore wrong
    by far more than the tolerance relative to their own widths, as the table of results tells. Of a
    beam without an `integration`, "_xx" is N/A − M y/I with the `SectionForces`, for a section of
    the area A and the second moment of area I. In an arc it is Winkler's
    (N + κ₀M)/A − M y/(Z (1 − κ₀y)) with Z = ∫y²/(1 − κ₀y) dA.

    Parameters and errors are those of `Strain`; a cable, which has no section, is refused.
    """

    units = (("_xx", "Pa"), ("_yy", "Pa"), ("_xy", "Pa"))

    def _numbers(self, member: CentreLine, along: Along) -> Sequence[ArrayLike]:
        if member.across(along) is None:
            kind = with_article(type(member).__name__)
            raise InputError(f"stresses need a Beam; {self.body!r} is {kind}")
        return super()._numbers(member, along)

    def _outputs(
        self, member: CentreLine, state: ElementState, numbers: np.ndarray
    ) -> Sequence[np.ndarray]:
        return member.fibre_stresses(state, numbers)
