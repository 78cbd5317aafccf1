"""Whether a mechanism rotates steadily: its equations are the same when all of it has turned."""

from __future__ import annotations

import numpy as np

from flexband.errors import InputError
from flexband.mechanics.assembly.packing import AT_START, pack
from flexband.mechanics.assembly.system import System
from flexband.mechanics.linearization.balance import Balance
from flexband.mechanics.linearization.eigenmodes import Eigenmodes, rounding
from flexband.mechanics.linearization.linearize import Equations, Spin, turned


def check_rotation(
    system: System,
    sample: int,
    balance: Balance,
    modes: Eigenmodes,
    spin: Spin,
    *,
    angles: tuple[float, ...] = (1.0, 2.4),
    difference: float = 1e-5,
    max_excess: float = 1e3,
) -> None:
    """Raise `InputError` if the equations differ when everything has turned by some angle.

    Parameters
    ----------
    balance, modes : the relative equilibrium of a sample, and its modes.
    angles : by which the mechanism is turned [rad]; none is symmetric under both by chance.
    difference : of the equations, relative, from which on they count as different.
    max_excess : of the forces, as `Balance` measures it, that counts as no difference.
    """
    start, state = balance.equations, system.structure.state
    refused = f"the mechanism does not rotate steadily at {spin.rate:g} rad/s (sample {sample}): "
    pace = np.maximum(np.abs(modes.s), abs(spin.rate))
    noise = np.sqrt(rounding(balance.linear, modes.vectors))
    for angle in angles:
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
        if off.max(initial=0) > difference:
            owner = system.constraints[int(off.argmax())]
            raise InputError(f"{refused}{owner} does not turn with it")
        if later.excess > max_excess:
            raise InputError(f"{refused}its loads depend on its angle")
        reference, other = (
            (part.linear, _rotated(modes.vectors, turn))
            for part, turn in ((balance, 0.0), (later, signed))
        )
        stiffness, damping = (
            np.abs(_seen(b, other[1]) - _seen(a, reference[1]))
            for a, b in (
                (reference[0].K + reference[0].L, other[0].K + other[0].L),
                (reference[0].D, other[0].D),
            )
        )
        allowed = difference * np.outer(pace, pace) + np.outer(noise, noise)
        if np.any(stiffness > allowed) or np.any(damping > difference * np.add.outer(pace, pace)):
            raise InputError(f"{refused}its stiffness or damping depends on its angle")


def _rotated(q: np.ndarray, angle: float) -> np.ndarray:
    """Return all vectors of the plane rotated by an angle."""
    return np.cos(angle) * q + np.sin(angle) * turned(q)


def _seen(matrix: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return a matrix as the modes see it."""
    return np.conj(vectors.T) @ matrix @ vectors
