"""From a mechanism to arrays: what is the same for all samples, and what each sample has."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import groupby

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError
from flexband.mechanics.assembly.elements import Elements, rigidity
from flexband.mechanics.assembly.parts import (
    AngleParts,
    LawParts,
    SpringParts,
    couples,
    square_slots,
)
from flexband.mechanics.assembly.products import FormTable, asked_for, functions_of
from flexband.mechanics.assembly.stacking import count_samples, indices, stack
from flexband.mechanics.assembly.structure import Beams, Cables, Mass, Structure
from flexband.mechanics.bodies.beam import Beam
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.forms import Form, TimeFunction
from flexband.mechanics.kernels.factorization import NONE, analyse
from flexband.mechanics.kernels.indices import as_indices
from flexband.mechanics.loads.force_laws import TorsionSpring
from flexband.mechanics.loads.loads import Gravity, Spring
from flexband.mechanics.mechanism import LAWS, Mechanism


@dataclass(frozen=True)
class System:
    """A mechanism as arrays.

    Attributes
    ----------
    structure : sizes and indices, the same for all samples.
    samples : number of samples, 1 where no parameter is an array.
    rows : field of `Values`, with a dot for a field of its parts -> array of shape
        (rows, samples or 1).
    functions : the functions of time in use, apart from the constant one.
    constraints : what each row of Φ belongs to.
    outputs, units : name and unit of each output.
    sensors : for each, what makes outputs of its rows, and which of the rows that the engine
        evaluates are its own.
    conditions : the joint behind each further row, which must stay positive.
    """

    structure: Structure
    samples: int
    rows: dict[str, np.ndarray]
    functions: list[TimeFunction]
    constraints: list[str]
    outputs: list[str]
    units: list[str]
    sensors: list[tuple[Callable[[np.ndarray], np.ndarray], slice]]
    conditions: list[str]

    @cached_property
    def handed_on(self) -> Structure:
        """The structure as kernels take it."""
        return as_indices(self.structure)

    @property
    def sensed(self) -> int:
        """Number of rows that `sense` writes: the sensors', then the conditions."""
        return (self.sensors[-1][1].stop if self.sensors else 0) + len(self.conditions)


def assemble(mechanism: Mechanism) -> System:
    """Return the arrays of a mechanism.

    Raises
    ------
    InputError
        Where numbers of samples do not fit each other or a function of position gives values that
        are not allowed.
    """
    first = mechanism.first_coordinates()
    start: list[ArrayLike] = [1.0]
    velocity: list[ArrayLike] = [0.0]
    mass: dict[tuple[int, int], np.ndarray] = {}
    nodes: list[int] = []
    beams, cables = Elements(12), Elements(8)
    for name, body in mechanism.bodies.items():
        try:
            start += body.coordinates()
            velocity += body.velocities()
            nodes += [first[name] + place for place in body.nodes]
            for (i, j), value in body.mass_entries().items():
                mass[first[name] + i, first[name] + j] = value
            if isinstance(body, CentreLine):
                (beams if isinstance(body, Beam) else cables).take(body, first[name])
        except InputError as error:
            raise InputError(f"body {name!r}: {error}") from None

    constraints = mechanism.constraints
    owners = [owner for owner, _ in constraints]
    count = mechanism.coordinates
    first_multiplier, first_angle = 1 + count, 1 + count + len(owners)
    variables = itertools.count(first_angle)
    constraint_rows = [row.with_variables(variables) for _, row in constraints]
    turned = [
        (first_multiplier + k, vector)
        for k, (_, row) in enumerate(constraints)
        for vector, _ in row.angles
    ]
    laws = LawParts(list(mechanism.force_laws.values()), mechanism.frame, len(turned))
    vectors = [v for _, v in turned] + [f.normal for frames in laws.frames for f in frames]
    angles = AngleParts(vectors, [k for k, _ in turned])
    springs = SpringParts(
        [load for load in mechanism.loads.values() if isinstance(load, Spring)], mechanism.frame
    )
    outputs, units, sensors, conditions, sensor_rows = _sensors(mechanism)
    force_rows = _force_rows(mechanism)
    functions = functions_of(
        [*constraint_rows, *sensor_rows, *force_rows], [*laws.functions, *springs.functions]
    )
    numbers_of = {None: 0} | {f: k + 1 for k, f in enumerate(functions)}
    terms = FormTable(constraint_rows, numbers_of, first_multiplier, first_angle)
    sensed, forces = FormTable(sensor_rows, numbers_of), FormTable(force_rows, numbers_of)

    needed = {
        *mass,
        *couples(beams.groups),
        *couples(cables.groups),
        *couples(springs.groups),
        *angles.couples(),
        *couples(laws.groups),
        *terms.couples(),
    }
    among = [(i, j) for i, j in needed if 0 < i < first_angle and 0 < j < first_angle]
    pattern, slots = analyse(_pairs(count, owners), count, among)
    nowhere = pattern.rows - 1

    def slot(i: int, j: int) -> int:
        return slots.get((min(i, j), max(i, j)), nowhere)

    structure = Structure(
        coordinates=count,
        multipliers=len(owners),
        velocity=mechanism.velocity_row,
        acceleration=mechanism.velocity_row + 1 + count,
        energy=asked_for(mechanism.energy_row, sensor_rows),
        functions=len(functions) + 1,
        mass=Mass(
            i=indices(i for i, _ in mass),
            j=indices(j for _, j in mass),
            slot=indices(slot(i, j) for i, j in mass),
        ),
        beams=Beams(
            first=indices(beams.first),
            damped=beams.damped(),
            initial=indices(beams.initial_row),
            slot=square_slots(beams.groups, slot, nowhere),
        ),
        cables=Cables(
            first=indices(cables.first),
            damped=cables.damped(),
            slot=square_slots(cables.groups, slot, nowhere),
        ),
        springs=springs.structure(numbers_of, slot, nowhere),
        terms=terms.terms(slot),
        angles=angles.structure(first_angle, mechanism.energy_row + 1, slot, nowhere),
        laws=laws.structure(
            numbers_of,
            [isinstance(mechanism.loads[name], TorsionSpring) for name in mechanism.force_laws],
            slot,
            nowhere,
            sum(map(len, angles.groups[: len(turned)])),
        ),
        forces=forces.products(),
        sensors=sensed.products(),
        pattern=pattern,
    )
    rows = {
        "start": start,
        "velocity": velocity,
        "inverse_scale": _inverse_scale(start, mass, nodes),
        "mass": list(mass.values()),
        "force": _constant_forces(mechanism),
        "rigidity": [rigidity(beams, cables, mass)],
        "coefficient": terms.coefficients,
        "load": forces.coefficients,
        "sensor": sensed.coefficients,
        "beams.inverse_length": beams.inverse_length,
        "beams.stiffness": beams.stiffness,
        "beams.initial": beams.initial,
        "beams.retardation": beams.retardation,
        "cables.inverse_length": cables.inverse_length,
        "cables.stiffness": cables.stiffness,
        "cables.retardation": cables.retardation,
        **springs.rows(),
        **angles.rows(),
        **laws.rows(),
    }
    stacked = {name: stack(values) for name, values in rows.items()}
    driven = [np.atleast_1d(np.asarray(f(0.0), dtype=float)) for f in functions]
    samples = count_samples([*stacked.values(), *driven])
    return System(
        structure, samples, stacked, functions, owners, outputs, units, sensors, conditions
    )


