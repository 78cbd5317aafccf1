"""The guess with all bodies moved and turned, but not bent, to where the joints meet.

Newton's method on all coordinates turns a flexible member along a tangent, which stretches it, and
then has to undo that against its stiffness. So loops are closed by rigid motions first, with three
unknowns for each body, turns that are exact, and the steps of Levenberg and Marquardt.
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


def guessed(system: System, values: Values) -> np.ndarray:
    """Return the rows [1, q, λ, θ] of z in the guess, with λ = 0 and the angles that are drawn."""
    z = np.zeros((system.structure.state.velocity, values.start.shape[1]))
    z[: len(values.start)] = values.start
    z[system.structure.state.angle :] = values.drawn
    return z


def closed(
    system: System, values: Values, options: ClosureOptions = ClosureOptions()
) -> tuple[np.ndarray, np.ndarray]:
    """Return z as near to Φ = 0 as rigid motions get, and Φ over the size, (multipliers, lanes)."""
    c = values.terms * values.functions[system.structure.terms.f]
    z, inverse = guessed(system, values), values.inverse_scale[1]
    misfit = inverse * constraint_errors(system, values, z)
    damping = np.full(z.shape[1], options.min_damping)
    for _ in range(ASSEMBLY.iterations):
        apart = np.abs(misfit).max(axis=0, initial=0.0) > options.tolerance
        if not apart.any():
            break
        rows = derivatives(system, c, values.vectors, z).transpose(2, 0, 1)
        motions = rigid_motions(system, z, 1 / inverse).transpose(2, 0, 1)
        rows = inverse[:, None, None] * (rows @ motions)
        rows[:, :, 2::3] /= options.turn_weight
        matrix = rows @ rows.transpose(0, 2, 1)
        scale = np.maximum(np.abs(matrix).max(axis=(1, 2), keepdims=True), 1.0)
        matrix += damping[:, None, None] * scale * np.eye(rows.shape[1])
        step = -rows.transpose(0, 2, 1) @ np.linalg.solve(matrix, misfit.T[:, :, None])
        step[:, 2::3] /= options.turn_weight
        largest = np.abs(step).max(axis=1, keepdims=True)
        step *= ASSEMBLY.max_step / np.maximum(largest, ASSEMBLY.max_step)
        moved = z.copy()
        _move(system, moved, step[:, :, 0].T, 1 / inverse)
        next_misfit = inverse * constraint_errors(system, values, moved)
        nearer = apart & ((next_misfit**2).sum(axis=0) < (misfit**2).sum(axis=0))
        z, misfit = np.where(nearer, moved, z), np.where(nearer, next_misfit, misfit)
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
    z, misfit = closed(system, values)
    size = 1 / values.inverse_scale[1]
    c = values.terms * values.functions[system.structure.terms.f]
    rows = derivatives(system, c, values.vectors, z).transpose(2, 0, 1)[0]
    moves = (rows @ rigid_motions(system, z, size)[:, :, 0]).reshape(len(rows), -1, 3)[:, :, :2]
    open_by: dict[str, float] = {}
    for owner, row, part in zip(system.constraints, moves, misfit[:, 0], strict=True):
        if owner.startswith("joint ") and np.abs(row).max() > RANK * size[0]:
            name = owner.removeprefix("joint ")[1:-1]
            open_by[name] = math.hypot(open_by.get(name, 0.0), part * size[0])
    least = ASSEMBLY.constraint_tolerance * size[0]
    return {name: gap for name, gap in open_by.items() if gap > least}


def rigid_motions(system: System, z: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return dq of each body's moves by `size` [m] and turn by 1 rad, shape (q, motions, …)."""
    model = system.model
    motions = np.zeros((system.structure.state.coordinates, 3 * len(model.bodies), z.shape[1]))
    for b, (name, body) in enumerate(model.bodies.items()):
        first = model.first_coordinates[name]
        for n in (first + k for k in body.nodes):
            motions[n - 1, 3 * b], motions[n, 3 * b + 1] = size, size
            motions[n - 1, 3 * b + 2] = -(z[n + 1] - z[first + 1])
            motions[n, 3 * b + 2] = z[n] - z[first]
            for d in range(n + 2, n + body.per_node, 2):
                motions[d - 1, 3 * b + 2], motions[d, 3 * b + 2] = -z[d + 1], z[d]
    return motions


def _move(system: System, z: np.ndarray, step: np.ndarray, size: np.ndarray) -> None:
    """Move and turn the bodies, each about its first node, by steps as those of `rigid_motions`."""
    for b, (name, body) in enumerate(system.model.bodies.items()):
        first = system.model.first_coordinates[name]
        cosine, sine = np.cos(step[3 * b + 2]), np.sin(step[3 * b + 2])
        n = first + np.array(body.nodes)
        origin = z[first : first + 2].copy()
        z[n] -= origin[0]
        z[n + 1] -= origin[1]
        for k in range(0, body.per_node, 2):
            x, y = z[n + k], z[n + k + 1]
            z[n + k], z[n + k + 1] = cosine * x - sine * y, sine * x + cosine * y
        z[n] += origin[0] + size * step[3 * b]
        z[n + 1] += origin[1] + size * step[3 * b + 1]


def constraint_errors(system: System, values: Values, z: np.ndarray) -> np.ndarray:
    """Return Φ, shape (multipliers, lanes), after the angles in z have been updated."""
    _update_angles(system, values, z)
    terms, state = system.structure.terms, system.structure.state
    c = values.terms * values.functions[terms.f]
    Phi = np.zeros((state.friction - state.multiplier, z.shape[1]))
    np.add.at(Phi, terms.k - state.multiplier, c * z[terms.i] * z[terms.j])
    return Phi


def _update_angles(system: System, values: Values, z: np.ndarray) -> None:
    """Set the angles and lengths in z as the kernel of this name does."""
    vectors, state = system.structure.vectors, system.structure.state
    for a, row in enumerate(range(state.angle, state.sensor_angle)):
        (x, y), _ = vector_and_gradient(system, values.vectors, a, z)
        if vectors.length[a]:
            z[row] = np.hypot(x, y)
        else:
            z[row] = nearest(np.arctan2(y, x), z[row])
