"""From a mechanism to arrays: what all samples share, and the numbers of each sample."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import chain, groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.user_functions import evaluate_function, function_text
from flexband.errors import InputError
from flexband.mechanics.assembly.elements import (
    ContinuumTable,
    ElementTable,
    rigidity,
    warn_of_elements,
)
from flexband.mechanics.assembly.entry_tables import (
    ExtremeTable,
    MassTable,
    Places,
    ProductTable,
    Table,
    TermTable,
)
from flexband.mechanics.assembly.friction import FrictionTable
from flexband.mechanics.assembly.inertia import Inertia
from flexband.mechanics.assembly.stacking import count_samples, indices, leaves, stack
from flexband.mechanics.assembly.structure import Structure, Values
from flexband.mechanics.assembly.vectors import VectorTables
from flexband.mechanics.kernels.forms import Form, TimeFunction
from flexband.mechanics.kernels.pattern import NONE, analyse
from flexband.mechanics.kernels.records import Record
from flexband.mechanics.loads.law_shape import CompiledLaw
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.model.model import Model
from flexband.mechanics.model.parts import name_errors
from flexband.mechanics.sensors.motion import Sensor


@dataclass(frozen=True)
class System:
    """A mechanism as arrays."""

    structure: Structure  # sizes and indices, the same for all samples
    samples: int  # number of samples, 1 if no parameter is an array
    # the numbers of all samples, arrays of shape (rows, samples or 1). The functions of time are
    # tabulated in `packing`.
    values: Values
    functions: list[TimeFunction]  # the functions of time in use, except for the constant one
    constraints: list[str]  # the part that each row of Φ belongs to
    turning: list[str]  # the part that each of the turning vectors belongs to
    # name and unit of each output
    outputs: list[str]
    units: list[str]
    # for each sensor, what computes its outputs from its rows, and which rows are its own
    sensors: list[tuple[Callable[[np.ndarray], np.ndarray], slice]]
    conditions: list[str]  # the joint behind each further row, which must stay positive
    # the compiled force laws, which must exist as long as the engine calls them, each with the name
    # of its load
    laws: Sequence[tuple[str, CompiledLaw]]
    mechanism: Mechanism  # what the arrays are of
    nominal_start: np.ndarray  # the start [1, q] that the bodies state, shape (rows, samples or 1)
    first_time: float = 0.0
    """Of a motion [s]."""
    # number -> load and reason, as the engine finds them, and new numbers
    law_failures: dict[int, str] = field(default_factory=dict)
    numbers: Iterator[int] = field(default_factory=itertools.count)

    @property
    def impulsive(self) -> set[str]:
        """The outputs that are forces and moments of joints."""
        sensors = self.mechanism.sensors.items()
        outputs = (self.model.outputs[name] for name, sensor in sensors if sensor.impulsive)
        return {name for group in outputs for name, _ in group}

    @property
    def model(self) -> Model:
        """The forms that the arrays are of."""
        return self.mechanism.model

    @cached_property
    def record(self) -> Record:
        """The structure as kernels take it."""
        return Record(self.structure)

    @property
    def sensor_row_count(self) -> int:
        """Number of rows that `sense` writes: those of the sensors, then the conditions."""
        return (self.sensors[-1][1].stop if self.sensors else 0) + len(self.conditions)


def assemble(mechanism: Mechanism) -> System:
    """Return the arrays of a mechanism."""
    warn_of_elements(mechanism)
    model = mechanism.model
    state = model.state.with_extremes(len(model.watch_list))
    mass = model.mass
    velocity: list[ArrayLike] = [0.0]
    # Take the elements of all flexible bodies.
    free_strains = [strain for entries in model.entries.values() for strain in entries.strains]
    continua = ContinuumTable()
    elements = {
        "beams": ElementTable(free_strains),
        "continua": continua,
        "cables": ElementTable(free_strains),
    }
    for name, body in model.bodies.items():
        velocity += name_errors(f"body {name!r}", body.velocities)
        if name in model.members:
            member, first = model.member(name)
            name_errors(f"body {name!r}", elements[member.element_table].take, name, member, first)

    # Collect the tables of numbers and indices.
    inertia = Inertia(model)
    sensing = Sensing.from_model(model)
    watched = model.watch_list
    weight, force_rows = _forces(model)
    vectors = VectorTables.from_model(model)
    tables: dict[str, Table] = {
        "mass": MassTable(mass, inertia.regular_mass),
        **elements,
        "vectors": vectors.vectors,
        "springs": vectors.springs,
        "laws": vectors.laws,
        "terms": TermTable(
            model.constraint_forms, state.multiplier, state.angle, _angle_coordinates(model)
        ),
        "friction": FrictionTable(model, vectors),
        "forces": ProductTable(force_rows),
        "sensors": ProductTable(sensing.rows),
        "extremes": ExtremeTable([w.form for w in watched], [w.kind for w in watched]),
    }
    # Find the functions of time, and the pattern of the matrix.
    all_functions = chain.from_iterable(table.functions for table in tables.values())
    functions = [f for f in dict.fromkeys(all_functions) if f is not None]
    owners = [owner for owner, _ in model.constraints]
    couples = set(chain.from_iterable(table.couples() for table in tables.values()))
    angle = state.angle
    matrix_entries = [(i, j) for i, j in couples if 0 < i < angle and 0 < j < angle]
    frictions = [f"friction {k}" for k in range(len(model.frictions))]
    bodies = [name for name, body in model.bodies.items() for _ in range(body.size)]
    pairs = [*_pairs(bodies, 1), *_pairs([*owners, *frictions], state.multiplier)]
    pattern, slots = analyse(pairs, state.coordinates, matrix_entries)
    numbers = {None: 0} | {f: k + 1 for k, f in enumerate(functions)}
    places = Places(state, numbers, slots, nowhere=pattern.rows - 1)
    pivots = [places.slot(k, k) for k in range(state.friction, state.angle)]  # of what slides
    pattern = pattern._replace(filled_up=indices([*pattern.filled_up, *pivots]))
    # Fill in the structure and the values.
    forms = [*sensing.rows, *(form for form, *_ in watched)]
    read = {i for row in forms for key in row.terms for i in key[:2]}
    structure = Structure(
        state=state,
        functions=len(numbers),
        reads_energy=state.energy in read,
        reads_laws=not read.isdisjoint(range(state.law, state.extreme)),
        pattern=pattern,
        **{name: table.structure(places) for name, table in tables.items()},
    )
    of_runs = ("parts", "numbers", "moments", "functions", "rates", "polynomials")
    values = Values(
        start=stack(model.guess),
        drawn=stack(model.drawn_angles),
        velocity=stack(velocity),
        inverse_scale=stack(inertia.inverse_scale),
        rigidity=stack([rigidity(elements["beams"], continua, elements["cables"], mass)]),
        regular_mass=stack(list(inertia.regular_mass.values())),
        sharing_mass=stack(list(inertia.sharing_mass().values())),
        metric=stack(inertia.metric()),
        weight=stack(weight),
        windows=stack([time for w in watched for time in w.times]),
        law_states=vectors.laws.starting_states(),
        **dict.fromkeys(of_runs, np.empty((0, 1))),
        **{name: table.values() for name, table in tables.items()},
    )
    # Check what functions return, and count the samples.
    driven = [np.atleast_1d(evaluate_function(f, 0.0)) for f in functions]
    for f, value in zip(functions, driven, strict=True):
        if value.ndim > 1:
            shapes = "a number or one per sample, shape (n,)"
            raise InputError(f"{function_text(f)} must return {shapes}; got shape {value.shape}")
    samples = count_samples([*leaves(values), *driven])
    loads = [name for name, entries in model.entries.items() for _ in entries.laws]
    return System(
        structure=structure,
        samples=samples,
        values=values,
        functions=functions,
        constraints=owners,
        turning=[part for part, _ in model.turn_axes],
        outputs=sensing.outputs,
        units=sensing.units,
        sensors=sensing.sensors,
        conditions=sensing.conditions,
        laws=list(zip(loads, vectors.laws.compiled, strict=True)),
        mechanism=mechanism,
        nominal_start=stack(model.initial_guess),
    )


def _angle_coordinates(model: Model) -> set[int]:
    """Return the coordinates that angles in constraints, and the travels of friction, depend on."""
    vectors = [polar.vector for row in model.rows_with_multipliers for polar in row.polar]
    keys = [key for vector in vectors for form in vector for key in form.terms]
    keys += [key for travel in model.travel_forms for key in travel.terms if key[0] > 0]
    return {n for i, j, _ in keys for n in (i, j) if n > 0}


class Sensing(NamedTuple):
    """What the engine evaluates at every time for the sensors, and for the conditions of joints."""

    outputs: list[str]
    units: list[str]
    sensors: list[tuple[Callable[[np.ndarray], np.ndarray], slice]]
    """For each sensor, the function that computes its outputs from its rows, and these rows."""
    conditions: list[str]  # the joint of each condition
    rows: list[Form]  # of all sensors, then the conditions

    @staticmethod
    def from_model(model: Model) -> Sensing:
        """Return the sensing of a model."""
        sensing = Sensing([], [], [], [], [])
        for name, sensor in model.sensors.items():
            sensing.outputs.extend(output for output, _ in model.outputs[name])
            sensing.units.extend(unit for _, unit in model.outputs[name])
            first = len(sensing.rows)
            sensing.rows.extend(sensor.rows(model))
            derive = partial(_derive_outputs, name, len(model.outputs[name]), sensor, model)
            sensing.sensors.append((derive, slice(first, len(sensing.rows))))
        for name, joint in model.joints.items():
            positive = joint.conditions(model.frame)
            sensing.conditions.extend([name] * len(positive))
            sensing.rows.extend(positive)
        return sensing


def _derive_outputs(
    name: str, count: int, sensor: Sensor, model: Model, rows: np.ndarray
) -> np.ndarray:
    """Return the outputs of a sensor, shape (outputs, times, lanes)."""
    outputs = np.asarray(sensor.derive(rows, model))
    if outputs.shape != (count, *rows.shape[1:]):
        raise InputError(
            f"sensor {name!r}: derive must return shape (outputs, times, lanes), "
            f"{(count, *rows.shape[1:])}; got {outputs.shape}"
        )
    return outputs


def _forces(model: Model) -> tuple[list[np.ndarray], list[Form]]:
    """Return the generalized forces: what is constant on [1, q], and all other terms."""
    count = 1 + model.state.coordinates
    rows = [Form({})] * model.state.velocity
    for name in model.loads:
        for j, force in model.forces(name).items():
            rows[j] = rows[j] + force
    constant_key = (0, 0, None)  # key of the constant term
    constant = [row.terms.get(constant_key, np.zeros(())) for row in rows[:count]]
    others = [Form({key: c for key, c in row.terms.items() if key != constant_key}) for row in rows]
    return constant, [*others[:count], *rows[count:]]


def _pairs(owners: Sequence[str], first: int) -> list[tuple[int, int]]:
    """Return the unknowns from row `first` of z on in pairs, each of one owner."""
    pairs = []
    for _, group in groupby(owners):
        end = first + len(list(group))
        pairs += [(k, k + 1 if k + 1 < end else NONE) for k in range(first, end, 2)]
        first = end
    return pairs
