"""Whether loads can be raised from zero in full without a snap-through.

In smaller and smaller steps of the loads a rest moves by less and less, but at a limit point,
beyond which there is none nearby. So the step in which it moves farthest is divided again and
again: where the move stays as long, and little stiffness is left before it, the mechanism snaps
through.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.mechanics.assembly.structure import Values, WorkSpace
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.batch import run
from flexband.mechanics.engine.entries import SETTLE
from flexband.mechanics.engine.static_solver import STATIC
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.linearization.balance import Balance
from flexband.mechanics.linearization.linearize import Equations
from flexband.mechanics.linearization.spin import Spin


class SnapThroughSearch(NamedTuple):
    """How a snap-through is searched for."""

    steps: int = 4
    """Parts that the step of the loads is divided into in which the rest jumps."""
    rounds: int = 5
    """Such divisions, one after the other."""
    max_ratio: float = 3.0
    """Of the longest move to the second longest in so many equal steps, if there is no jump. Where
    the loads end at a limit point, it is 2.4."""
    min_jump: float = 1e-3
    """Relative to the size of the mechanism; shorter moves are none."""
    softness: float = 0.25
    """What is left of the lowest ω² without loads at a snap-through, at most."""


def raise_loads(values: Values, part: float | np.ndarray) -> Values:
    """Return the numbers with a part of gravity, forces, moments and distributed loads."""
    return values._replace(weight=part * values.weight, forces=part * values.forces)


def snap_throughs(
    system: System,
    values: Values,
    start: np.ndarray,
    failure: np.ndarray,
    search: SnapThroughSearch = SnapThroughSearch(),
) -> None:
    """Mark the samples of a block, from `start` (rows, WIDTH), that snap through on the way.

    What has no rest near its start without loads, as a pendulum, does not snap through there. The
    part of the loads that is reached is filled in the last row of `failure`.
    """
    if not (values.weight.any() or values.forces.any()):
        return
    q = slice(1, 1 + system.structure.state.coordinates)
    lanes = np.arange(WIDTH)
    first = np.zeros(WIDTH)
    last = np.ones(WIDTH)
    unloaded, jumps = _settle(system, values, first, start)
    before = unloaded
    jumps = jumps & (failure[0] == 0)
    # Search for the longest move, in smaller parts of the loads each time.
    for k in range(search.rounds):
        parts = np.linspace(first, last, search.steps + 1)
        rests = [before]
        moves = np.zeros((search.steps, WIDTH))
        sound = np.ones(WIDTH, dtype=bool)
        for n, part in enumerate(parts[1:]):
            rest, settled = _settle(system, values, part, rests[-1])
            move = np.abs(values.inverse_scale[q] * (rest - rests[-1])[q]).max(axis=0)
            moves[n] = np.where(sound, np.where(settled, move, np.inf), 0.0)
            sound &= settled
            rests.append(rest)
        second, longest = np.sort(moves, axis=0)[-2:]
        jumps &= (longest > search.min_jump) & ((longest > search.max_ratio * second) | (k == 0))
        if not jumps.any():
            return
        at = moves.argmax(axis=0)
        first = parts[at, lanes]
        last = parts[at + 1, lanes]
        before = np.stack(rests)[at, :, lanes].T
    # A jump is a snap-through if the stiffness vanishes before it.
    for lane in np.flatnonzero(jumps & (first > 0)):
        soft = _lowest(system, raise_loads(values, first), before, int(lane))
        if soft < search.softness * _lowest(system, raise_loads(values, 0.0), unloaded, int(lane)):
            failure[:, lane] = FAILURE.snapped_through, 0.0, -1.0, first[lane]


def _lowest(system: System, values: Values, z: np.ndarray, lane: int) -> float:
    """Return the lowest ω² [1/s²] about a rest."""
    equations = Equations(system, values, lane)
    at_rest = Spin(0.0, np.zeros(system.structure.state.coordinates))
    return Balance(equations, z[:, lane], at_rest).lowest()


def _settle(
    system: System, values: Values, part: np.ndarray, z: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the rests under parts of the loads near some states, and which samples have one."""
    work = WorkSpace.from_structure(system.structure)
    failure = np.zeros((4, WIDTH))
    work.z[:] = z
    rows = np.empty((STATIC.iterations + 1, system.sensor_row_count, WIDTH))
    run(SETTLE, system, raise_loads(values, part), work, rows, failure)
    return work.z.copy(), failure[0] == 0
