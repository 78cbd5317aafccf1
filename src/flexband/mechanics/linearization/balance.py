"""The balance of forces of one sample on the directions that its constraints allow.

With a basis N of the solutions of Φ_q δq = 0 a mechanism rests if Nᵀ r = 0, where r is the residual
without multipliers; the multipliers follow from the other directions. Coordinates are measured by
the size of the mechanism, so that r [N m] and displacements compare.
"""

from __future__ import annotations

from functools import cached_property, reduce
from typing import NamedTuple

import numpy as np
from scipy.linalg import get_lapack_funcs

from flexband.mechanics.linearization.eigenmodes import (
    eigenmodes,
    is_symmetric,
    nullspace_basis,
    reduce_matrix,
    softest,
)
from flexband.mechanics.linearization.linearize import Equations, Linear
from flexband.mechanics.linearization.spin import Spin

ROUNDING = 64 * np.finfo(float).eps
"""Error of the forces, relative to stiffness times coordinates."""

SINGULAR = 1e-14
"""Relative size of a stiffness that counts as none, once each is scaled by its diagonal."""


class BalanceTolerances(NamedTuple):
    """What counts as balanced."""

    force: float = 1e-9
    """Force that counts as none, relative to the largest one."""
    lost_force: float = 1e-4
    """What may be unbalanced along directions whose stiffness counts as none, relative to the
    largest force."""
    rank: float = 1e-6
    """Relative size below which a direction of Φ_qᵀ cannot carry a force."""
    iterations: int = 20
    """In which reactions settle that friction follows, at most."""


Factors = tuple[np.ndarray, np.ndarray]
"""LU factors of a matrix, and the order of its rows."""


