"""From a mechanism to arrays: what all samples share, and the numbers of each sample."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import chain, groupby
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError, ResolutionWarning, named, returned, warn
from flexband.mechanics.assembly.elements import ContinuumTable, ElementTable, rigidity
from flexband.mechanics.assembly.laws import LawTable
from flexband.mechanics.assembly.mechanism import Mechanism
from flexband.mechanics.assembly.products import ProductTable, TermTable
from flexband.mechanics.assembly.springs import SpringTable
from flexband.mechanics.assembly.stacking import (
    count_samples,
    leaves,
    stack,
    starts,
)
from flexband.mechanics.assembly.structure import Structure, Values
from flexband.mechanics.assembly.tables import MassTable, Places, Table
from flexband.mechanics.assembly.vectors import VectorTable
from flexband.mechanics.bodies.beam import Beam
from flexband.mechanics.bodies.cable import Cable
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.rigid import RigidBody
from flexband.mechanics.kernels.forms import Form, TimeFunction
from flexband.mechanics.kernels.pattern import NONE, analyse
from flexband.mechanics.kernels.records import Record
from flexband.mechanics.kernels.state import State
from flexband.mechanics.loads.compiled_laws import CompiledLaw
from flexband.mechanics.sensors.motion import Sensor
from flexband.words import number_of

TURNING = 1e3
"""How much more assembly minds turning a rigid body by 1 rad than moving it by the size of all."""

MASSLESS = 1e-12
"""Masses and inertias of rigid bodies that count as none, relative to the whole mechanism."""

REGULAR_MASS, MIN_REGULAR_MASS = 1e-4, 1e-10
"""What matrices have instead, relative to the smallest that is not zero, and to the whole mechanism
at least; see `projection.refine`."""

MIN_SHARING_MASS = 1e-6
"""Masses and inertias of rigid bodies that redundant constraints share forces by are at least this
part of the whole mechanism's."""

CONSTANT = (0, 0, None)
"""Key of the constant term of a form."""


@dataclass(frozen=True)
class System:
    """A mechanism as arrays.

    Attributes
    ----------
    structure : sizes and indices, the same for all samples.
    samples : number of samples, 1 if no parameter is an array.
    values : the numbers of all samples, arrays of shape (rows, samples or 1). The functions of time
        are tabulated in `packing`.
    functions : the functions of time in use, except for the constant one.
    constraints : the part that each row of Φ belongs to.
    turning : the part that each of the turning vectors belongs to.
    outputs, units : name and unit of each output.
    sensors : for each sensor, what computes its outputs from its rows, and which rows are its own.
    conditions : the joint behind each further row, which must stay positive.
    laws : the compiled force laws, which must exist as long as the engine calls them, each with the
        name of its load.
    law_failures, numbers : number -> load and reason, as the engine finds them, and new numbers.
    mechanism : what the arrays are of.
    given : the start [1, q] that the bodies state, shape (rows, samples or 1).
    """

    structure: Structure
    samples: int
    values: Values
    functions: list[TimeFunction]
    constraints: list[str]
    turning: list[str]
    outputs: list[str]
    units: list[str]
    sensors: list[tuple[Callable[[np.ndarray], np.ndarray], slice]]
    conditions: list[str]
    laws: Sequence[tuple[str, CompiledLaw]]
    mechanism: Mechanism
    given: np.ndarray
    law_failures: dict[int, str] = field(default_factory=dict)
    numbers: Iterator[int] = field(default_factory=itertools.count)

    @property
    def impulsive(self) -> set[str]:
        """The outputs that are forces and moments of joints."""
        sensors = self.mechanism.sensors.items()
        return {name + suffix for name, sensor in sensors if sensor.impulsive
                for suffix, _ in sensor.outputs()}  # fmt: skip

    @cached_property
    def record(self) -> Record:
        """The structure as kernels take it."""
        return Record(self.structure)

    @property
    def sensed(self) -> int:
        """Number of rows that `sense` writes: those of the sensors, then the conditions."""
        return (self.sensors[-1][1].stop if self.sensors else 0) + len(self.conditions)


