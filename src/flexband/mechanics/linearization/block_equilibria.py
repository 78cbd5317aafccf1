"""Static equilibria of the samples of one block of lanes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from flexband.mechanics.assembly.structure import Values
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.batch import begin, run
from flexband.mechanics.engine.entries import SENSE, SETTLE
from flexband.mechanics.engine.static_solver import STATIC
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.linearization.balance import Balance
from flexband.mechanics.linearization.linearize import Equations
from flexband.mechanics.linearization.load_path import raise_loads, snap_throughs
from flexband.mechanics.linearization.rest_search import RestSearch, find_rest
from flexband.mechanics.linearization.spin import Spin


class BlockEquilibria(NamedTuple):
    """Equilibria of the first samples of one block."""

    rows: np.ndarray  # of the sensors on the way to the equilibria, (states, rows, WIDTH)
    failure: np.ndarray  # as the engine has it, (4, WIDTH)
    balances: list[Balance]  # of each sample
    start: np.ndarray  # the state at the start, (rows, WIDTH)


def block_equilibria(
    system: System, values: Values, steps: int, samples: int, spins: Sequence[Spin] | None = None
) -> BlockEquilibria:
    """Find the equilibria of the first samples of a block, at rest or in their rotations."""
    spins = spins or [no_rotation(system)] * samples
    work, failure = begin(system, values)
    state = system.structure.state
    work.z[state.multiplier : state.angle] = 0.0
    Equations.close_contacts(system, work.z)
    work.z[state.rule : state.gap][1:2] = RestSearch().state_step
    start = work.z.copy()
    failed = failure.copy()
    # Raise the loads in steps, unless the mechanism rotates.
    on_way = []
    if not any(spin.rate for spin in spins):
        snap_throughs(system, values, start, failed)
        for k in range(1, steps + 1):
            rows = np.full((STATIC.iterations + 1, system.sensor_row_count, WIDTH), np.nan)
            run(SETTLE, system, raise_loads(values, k / steps), work, rows, failure)
            on_way.append(rows[~np.isnan(rows).all(axis=(1, 2))])
    # Find the rest of each sample from there.
    balances: list[Balance] = []
    for lane, spin in enumerate(spins):
        if failed[0, lane]:
            balances.append(Balance(Equations(system, values, lane), start[:, lane], spin))
            continue
        z = work.z[:, lane] if np.isfinite(work.z[:, lane]).all() else start[:, lane]
        for k in range(1, steps if spin.rate else 1):
            equations = Equations(system, raise_loads(values, k / steps), lane)
            z = find_rest(equations, z, spin.scale_centrifugal(k / steps), z)[0].z
        first = z if spin.rate else start[:, lane]
        balance, settled = find_rest(Equations(system, values, lane), z, spin, first)
        balances.append(balance)
        failed[0, lane] = 0.0 if settled else FAILURE.not_settled
        failed[2:, lane] = (-1.0, 0.0) if settled else (balance.weakest, _loose(system, balance))
        balance.equations.residual(balance.z)
        if balance.equations.failure[0, 0]:
            failed[:, lane] = balance.equations.failure[:, 0]
        work.z[:, lane] = balance.z
    # Check the conditions of the joints.
    rows = np.zeros((1, system.sensor_row_count, WIDTH))
    run(SENSE, system, values, work, rows, failed)
    for condition in range(len(system.conditions)):
        wrong = rows[0, system.sensor_row_count - len(system.conditions) + condition] < 0
        failed[:3, wrong & (failed[0] == 0)] = [[FAILURE.wrong_branch], [0.0], [condition]]
    return BlockEquilibria(np.concatenate([*on_way, rows]), failed, balances, start)


def _loose(system: System, balance: Balance) -> float:
    """Return 1 plus the number of the body that loads move most, negative if they turn it.

    It is 0 where loads are balanced, or nothing can move.
    """
    forces = np.abs(balance.forces).max(initial=0.0)
    if not (balance.freedom_count and np.isfinite(forces) and forces > 0 and balance.excess > 1):
        return 0.0
    model = system.model
    moved = np.abs(balance.push())
    largest = 0.0
    loose = 0.0
    for number, name in enumerate(model.bodies, start=1):
        place = moved[model.node_vectors[name][:, 0] - 1].max()
        turn = moved[model.axes[name][0] - 1].max(initial=0.0)
        if max(place, turn) > largest:
            largest = max(place, turn)
            loose = float(number if place >= turn else -number)
    return loose


def no_rotation(system: System) -> Spin:
    """Return the rotation of a mechanism that does not rotate."""
    return Spin(0.0, np.zeros(system.structure.state.coordinates))