class Balance:
    """The forces and the linearization at a state z, with multipliers of least norm.

    `forces` [N m] are not balanced along the allowed directions `basis`; `violation` is Φ, each row
    over its largest gradient, so that multipliers compare as forces on points.
    """

    def __init__(
        self,
        equations: Equations,
        z: np.ndarray,
        spin: Spin,
        tolerances: BalanceTolerances = BalanceTolerances(),
    ):
        self.equations = equations
        self.spin = spin
        self.tolerances = tolerances
        size = equations.size
        z = equations.spun(z, spin)
        z[equations.multipliers] = 0.0
        r, Phi = equations.residual(z)
        self.directionless, loose = equations.directionless(z)
        # Scale the constraints to gradients of length 1.
        rows = equations.jacobian(z) * size
        dimension = equations.system.model.dimension
        lengths = reduce(np.hypot, (rows[:, k::dimension] for k in range(dimension)))
        self.norms = lengths.max(axis=1, initial=1e-300)
        self.rows = rows / self.norms[:, None]
        self.violation = Phi / self.norms
        # Find the multipliers that balance the forces best.
        self.carried = np.zeros(0)
        if len(rows):
            self.carried = np.linalg.lstsq(self.rows.T, -size * r, rcond=tolerances.rank)[0]
            r = self._with_friction(z, r)
            z[equations.multipliers] = self.carried / self.norms
        # Reduce the forces to the directions that constraints allow.
        self.z = z
        self.linear = equations.linear(z, spin).follow_reactions(self.reaction_matrix(self.rows))
        self.basis = nullspace_basis(self.linear.Phi, size, tolerances.rank)
        with np.errstate(invalid="ignore"):  # a law that fails, which is told later
            self.forces = self.basis.T @ r
            self.loose = self.basis.T @ loose
        self.pull = equations.inertia(z)
        z[equations.y] = equations.solved_states()

    def _with_friction(self, z: np.ndarray, r: np.ndarray) -> np.ndarray:
        """Let sliding friction follow the reactions by Newton's method; return the residual."""
        equations = self.equations
        size = self.equations.size
        for _ in range(self.tolerances.iterations):
            if not equations.follows(z):
                break
            z[equations.carried] = self.carried / self.norms
            r = equations.residual(z)[0]
            G = equations.by_reactions(z)
            forces = size[:, None] * np.column_stack([r - G @ z[equations.carried], G / self.norms])
            across = np.linalg.lstsq(self.rows.T, forces, rcond=self.tolerances.rank)[0]
            following = np.eye(len(self.rows)) + across[:, 1:]
            before = self.carried
            self.carried = np.linalg.solve(following, -across[:, 0])
            if np.abs(self.carried - before).max() <= ROUNDING * np.abs(before).max():
                break
        return r

    def reaction_matrix(self, rows: np.ndarray) -> np.ndarray | None:
        """Return R of `Linear.follow_reactions` with these constraints, those of joints first.

        δλ = −(I + Φ⁺ᵀ G)⁻¹ Φ⁺ᵀ δr balances forces on the directions of the constraints.
        """
        if not self.equations.follows(self.z):
            return None
        G = self.equations.by_reactions(self.z)
        count = len(self.rows)
        across = np.linalg.pinv(rows.T, rcond=self.tolerances.rank) * self.equations.size
        change = np.eye(len(rows))
        change[:, :count] += across @ (G / self.norms)
        return -(G / self.norms) @ np.linalg.solve(change, across)[:count]

    def contraction(self, rows: np.ndarray, M: np.ndarray) -> float:
        """Return the gain of the friction loop; from 1 on, accelerations are none or several."""
        n = len(M)
        count = len(self.rows)
        size = self.equations.size
        matrix = np.zeros((n + len(rows),) * 2)
        matrix[:n, :n] = M * size * size[:, None]
        matrix[:n, n:] = rows.T
        matrix[n:, :n] = rows
        forces = np.zeros((len(matrix), count))
        forces[:n] = -size[:, None] * self.equations.by_reactions(self.z) / self.norms
        changes = np.linalg.lstsq(matrix, forces, rcond=None)[0][n : n + count]
        return float(np.abs(np.linalg.eigvals(changes)).max())

    @property
    def freedom_count(self) -> int:
        """Number of the allowed directions."""
        return self.basis.shape[1]

    @property
    def redundant(self) -> bool:
        """Whether constraints depend on each other, so that multipliers are not unique."""
        return self.freedom_count > self.basis.shape[0] - len(self.rows)

    @property
    def weakest(self) -> int:
        """The constraint that is nearest to depending on others, or −1 if none is near to it."""
        if not len(self.rows):
            return -1
        u, sizes, _ = np.linalg.svd(self.rows)
        nearly_dependent = len(u) > len(sizes) or sizes[-1] < 1e-3 * sizes[0]
        return int(np.abs(u[:, -1]).argmax()) if nearly_dependent else -1

    @property
    def largest_force(self) -> float:
        """The largest load, inertia force or reaction, times the size [N m]."""
        forces = (*self.equations.applied_forces(self.z), self.pull)
        loads = [np.abs(self.equations.size * force).max() for force in forces]
        return max(np.abs(self.rows.T * self.carried).max(initial=0.0), *loads)

    @cached_property
    def force_tolerance(self) -> np.ndarray:
        """Largest force along each allowed direction that counts as zero [N m]."""
        size = self.equations.size
        position = np.abs(self.z[self.equations.q]) + size
        noise = ROUNDING * np.abs(self.basis).T @ (self.linear.terms @ position)
        reach = np.abs(self.basis / size[:, None]).max(axis=0, initial=0.0)
        return self.tolerances.force * self.largest_force * reach + noise + np.finfo(float).tiny

    @property
    def excess(self) -> float:
        """The largest force that is not balanced, over the one that is allowed."""
        return float(np.max(np.abs(self.forces) / self.force_tolerance, initial=0.0))

    @cached_property
    def stiffness(self) -> tuple[np.ndarray, np.ndarray, Factors | None]:
        """The stiffness on the allowed directions, as `_scale_by_diagonal` returns it.

        It is none where a move by the whole size would change forces by less than is tolerated.
        """
        matrix = reduce_matrix(self.linear.K + self.linear.L, self.basis)
        tolerance_root = np.sqrt(self.force_tolerance)
        return _scale_by_diagonal(
            np.where(np.abs(matrix) < tolerance_root * tolerance_root[:, None], 0.0, matrix)
        )

    @property
    def has_lost_stiffness(self) -> bool:
        """Whether forces act along directions whose stiffness is lost in rounding errors."""
        matrix, scale, factors = self.stiffness
        if factors is not None:
            return False
        _, sizes, directions = np.linalg.svd(matrix)
        lost = directions[sizes <= SINGULAR * sizes.max(initial=0.0)] * scale
        reach = np.abs(lost @ self.basis.T / self.equations.size).max(axis=1, initial=0.0)
        allowed = self.tolerances.lost_force * self.largest_force * reach
        return bool(np.any((np.abs(lost @ self.forces) > allowed) & (allowed > 0)))

    def step(self, weight: float) -> np.ndarray:
        """Return the step of Newton's method, relative to the size, with inertia over `weight`."""
        size = self.equations.size
        K = self.linear.K + self.linear.L
        constraint_step = np.zeros(len(size))
        if len(self.rows):
            constraint_step = (
                -np.linalg.lstsq(self.rows, self.violation, rcond=self.tolerances.rank)[0] * size
            )
        matrix, scale, factors = self.stiffness
        if np.isfinite(weight):
            matrix, scale, factors = _scale_by_diagonal(
                reduce_matrix(K + self.linear.M / weight, self.basis)
            )
        right = -self.forces - self.basis.T @ (K @ constraint_step)
        y = scale * _solution(matrix, factors, scale * right)
        return (constraint_step + self.basis @ y) / size

    def after_step(self, step: np.ndarray) -> Balance:
        """Return the balance after a step, relative to the size."""
        z = self.z.copy()
        z[self.equations.q] += step * self.equations.size
        return Balance(self.equations, z, self.spin, self.tolerances)

    def push(self) -> np.ndarray:
        """Return the unit direction in which forces accelerate, without directionless springs."""
        M = reduce_matrix(self.linear.M, self.basis)
        forces = self.forces - self.loose
        if not np.abs(forces).max(initial=0.0) > 0:
            forces = np.ones(self.freedom_count)
        direction = -self.basis @ np.linalg.solve(M, forces) / self.equations.size
        return direction / np.abs(direction).max()

    @cached_property
    def motion(self) -> Linear:
        """The matrices of small motions, in which states of force laws are unknowns."""
        if not self.equations.state_count:
            return self.linear
        linear = self.equations.linear_with_states(self.z, self.spin)
        return linear.follow_reactions(self.reaction_matrix(self.rows))

    def lowest(self) -> float:
        """Return the lowest ω² [1/s²] of the symmetric part of the stiffness, or 0."""
        if not self.freedom_count:
            return 0.0
        return float(softest(self.linear, self.basis, 1)[0][0])

    @cached_property
    def stable(self) -> bool:
        """Whether no small motion grows, but for rounding of the multipliers."""
        floor = ROUNDING * np.abs(self.carried).max(initial=0.0) / self.equations.size**2
        return is_stable(self.motion._replace(K=self.motion.K + np.diag(floor)), self.basis)


