"""What assembly changed in the given start, and warnings of large changes."""

from __future__ import annotations

from functools import reduce
from typing import NamedTuple

import numpy as np

from flexband.basics.warning import warn
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.loop_closure import rigid_motions
from flexband.mechanics.engine.redundancy import RANK, jacobian, of_samples
from flexband.mechanics.model.rotations import spin, turn_between
from flexband.remarks.remark import Remark, RemarkKind


class ReportedChanges(NamedTuple):
    """From where on changes of the given start are reported, and warned of."""

    min_turn: float = 1e-6
    """Least turn that is reported [rad]."""
    min_move: float = 1e-6
    """The same of a move, relative to the size of the mechanism."""
    min_rate: float = 1e-6
    """The same of a rate, relative to the given one."""
    large_turn: float = 0.1
    """Turn that is warned of [rad]."""
    large_rate: float = 0.1
    """Change of a rate that is warned of, relative to the given one."""


class Corrections(NamedTuple):
    """How the start differs from what was given, all of shape (bodies, samples) but `reversed`."""

    turns: np.ndarray  # largest change of an angle of the body [rad]
    moves: np.ndarray  # largest change of a place of the body [m]
    rates: np.ndarray  # relative change of the body's angular velocity, 0 if none was given
    speeds: np.ndarray  # relative change of the velocity of its first node, 0 if none was given
    reversed: np.ndarray  # whether loops closed in another branch than the guess, (samples,)

    @staticmethod
    def zeros(bodies: int, samples: int) -> Corrections:
        """Return no corrections."""
        turns, moves, rates, speeds = np.zeros((4, bodies, samples))
        return Corrections(turns, moves, rates, speeds, np.zeros(samples, dtype=bool))


def corrections(
    system: System, z: np.ndarray, samples: np.ndarray, *, branch_turn: float = 0.01
) -> Corrections:
    """Return how the states `z` of these samples at the start, (rows, …), differ from the given.

    Loops whose bodies turned by less than `branch_turn` [rad] are not examined for another branch.
    Members with a free strain or curvature have another shape than the given one, so their turns
    and moves count as 0.
    """
    z = z[:, : len(samples)]
    velocity = system.structure.state.velocity
    q = z[:velocity]
    v = z[velocity:]
    nominal_q = of_samples(system.nominal_start, samples)
    nominal_v = of_samples(system.values.velocity, samples)
    model = system.model
    shape = len(model.bodies), len(samples)
    turns, moves, rates, speeds = (np.zeros(shape) for _ in range(4))
    free_strain_members = {
        entry.member for entries in model.entries.values() for entry in entries.strains
    }
    # Compare the places, turns and velocities of each body.
    for b, (name, vectors) in enumerate(model.node_vectors.items()):
        places = vectors[:, 0]
        axes = model.axes[name]
        moves[b] = _length(q[places] - nominal_q[places]).max(axis=0)
        first = places[0]
        change = _length((v[first] - nominal_v[first])[None])[0]
        speeds[b] = _relative(change, _length(nominal_v[first][None])[0])
        if axes.size:
            turns[b] = np.max([turn_between(nominal_q[node], q[node]) for node in axes], axis=0)
            rate = spin(nominal_q[axes[0]], nominal_v[axes[0]])
            now = spin(q[axes[0]], v[axes[0]])
            rates[b] = _relative(np.linalg.norm(now - rate, axis=0), np.linalg.norm(rate, axis=0))
        if name in free_strain_members:
            turns[b] = moves[b] = 0.0
    changes = Corrections(turns, moves, rates, speeds, np.zeros(len(samples), dtype=bool))
    # Examine the samples whose bodies turn far for another branch.
    candidates = np.flatnonzero(turns.max(axis=0) > branch_turn)
    if len(candidates):
        guess = np.zeros((len(z), len(candidates)))
        guess[: len(nominal_q)] = of_samples(system.values.start, samples[candidates])
        changes.reversed[candidates] = _passes_singularity(
            system, guess, z[:, candidates], samples[candidates]
        )
    return changes


