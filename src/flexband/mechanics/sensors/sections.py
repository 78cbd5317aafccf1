"""Sensors inside beams and cables: section forces, strains and stresses.

They follow from the material law in one element, so they converge more slowly with the mesh than
displacements do. They jump where a force or joint acts. At such a point, as at every node, they are
those of the element that starts there, on the side of the member's end; those on the other side are
found a little before it, at "0.499999" for a point "0.5".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from flexband.arguments import frozen
from flexband.errors import InputError, check_finite
from flexband.mechanics.bodies.beam import Beam
from flexband.mechanics.bodies.cable import Cable
from flexband.mechanics.bodies.properties import Property
from flexband.mechanics.bodies.section_stiffness import Elasticity
from flexband.mechanics.bodies.sections import Along
from flexband.mechanics.kernels.elements.continuum_strains import gradient, resultants
from flexband.mechanics.kernels.forms import Form
from flexband.mechanics.sensors.motion import Sensor, SensorModel
from flexband.words import with_article


class _Local(Sensor):
    """A sensor at a place of a beam or cable, which reads the coordinates of one element."""

    body: str
    place: str

    def _located(self, model: SensorModel) -> tuple[Beam | Cable, int, int, float]:
        """Return the member, the row of its first coordinate, the element and ξ of the place."""
        member, first = model.member(self.body)
        place = member.located(self.place)
        element = min(int(place), member.elements - 1)
        return member, first, element, place - element

    def rows(self, model: SensorModel) -> Sequence[Form]:
        """Return the element's coordinates, its length and strains at the start, and `_numbers`.

        Raises
        ------
        InputError
            If the mechanism has no such member, or the member no such place.
        """
        member, first, element, xi = self._located(model)
        first, at = first + int(member.element_rows[element]), np.array([element + xi])

        def along(name: str, value: Property, check: Callable) -> np.ndarray:
            return member.evaluated(at, name, value, check)[:, 0]

        initial = member.element_strains(member.at_start, member.element_lengths.T)
        return [
            *(Form.variable(first + k) for k in range(member.element_coordinates)),
            Form.constant(member.length_of(element)),
            *(Form.constant(strain[element]) for strain in initial),
            *map(Form.constant, member.section_stiffness(along)),
            *map(Form.constant, self._numbers(member, along)),
        ]

    def _numbers(self, member: Beam | Cable, along: Along) -> Sequence[ArrayLike]:
        """Return what the sensor needs beside the stiffness of the section."""
        return []

    def _read(self, rows: np.ndarray, model: SensorModel):
        """Return the member, q, ξ, length, strains less those at the start, and the numbers.

        The numbers are the stiffness of the section, and those of the sensor.
        """
        member, _, _, xi = self._located(model)
        count = member.element_coordinates
        q, length, rest = rows[:count], rows[count], rows[count + 1 :]
        of_element, of_section = np.cumsum(member.counts)
        initial, section = rest[:of_element], rest[of_element:of_section]
        strain = member.strains(q, xi, length, initial, section)
        return member, q, xi, length, strain, section, rest[of_section:]


@frozen()
class SectionForces(_Local):
    """Axial force, shear force and bending moment: outputs "_N" [N], "_Q" [N], "_M" [N m].

    They are what the part behind the section (towards the end) exerts on the part before it: N
    along the section's normal, Q along the section to the left, and M about the axis. A cable has
    no shear strain; its Q is −dM/ds.

    Parameters
    ----------
    body : name of the beam or cable.
    place : a point of it: "start", "middle", "node 2", or the fraction of the length, "0.25".
    """

    body: str
    place: str = "middle"
    units = (("_N", "N"), ("_Q", "N"), ("_M", "N m"))

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        member, q, xi, length, strain, section, _ = self._read(rows, model)
        if isinstance(member, Cable):
            EA, EI = section
            return np.stack([EA * strain[0], -EI * strain[2], EI * strain[1]])
        if member.integration is None:
            EA, EI, kGA = section
            return np.stack([EA * strain[0], kGA * strain[2], EI * strain[1]])
        p, w, d = member.vectors(q, xi, length)
        force, couple, _ = gradient.py_func(resultants.py_func(section, strain), (p, w, d))
        size = np.hypot(*d)
        normal = (force[0] * d[1] - force[1] * d[0]) / size
        across = (force[0] * d[0] + force[1] * d[1]) / size
        return np.stack([normal, across, d[0] * couple[1] - d[1] * couple[0]])


@frozen()
class Strain(_Local):
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

    def _numbers(self, member: Beam | Cable, along: Along) -> Sequence[ArrayLike]:
        if isinstance(member, Cable):
            return [self.y]
        half = np.min(member.profile.across(along)) / 2
        if np.any(np.abs(self.y) > half * (1 + 1e-12)):
            worst = np.ravel(self.y)[np.argmax(np.abs(self.y))]
            raise InputError(f"y [m] must be from {-half:g} to {half:g}; got {worst:g}")
        return [self.y, *member.elasticity(along), *member.curved(self.y, along)]

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        member, *_, strain, _, numbers = self._read(rows, model)
        if isinstance(member, Cable):
            axial = strain[0] - numbers[0] * strain[1]
            return np.stack([axial, 0.0 * axial, 0.0 * axial])
        y, material, (a, b) = numbers[0], Elasticity(*numbers[1:4]), numbers[4:]
        if member.integration is None:
            axial, bending, shear, thickness = strain
            along = axial + (a - y * b) * bending
            return np.stack([along, thickness - material.nu * along, shear])
        a0, a1, a2, b, g0, g1 = strain
        return np.stack([a0 + y * a1 + y**2 * a2, b, g0 + y * g1])


@frozen()
class Stress(Strain):
    """Stresses at a point of a beam's section [Pa]: outputs "_xx", "_yy", "_xy".

    They are stresses in the section's axes, without damping: E times the axial strain, 0 (apart
    from vibrations of the thickness), and kG times the shear strain, which is the mean over the
    section. Those of a beam with an `integration` are second Piola–Kirchhoff stresses from its law.

    A study that chooses step and elements judges the components together, by the width of the
    widest one. The bands of "_yy" of a slender beam, and often those of "_xy", are therefore wrong
    by far more than the tolerance in parts of their own widths, as the table of results tells. Of a
    beam without an `integration`, "_xx" is N/A − M y/I with the `SectionForces`, for a section of
    the area A and the second moment of area I. In an arc it is Winkler's
    (N + κ₀M)/A − M y/(Z (1 − κ₀y)) with Z = ∫y²/(1 − κ₀y) dA.

    Parameters and errors are those of `Strain`; a cable, which has no section, is refused.
    """

    units = (("_xx", "Pa"), ("_yy", "Pa"), ("_xy", "Pa"))

    def _numbers(self, member: Beam | Cable, along: Along) -> Sequence[ArrayLike]:
        if not isinstance(member, Beam):
            kind = with_article(type(member).__name__)
            raise InputError(f"stresses need a Beam; {self.body!r} is {kind}")
        return super()._numbers(member, along)

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        member, *_, strain, _, numbers = self._read(rows, model)
        y, material, (a, b) = numbers[0], Elasticity(*numbers[1:4]), numbers[4:]
        rule = cast("Beam", member).integration
        if rule is not None:
            return np.stack(rule.stress(material, strain, y))
        (E, nu, k), (axial, bending, shear, thickness) = material, strain
        return np.stack(
            [E * (axial + (a - y * b) * bending), E * thickness, k * E / (2 * (1 + nu)) * shear]
        )
