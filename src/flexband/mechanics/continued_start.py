"""Starts where another motion ended: the states of the parts that both mechanisms have."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any

import numpy as np
import xarray as xr

from flexband.basics.words import number_of, value_text
from flexband.errors import InputError
from flexband.mechanics.assembly.stacking import stack
from flexband.mechanics.assembly.structure import Values, WorkSpace
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.batch import Batch, BlockStart, Run, Start, begin
from flexband.mechanics.engine.batch import run as run_task
from flexband.mechanics.engine.corrections import Corrections
from flexband.mechanics.engine.entries import STRIKE
from flexband.mechanics.engine.failures import blame_overlaps
from flexband.mechanics.engine.loop_closure import constraint_errors
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.forms import Vector
from flexband.mechanics.kernels.lane_arrays import WIDTH, to_lanes
from flexband.mechanics.kernels.state import STATE_ROWS, rows_of_gaps
from flexband.mechanics.model.turns import nearest

Label = tuple[str, str, int]
"""A kind of numbers, the part that has them, and which of several they are."""

STEP_ROWS = 4
"""Rows of `WorkSpace.steps`."""


@dataclass(frozen=True, eq=False)
class EndState:
    """The state of a mechanism at the end of a motion, from which another one goes on."""

    time: float  # end of the motion [s]
    spectral_radius: float  # of the integrator
    meshes: dict[str, tuple]  # of the bodies
    parts: dict[Label, np.ndarray]  # numbers by their labels, (rows, samples)
    at_rest: bool = False  # whether it is an equilibrium, from which bodies have given velocities

    @property
    def samples(self) -> int:
        return next(iter(self.parts.values())).shape[1]

    def __repr__(self) -> str:
        return f"<state of {number_of(self.samples, 'sample')} at t = {self.time:g} s>"


def end_state(system: System, batch: Batch, time: float, spectral_radius: float) -> EndState:
    """Return the state at the end of a motion."""
    ends = batch.ends
    parts = {label: ends[rows] for label, rows in _labels(system).items()}
    start = ends[-system.structure.state.multiplier :]
    directions = zip(_directions(system, start), _directions(system, ends), strict=True)
    for k, ((name, before, vector), (_, after, _)) in enumerate(directions):
        start_angle = nearest(before, system.model.drawn(vector))
        change = nearest(after - before, batch.turn_statistics[:, k, 1])
        parts["turn", name, 0] = np.atleast_2d(start_angle + change)
    return EndState(time, spectral_radius, _meshes(system), parts)


def rest_state(system: System, z: np.ndarray, rest: np.ndarray, time: float) -> EndState:
    """Return the state of equilibria z, (rows, samples), with springs' elongations at `rest`."""
    sizes = _sizes(system)
    ends = np.zeros((sum(sizes), z.shape[1]))
    ends[: len(z)] = z
    first = sizes[0] + sizes[1]
    ends[first : first + len(rest)] = rest
    kinds = "body", "angle", "spring", "law state"
    parts = {label: ends[rows] for label, rows in _labels(system).items() if label[0] in kinds}
    for name, direction, vector in _directions(system, z):
        parts["turn", name, 0] = np.atleast_2d(nearest(direction, system.model.drawn(vector)))
    return EndState(time, np.nan, _meshes(system), parts, at_rest=True)


def _directions(system: System, q: np.ndarray) -> Iterator[tuple[str, np.ndarray, Vector]]:
    """Yield the bodies that turn, the directions of their first sections, and these vectors."""
    turning = [name for name, (axes, *_) in system.model.axes.items() if len(axes)]
    for name, (_, ((x, y, *_), *_)) in zip(turning, system.model.turn_axes, strict=False):
        yield name, np.arctan2(y.at([*q]), x.at([*q])), (x, y)


