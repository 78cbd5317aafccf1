"""Modes of the samples of one block of lanes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.linalg import null_space

from flexband.errors import InputError
from flexband.mechanics.assembly.structure import Values
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.batch import begin, derive, run
from flexband.mechanics.engine.entries import SENSE
from flexband.mechanics.engine.failures import friction_names
from flexband.mechanics.engine.redundancy import dependent, refuse_shared_friction, require_inertia
from flexband.mechanics.kernels.friction.modes import MODE
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.linearization.balance import Balance
from flexband.mechanics.linearization.block_equilibria import block_equilibria, no_rotation
from flexband.mechanics.linearization.contact_damping import contact_damping
from flexband.mechanics.linearization.eigenmodes import Eigenmodes, eigenmodes
from flexband.mechanics.linearization.linearize import Equations, Linear
from flexband.mechanics.linearization.spin import Spin
from flexband.mechanics.linearization.steady_motion import check_steady, driven_spins
from flexband.mechanics.linearization.thickness import Thickness


class SampleModes(NamedTuple):
    """Modes of a sample, the outputs' derivatives along them, and their momenta Mφ as columns."""

    modes: Eigenmodes
    shapes: np.ndarray
    momenta: np.ndarray
    sliding: np.ndarray  # which frictions slide
    stuck: np.ndarray  # which hold what they can


class BlockModes(NamedTuple):
    """Modes of the samples of a block."""

    failure: np.ndarray  # as the engine has it, (4, WIDTH)
    samples: list[SampleModes]  # those that did not fail
    unbalanced: list[int]  # samples that are not in equilibrium
    moving: bool  # whether the mechanism moves at the start