def assemble(mechanism: Mechanism) -> System:
    """Return the arrays of a mechanism.

    Raises
    ------
    InputError
        If numbers of samples do not fit each other or a function of position returns values that
        are not allowed.
    """
    for name in mechanism.without_elements:
        warn(
            f"the number of elements of {name!r} is left out: {mechanism.elements[name]} are used",
            ResolutionWarning,
        )
    for name, body in mechanism.bodies.items():
        if isinstance(body, CentreLine) and body.mesh.parts > body.elements:
            warn(
                f"{name!r} has {number_of(body.elements, 'element')} but {body.mesh.parts} parts "
                "between the points where joints and loads act: its section forces are wrong near "
                f"these points. Give elements={body.mesh.parts} or more",
                ResolutionWarning,
            )
    state, start, mass = mechanism.state, mechanism.guess, mechanism.mass
    velocity: list[ArrayLike] = [0.0]
    beams, continua, cables = ElementTable(), ContinuumTable(), ElementTable()
    for name, body in mechanism.bodies.items():
        first = mechanism.first_coordinates[name]
        try:
            velocity += body.velocities()
            if isinstance(body, Beam):
                table = beams if body.integration is None else continua
                table.take(body, first)
            elif isinstance(body, Cable):
                cables.take(body, first)
        except InputError as error:
            raise InputError(f"body {name!r}: {error}") from None

    scale = _inverse_scale(mechanism, start, mass)
    regular_mass = _regular(mechanism, mass, scale)
    outputs, units, sensors, conditions, sensor_rows = _sensors(mechanism)
    weight, force_rows = _forces(mechanism)
    tables: dict[str, Table] = {
        "mass": MassTable(mass, regular_mass),
        "beams": beams,
        "continua": continua,
        "cables": cables,
        **_vector_tables(mechanism),
        "terms": TermTable(
            mechanism.constraint_forms, state.multiplier, state.angle, _turning(mechanism)
        ),
        "forces": ProductTable(force_rows),
        "sensors": ProductTable(sensor_rows),
    }
    used = chain.from_iterable(table.functions for table in tables.values())
    functions = [f for f in dict.fromkeys(used) if f is not None]
    owners = [owner for owner, _ in mechanism.constraints]
    couples = set(chain.from_iterable(table.couples() for table in tables.values()))
    angle = state.angle
    among = [(i, j) for i, j in couples if 0 < i < angle and 0 < j < angle]
    pattern, slots = analyse(_pairs(state, owners), state.coordinates, among)
    numbers = {None: 0} | {f: k + 1 for k, f in enumerate(functions)}
    places = Places(state, numbers, slots, nowhere=pattern.rows - 1)
    read = {i for row in sensor_rows for key in row.terms for i in key[:2]}
    structure = Structure(
        state=state,
        functions=len(numbers),
        reads_energy=state.energy in read,
        reads_laws=not read.isdisjoint(range(state.law, state.rows)),
        pattern=pattern,
        **{name: table.structure(places) for name, table in tables.items()},
    )
    values = Values(
        start=stack(start),
        velocity=stack(velocity),
        inverse_scale=stack(scale),
        rigidity=stack([rigidity(beams, continua, cables, mass)]),
        regular_mass=stack(list(regular_mass.values())),
        sharing_mass=stack(list(_without_light(mechanism, regular_mass, scale).values())),
        metric=stack(_metric(mechanism, regular_mass, scale)),
        weight=stack(weight),
        parts=np.empty((0, 1)),
        numbers=np.empty((0, 1)),
        functions=np.empty((0, 1)),
        rates=np.empty((0, 1)),
        **{name: table.values() for name, table in tables.items()},
    )
    driven = [np.atleast_1d(returned(f, 0.0)) for f in functions]
    for f, value in zip(functions, driven, strict=True):
        if value.ndim > 1:
            shapes = "a number or one per sample, shape (n,)"
            raise InputError(f"{named(f)} must return {shapes}; got shape {value.shape}")
    samples = count_samples([*leaves(values), *driven])
    loads = [name for name, entries in mechanism.entries.items() for _ in entries.laws]
    return System(
        structure, samples, values, functions, owners, [part for part, _ in mechanism.turning],
        outputs, units, sensors, conditions,
        list(zip(loads, cast(LawTable, tables["laws"]).compiled, strict=True)),
        mechanism, stack(mechanism.given),
    )  # fmt: skip


