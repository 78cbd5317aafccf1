"""The elements of all beams and cables as arrays."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.warning import warn
from flexband.basics.words import number_of
from flexband.errors import ResolutionWarning
from flexband.mechanics.assembly.entry_tables import Couples, Places, pairs_of
from flexband.mechanics.assembly.stacking import indices, stack
from flexband.mechanics.assembly.structure import Continua, ContinuumValues, Elements, ElementValues
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.kernels.elements.beams import NUMBERS as BEAM_NUMBERS
from flexband.mechanics.kernels.elements.cables import NUMBERS as CABLE_NUMBERS
from flexband.mechanics.kernels.elements.hermite import GAUSS_POINTS, POSITIONS
from flexband.mechanics.kernels.forms import TimeFunction
from flexband.mechanics.loads.load import FreeStrainEntry
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.sensors.sections import LocalSensor
from flexband.remarks.remark import Remark, RemarkKind


class FreeTerm(NamedTuple):
    """A term c f(t) of a strain without stress, in a row of the stiffness."""

    row: int
    c: np.ndarray
    f: TimeFunction


class ElementTable:
    """The elements of all cables, or of all beams without an integration rule."""

    def __init__(self, free_strains: Sequence[FreeStrainEntry] = ()):
        self.free_strains = free_strains
        self.free_terms = list[FreeTerm]()
        self.groups: list[range] = []
        self.inverse_length: list[ArrayLike] = []
        self.retardation: list[ArrayLike] = []
        self.stiffness: list[np.ndarray] = []

    @property
    def functions(self) -> list[TimeFunction]:
        return [term.f for term in self.free_terms]

    def take(self, name: str, body: CentreLine, first: int) -> None:
        """Append the elements of a body whose coordinates start in row `first` of z."""
        self._take(first, body)
        self.retardation += body.retardation_times * body.elements
        strains = body.element_strains(body.at_start, body.element_lengths.T)
        numbers = [np.moveaxis(c, 0, -1) for c in body.element_stiffness()] + list(strains)
        begin = len(self.stiffness)
        count = len(numbers)
        axial = len(numbers) - len(strains)
        self.stiffness += _rows(np.stack(np.broadcast_arrays(*numbers), axis=1))
        strains = [enumerate(entry.strains) for entry in self.free_strains if entry.member == name]
        for e, forms in itertools.chain.from_iterable(strains):
            for row, form in enumerate(forms, start=begin + e * count + axial):
                for (_, _, f), c in form.terms.items():
                    if f is None:
                        self.stiffness[row] = self.stiffness[row] + c
                    else:
                        self.free_terms.append(FreeTerm(row, c, f))

    def _take(self, first: int, body: CentreLine) -> None:
        """Append what elements of all kinds have."""
        starts = [first + int(row) for row in body.element_rows]
        self.groups += [range(start, start + body.element_coordinates) for start in starts]
        self.inverse_length += list(1 / body.element_lengths.T)

    def couples(self) -> Couples:
        return pairs_of(self.groups)

    def structure(self, places: Places) -> Elements | Continua:
        return Elements(
            self.first(),
            self.damping_mask(),
            free_strain_rows=indices(term.row for term in self.free_terms),
            f=indices(places.functions[term.f] for term in self.free_terms),
            slot=places.square(self.groups),
        )

    def values(self) -> ElementValues | ContinuumValues:
        free_strain_factors = [term.c for term in self.free_terms]
        at_start = [self.stiffness[term.row] for term in self.free_terms]
        rows = (
            self.inverse_length,
            self.stiffness,
            self.retardation,
            free_strain_factors,
            at_start,
        )
        return ElementValues(*map(stack, rows))

    def first(self) -> np.ndarray:
        """Return the first coordinate of each element."""
        return indices(group[0] for group in self.groups)

    def damping_mask(self) -> np.ndarray:
        """Return whether the material of each element is damped in any sample."""
        damped = np.array([np.any(np.asarray(t) > 0) for t in self.retardation], dtype=bool)
        per_element = max(len(damped) // max(len(self.groups), 1), 1)
        return np.array(damped.reshape(-1, per_element).any(axis=1))


class ContinuumTable(ElementTable):
    """The elements of all beams with an integration rule."""

    def __init__(self):
        super().__init__()
        self.initial: list[np.ndarray] = []
        self.initial_row: list[int] = []

    def take(self, name: str, body: CentreLine, first: int) -> None:
        """Append the elements of a beam; only curved ones have strains at the start."""
        self._take(first, body)
        self.retardation += body.retardation_times[:1] * body.elements
        self.stiffness += _by_point([np.moveaxis(c, 0, -1) for c in body.stiffness()])
        rows = [] if body.straight else _by_point(body.initial_strains(POSITIONS))
        per_element = len(rows) // body.elements
        begin = len(self.initial)
        self.initial_row += [begin + per_element * e if rows else -1 for e in range(body.elements)]
        self.initial += rows

    def structure(self, places: Places) -> Continua:
        return Continua(
            self.first(), self.damping_mask(), indices(self.initial_row), places.square(self.groups)
        )

    def values(self) -> ContinuumValues:
        rows = (self.inverse_length, self.stiffness, self.initial, self.retardation)
        return ContinuumValues(*map(stack, rows))


def _by_point(numbers: list[np.ndarray]) -> list[np.ndarray]:
    """Return numbers (elements, GAUSS_POINTS, n or 1) as rows, those of a point side by side."""
    return _rows(np.stack(np.broadcast_arrays(*numbers), axis=2))


def _rows(numbers: np.ndarray) -> list[np.ndarray]:
    """Return numbers (…, n or 1) as rows."""
    return list(numbers.reshape(-1, numbers.shape[-1]))


def rigidity(
    beams: ElementTable, continua: ContinuumTable, cables: ElementTable, mass: dict
) -> np.ndarray:
    """Return a weight [s²] that makes beams almost rigid: 10¹⁰ over the highest ω².

    For a beam, ω² is about ∫ c dx with the stiffness c against changes of |r_y| over the inertia of
    r_y; for a cable, ∫ EA dx / l² over the node's inertia.
    """
    squares = []
    if beams.groups:
        numbers = stack(beams.stiffness).reshape(len(beams.groups), BEAM_NUMBERS, -1)
        inertia = stack([mass[e + 4, e + 4] for e, *_ in beams.groups])
        squares.append((numbers[:, 12:14].sum(axis=1) / inertia).max(axis=0))
    if continua.groups:
        breathing = stack(continua.stiffness)[6::9].reshape(len(continua.groups), GAUSS_POINTS, -1)
        inertia = stack([mass[e + 4, e + 4] for e, *_ in continua.groups])
        squares.append((breathing.sum(axis=1) / inertia).max(axis=0))
    if cables.groups:
        numbers = stack(cables.stiffness).reshape(len(cables.groups), CABLE_NUMBERS, -1)
        axial = 2.25 * numbers[:, 0]  # the middle has the factor 3/2 of the chord
        inertia = stack([mass[e, e] for e, *_ in cables.groups])
        inverse_length = stack(cables.inverse_length)
        squares.append((axial * inverse_length**2 / inertia).max(axis=0))
    return 1e10 / np.maximum.reduce(np.broadcast_arrays(*squares)) if squares else np.ones(1)


def warn_of_elements(mechanism: Mechanism) -> None:
    """Warn of members whose number of elements was left out, or is too small."""
    for name in mechanism.without_elements:
        warn(
            f"the number of elements of {name!r} is left out: {mechanism.elements[name]} are used",
            ResolutionWarning,
        )
    for name, body in mechanism.model.members.items():
        if body.mesh.parts > body.elements:
            text = (
                f"{name!r} has {number_of(body.elements, 'element')} but {body.mesh.parts} "
                "parts between the points where joints and loads act: its section forces are "
                f"wrong near these points. Give elements={body.mesh.parts} or more"
            )
            outputs = tuple(
                output
                for sensor_name, sensor in mechanism.sensors.items()
                if isinstance(sensor, LocalSensor) and sensor.body == name
                for output, _ in mechanism.model.outputs[sensor_name]
            )
            remark = Remark(RemarkKind.COARSE_MESH, text, part=name, outputs=outputs)
            warn(text, ResolutionWarning, [remark])