@dataclass(frozen=True)
class ModeSolver:
    """What modes are looked for, and how."""

    system: System
    sections: Thickness  # what tells modes of thickness
    count: int
    at_start: bool  # whether the modes are about the start instead of an equilibrium
    steps: int  # as in `equilibrium`
    thickness: bool  # whether modes of thickness are among them
    spins: list[Spin] | None  # the steady rotation of each sample
    sliding: bool  # whether drives go on instead
    perturbation: float = 1e-6
    """Of the differences that differentiate the sensors, over the size."""
    min_speed: float = 1e-7
    """In sizes of the mechanism per second; less counts as none."""
    unbalanced: float = 1e3
    """Excess of forces in `Balance` from which on the start is no rest."""

    def block(self, values: Values, numbers: np.ndarray) -> BlockModes:
        """Return the modes of a block that has the samples with these numbers."""
        system = self.system
        state = self.system.structure.state
        work, failure = begin(system, values)
        count = len(numbers)
        v = work.z[state.velocity + 1 : state.acceleration, :count]
        scale = values.inverse_scale[1 : 1 + state.coordinates, :count]
        spins = None if self.spins is None else self.spins[numbers[0] : numbers[-1] + 1]
        if self.sliding:
            spins = driven_spins(system, numbers)
        moving = bool(np.any(np.abs(v * scale) > self.min_speed)) and spins is None
        still = no_rotation(system)
        # Find the states to linearize about.
        if self.at_start:
            if moving:
                raise InputError(
                    "about must not be 'start' if the mechanism moves at the start; give "
                    "about='equilibrium', or about=SteadyRotation(rate) for a rotation"
                )
            balances = [
                Balance(Equations(system, values, lane), z, still)
                for lane, z in enumerate(work.z.T)
            ][:count]
        else:
            _, failure, balances, _ = block_equilibria(system, values, self.steps, count, spins)
        results = []
        unbalanced = []
        # Solve for the modes of each sample.
        for lane, balance in enumerate(balances):
            if failure[0, lane]:
                continue
            if not balance.freedom_count and not balance.equations.state_count:
                raise InputError("the mechanism has no degree of freedom, so it has no modes")
            z = balance.z
            linear = balance.motion
            sample = int(numbers[lane])
            if self.at_start:
                z = work.z[:, lane]
                # Linearize with the multipliers of the motion.
                linear = balance.equations.linear_with_states(z, still)
                if balance.excess > self.unbalanced:
                    unbalanced.append(sample)
            require_inertia(system, balance.equations.values, z[:, None], numbers[lane : lane + 1])
            damping = linear.D + contact_damping(balance.equations, z, linear)
            linear = linear._replace(M=balance.equations.mass, D=damping)
            basis = balance.basis
            sliding = z[balance.equations.senses] != MODE.inactive
            stuck = balance.equations.can_hold(z) & ~sliding
            if system.model.frictions:
                linear, basis = _with_friction(balance, linear, z, stuck, sample)
            modes = self._lowest(linear, basis, sample, z)
            if spins is not None and spins[lane].pace(balance.equations.size):
                check_steady(system, sample, balance, modes, spins[lane])
            shapes = self._shapes(balance.equations, z, modes)
            results.append(SampleModes(modes, shapes, linear.M @ modes.vectors, sliding, stuck))
        return BlockModes(failure, results, unbalanced, moving)

    def _lowest(self, linear: Linear, basis: np.ndarray, sample: int, z: np.ndarray) -> Eigenmodes:
        """Return the modes of lowest frequency, with those of thickness or without."""
        share = partial(self.sections.share, sample, z)
        asked = self.count
        while True:
            candidates = eigenmodes(linear, basis, asked)
            across = share(candidates.vectors) > 0.5
            candidates = candidates._replace(thickness=across)
            listed = np.flatnonzero(self.thickness | ~across)
            if len(listed) >= self.count or len(candidates.s) < asked:
                return candidates.select(listed[: self.count])
            asked *= 2

    def _shapes(self, equations: Equations, z: np.ndarray, modes: Eigenmodes) -> np.ndarray:
        """Return the outputs' derivatives along each vector, shape (modes, outputs)."""
        system = equations.system
        work = equations.work
        rows = np.zeros((system.sensor_row_count, WIDTH))
        shapes = []
        vectors = modes.vectors
        sizes = equations.size
        q = np.arange(equations.q.start, equations.q.stop)
        z = equations.freeze_law_states(z)
        if equations.state_count:
            vectors = np.vstack([vectors, modes.states])
            sizes = np.append(sizes, equations.state_sizes(z, no_rotation(system)))
            q = np.append(q, np.arange(equations.y0.start, equations.y0.stop))
        for vector in vectors.T:
            size = self.perturbation / np.abs(vector / sizes).max()
            work.z[:] = z[:, None]
            for lane, step in enumerate((1.0, -1.0, 1.0j, -1.0j)):
                work.z[q, lane] += (step.conjugate() * size * vector).real
            run(SENSE, system, equations.values, work, rows[None], equations.failure)
            outputs = derive(system, rows[:, None].copy())[:, 0]
            parts = [(outputs[:, k] - outputs[:, k + 1]) / (2 * size) for k in (0, 2)]
            shapes.append(parts[0] + 1j * parts[1] if np.iscomplexobj(vectors) else parts[0])
        return np.stack(shapes)


def _with_friction(
    balance: Balance, linear: Linear, z: np.ndarray, hold_mask: np.ndarray, sample: int
) -> tuple[Linear, np.ndarray]:
    """Return the matrices with friction that slides, and the motions that it does not hold."""
    equations = balance.equations
    basis = balance.basis
    system = balance.equations.system
    if np.any(system.structure.friction.one_way * z[equations.senses] < 0):
        raise InputError("a OneWayClutch would lock, so the mechanism does not slide steadily")
    stuck = equations.friction_jacobian(z)[hold_mask] * equations.size
    basis = basis @ null_space(stuck / equations.size @ basis)
    if not basis.shape[1]:
        raise InputError("friction holds all that can move, so there are no modes")
    if not equations.follows(z):
        return linear, basis
    refuse_shared_friction(system, dependent(system, z, sample)[1])
    norms = np.maximum(np.linalg.norm(stuck, axis=1, keepdims=True), 1e-300)
    rows = np.vstack([balance.rows, stuck / norms])
    if balance.contraction(rows, linear.M) >= 1:
        raise InputError(
            f"friction of {friction_names(system)} jams: with it no motion is consistent, or "
            "several are (Painlevé), so there are no modes"
        )
    coupled = equations.linear_with_states(z, balance.spin)
    damping = coupled.D + contact_damping(equations, z, coupled)
    linear = coupled._replace(M=linear.M, D=damping)
    return linear.follow_reactions(balance.reaction_matrix(rows)), basis
