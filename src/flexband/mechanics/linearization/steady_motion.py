"""Steady motions: whether a mechanism rotates or slides steadily, and how drives move it.

The equations of a steady rotation are the same when all of it has turned. Those of steady sliding
are the same when drives have gone on and all else is where it was.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from flexband.errors import InputError
from flexband.mechanics.assembly.packing import AT_START, pack
from flexband.mechanics.assembly.structure import Values
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.batch import begin
from flexband.mechanics.kernels.lane_arrays import zeros
from flexband.mechanics.linearization.balance import Balance
from flexband.mechanics.linearization.eigenmodes import Eigenmodes, rounding_errors
from flexband.mechanics.linearization.linearize import Equations, Linear
from flexband.mechanics.linearization.spin import Driven, Spin, rotate_vectors


class SteadyChecks(NamedTuple):
    """How steady motions are told from others."""

    # by which a rotation is turned [rad]; none is symmetric under both by chance
    angles: tuple[float, ...] = (1.0, 2.4)
    # by which drives go on, relative to the size of the mechanism or in rad
    shifts: tuple[float, ...] = (0.2, 0.37)
    step: float = 1e-3
    """Of the differences of velocities of drives, in the same unit."""
    difference: float = 1e-5
    """Of the equations, relative, from which on they count as different."""
    max_excess: float = 1e3
    """Of the forces, as `Balance` measures it, that counts as no difference."""


CHECKS = SteadyChecks()


def check_steady(
    system: System, sample: int, balance: Balance, modes: Eigenmodes, spin: Spin
) -> None:
    """Raise `InputError` if the equations of a balance differ when the motion has gone on."""
    refused = f"the mechanism does not rotate steadily at {spin.rate:g} rad/s"
    reasons = "turn with it", "depend on its angle", "depends on its angle"
    if isinstance(spin, Driven):
        refused = "the mechanism does not slide steadily while its drives go on"
        reasons = "let it", "change on the way", "changes on the way"
    refused = f"{refused} (sample {sample}): "
    pace = np.maximum(np.abs(modes.s), np.abs(spin.pace(balance.equations.size)))
    noise = np.sqrt(rounding_errors(balance.linear, modes.vectors))
    for later, angle in _later(system, sample, balance, spin):
        basis = _rotate(balance.basis, angle) / balance.equations.size[:, None]
        off = np.abs(np.column_stack([later.violation, later.rows @ basis])).max(axis=1, initial=0)
        if off.max(initial=0) > CHECKS.difference:
            owner = system.constraints[int(off.argmax())]
            raise InputError(f"{refused}{owner} does not {reasons[0]}")
        if later.excess > CHECKS.max_excess:
            raise InputError(f"{refused}its loads {reasons[1]}")
        before = _modal_matrices(balance.linear, modes.vectors)
        after = _modal_matrices(later.linear, _rotate(modes.vectors, angle))
        stiffness, damping = (np.abs(b - a) for a, b in zip(before, after, strict=True))
        allowed = CHECKS.difference * np.outer(pace, pace) + np.outer(noise, noise)
        if np.any(stiffness > allowed) or np.any(
            damping > CHECKS.difference * np.add.outer(pace, pace)
        ):
            raise InputError(f"{refused}its stiffness or damping {reasons[2]}")


def driven_spins(system: System, samples: np.ndarray) -> list[Spin]:
    """Return the motion at the start of what drives move, of some samples of a block."""
    n = system.structure.state.coordinates
    values, motion, _ = _on_way(system, samples, 0.0, AT_START[1])
    paces = np.abs(motion.v * values.inverse_scale[1 : 1 + n]).max(axis=0)[: len(samples)]
    if not paces.all():
        where = f" (sample {samples[paces.argmin()]})" if system.samples > 1 else ""
        raise InputError(f"about must not be 'sliding' if no drive moves at the start{where}")
    motion = _on_way(system, samples, 0.0, CHECKS.step / paces.max())[1]
    return [Driven(0.0, np.zeros(n), motion.v[:, k], motion.a[:, k]) for k in range(len(samples))]


def _on_way(
    system: System, samples: np.ndarray, time: float, step: float
) -> tuple[Values, Driven, np.ndarray]:
    """Return numbers of samples at a time, how drives move, and z, assembled: rows of lanes."""
    packed = pack(system, time + step * np.arange(3), samples)
    values = packed(0)
    state = system.structure.state
    if not packed.schedule.is_regular:
        raise InputError(f"a function of time has a kink or a jump at about t = {time:g} s")
    values = values._replace(velocity=zeros(len(values.velocity)))
    states = []
    for k in range(3):
        first = k * system.structure.functions
        functions = values.functions[first:]
        rates = values.rates[2 * first :]
        work, failure = begin(system, values._replace(functions=functions, rates=rates))
        if failure[0, : len(samples)].any():
            raise InputError(f"the drives cannot go on until t = {time:g} s")
        states.append(work.z)
    v0, v1, v2 = (z[state.velocity + 1 : state.acceleration] for z in states)
    motion = Driven(0.0, np.zeros(len(v0)), v0, (4 * v1 - v2 - 3 * v0) / (2 * step))
    return values, motion, states[0]


def _later(
    system: System, sample: int, balance: Balance, spin: Spin
) -> Iterator[tuple[Balance, float]]:
    """Yield balances at later times, and the angles by which their vectors have turned."""
    equations = balance.equations
    state = system.structure.state
    samples = np.array([sample])
    pace = spin.pace(equations.size)
    rest = equations.values.springs.rest
    # Follow the motion that drives prescribe.
    if isinstance(spin, Driven):
        step = CHECKS.step / pace
        _, _, before = _on_way(system, samples, 0.0, step)
        for shift in CHECKS.shifts:
            values, motion, after = _on_way(system, samples, shift / pace, step)
            values.springs.rest[:] = rest
            z = balance.z.copy()
            z[: state.velocity] += (after - before)[: state.velocity, 0]
            motion = Driven(0.0, motion.centre, motion.v[:, 0], motion.a[:, 0])
            yield Balance(Equations(system, values, 0), z, motion), 0.0
        return
    # Rotate the state about the centre.
    for angle in CHECKS.angles:
        time = angle / pace
        values = pack(system, np.array([time, time + AT_START[1]]), samples)(0)
        values.springs.rest[:] = rest
        signed = float(np.copysign(angle, spin.rate))
        z = balance.z.copy()
        z[equations.q] = spin.centre + _rotate(z[equations.q] - spin.centre, signed)
        z[state.angle : state.velocity] += signed
        yield Balance(Equations(system, values, 0), z, spin), signed


def _rotate(q: np.ndarray, angle: float) -> np.ndarray:
    return np.cos(angle) * q + np.sin(angle) * rotate_vectors(q)


def _modal_matrices(linear: Linear, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness and damping as the modes see them."""
    adjoint = np.conj(vectors.T)
    return adjoint @ (linear.K + linear.L) @ vectors, adjoint @ linear.D @ vectors