def _turning(mechanism: Mechanism) -> set[int]:
    """Return the coordinates that the angles in constraints depend on."""
    vectors = [polar.vector for _, row in mechanism.constraints for polar in row.polar]
    keys = [key for vector in vectors for form in vector for key in form.terms]
    return {j for _, j, _ in keys if j > 0}


def _vector_tables(mechanism: Mechanism) -> dict[str, Table]:
    """Return the tables of vectors, and of the springs and laws that use them.

    Vectors with angles come first: those of constraints, of torsion springs, of points of laws and
    of moments. Those of translational springs, the positions of points of laws, the directions of
    following forces and what turns with bodies and rods come after them.
    """
    owned = [
        (mechanism.state.multiplier + k, polar)
        for k, (_, row) in enumerate(mechanism.constraints)
        for polar in row.polar
    ]
    springs = [spring for _, spring in mechanism.springs]
    points = [frame for law in mechanism.laws for frame in law.points]
    parts = [
        [polar.vector for _, polar in owned],
        [vector for spring in springs if spring.torsion for vector in spring.vectors],
        [frame.normal for frame in points],
        [moment.direction for moment in mechanism.moments],
        [vector for spring in springs if not spring.torsion for vector in spring.vectors],
        [frame.position for frame in points],
        [force.direction for force in mechanism.following],
        [vector for _, vector in mechanism.turning],
    ]
    _, torsion, normal, _, straight, position, direction, turning, _ = starts(parts).tolist()
    vectors = VectorTable(
        [v for part in parts for v in part],
        straight,
        [k for k, _ in owned],
        [polar.length for _, polar in owned],
        direction,
        turning,
    )
    numbers = [range(a, a + 1) for a in range(straight, position)]
    numbers += [range(a, a + 2) for a in range(torsion, normal, 2)]
    return {
        "vectors": vectors,
        "springs": SpringTable(springs, numbers, vectors.groups),
        "laws": LawTable(mechanism.laws, normal, position, vectors.groups),
    }


def _sensors(mechanism: Mechanism):
    """Return outputs, units, sensors with their rows, owners of conditions, and all the rows."""
    outputs, units, sensors, conditions, rows = [], [], [], [], []
    for name, sensor in mechanism.sensors.items():
        before = len(outputs)
        for suffix, unit in sensor.outputs():
            outputs.append(name + suffix)
            units.append(unit)
        first = len(rows)
        rows += sensor.rows(mechanism)
        derived = partial(_derived, name, len(outputs) - before, sensor, mechanism)
        sensors.append((derived, slice(first, len(rows))))
    for name, joint in mechanism.joints.items():
        positive = joint.conditions(mechanism.frame)
        conditions += [name] * len(positive)
        rows += positive
    return outputs, units, sensors, conditions, rows


def _derived(
    name: str, count: int, sensor: Sensor, mechanism: Mechanism, rows: np.ndarray
) -> np.ndarray:
    """Return the outputs of a sensor, shape (outputs, times, lanes)."""
    outputs = np.asarray(sensor.derive(rows, mechanism))
    if outputs.shape != (count, *rows.shape[1:]):
        raise InputError(
            f"sensor {name!r}: derive must return shape (outputs, times, lanes), "
            f"{(count, *rows.shape[1:])}; got {outputs.shape}"
        )
    return outputs


def _forces(mechanism: Mechanism) -> tuple[list[np.ndarray], list[Form]]:
    """Return the generalized forces on each of [1, q, λ, θ]: what is constant, and all other terms.

    What is constant is that on [1, q].
    """
    count = 1 + mechanism.state.coordinates
    rows = [Form({})] * mechanism.state.velocity
    for name in mechanism.loads:
        for j, force in mechanism.forces(name).items():
            rows[j] = rows[j] + force
    constant = [row.terms.get(CONSTANT, np.zeros(())) for row in rows[:count]]
    others = [Form({key: c for key, c in row.terms.items() if key != CONSTANT}) for row in rows]
    return constant, [*others[:count], *rows[count:]]