def _sensors(mechanism: Mechanism):
    """Return outputs, units, sensors with their rows, owners of conditions, and all the rows."""
    outputs, units, sensors, conditions, rows = [], [], [], [], []
    for name, sensor in mechanism.sensors.items():
        for suffix, unit in sensor.outputs():
            outputs.append(name + suffix)
            units.append(unit)
        first = len(rows)
        rows += sensor.rows(mechanism)
        sensors.append((partial(sensor.derive, model=mechanism), slice(first, len(rows))))
    for name, joint in mechanism.joints.items():
        positive = joint.conditions(mechanism.frame)
        conditions += [name] * len(positive)
        rows += positive
    return outputs, units, sensors, conditions, rows


def _force_rows(mechanism: Mechanism) -> list[Form]:
    """Return the generalized force on each of [1, q], of all loads but gravity and springs."""
    rows = [Form({})] * (mechanism.coordinates + 1)
    for load in mechanism.loads.values():
        if not isinstance(load, (Spring, Gravity, *LAWS)):
            for j, force in load.forces(mechanism).items():
                rows[j] = rows[j] + force
    return rows


def _pairs(coordinates: int, owners: Sequence[str]) -> list[tuple[int, int]]:
    """Return the unknowns in pairs: vectors of the plane, then multipliers of the same joint."""
    pairs = [(i, i + 1) for i in range(1, coordinates, 2)]
    first = coordinates + 1
    for _, group in groupby(owners):
        end = first + len(list(group))
        pairs += [(k, k + 1 if k + 1 < end else NONE) for k in range(first, end, 2)]
        first = end
    return pairs


def _constant_forces(mechanism: Mechanism) -> list[np.ndarray]:
    """Return the weight on each of [1, q]."""
    forces = [np.zeros(())] * (mechanism.coordinates + 1)
    for load in mechanism.loads.values():
        if isinstance(load, Gravity):
            for i, force in mechanism.weight(load).items():
                forces[i] = forces[i] + force.terms.get((0, 0, None), np.zeros(()))
    return forces


def _inverse_scale(start: list, mass: dict[tuple[int, int], np.ndarray], nodes: list[int]) -> list:
    """Return 1/size for positions and 1 for directions; the size is that of the whole mechanism.

    It is the diagonal of the box around the nodes, plus the largest radius of gyration.
    """
    x, y = (stack([start[node + axis] for node in nodes]) for axis in range(2))
    none = np.zeros(())
    gyration = [np.sqrt(mass.get((n + 2, n + 2), none) / mass[n, n]) for n in nodes]
    size = np.hypot(np.ptp(x, axis=0), np.ptp(y, axis=0)) + stack(gyration).max(axis=0)
    size = np.where(size > 0, size, 1.0)  # a single point mass has none
    scale: list = [1.0] * len(start)
    for node in nodes:
        scale[node] = scale[node + 1] = 1 / size
    return scale
