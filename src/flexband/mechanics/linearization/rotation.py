"""Whether a mechanism rotates steadily: its equations are the same when all of it has turned."""

from __future__ import annotations

import numpy as np

from flexband.errors import InputError
from flexband.mechanics.assembly.packing import AT_START, pack
from flexband.mechanics.assembly.system import System
from flexband.mechanics.linearization.balance import Balance
from flexband.mechanics.linearization.eigenmodes import Eigenmodes, rounding
from flexband.mechanics.linearization.linearize import Equations, Spin, turned

ANGLES = (1.0, 2.4)
"""By which the mechanism is turned [rad]; no mechanism is symmetric under both by chance."""

DIFFERENCE = 1e-5
"""Relative difference of the equations from which on they count as different."""

UNBALANCED = 1e3
"""Excess of the forces, as `Balance` measures it, that counts as a difference."""


def check_rotation(
    system: System, sample: int, balance: Balance, found: Eigenmodes, spin: Spin
) -> None:
    """Raise `InputError` if the equations differ when everything has turned by some angle.

    Parameters
    ----------
    balance, found : the relative equilibrium of a sample, and its modes.
    """
    start, state = balance.equations, system.structure.state
    refused = f"the mechanism does not rotate steadily at {spin.rate:g} rad/s (sample {sample}): "
    pace = np.maximum(np.abs(found.s), abs(spin.rate))
    noise = np.sqrt(rounding(balance.linear, found.vectors))
    for angle in ANGLES:
        time = angle / abs(spin.rate)
        values = pack(system, np.array([time, time + AT_START[1]]), np.array([sample]))(0)
        values.springs.rest[:] = start.values.springs.rest
        signed = float(np.copysign(angle, spin.rate))
        z = balance.z.copy()
        z[start.q] = spin.centre + _rotated(z[start.q] - spin.centre, signed)
        z[state.angle : state.velocity] += signed
        later = Balance(Equations(system, values, 0), z, spin)
        basis = _rotated(balance.basis, signed) / start.size[:, None]
        off = np.abs(np.column_stack([later.violation, later.rows @ basis])).max(axis=1, initial=0)
        if off.max(initial=0) > DIFFERENCE:
            owner = system.constraints[int(off.argmax())]
            raise InputError(f"{refused}{owner} does not turn with it")
        if later.excess > UNBALANCED:
            raise InputError(f"{refused}its loads depend on its angle")
        reference, other = (
            (part.linear, _rotated(found.vectors, turn))
            for part, turn in ((balance, 0.0), (later, signed))
        )
        stiffness, damping = (
            np.abs(_seen(b, other[1]) - _seen(a, reference[1]))
            for a, b in (
                (reference[0].K + reference[0].L, other[0].K + other[0].L),
                (reference[0].D, other[0].D),
            )
        )
        allowed = DIFFERENCE * np.outer(pace, pace) + np.outer(noise, noise)
        if np.any(stiffness > allowed) or np.any(damping > DIFFERENCE * np.add.outer(pace, pace)):
            raise InputError(f"{refused}its stiffness or damping depends on its angle")


def _rotated(q: np.ndarray, angle: float) -> np.ndarray:
    """Return all vectors of the plane rotated by an angle."""
    return np.cos(angle) * q + np.sin(angle) * turned(q)


def _seen(matrix: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return a matrix as the modes see it."""
    return np.conj(vectors.T) @ matrix @ vectors
