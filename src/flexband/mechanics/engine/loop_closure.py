"""The guess with all bodies moved and turned, but not bent, to where the joints meet.

Newton's method on all coordinates turns a flexible member along a tangent, which stretches it, and
then has to undo that against its stiffness. So loops are closed by rigid motions first, with moves
and turns of each body as unknowns, turns that are exact, and the steps of Levenberg and Marquardt.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flexband.mechanics.assembly.packing import AT_START, pack
from flexband.mechanics.assembly.structure import Values
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.initial_conditions import ASSEMBLY
from flexband.mechanics.engine.redundancy import RANK, derivatives, vector_and_gradient
from flexband.mechanics.model.rotations import PLANES, rotation
from flexband.mechanics.model.turns import nearest


class ClosureOptions(NamedTuple):
    """How loops are closed."""

    tolerance: float = 1e-13
    """Of the constraints, relative to the size of the mechanism."""
    turn_weight: float = 30.0
    """Of a turn by 1 rad against a move by the size of the mechanism."""
    min_damping: float = 1e-10
    """Of a step, over the largest part of its matrix: redundant constraints do no harm."""
    first_damping: float = 1e-4
    """After the first step that leads away."""
    damping_factor: float = 10.0
    """From one step to the next."""


def guess_state(system: System, values: Values) -> np.ndarray:
    """Return the rows [1, q, λ, θ] of z in the guess, with λ = 0 and the angles that are drawn."""
    z = np.zeros((system.structure.state.velocity, values.start.shape[1]))
    z[: len(values.start)] = values.start
    z[system.structure.state.angle :] = values.drawn
    return z


def close_loops(
    system: System, values: Values, options: ClosureOptions = ClosureOptions()
) -> tuple[np.ndarray, np.ndarray]:
    """Return z as near to Φ = 0 as rigid motions get, and Φ over the size, (multipliers, lanes)."""
    c = values.terms * values.functions[system.structure.terms.f]
    z = guess_state(system, values)
    inverse = values.inverse_scale[1]
    misfit = inverse * constraint_errors(system, values, z)
    damping = np.full(z.shape[1], options.min_damping)
    turns = _are_turns(system)
    for _ in range(ASSEMBLY.iterations):
        open_mask = np.abs(misfit).max(axis=0, initial=0.0) > options.tolerance
        if not open_mask.any():
            break
        # Solve for a damped step of rigid motions.
        rows = derivatives(system, c, values.vectors, z).transpose(2, 0, 1)
        motions = rigid_motions(system, z, 1 / inverse).transpose(2, 0, 1)
        rows = inverse[:, None, None] * (rows @ motions)
        rows[:, :, turns] /= options.turn_weight
        matrix = rows @ rows.transpose(0, 2, 1)
        scale = np.maximum(np.abs(matrix).max(axis=(1, 2), keepdims=True), 1.0)
        matrix += damping[:, None, None] * scale * np.eye(rows.shape[1])
        step = -rows.transpose(0, 2, 1) @ np.linalg.solve(matrix, misfit.T[:, :, None])
        step[:, turns] /= options.turn_weight
        largest = np.abs(step).max(axis=1, keepdims=True)
        step *= ASSEMBLY.max_step / np.maximum(largest, ASSEMBLY.max_step)
        # Take the step where it leads nearer, and adapt the damping.
        moved = z.copy()
        _move(system, moved, step[:, :, 0].T, 1 / inverse)
        next_misfit = inverse * constraint_errors(system, values, moved)
        nearer = open_mask & ((next_misfit**2).sum(axis=0) < (misfit**2).sum(axis=0))
        z = np.where(nearer, moved, z)
        misfit = np.where(nearer, next_misfit, misfit)
        damping = np.where(
            nearer,
            np.maximum(damping / options.damping_factor, options.min_damping),
            np.maximum(damping * options.damping_factor, options.first_damping),
        )
    return z, misfit


def gaps(system: System, sample: int) -> dict[str, float]:
    """Return by how much [m] each joint stays open where rigid motions close a sample best.

    Joints that close are left out, as are rows of Φ that only turns change, which are angles.
    """
    values = pack(system, AT_START, np.array([sample]))(0)
    z, misfit = close_loops(system, values)
    size = 1 / values.inverse_scale[1]
    c = values.terms * values.functions[system.structure.terms.f]
    rows = derivatives(system, c, values.vectors, z).transpose(2, 0, 1)[0]
    moves = rows @ rigid_motions(system, z, size)[:, ~_are_turns(system), 0]
    open_by: dict[str, float] = {}
    for owner, row, part in zip(system.constraints, moves, misfit[:, 0], strict=True):
        if owner.startswith("joint ") and np.abs(row).max() > RANK * size[0]:
            name = owner.removeprefix("joint ")[1:-1]
            open_by[name] = math.hypot(open_by.get(name, 0.0), part * size[0])
    min_gap = ASSEMBLY.constraint_tolerance * size[0]
    return {name: gap for name, gap in open_by.items() if gap > min_gap}


def rigid_motions(system: System, z: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return dq of each body's moves by `size` [m] and turns by 1 rad, shape (q, motions, …)."""
    count = len(_are_turns(system))
    motions = np.zeros((system.structure.state.coordinates, count, z.shape[1]))
    m = 0
    for vectors in system.model.node_vectors.values():
        rows = vectors - 1
        levers = z[vectors]
        levers[:, 0] -= levers[0, 0].copy()
        for axis in range(rows.shape[2]):
            motions[rows[:, 0, axis], m] = size
            m += 1
        for i, j in PLANES[rows.shape[2]]:
            motions[rows[:, :, i], m] = -levers[:, :, j]
            motions[rows[:, :, j], m] = levers[:, :, i]
            m += 1
    return motions


def _are_turns(system: System) -> np.ndarray:
    """Return which of the `rigid_motions` are turns."""
    components = [body.dimension for body in system.model.bodies.values()]
    motions = [[False] * count + [True] * len(PLANES[count]) for count in components]
    return np.concatenate(motions)


def _move(system: System, z: np.ndarray, step: np.ndarray, size: np.ndarray) -> None:
    """Move and turn the bodies, each about its first node, by steps as those of `rigid_motions`."""
    first = 0
    for vectors in system.model.node_vectors.values():
        components = vectors.shape[2]
        turn = first + components
        end = turn + len(PLANES[components])
        levers = z[vectors]
        origin = levers[0, 0].copy()
        levers[:, 0] -= origin
        z[vectors] = np.einsum("ijs,nvjs->nvis", rotation(step[turn:end]), levers)
        z[vectors[:, 0]] += origin + size * step[first:turn]
        first = end


def constraint_errors(system: System, values: Values, z: np.ndarray) -> np.ndarray:
    """Return Φ, shape (multipliers, lanes), after the angles in z have been updated."""
    _update_angles(system, values, z)
    terms = system.structure.terms
    state = system.structure.state
    c = values.terms * values.functions[terms.f]
    Phi = np.zeros((state.friction - state.multiplier, z.shape[1]))
    np.add.at(Phi, terms.k - state.multiplier, c * z[terms.i] * z[terms.j])
    return Phi


def _update_angles(system: System, values: Values, z: np.ndarray) -> None:
    """Set the angles and lengths in z as the kernel of this name does."""
    vectors = system.structure.vectors
    state = system.structure.state
    for a, row in enumerate(range(state.angle, state.sensor_angle)):
        (x, y), _ = vector_and_gradient(system, values.vectors, a, z)
        if vectors.length[a]:
            z[row] = np.hypot(x, y)
        else:
            z[row] = nearest(np.arctan2(y, x), z[row])