def state_of(motion: xr.DataArray, period: float | None) -> EndState:
    """Return the state at the end of a motion; raise `InputError` if it has none."""
    if period is not None:
        raise InputError(f"period [s] must be None for a motion that goes on; got {period!r}")
    state = motion.attrs.get("state")
    if not isinstance(state, EndState):
        raise InputError(
            "start must be 'assembled', 'static', 'periodic', or the result of "
            "simulate(..., keep_state=True) or of equilibrium(..., keep_state=True); got a result "
            "without a state"
        )
    if motion.sizes.get("sample", 1) != state.samples or (
        "time" in motion.dims and float(motion["time"][-1]) != state.time
    ):
        raise InputError(
            "start must be the whole result of simulate, of "
            f"{number_of(state.samples, 'sample')} until t = {state.time:g} s; got a part of it, "
            f"{value_text(dict(motion.sizes))}"
        )
    return state


def continue_from(system: System, state: EndState) -> tuple[System, ContinuedStart]:
    """Return a system that starts in the state of another one, and its start."""
    # Refuse a state of other bodies, meshes or samples.
    for name, mesh in _meshes(system).items():
        if name not in state.meshes:
            names = ", ".join(state.meshes)
            raise InputError(f"body {name!r} must be in the motion that goes on; there is {names}")
        if mesh != state.meshes[name]:
            raise InputError(
                f"body {name!r} must have the same mesh in both mechanisms; members are divided "
                "where joints and loads act, so give it as many elements and the same such points"
            )
    if len({system.samples, state.samples} - {1}) > 1:
        raise InputError(
            f"start must have as many samples as the mechanism, {system.samples}, or one; got "
            f"{state.samples}"
        )
    # Take over the rows that both mechanisms have.
    samples = max(system.samples, state.samples)
    rows = system.structure.state
    ends = np.zeros((sum(_sizes(system)), samples))
    common_rows = np.zeros((len(ends), 1), dtype=bool)
    for label, places in _labels(system).items():
        if label in state.parts:
            ends[places] = state.parts[label]
            common_rows[places] = True
    ends[0] = 1.0
    if state.at_rest:
        ends[rows.velocity : rows.acceleration] = system.values.velocity
    first_rest = rows.rows + rows.coordinates + 1

    def carry_over(first: int, defaults: np.ndarray) -> np.ndarray:
        place = slice(first, first + len(defaults))
        return np.where(common_rows[place], ends[place], defaults)

    # Angles count turns from those at the end of the other motion.
    turns = {name: part[0] for (kind, name, _), part in state.parts.items() if kind == "turn"}
    turns = {name: turn for name, turn in turns.items() if name in system.model.bodies}
    mechanism = replace(system.mechanism, branches=turns)
    angles = slice(rows.angle, rows.velocity)
    drawn_angles = stack(mechanism.model.drawn_angles)
    drawn_angles = np.broadcast_to(drawn_angles, (rows.velocity - rows.angle, samples))
    ends[angles] = np.where(common_rows[angles], ends[angles], drawn_angles)
    # States of parts that are new are those of the mechanism itself.
    values = system.values
    values = values._replace(
        drawn=ends[angles],
        start=ends[: rows.coordinates + 1],
        velocity=ends[rows.velocity : rows.acceleration],
        law_states=carry_over(rows.law_state, values.law_states),
        springs=values.springs._replace(rest=carry_over(first_rest, values.springs.rest)),
    )
    continuing = replace(
        system,
        values=values,
        nominal_start=values.start,
        samples=samples,
        first_time=state.time,
        mechanism=mechanism,
    )
    return continuing, ContinuedStart(ends, common_rows, state.spectral_radius, np.zeros(samples))