def _pairs(state: State, owners: Sequence[str]) -> list[tuple[int, int]]:
    """Return the unknowns in pairs: vectors of the plane, then multipliers of the same joint."""
    pairs = [(i, i + 1) for i in range(1, state.coordinates, 2)]
    first = state.multiplier
    for _, group in groupby(owners):
        end = first + len(list(group))
        pairs += [(k, k + 1 if k + 1 < end else NONE) for k in range(first, end, 2)]
        first = end
    return pairs


def _regular(mechanism: Mechanism, mass: dict, scale: list) -> dict:
    """Return the mass matrix with small masses and inertias of rigid bodies in place of zeros."""
    inertia, whole = _inertias(mechanism, mass, scale)
    none = {i: m <= MASSLESS * whole for i, m in inertia.items()}
    least = np.minimum.reduce([np.where(none[i], whole, m) for i, m in inertia.items()])
    least = np.maximum(REGULAR_MASS * least, MIN_REGULAR_MASS * whole)
    regular = dict(mass)
    for i in _rigid_rows(mechanism):
        if none[i].any():
            regular[i, i] = np.where(none[i], least * np.square(scale[i]), mass[i, i])
    return regular


def _without_light(mechanism: Mechanism, mass: dict, scale: list) -> dict:
    """Return the mass matrix with larger masses and inertias of light rigid bodies."""
    inertia, whole = _inertias(mechanism, mass, scale)
    least, heavier = MIN_SHARING_MASS * whole, dict(mass)
    for i in _rigid_rows(mechanism):
        if np.any(inertia[i] < least):
            heavier[i, i] = np.maximum(mass[i, i], least * np.square(scale[i]))
    return heavier


def _inertias(mechanism: Mechanism, mass: dict, scale: list) -> tuple[dict, np.ndarray]:
    """Return the inertia [kg m²] of each row of z, and the sum of those of all nodes or 1."""
    rows = [i for i, j in mass if i == j]
    inertia = dict(zip(rows, stack([mass[i, i] / np.square(scale[i]) for i in rows]), strict=True))
    whole = np.sum([inertia[i] for i in node_rows(mechanism)], axis=0)
    return inertia, np.where(whole > 0, whole, 1.0)


def _rigid_rows(mechanism: Mechanism) -> list[int]:
    """Return the rows of z of all rigid bodies and point masses."""
    return [
        mechanism.first_coordinates[name] + k
        for name, body in mechanism.bodies.items()
        for k in range(0 if body.elements else body.size)
    ]


def _metric(mechanism: Mechanism, mass: dict, scale: list) -> list[np.ndarray]:
    """Return the mass matrix with moments of inertia of rigid bodies that outweigh all masses."""
    rigid = [name for name, body in mechanism.bodies.items() if isinstance(body, RigidBody)]
    turned = {mechanism.first_coordinates[name] + k for name in rigid for k in (2, 3)}
    masses = sum(mass[n, n] for n in node_rows(mechanism))
    inertia = TURNING * masses / np.square(scale[node_rows(mechanism)[0]])
    return [m + inertia if i == j and i in turned else m for (i, j), m in mass.items()]


def node_rows(mechanism: Mechanism) -> list[int]:
    """Return the row of z of the first coordinate of each node."""
    first = mechanism.first_coordinates
    return [first[name] + k for name, body in mechanism.bodies.items() for k in body.nodes]


def _inverse_scale(mechanism: Mechanism, start: list, mass: dict) -> list:
    """Return 1/size for positions and 1 for directions, with the size of the whole mechanism.

    The size is the diagonal of the box around the nodes, plus the largest radius of gyration.
    """
    nodes = node_rows(mechanism)
    x, y = (stack([start[node + axis] for node in nodes]) for axis in range(2))
    none = np.zeros(())
    least = MASSLESS * sum(mass[n, n] for n in nodes)
    massive = [np.where(mass[n, n] > least, mass[n, n], np.inf) for n in nodes]
    inertia = [mass.get((n + 2, n + 2), none) for n in nodes]
    gyration = [np.sqrt(j / m) for j, m in zip(inertia, massive, strict=True)]
    size = np.hypot(np.ptp(x, axis=0), np.ptp(y, axis=0)) + stack(gyration).max(axis=0)
    size = np.where(size > 0, size, 1.0)  # a single point mass has none
    scale: list = [1.0] * len(start)
    for node in nodes:
        scale[node] = scale[node + 1] = 1 / size
    return scale
