"""The equations of one sample about a state: the residual, and its complete linearization.

    M δq̈ + D δq̇ + (K + L) δq + Φ_qᵀ δλ = 0,   Φ_q δq = 0

K is symmetric, L is the stiffness of loads. L and D contain what Newton's matrix of the integrator
leaves out: forces that are products of the state, such as those that turn with a body, and the part
of force laws that is not symmetric. Where laws have states y with rates ẏ = g, these are unknowns
too:

    M δq̈ + … = Q_y δy,   δẏ = g_q δq + g_v δq̇ + g_y δy

Friction that slides is a load. Where it depends on reactions, it adds G δλ. With δλ from the
equations themselves, that is R (M δq̈ + D δq̇ + (K + L) δq), see `Linear.follow_reactions`.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from flexband.mechanics.assembly.stacking import map_tree
from flexband.mechanics.assembly.structure import Values, WorkSpace
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.batch import run
from flexband.mechanics.engine.entries import LINEARIZE, LOADS, RESIDUAL
from flexband.mechanics.kernels.factorization import to_dense
from flexband.mechanics.kernels.friction.modes import MODE
from flexband.mechanics.kernels.lane_arrays import WIDTH, zeros
from flexband.mechanics.kernels.laws.forces import GAP
from flexband.mechanics.kernels.laws.states import MARK, rows_of_states
from flexband.mechanics.kernels.state import FRICTION_ROWS, friction_rows, rows_of_gaps
from flexband.mechanics.linearization.spin import Spin, rotate_columns


class LinearStates(NamedTuple):
    """The derivatives of force laws with states: of loads by states, and of the states' rates."""

    loads: np.ndarray  # Q_y, (coordinates, states)
    by_place: np.ndarray  # g_q, (states, coordinates)
    by_rate: np.ndarray  # g_v
    by_state: np.ndarray  # g_y, (states, states)


class Linear(NamedTuple):
    """The matrices of small motions."""

    M: np.ndarray  # without zeros, where bodies are massless
    D: np.ndarray
    K: np.ndarray
    L: np.ndarray
    Phi: np.ndarray  # (multipliers, coordinates)
    terms: np.ndarray  # magnitudes of the terms of K + L, whose rounding matters
    dimension: int = 2  # number of components of a vector
    states: LinearStates | None = None  # of laws, where M, … hold them
    carried: np.ndarray | None = None  # inertia by which reactions change friction, R M

    @property
    def inertia(self) -> np.ndarray:
        """What multiplies δq̈: M, with the part of friction that is not symmetric."""
        return self.M if self.carried is None else self.M + self.carried

    def follow_reactions(self, R: np.ndarray | None) -> Linear:
        """Return the matrices with friction that follows reactions, R of the forces."""
        if R is None:
            return self
        states = self.states and self.states._replace(
            loads=self.states.loads + R @ self.states.loads
        )
        D = self.D + R @ self.D
        L = self.L + R @ (self.K + self.L)
        return self._replace(D=D, L=L, states=states, carried=R @ self.M)


