"""Run samples, eight per lane, with blocks of lanes distributed over threads."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from flexband.mechanics.assembly.packing import pack, pack_end
from flexband.mechanics.assembly.structure import KEPT, Values, WorkSpace
from flexband.mechanics.engine.corrections import Corrections, corrections, report
from flexband.mechanics.engine.entries import HOLD, MARCH, START, dynamics, free_dynamics, statics
from flexband.mechanics.engine.failures import blame_laws, blame_overlaps
from flexband.mechanics.engine.free_steps.under_way import BlocksUnderWay
from flexband.mechanics.engine.generalized_alpha import Coefficients, GeneralizedAlpha, StepLimits
from flexband.mechanics.engine.initial_conditions import ASSEMBLY
from flexband.mechanics.engine.loop_closure import close_loops, guess_state
from flexband.mechanics.engine.newton import NEWTON
from flexband.mechanics.engine.projection import PROJECTION
from flexband.mechanics.engine.redundancy import rank_deficiency, require_inertia
from flexband.mechanics.engine.straining import LargestStrains, Members, kept_steps
from flexband.mechanics.engine.threads import stop_flag, while_compiling
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.lane_arrays import WIDTH, address, zeros
from flexband.mechanics.kernels.records import Record
from flexband.mechanics.time_functions.schedule import IMPULSE, Schedule

if TYPE_CHECKING:
    from flexband.basics.progress import Progress
    from flexband.mechanics.assembly.system import System

NOTHING = np.zeros((1, WIDTH))
"""In place of an array that a task does not use."""


class BlockStart(NamedTuple):
    """A block at time zero: its state, its failures (4, WIDTH), and the z that assembly found."""

    work: WorkSpace
    failure: np.ndarray
    assembled: np.ndarray


class BlockRun(NamedTuple):
    """A block that has run."""

    series: np.ndarray  # (rounds, rows, WIDTH): those of the sensors, then the joints' conditions
    failure: np.ndarray  # (4, WIDTH)
    first: np.ndarray  # z at the start
    work: WorkSpace  # at the end


class Run(NamedTuple):
    """What the blocks of a run share: equidistant times [s], and the numbers of the samples."""

    system: System
    times: np.ndarray
    integrator: GeneralizedAlpha
    samples: np.ndarray


class Start:
    """How runs start: from the guess, assembled with as little deformation as joints allow."""

    def of_blocks(self, run: Run) -> Callable[[int, Values], BlockStart]:
        """Return what begins a block, given its number and its values."""

        def begin_block(number: int, values: Values) -> BlockStart:
            work, failure = begin(run.system, values)
            blame_overlaps(run.system, values, work.z, failure)
            return BlockStart(work, failure, work.z.copy())

        return begin_block

    def attributes(self, system: System, changes: Corrections) -> dict[str, Any]:
        """Return what a result says about the start."""
        return report(system, changes)


class Batch(NamedTuple):
    """The results of the runs of some samples."""

    outputs: np.ndarray  # (samples, outputs, times)
    failures: np.ndarray  # (samples, 4), see `entries`
    starts: dict[int, np.ndarray]  # sample with redundant constraints -> its z at the start
    corrections: Corrections  # of the given start
    turn_statistics: np.ndarray  # (samples, bodies, 4), see `WorkSpace`
    unresolved: np.ndarray  # (samples,), number of the first time, see `WorkSpace`, or 0
    strains: LargestStrains
    snapshot_times: np.ndarray  # [s], of the states whose strains these are
    impulses: list[Impulse]
    # z, a, springs' elongations at rest, `WorkSpace.steps`, q̈ anew, q at the start; or no rows
    ends: np.ndarray

    @staticmethod
    def empty(system: System, samples: int, times: int, members: int) -> Batch:
        """Return results into which blocks of samples write theirs."""
        return Batch(
            outputs=np.empty((samples, len(system.outputs), times)),
            failures=np.zeros((samples, 4)),
            starts={},
            corrections=Corrections.zeros(len(system.model.bodies), samples),
            turn_statistics=np.zeros((samples, len(system.turning), 4)),
            unresolved=np.zeros(samples),
            strains=LargestStrains.zeros(members, samples),
            snapshot_times=np.zeros(0),
            impulses=[],
            ends=np.empty((0, samples)),
        )


class Impulse(NamedTuple):
    """An impulse of a sample where the speed of a prescribed motion jumps."""

    sample: int
    time: float  # [s]
    outputs: np.ndarray  # (outputs,): those of forces are their impulses [N s], [N m s]


def run_samples(
    system: System,
    times: np.ndarray,
    integrator: GeneralizedAlpha,
    *,
    samples: np.ndarray | None = None,
    start: Start = Start(),
    stride: int = 1,
    attempts: int = 1,
    keep: bool = False,
    threads: int = 1,
    progress: Progress | None = None,
) -> Batch:
    """Run all samples of a system, or those with these numbers, over equidistant times [s].

    The outputs are those of every `stride`-th time. If two `attempts` are made at each step, the
    second one damps Newton's method, and leaves out no constraint that is independent of the
    others. The ends of the motions are part of the result if it is to `keep` them.
    """
    limits = integrator.step_limits(system.structure.state, times[1] - times[0])
    packed = pack(system, times, samples, limits and limits.tolerance)
    at_end = pack_end(system, times, samples) if keep else None
    sample_numbers = np.arange(system.samples) if samples is None else samples
    begin_block = start.of_blocks(Run(system, times, integrator, sample_numbers))
    schedule = packed.schedule
    rounds = len(schedule.parts)
    method = integrator.coefficients(times[1] - times[0])._replace(
        attempts=attempts, matrices=most_matrices(system) if limits else 1000
    )
    run_block = partial(march_block, system, method, float(integrator.tolerance), limits=limits)
    members = Members(system)
    count = len(sample_numbers)
    batch = Batch.empty(system, count, len(times[::stride]), len(members.bodies))
    blocks = -(-count // WIDTH)
    firsts = np.empty((system.structure.state.rows, count))
    ends = [np.empty((0, 0))] * blocks
    under_way = BlocksUnderWay(system, blocks, rounds - 1)

    def simulate(block: int) -> int:
        places = slice(block * WIDTH, (block + 1) * WIDTH)
        numbers = sample_numbers[places]
        values = packed(block)
        block_start = begin_block(block, values)
        under_way.works[block] = block_start.work
        first_q = block_start.work.z[: system.structure.state.multiplier].copy()
        series, failure, first, work = run_block(values, rounds, block_start=block_start[:2])
        require_inertia(system, values, _determined(first, failure)[:, : len(numbers)], numbers)
        if at_end:
            ends[block] = end_of(system, values, at_end(block), work, first_q)[:, : len(numbers)]
        # Lanes may have rounds of their own: select those of the times of the result.
        with np.errstate(all="ignore" if failure[0].any() else None):
            derived = derive(system, series.transpose(1, 0, 2))
        lanes = np.minimum(np.arange(places.start, places.stop), count - 1)
        conditions = series[:, system.sensor_row_count - len(system.conditions) :]
        if not schedule.is_regular:
            batch.impulses.extend(_impulses(schedule, lanes[: len(numbers)], numbers, derived))
            last = schedule.lanes(schedule.last, lanes)
            derived = derived[:, last, np.arange(WIDTH)]
            conditions = conditions[last, :, np.arange(WIDTH)].transpose(0, 2, 1)
        # Fill in the results of the block, without the lanes that have no sample.
        batch.outputs[places] = derived[:, ::stride].transpose(2, 0, 1)[: len(numbers)]
        batch.failures[places] = _with_branches(conditions, failure).T[: len(numbers)]
        turns = work.turn_statistics.T[: len(numbers)]
        batch.turn_statistics[places] = turns.reshape(len(numbers), -1, 4)
        batch.unresolved[places] = work.unresolved[0, : len(numbers)]
        states = work.snapshots.reshape(KEPT, -1, WIDTH)[:, :, : len(numbers)]
        batch.strains.place(places, members.largest(states, numbers))
        firsts[:, places] = block_start.assembled[:, : len(numbers)]
        if failure[3, : len(numbers)].any():
            batch.starts[int(numbers[0])] = first[:, 0].copy()
        return len(numbers)

    # Compile before the threads begin, and run all blocks.
    if not (free_dynamics if limits else dynamics).codes:
        while_compiling(lambda: run_block(packed(0), 1))
    under_way.run(simulate, count, threads, progress)
    return batch._replace(
        corrections=corrections(system, firsts, sample_numbers),
        snapshot_times=times[schedule.numbers[kept_steps(rounds - 1), 0]],
        impulses=sorted(batch.impulses, key=lambda impulse: (impulse.time, impulse.sample)),
        ends=np.concatenate(ends, axis=1),
    )


def _determined(first: np.ndarray, failure: np.ndarray) -> np.ndarray:
    """Return the first z of a block, NaN where no start was found."""
    return np.where((failure[0] > 0) & (failure[1] == 0), np.nan, first)


def most_matrices(system: System) -> int:
    """Return how many matrices a step that is chosen freely may take."""
    return NEWTON.rough_matrices if system.model.frictions else NEWTON.factorizations


def _impulses(
    schedule: Schedule, lanes: np.ndarray, samples: np.ndarray, derived: np.ndarray
) -> list[Impulse]:
    """Return the impulses of a block from its outputs (outputs, rounds, WIDTH)."""
    times = schedule.lanes(schedule.times, lanes)
    hits = np.argwhere(schedule.lanes(schedule.parts, lanes) == IMPULSE)
    return [Impulse(int(samples[k]), float(times[n, k]), derived[:, n, k].copy()) for n, k in hits]


def march_block(
    system: System,
    method: Coefficients,
    tolerance: float,
    values: Values,
    rounds: int,
    limits: StepLimits | None = None,
    block_start: tuple[WorkSpace, np.ndarray] | None = None,
) -> BlockRun:
    """Run one block from the guess, or from `block_start`; with `limits` its lanes choose steps."""
    series = np.zeros((rounds + (limits is not None), system.sensor_row_count, WIDTH))
    work, failure = block_start or begin(system, values)
    first = work.z.copy()
    run(MARCH, system, values, work, series, failure, method, tolerance, limits)
    return BlockRun(series[:rounds], failure, first, work)


def begin(
    system: System, values: Values, last_z: np.ndarray | None = None
) -> tuple[WorkSpace, np.ndarray]:
    """Return the state of a block at time zero, and its failures (4, WIDTH).

    Flexible members start unbent where loops close so. What fails is tried again from where loops
    are as near to closing as they get so. Or else the block goes on from the state `last_z`.
    """
    guess = guess_state(system, values) if last_z is None else last_z
    start = partial(_start_block, system, values, going_on=last_z is not None)
    massless = (values.mass != values.regular_mass).any(axis=0)
    pivots = np.where(massless, PROJECTION.massless_pivot, PROJECTION.min_pivot)
    members = any(len(body.nodes) > 1 for body in system.model.bodies.values())
    if last_z is None and members:
        rigid_guess, misfit = close_loops(system, values)
        guess = np.where(
            np.abs(misfit).max(axis=0, initial=0.0) < ASSEMBLY.constraint_tolerance,
            rigid_guess,
            guess,
        )
    work, failure = start(guess, pivots)
    failed = failure[0] > 0
    if last_z is None and failed.any():
        before = failure
        guess = np.where(failed, close_loops(system, values)[0], guess)
        work, failure = start(guess, pivots)
        failure[:] = np.where(failed & (failure[0] > 0), before, failure)
    if failure[3].any() or massless.any():
        dependent = rank_deficiency(system, values, work.z)
        independent = failure[3] > dependent
        pivots = np.where(
            independent | (massless & (dependent == 0)), PROJECTION.zero_pivot, pivots
        )
        if independent.any():
            work, failure = start(guess, pivots)
        work.smallest[:] = pivots
    return work, failure


def end_of(
    system: System, values: Values, at_end: Values, work: WorkSpace, first_q: np.ndarray
) -> np.ndarray:
    """Return the end of a run, see `Batch.ends`; the last functions of `at_end` belong to it."""
    state = system.structure.state
    count = system.structure.functions
    at_end = at_end._replace(
        springs=values.springs,
        functions=at_end.functions[-count:],
        rates=at_end.rates[-2 * count :],
        velocity=_lanes(work.z[state.velocity : state.acceleration]),
        law_states=_lanes(work.z[state.law_state :][: len(values.law_states)]),
    )
    with np.errstate(all="ignore"):  # of samples that failed
        anew, _ = begin(system, at_end, work.z)
    accelerations = anew.z[state.acceleration : state.energy]
    rest = values.springs.rest
    return np.concatenate([work.z, work.a, rest, work.steps, accelerations, first_q])


def _start_block(
    system: System,
    values: Values,
    guess: np.ndarray,
    smallest_pivots: np.ndarray,
    *,
    going_on: bool,
) -> tuple[WorkSpace, np.ndarray]:
    """Return the state of a block that START or HOLD finds from a guess, and its failures.

    The work space is new: NaN of an attempt that failed would spread. Where they are in the state,
    it is the guess.
    """
    work = WorkSpace.from_structure(system.structure)
    failure = np.zeros((4, WIDTH))
    work.smallest[:] = smallest_pivots
    work.z[: len(guess)] = guess
    run(HOLD if going_on else START, system, values, work, failure=failure)
    lost = ~np.isfinite(work.z).all(axis=0)
    work.z[:, lost] = 0.0
    work.z[: len(guess), lost] = guess[:, lost]
    return work, failure


def hold(
    system: System, values: Values, work: WorkSpace, z: np.ndarray, *, velocities: bool
) -> np.ndarray:
    """Start a block that has begun from other coordinates and states of laws; return its failures.

    Velocities are the nearest to those in z, or, as at every start, those with the least rate of
    deformation. Springs keep their elongations at rest, and angles the turns on which they began.
    """
    state = system.structure.state
    failure = np.zeros((4, WIDTH))
    work.z[1 : state.multiplier] = z[1 : state.multiplier]
    work.z[state.gap : state.extreme] = 0.0
    law_states = _lanes(values.law_states)
    laws = int(system.structure.laws.state_start[-1])
    law_states[:laws] = z[state.law_state : state.law_state + laws]
    values = values._replace(law_states=law_states)
    if velocities:
        values = values._replace(velocity=_lanes(z[state.velocity : state.acceleration]))
    run(HOLD, system, values, work, failure=failure, number=0.0 if velocities else 1.0)
    return failure


def _lanes(rows: np.ndarray) -> np.ndarray:
    """Return a copy of rows as the engine takes them."""
    lanes = zeros(len(rows))
    lanes[:] = rows
    return lanes


def run(
    task: int,
    system: System,
    values: Values,
    work: WorkSpace,
    outputs: np.ndarray = NOTHING[None],
    failure: np.ndarray = NOTHING,
    method: Coefficients = Coefficients(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    number: float = 0.0,
    limits: StepLimits | None = None,
) -> None:
    """Perform one of the tasks of `entries`. With limits it is one of `free_dynamics`."""
    memory = Record(values), Record(work), outputs, address(failure), address(stop_flag())
    if limits:
        free_dynamics(task, system.record, method, limits, float(number), *memory)
    else:
        entry = dynamics if task in (START, HOLD, MARCH) else statics
        entry(task, system.record, method, float(number), *memory)
    if system.laws and failure is not NOTHING:
        blame_laws(system, failure, method.step if task == MARCH else 0.0)


def derive(system: System, rows: np.ndarray) -> np.ndarray:
    """Return the outputs (outputs, times, WIDTH) from the rows that the engine evaluated."""
    parts = [outputs(rows[place]) for outputs, place in system.sensors]
    return np.concatenate([rows[:0], *parts])


def _with_branches(conditions: np.ndarray, failure: np.ndarray) -> np.ndarray:
    """Return the failures with those of conditions (times, conditions, WIDTH) that are negative."""
    failure = failure.copy()
    for time, row, lane in np.argwhere(conditions < 0)[::-1]:
        if failure[0, lane] in (0, FAILURE.wrong_branch) or time < failure[1, lane]:
            failure[:3, lane] = FAILURE.wrong_branch, time, row
    return failure