@dataclass(frozen=True, eq=False)
class ContinuedStart(Start):
    """The end of another motion, whose velocities joints change by a plastic impact."""

    ends: np.ndarray  # see `Batch`, (rows, samples)
    common_rows: np.ndarray  # which rows are not of new parts
    spectral_radius: float  # of the integrator of the other motion
    lost_energy: np.ndarray  # kinetic energy lost at the start [J], (samples,), filled by blocks
    tolerance: float = 1e-5
    """By which joints may be apart, relative to the mechanism's size."""

    def of_blocks(self, run: Run) -> Callable[[int, Values], BlockStart]:
        """Return what begins a block."""
        system = run.system
        state = run.system.structure.state
        step = float(run.times[1] - run.times[0])
        free_steps = run.integrator.step_limits(state, step) is not None
        same_method = self.spectral_radius == float(run.integrator.spectral_radius)
        q = slice(1, state.coordinates + 1)
        velocity = state.velocity
        second = slice(state.acceleration + 1, state.energy)
        laws = slice(state.law_state, state.sliding)
        stuck = slice(state.sliding, state.sliding + 2 * (state.angle - state.friction))
        keeps_rule = self.common_rows[laws].all()
        places = [*accumulate(_sizes(system))]

        def begin_block(number: int, values: Values) -> BlockStart:
            lanes = to_lanes(self.ends[:, run.samples], number)
            z, a, _, steps, anew, _, _ = np.split(lanes, places)
            errors = np.abs(constraint_errors(system, values, z))
            size = 1 / values.inverse_scale[1]
            work, failure = begin(system, values, z)
            # accelerations change by what they jump, the method's only if that is less than its
            # distance from them, which depends on the past
            distance = a[q] - z[second]
            jump = work.z[second] - anew[1:]
            change_sizes = [
                np.abs(values.inverse_scale[q] * x).max(axis=0) for x in (jump, distance)
            ]
            smooth = (change_sizes[0] <= change_sizes[1]) & same_method & (steps[1] > 0)
            ratio = 1.0 if free_steps else step / np.where(smooth, steps[1], step)
            work.z[second] = np.where(smooth, z[second] + jump, work.z[second])
            work.a[q] = work.z[second] + np.where(smooth, ratio * distance, 0.0)
            work.steps[:] = np.where(smooth, steps if free_steps else step, 0.0)
            if keeps_rule:
                unchanged = smooth & (np.abs(ratio - 1.0) < 1e-9)
                work.z[laws] = np.where(unchanged, z[laws], work.z[laws])
            work.z[stuck] = z[stuck]  # and where; what is new is free until the run begins
            if free_steps and state.friction < state.angle:
                _strike(run, values, work, z, failure)
            samples = run.samples[number * WIDTH : (number + 1) * WIDTH]
            losses = _lost_energy(system, values, z[velocity:], work.z[velocity:])
            self.lost_energy[samples] = losses[: len(samples)]
            blame_overlaps(system, values, work.z, failure, z)
            if len(errors):
                code = np.full(WIDTH, FAILURE.not_met)
                worst = errors.max(axis=0)
                not_met = np.stack([code, 0.0 * code, errors.argmax(axis=0), worst])
                failure = np.where(worst > self.tolerance * size, not_met, failure)
            return BlockStart(work, failure, work.z.copy())

        return begin_block

    def attributes(self, system: System, changes: Corrections) -> dict[str, Any]:
        return {"lost_energy": self.lost_energy.tolist()}


def _strike(
    run: Run,
    values: Values,
    work: WorkSpace,
    before: np.ndarray,
    failure: np.ndarray,
    *,
    threshold: float = 1e-9,
) -> None:
    """Let friction take part in the impact that changed the velocities `before`, (rows, WIDTH).

    It slides then as it does after the impact. A change below the part `threshold` of the
    largest velocity is none.
    """
    state = run.system.structure.state
    speeds = slice(state.velocity, state.acceleration)
    modes = slice(state.sliding, state.sliding + state.angle - state.friction)
    z = work.z.copy()
    scale = values.inverse_scale * np.abs(before[speeds])
    change = values.inverse_scale * np.abs(before[speeds] - z[speeds])
    struck = change.max(axis=0) > threshold * scale.max(axis=0)
    if not struck.any():
        return
    step = float(run.times[1] - run.times[0])
    work.z[speeds] = before[speeds]
    run_task(
        STRIKE, run.system, values, work, failure=failure,
        method=run.integrator.coefficients(step), limits=run.integrator.step_limits(state, step),
    )  # fmt: skip
    after = [np.where(struck, work.z[rows], z[rows]) for rows in (speeds, modes)]
    work.z[:] = z
    for rows, numbers in zip((speeds, modes), after, strict=True):
        work.z[rows] = numbers