class Equations:
    """The equations of motion of one sample, of which the engine computes eight copies.

    Loads are differentiated over a `perturbation` of the size, or `of_depth` of a contact and
    `of_speed` of a Stribeck speed, if less. Sliding speeds below `still`, relative to the largest
    velocity, and springs shorter than `min_length` of the size, count as none; `damping_weight`
    [1/s] is that of the damping against the stiffness.
    """

    perturbation = 1e-6
    of_depth = of_speed = 2e-3
    still = 1e-9
    min_length = 1e-12
    damping_weight = 1e9

    def __init__(self, system: System, values: Values, lane: int):
        self.system = system
        self.state = system.structure.state
        self.values = map_tree(lambda rows: _copies(rows[:, lane]), values)
        self.work = WorkSpace.from_structure(system.structure)
        self.failure = np.zeros((4, WIDTH))  # of force laws, in the last evaluation
        self.q = slice(1, 1 + self.state.coordinates)
        self.v = slice(self.state.velocity + 1, self.state.acceleration)
        self.a = slice(self.state.acceleration + 1, self.state.energy)
        self.multipliers = slice(self.state.multiplier, self.state.friction)
        starts = self.state.law_state + self.state_count * np.arange(5)
        self.frictions = self.state.angle - self.state.friction
        self.senses = slice(self.state.sliding, self.state.sliding + self.frictions)
        carried = self.state.sliding + FRICTION_ROWS * self.frictions
        self.carried = slice(carried, carried + self.state.friction - self.state.multiplier)
        self.y, self.y0, _, self.rates = (slice(*pair) for pair in pairwise(starts.tolist()))
        self.size = 1.0 / self.values.inverse_scale[self.q, 0]

    @property
    def state_count(self) -> int:
        """Number of the states of force laws."""
        return rows_of_states.py_func(self.state).states

    def freeze_law_states(self, z: np.ndarray) -> np.ndarray:
        """Return the state in which the states of force laws keep their values, without rates."""
        z = z.copy()
        z[self.y0] = z[self.y]
        z[self.state.rule : self.state.sliding] = 0.0
        return z

    def update_law_modes(self, z: np.ndarray) -> np.ndarray:
        """Return the state with the modes of laws that fit its gaps; contacts keep theirs."""
        z = z.copy()
        rows = rows_of_gaps.py_func(self.state)
        self.loads(z[:, None])
        gaps = self.work.z[rows.value :][: rows.number, 0]
        modes = z[rows.mode :][: rows.number]
        events = self.system.structure.laws.gap_kind == GAP.event
        modes[events & (gaps * modes < 0)] *= -1.0
        return z

    @staticmethod
    def close_contacts(system: System, z: np.ndarray) -> None:
        """Close all contacts in these states, (rows, WIDTH): forces follow from the depth alone."""
        kinds = system.structure.laws.gap_kind
        rows = rows_of_gaps.py_func(system.structure.state)
        z[rows.mode :][: rows.number][np.isin(kinds, (GAP.length, GAP.angle))] = -MARK.at_rest

    def solved_states(self) -> np.ndarray:
        """Return the states of force laws that the last evaluation has solved for."""
        return self.work.z[self.y, 0].copy()

    @cached_property
    def _bare(self) -> System:
        """The system without the loads that `LOADS` computes."""
        structure = self.system.structure
        none = np.zeros(0, dtype=np.int64)
        structure = structure._replace(
            forces=type(structure.forces)(*(none for _ in structure.forces)),
            laws=structure.laws._replace(address=structure.laws.address[:0]),
        )
        return replace(self.system, structure=structure)

    @cached_property
    def _massless(self) -> Values:
        """The numbers without the mass: M + K would round K relative to M."""
        none = np.zeros_like(self.values.mass)
        return self.values._replace(mass=none, regular_mass=none)

    @cached_property
    def mass(self) -> np.ndarray:
        """The mass matrix."""
        return self._square(self.values.mass)

    def _square(self, entries: np.ndarray) -> np.ndarray:
        mass = self.system.structure.mass
        count = self.state.coordinates
        M = np.zeros((count + 1, count + 1))
        M[mass.i, mass.j] = M[mass.j, mass.i] = entries[:, 0]
        return M[1:, 1:]

    @cached_property
    def _units(self) -> np.ndarray:
        """The size of the mechanism for each friction, 1 where its travel is an angle."""
        return np.where(self.system.structure.friction.angular, 1.0, self.size.max())

    def spun(self, z: np.ndarray, spin: Spin) -> np.ndarray:
        """Return the state with the velocities, accelerations and sliding of a steady motion."""
        z = z.copy()
        z[self.v], z[self.a] = spin.velocity(z[self.q]), spin.acceleration(z[self.q])
        if self.frictions:
            self.loads(z[:, None])
            speeds = self.work.z[self.senses.start + 2 * self.frictions :][: self.frictions, 0]
            rest = np.abs(speeds) <= self.still * self._units * spin.pace(self.size)
            z[self.senses] = np.where(rest, MODE.inactive, np.sign(speeds))
        return z

    def can_hold(self, z: np.ndarray, *, min_share: float = 1e-9) -> np.ndarray:
        """Return which frictions can hold: their normal force is above `min_share`.

        That is a part of the largest reaction or load. Joints that switch hold if they are active,
        and clutches that turn one way always.
        """
        z = z.copy()
        friction = self.system.structure.friction
        if not self.frictions:
            return np.zeros(0, dtype=bool)
        reactions = z[self.multipliers]
        z[self.carried] = reactions
        z[self.senses] = MODE.inactive
        loads = self.loads(z[:, None])[:, 0]
        first = friction_rows.py_func(self.state).normal
        normal = self.work.z[first : first + self.frictions, 0]
        largest = np.abs([*reactions, *loads, *self.values.weight[self.q, 0]]).max(initial=0.0)
        coefficient = self.values.friction.static[:, 0]
        hold_mask = np.where(
            friction.switched, normal > 0, coefficient * normal > min_share * largest
        )
        return hold_mask | (friction.one_way != 0)

    def follows(self, z: np.ndarray) -> bool:
        """Return whether friction slides that may depend on reactions."""
        return self.system.structure.friction.follows and bool(z[self.senses].any())

    def by_reactions(self, z: np.ndarray) -> np.ndarray:
        """Return G, the derivatives of friction by the reactions of joints."""
        size = np.abs(z[self.carried]).max(initial=0.0) or 1.0
        steps = np.full(self.state.friction - self.state.multiplier, self.perturbation * size)
        return -self._differences(z, self.carried.start, steps)[: self.state.coordinates]

    def residual(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return M a + Φ_qᵀλ + F − Q, and Φ."""
        self.work.z[:] = z[:, None]
        self._run(RESIDUAL, self.system)
        r = self.work.r[:, 0].copy()
        return r[self.q], r[self.multipliers]

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        """Return Φ_q."""
        n = self.state.coordinates
        last = self.state.friction - 1
        return self._matrix(z, 0.0)[n:last, :n]

    def friction_jacobian(self, z: np.ndarray) -> np.ndarray:
        """Return the derivatives of the travels of friction, shape (frictions, coordinates)."""
        z = z.copy()
        self.residual(z)  # which sets the distance of circles, as long as they do not stick
        z[self.senses] = MODE.sticks
        return self._matrix(z, 0.0)[self.state.friction - 1 :, : self.state.coordinates]

    def applied_forces(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the constant generalized forces, and those of products and force laws."""
        return self.values.weight[self.q, 0], self.loads(z[:, None])[:, 0]

    def directionless(self, z: np.ndarray) -> tuple[bool, np.ndarray]:
        """Return whether springs of no length pull without a direction, and their residual.

        Such a spring holds any force up to its tension, and none if it pushes.
        """
        springs = self.system.structure.springs
        vectors = self.system.structure.vectors
        wrong = False
        part = np.zeros(self.state.coordinates)
        for s in range(springs.translational):
            entries = slice(vectors.start[springs.vector[s]], vectors.start[springs.vector[s] + 1])
            columns = vectors.coordinate[entries]
            x = self.values.vectors.x[entries, 0]
            y = self.values.vectors.y[entries, 0]
            d = np.array([x @ z[columns], y @ z[columns]])
            length = self.work.z[self.state.elongation + s, 0]
            tension = self.work.z[self.state.tension + s, 0]
            if length < self.min_length * self.size.max() and abs(tension) > 0:
                pull = tension * d / length
                wrong |= tension < 0 or np.hypot(*d) > length
                np.add.at(part, columns - 1, pull[0] * x + pull[1] * y)
        return wrong, part

    def inertia(self, z: np.ndarray) -> np.ndarray:
        """Return M a."""
        return self.mass @ z[self.a]

    def _run(self, task: int, system: System, number: float = 0.0) -> None:
        self.failure[:] = 0.0
        values = self.values if task != LINEARIZE else self._massless
        run(task, system, values, self.work, failure=self.failure, number=number)

    def _matrix(self, z: np.ndarray, rate: float) -> np.ndarray:
        self.work.z[:] = z[:, None]
        self._run(LINEARIZE, self._bare, rate)
        return to_dense(self.system.structure.pattern, self.work.matrix[:, :1])[0]

    def loads(self, z: np.ndarray) -> np.ndarray:
        """Return the generalized forces Q of products and force laws for eight states."""
        self.work.z[:] = z
        self._run(LOADS, self.system)
        return -self.work.r[self.q]

    def linear_with_states(self, z: np.ndarray, spin: Spin) -> Linear:
        """Return the matrices about a state with the states of force laws as unknowns."""
        if not self.state_count:
            return self.linear(z, spin)
        z = self.freeze_law_states(z)
        scale = self.state_sizes(z, spin)
        states = self._state_derivatives(z, spin, scale)
        return self.linear(z, spin)._replace(states=states)

    def state_sizes(self, z: np.ndarray, spin: Spin) -> np.ndarray:
        """Return positive sizes of the states of laws: their values, or those of a motion."""
        z = self.freeze_law_states(z)
        first = self._state_derivatives(z, spin, np.maximum(np.abs(z[self.y]), 1.0))
        caused = np.abs(first.by_place * self.size).max(axis=1, initial=0.0)
        decay = np.abs(np.diag(first.by_state))
        caused = caused / np.where(decay > 0, decay, 1.0)
        size = np.maximum(np.abs(z[self.y]), caused)
        return np.where(np.isfinite(size) & (size > 0), size, 1.0)

    def linear(self, z: np.ndarray, spin: Spin) -> Linear:
        """Return the matrices about a state, in axes that turn with `spin`."""
        n = self.state.coordinates
        M = self.mass
        smooth = z.copy()
        smooth[self.senses] = MODE.inactive  # friction is a load
        matrix = self._matrix(smooth, 0.0)
        K = matrix[:n, :n]
        Phi = matrix[n : self.state.friction - 1, :n]
        D = (self._matrix(smooth, self.damping_weight) - matrix)[:n, :n] / self.damping_weight
        by_place, by_rate = (part[:n] for part in self._load_derivatives(z, spin))
        centrifugal = spin.rate**2 * M
        coriolis = 2 * spin.rate * rotate_columns(M)
        L = -by_place - spin.rate * rotate_columns(by_rate)
        terms = np.abs(K) + np.abs(L) + np.abs(centrifugal)
        M = self._square(self.values.regular_mass)
        dimension = self.system.model.dimension
        return Linear(M, D - by_rate + coriolis, K - centrifugal, L, Phi, terms, dimension)

    def _load_derivatives(self, z: np.ndarray, spin: Spin) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of the loads, and of the rates of laws' states, by q and v."""
        n = self.state.coordinates
        structure = self.system.structure
        loaded = len(structure.forces.row) or len(structure.laws.address)
        if not (loaded or z[self.senses].any()):
            return np.zeros((n, n)), np.zeros((n, n))
        return (
            self._differences(z, self.q.start, self._nudge(z) * self.size),
            self._differences(z, self.v.start, self._pace(spin) * self.size),
        )

    def _nudge(self, z: np.ndarray) -> float:
        """Return the displacement of differences, a small part of the depth of each contact."""
        kinds = self.system.structure.laws.gap_kind
        self.loads(z[:, None])
        depths = -self.work.z[self.state.gap :][: len(kinds), 0]
        depths = np.where(kinds == GAP.length, depths / self.size.max(), depths)
        closed = np.isin(kinds, (GAP.length, GAP.angle)) & (depths > 0)
        part = self.of_depth * np.min(depths, where=closed, initial=1.0)
        return min(self.perturbation, max(part, 1e-5 * self.perturbation))

    def _pace(self, spin: Spin) -> float:
        """Return the velocity of differences, a small part of the Stribeck speeds."""
        inverse_speeds = np.sqrt(self.values.friction.inverse_square[:, 0])
        largest = np.max(self._units * inverse_speeds, initial=0.0)
        pace = self.perturbation * max(1.0, abs(spin.rate))
        return pace if pace * largest <= self.of_speed else self.of_speed / largest

    def _state_derivatives(self, z: np.ndarray, spin: Spin, scale: np.ndarray) -> LinearStates:
        """Return the derivatives of laws with states, which are held, of these sizes."""
        n = self.state.coordinates
        by_place, by_rate = self._load_derivatives(z, spin)
        by_state = self._differences(z, self.y0.start, self.perturbation * scale)
        by_place = by_place[n:] + spin.rate * rotate_columns(by_rate[n:])
        return LinearStates(by_state[:n], by_place, by_rate[n:], by_state[n:])

    def _differences(self, z: np.ndarray, first: int, steps: np.ndarray) -> np.ndarray:
        """Return the derivatives of loads and rates by rows of z, four columns at a time."""
        n = len(steps)
        half = WIDTH // 2
        derivatives = np.zeros((self.state.coordinates + self.state_count, n))
        for begin in range(0, n, half):
            columns = np.arange(begin, min(begin + half, n))
            place = first + columns
            lanes = np.arange(len(columns))
            states = _copies(z)
            states[place, lanes] += steps[columns]
            states[place, half + lanes] -= steps[columns]
            width = states[place, lanes] - states[place, half + lanes]  # as rounded
            Q = np.concatenate([self.loads(states), self.work.z[self.rates]])
            with np.errstate(invalid="ignore"):  # where a force law fails
                derivatives[:, columns] = (Q[:, lanes] - Q[:, half + lanes]) / width
        return derivatives


def _copies(column: np.ndarray) -> np.ndarray:
    """Return a column in all lanes."""
    lanes = zeros(len(column))
    lanes[:] = column[:, None]
    return lanes
