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
from flexband.indices import as_indices
from flexband.mechanics.beam import Beam
from flexband.mechanics.centre_line import CentreLine
from flexband.mechanics.elements import Elements, rigidity
from flexband.mechanics.factorization import NONE, analyse
from flexband.mechanics.force_laws import TorsionSpring
from flexband.mechanics.forms import Form, TimeFunction
from flexband.mechanics.law_assembly import AngleParts, LawParts, square_slots
from flexband.mechanics.law_assembly import couples as shared
from flexband.mechanics.loads import Gravity, Spring
from flexband.mechanics.mechanism import LAWS, Mechanism
from flexband.mechanics.stacking import count_samples, indices, stack
from flexband.mechanics.structure import Beams, Cables, Mass, Products, Springs, Structure, Terms

RELAXED = -1.0
"""Rest length of a spring that is relaxed at the start."""


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
    turned = [(first_multiplier + k, v) for k, (_, row) in enumerate(constraints)
              for v, _ in row.angles]  # fmt: skip
    laws = LawParts(list(mechanism.force_laws.values()), mechanism.frame, len(turned))
    vectors = [v for _, v in turned] + [f.normal for frames in laws.frames for f in frames]
    angles = AngleParts(vectors, [k for k, _ in turned])
    outputs, units, sensors, conditions, sensor_rows = _sensors(mechanism)
    force_rows = _force_rows(mechanism)
    springs = [load for load in mechanism.loads.values() if isinstance(load, Spring)]
    functions = _functions(
        [*constraint_rows, *sensor_rows, *force_rows],
        [*laws.functions, *(spring.actuator[1] for spring in springs)],
    )
    numbers_of = {None: 0} | {f: k + 1 for k, f in enumerate(functions)}

    terms = _terms(constraint_rows, numbers_of, first_multiplier, first_angle)
    sensor_terms = _terms(sensor_rows, numbers_of, first_row=0)
    force_terms = _terms(force_rows, numbers_of, first_row=0)
    entries = [_spring_entries(mechanism, spring) for spring in springs]
    coordinates = [sorted(x.keys() | y.keys()) for x, y in entries]

    couples = [
        *mass,
        *beams.couples(),
        *cables.couples(),
        *shared(coordinates),
        *angles.couples(),
        *shared(laws.groups),
        *(p for k, i, j, _ in terms[0] for p in ((k, i), (k, j), (i, j))),
    ]
    unknowns = range(1, first_angle)
    pattern, slots = analyse(
        _pairs(count, owners), count, [p for p in set(couples) if {*p} <= {*unknowns}]
    )
    nowhere = pattern.rows - 1

    def slot(i: int, j: int) -> int:
        return slots.get((min(i, j), max(i, j)), nowhere)

    structure = Structure(
        coordinates=count,
        multipliers=len(owners),
        velocity=mechanism.velocity_row,
        acceleration=mechanism.velocity_row + 1 + count,
        energy=_asked_for(mechanism.energy_row, sensor_rows),
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
            slot=beams.slots(slot),
        ),
        cables=Cables(indices(cables.first), cables.damped(), cables.slots(slot)),
        springs=Springs(
            start=np.cumsum([0] + [len(c) for c in coordinates]),
            coordinate=indices(i for c in coordinates for i in c),
            f=indices(numbers_of[spring.actuator[1]] for spring in springs),
            slot=square_slots(coordinates, slot, nowhere),
        ),
        terms=Terms(
            *(indices(t[k] for t in terms[0]) for k in range(4)),
            slot=indices(
                slot(*p) for k, i, j, _ in terms[0] for p in ((k, i), (k, j), (i, j))
            ).reshape(-1, 3),
            products=sum(i > 0 for _, i, _, _ in terms[0]),
            polynomials=sum(j < first_angle for _, _, j, _ in terms[0]),
        ),
        angles=angles.structure(first_angle, mechanism.energy_row + 1, slot, nowhere),
        laws=laws.structure(
            numbers_of,
            [isinstance(mechanism.loads[name], TorsionSpring) for name in mechanism.force_laws],
            slot,
            nowhere,
            sum(map(len, angles.groups[: len(turned)])),
        ),
        forces=Products(*(indices(t[k] for t in force_terms[0]) for k in range(4))),
        sensors=Products(*(indices(t[k] for t in sensor_terms[0]) for k in range(4))),
        pattern=pattern,
    )
    spring_x, spring_y = (
        [e[axis].get(i, 0.0) for e, c in zip(entries, coordinates, strict=True) for i in c]
        for axis in range(2)
    )
    rows = {
        "start": start,
        "velocity": velocity,
        "inverse_scale": _inverse_scale(start, mass, nodes),
        "mass": list(mass.values()),
        "force": _constant_forces(mechanism),
        "beams.inverse_length": beams.inverse_length,
        "beams.stiffness": beams.stiffness,
        "beams.initial": beams.initial,
        "beams.retardation": beams.retardation,
        "cables.inverse_length": cables.inverse_length,
        "cables.stiffness": cables.stiffness,
        "cables.retardation": cables.retardation,
        "rigidity": [rigidity(beams, cables, mass)],
        "coefficient": terms[1],
        "springs.x": spring_x,
        "springs.y": spring_y,
        "springs.stiffness": [s.stiffness for s in springs],
        "springs.cubic": [s.cubic for s in springs],
        "springs.damping": [s.damping for s in springs],
        "springs.pull": [s.actuator[0] for s in springs],
        "springs.rest_length": [
            RELAXED if s.rest_length is None else s.rest_length for s in springs
        ],
        "angles.x": angles.values(0),
        "angles.y": angles.values(1),
        "laws.x": laws.values(0),
        "laws.y": laws.values(1),
        "laws.parameter": laws.parameters,
        "load": force_terms[1],
        "sensor": sensor_terms[1],
    }
    stacked = {name: stack(values) for name, values in rows.items()}
    driven = [np.atleast_1d(np.asarray(f(0.0), dtype=float)) for f in functions]
    samples = count_samples([*stacked.values(), *driven])
    return System(
        structure, samples, stacked, functions, owners, outputs, units, sensors, conditions
    )