def _lost_energy(
    system: System, values: Values, before: np.ndarray, after: np.ndarray
) -> np.ndarray:
    """Return by how much velocities after an impact have less kinetic energy [J], of each lane."""
    i = system.structure.mass.i
    j = system.structure.mass.j
    change = before - after
    total = before + after
    products = change[i] * total[j] + np.where((i < j)[:, None], change[j] * total[i], 0.0)
    return 0.5 * (values.mass * products).sum(axis=0)


def _sizes(system: System) -> tuple[int, ...]:
    """Return the numbers of rows of what is kept, see `Batch.ends`."""
    state = system.structure.state
    springs = len(system.structure.springs.f)
    coordinates = state.coordinates + 1
    return state.rows, coordinates, springs, STEP_ROWS, coordinates, coordinates


def _meshes(system: System) -> dict[str, tuple]:
    """Return what must be the same of each body."""
    model = system.model
    meshes = {name: member.mesh[:2] for name, member in model.members.items()}
    return {
        name: (type(body), body.size, *(tuple(array.tolist()) for array in meshes.get(name, ())))
        for name, body in model.bodies.items()
    }


def _labels(system: System) -> dict[Label, np.ndarray]:
    """Return the rows of the end of a motion that belong to each label."""
    model = system.model
    state = system.structure.state
    a, rest, steps, anew, *_ = accumulate(_sizes(system))
    labels: dict[Label, np.ndarray] = {("steps", "", 0): np.arange(steps, anew)}
    # Coordinates of bodies, with their rates and accelerations.
    for name, body in model.bodies.items():
        n = model.first_coordinates[name] + np.arange(body.size)
        places = [n, state.velocity + n, state.acceleration + n, a + n, anew + n]
        labels["body", name, 0] = np.concatenate(places)
    # Angles, in the order in which the engine numbers them.
    entries = model.entries.items()
    angles = [owner for owner, row in model.constraints for _ in row.polar]
    angles += [owner for owner, f in model.frictions for _ in f.whole_travel.polar]
    angles += [owner for owner, spring in model.springs for _ in spring.angles]
    angles += [owner for owner, entry in entries for law in entry.laws for _ in law.points]
    angles += [owner for owner, entry in entries for _ in entry.moments]
    angles += [f"sensors of {point}" for point in model.sensor_points]
    labels |= _row_labels("angle", angles, state.angle)
    # Memory of springs, friction and force laws.
    labels |= _row_labels("spring", [owner for owner, _ in model.springs], rest)
    laws = [(owner, law) for owner, entry in entries for law in entry.laws]
    states = [owner for owner, law in laws for _ in law.states]
    friction_owners = [owner for owner, _ in model.frictions]
    labels |= _row_labels("friction", friction_owners, state.sliding, copies=2)
    labels |= _row_labels("law state", states, state.law_state, copies=STATE_ROWS)
    if states:
        labels["rule", "", 0] = np.arange(state.rule, state.sliding)
    # Gaps of contacts and events.
    gaps = [owner for owner, law in laws for _ in law.events]
    labels |= _row_labels("gap", gaps, state.gap)
    rows = rows_of_gaps.py_func(state)
    for kind in ("mode", "mass", "depth"):
        labels |= _row_labels(kind, gaps, getattr(rows, kind))
    return labels


def _row_labels(
    kind: str, owners: Iterable[str], first: int, copies: int = 1
) -> dict[Label, np.ndarray]:
    """Return the labels of rows with these owners; `copies` of all rows follow each other."""
    owners = list(owners)
    count = Counter[str]()
    labels: dict[Label, np.ndarray] = {}
    for row, owner in enumerate(owners, start=first):
        labels[kind, owner, count[owner]] = row + len(owners) * np.arange(copies)
        count[owner] += 1
    return labels