def report(
    system: System, changes: Corrections, limits: ReportedChanges = ReportedChanges()
) -> dict[str, str | float]:
    """Return attributes that state the largest changes; warn of large ones."""
    names = list(system.model.bodies)
    sentences = []
    attributes = {}
    size = float(np.min(1 / system.values.inverse_scale[1]))

    def largest(change: np.ndarray) -> tuple[float, str, str]:
        b, sample = np.unravel_index(np.argmax(change), change.shape)
        where = f" (sample {sample})" if system.samples > 1 else ""
        return float(change[b, sample]), f"body {names[b]!r}", where

    # Report the largest turn and move of a body.
    turn, body, where = largest(changes.turns)
    if turn > limits.min_turn:
        attributes["largest_turn"] = turn
        sentences.append(f"assembly turned {body} by {turn:.3g} rad from its given angle{where}")
        if turn > limits.large_turn:
            text = sentences[-1] + ", since the joints cannot be met at the given angles"
            warn(text, remarks=_change_remarks(changes.turns, limits.large_turn, text))
    move, body, where = largest(changes.moves)
    if move > limits.min_move * size:
        attributes["largest_move"] = move
        sentences.append(f"assembly moved {body} by {move:.3g} m from its given place{where}")
    # Report changes of the velocities.
    for change, quantity in ((changes.rates, "rate"), (changes.speeds, "velocity")):
        part, body, where = largest(change)
        if part > limits.min_rate:
            change_text = f"joints change the given {quantity} of {body} by {100 * part:.3g} %"
            sentences.append(change_text + where)
            if part > limits.large_rate:
                text = sentences[-1] + "; give all bodies velocities that joints and drives allow"
                warn(text, remarks=_change_remarks(change, limits.large_rate, text))
    # Warn of loops that are closed in another branch.
    if changes.reversed.any():
        where = f" (sample {np.argmax(changes.reversed)})" if system.samples > 1 else ""
        text = "a loop closed in another branch than that of the given angles"
        sentences.append(text + where)
        advice = "; give angles that are closer to the branch that is meant"
        warn(
            sentences[-1] + advice,
            remarks=[
                Remark(RemarkKind.OTHER_BRANCH, text, sample=int(k))
                for k in np.flatnonzero(changes.reversed)
            ],
        )
    if sentences:
        attributes["assembly"] = "; ".join(sentences)
    return attributes


def _change_remarks(change: np.ndarray, limit: float, text: str) -> list[Remark]:
    """Return remarks on the samples with a change, (bodies, samples), above what is allowed."""
    largest = change.max(axis=0)
    return [
        Remark(RemarkKind.CHANGED_START, text, size=float(largest[k]), sample=int(k))
        for k in np.flatnonzero(largest > limit)
    ]


def _length(vectors: np.ndarray) -> np.ndarray:
    """Return the lengths of vectors (vectors, components, …)."""
    return reduce(np.hypot, np.moveaxis(vectors, 1, 0))


def _relative(change: np.ndarray, reference: np.ndarray) -> np.ndarray:
    return np.divide(change, reference, out=np.zeros_like(change), where=reference > 0)


def _passes_singularity(
    system: System, guess: np.ndarray, z: np.ndarray, samples: np.ndarray
) -> np.ndarray:
    """Return whether the way from the guess to the start passes a singular position.

    With the Jacobians J₀ and J₁ of the constraints by the rigid motions of the bodies, and the
    singular vectors U and V of J₀, that is where det(Uᵀ J₁ V) is negative.
    """
    size = 1 / of_samples(system.values.inverse_scale, samples)[1]
    before, after = (
        np.einsum("kqs,qbs->skb", jacobian(system, at, samples), rigid_motions(system, at, size))
        for at in (guess, z)
    )
    reversals = np.zeros(len(samples), dtype=bool)
    for s, (J0, J1) in enumerate(zip(before, after, strict=True)):
        U, singular, V = np.linalg.svd(J0, full_matrices=False)
        rank = int(np.sum(singular > RANK * singular[0]))
        reversals[s] = np.linalg.det(U[:, :rank].T @ J1 @ V[:rank].T) < 0
    return reversals