def _terms(
    rows: Sequence[Form],
    numbers: dict[TimeFunction | None, int],
    first_row: int,
    first_angle: int = 0,
) -> tuple[list[tuple[int, int, int, int]], list[np.ndarray]]:
    """Return (row, i, j, function) and the coefficient of each term.

    Products come first, angles last.
    """
    flat = [
        ((first_row + k, i, j, numbers[f]), c)
        for k, row in enumerate(rows)
        for (i, j, f), c in row.terms.items()
    ]
    flat.sort(key=lambda term: (term[0][1] == 0, term[0][2] >= first_angle))
    return [place for place, _ in flat], [c for _, c in flat]


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


def _asked_for(row: int, forms: Sequence[Form]) -> int:
    """Return a row of z where a form depends on it, else 0."""
    return row if any(row in key[:2] for form in forms for key in form.terms) else 0


def _functions(rows: Sequence[Form], others: Sequence[TimeFunction | None]) -> list[TimeFunction]:
    """Return the functions of time in use, each once."""
    in_rows = [f for row in rows for _, _, f in row.terms]
    return list(dict.fromkeys(f for f in [*in_rows, *others] if f is not None))


def _force_rows(mechanism: Mechanism) -> list[Form]:
    """Return the generalized force on each of [1, q], of all loads but gravity and springs."""
    rows = [Form({})] * (mechanism.coordinates + 1)
    for load in mechanism.loads.values():
        if not isinstance(load, (Spring, Gravity, *LAWS)):
            for j, force in load.forces(mechanism).items():
                rows[j] = rows[j] + force
    return rows


def _spring_entries(mechanism: Mechanism, spring: Spring) -> list[dict[int, np.ndarray]]:
    """Return, for X and Y, coordinate -> its coefficient in the spring's vector."""
    x_and_y = spring.separation(mechanism.frame)
    return [{j: c for (_, j, _), c in form.terms.items()} for form in x_and_y]


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