def _scale_by_diagonal(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, Factors | None]:
    """Return a matrix scaled by the roots of its diagonal, 1 over these, and factors or None.

    Where the diagonal is smaller than K_ij² ≤ K_ii K_jj asks for, as without negative eigenvalues,
    what is coupled counts in its place.
    """
    size = np.abs(matrix)
    floor = np.finfo(float).tiny
    diagonal = np.maximum(np.diag(size), floor)
    with np.errstate(over="ignore"):
        coupled = np.minimum(size, size**2 / diagonal).max(axis=1, initial=0.0)
    scale = 1 / np.sqrt(np.maximum(diagonal, coupled))
    matrix = matrix * scale * scale[:, None]
    return matrix, scale, _factor(matrix)


def _factor(matrix: np.ndarray) -> Factors | None:
    """Return the factors of a matrix, or None if it is singular."""
    if not len(matrix):
        return matrix, np.zeros(0, dtype=np.int32)
    (getrf,) = get_lapack_funcs(("getrf",), (matrix,))
    lu, order, _ = getrf(matrix)
    pivots = np.abs(np.diag(lu))
    return (lu, order) if pivots.min() > SINGULAR * pivots.max() else None


def _solution(matrix: np.ndarray, factors: Factors | None, right: np.ndarray) -> np.ndarray:
    """Return x of least norm with matrix @ x = right, where directions without stiffness rest."""
    if not len(right):
        return right
    if factors is None:
        return np.linalg.lstsq(matrix, right, rcond=SINGULAR)[0]
    (getrs,) = get_lapack_funcs(("getrs",), (matrix,))
    return getrs(*factors, right)[0]


def is_stable(linear: Linear, basis: np.ndarray) -> bool:
    """Return whether no small motion grows: energy has a minimum, or no eigenvalue is positive."""
    if linear.states is not None:
        return not np.any(eigenmodes(linear, basis, 2 * len(linear.M)).unstable)
    if not basis.shape[1]:
        return True
    D, L = (reduce_matrix(part, basis) for part in (linear.D, linear.L))
    count = 2 * basis.shape[1]
    if linear.carried is None and is_symmetric(L) and _no_growth(D + D.T):
        K = reduce_matrix(linear.K + linear.L, basis)
        try:
            np.linalg.cholesky(K + K.T)
            return True
        except np.linalg.LinAlgError:
            linear = linear._replace(D=np.zeros_like(linear.D))
            count = 1
    return not np.any(eigenmodes(linear, basis, count).unstable)


def _no_growth(damping: np.ndarray) -> bool:
    """Return whether damping never gives energy."""
    if not damping.any():
        return True
    powers = np.linalg.eigvalsh(damping)
    return bool(powers[0] >= -1e-9 * abs(powers[-1]))
