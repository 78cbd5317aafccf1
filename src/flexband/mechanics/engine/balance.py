"""The balance of forces of one sample on the directions that its constraints allow.

With a basis N of the solutions of Φ_q δq = 0 a mechanism rests if Nᵀ r = 0, where r is the residual
without multipliers; the multipliers follow from the other directions. Coordinates are measured by
the size of the mechanism, so that r [N m] and displacements compare.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lstsq

from flexband.mechanics.engine.eigenmodes import allowed, eigenmodes
from flexband.mechanics.engine.linearize import Equations, Linear, Spin
from flexband.mechanics.engine.threads import stop_flag

ITERATIONS = 200
LONGEST_STEP = 0.1
"""Relative to the size of the mechanism; longer steps are shortened."""

UNBALANCED = 1e-9
"""Force that counts as none, relative to the largest one."""

ROUNDING = 64 * np.finfo(float).eps
"""Error of the forces, relative to stiffness times coordinates."""

STEP, STUCK = 1e-8, 1e-11
"""Newton steps at rest, and without progress, relative to the size of the mechanism."""

RANK = 1e-6
"""Relative size below which a direction of Φ_qᵀ cannot carry a force."""

PUSH, MAX_PUSHES = 1e-3, 3
"""Displacement, relative to the size, out of a place where Newton's method makes no progress."""

GROWTH = 100.0
"""Of the weight of the stiffness against the inertia, with every step that succeeds."""


class Balance:
    """The forces and the linearization at a state, with multipliers of least norm.

    Attributes
    ----------
    z : the state with its multipliers.
    linear, basis : the linearization, and the allowed directions.
    forces : what is not balanced along each of the allowed directions [N m].
    violation : Φ, each row over the norm of its gradient.
    """

    def __init__(self, equations: Equations, z: np.ndarray, spin: Spin):
        self.equations, size = equations, equations.size
        z = equations.spun(z, spin)
        z[equations.multipliers] = 0.0
        r, Phi = equations.residual(z)
        rows = equations.jacobian(z) * size
        norms = np.maximum(np.linalg.norm(rows, axis=1), 1e-300)
        self.rows, self.violation = rows / norms[:, None], Phi / norms
        self.carried = np.zeros(0)
        if len(rows):
            self.carried = lstsq(self.rows.T, -size * r, cond=RANK)[0]
            z[equations.multipliers] = self.carried / norms
        self.z = z
        self.linear = equations.linear(z, spin)
        self.basis = allowed(self.linear.Phi, size, RANK)
        self.forces = self.basis.T @ r
        self.pull = equations.inertia(z)

    @property
    def free(self) -> int:
        """Number of the allowed directions."""
        return self.basis.shape[1]

    @property
    def redundant(self) -> bool:
        """Whether constraints depend on each other, so that multipliers are not unique."""
        return self.free > self.basis.shape[0] - len(self.rows)

    @property
    def weakest(self) -> int:
        """The constraint that is nearest to depending on others, or −1 if none is near to it."""
        if not len(self.rows):
            return -1
        u, sizes, _ = np.linalg.svd(self.rows)
        near = len(u) > len(sizes) or sizes[-1] < 1e-3 * sizes[0]
        return int(np.abs(u[:, -1]).argmax()) if near else -1

    @property
    def excess(self) -> float:
        """The largest force that is not balanced, over the one that is allowed."""
        equations, size = self.equations, self.equations.size
        single = np.abs(self.rows.T * self.carried).max(initial=0.0)
        given = [np.abs(size * force).max() for force in (*equations.given(self.z), self.pull)]
        stiffness = np.abs(self.linear.K) + np.abs(self.linear.L)
        position = np.abs(self.z[equations.q])
        noise = ROUNDING * np.abs(self.basis).T @ (stiffness @ position)
        reach = np.abs(self.basis / size[:, None]).max(axis=0, initial=0.0)
        tolerated = UNBALANCED * max(single, *given) * reach + noise + np.finfo(float).tiny
        return float(np.max(np.abs(self.forces) / tolerated, initial=0.0))

    def step(self, weight: float) -> np.ndarray:
        """Return the step of Newton's method, relative to the size, with inertia over `weight`."""
        size = self.equations.size
        K = self.linear.K + self.linear.L
        back = np.zeros(len(size))
        if len(self.rows):
            back = -lstsq(self.rows, self.violation, cond=RANK)[0] * size
        H = self.basis.T @ (K + self.linear.M / weight) @ self.basis
        right = -self.forces - self.basis.T @ (K @ back)
        scale = 1 / np.sqrt(np.maximum(np.abs(np.diag(H)), np.finfo(float).tiny))
        y = lstsq(H * scale * scale[:, None], scale * right, cond=1e-14)[0] if self.free else right
        return (back + self.basis @ (scale * y)) / size

    def push(self) -> np.ndarray:
        """Return the direction, of length one, in which the forces accelerate the mechanism."""
        M = self.basis.T @ self.linear.M @ self.basis
        direction = -self.basis @ np.linalg.solve(M, self.forces) / self.equations.size
        return direction / np.abs(direction).max()

    def stable(self) -> bool:
        """Return whether no small motion grows."""
        return is_stable(self.linear, self.basis)


def is_stable(linear: Linear, basis: np.ndarray) -> bool:
    """Return whether no small motion grows: energy has a minimum, or no eigenvalue is positive."""
    if not basis.shape[1]:
        return True
    damping = np.linalg.eigvalsh(basis.T @ (linear.D + linear.D.T) @ basis)
    if damping[0] >= -1e-9 * abs(damping[-1]):
        still = eigenmodes(linear._replace(D=np.zeros_like(linear.D)), basis, 1)
        if still.conservative:
            return not np.any(still.s.real > 0)
    return not np.any(eigenmodes(linear, basis, 2 * basis.shape[1]).s.real > 0)


def find_rest(equations: Equations, z: np.ndarray, spin: Spin) -> tuple[Balance, bool]:
    """Move to an equilibrium; return the balance there, or where the search ended, and success.

    Inertia keeps the first steps short. It loses weight while the forces become smaller.
    """
    weight, pushes, before = 1e3 * float(equations.values.rigidity[0, 0]), 0, np.inf
    balance = Balance(equations, z, spin)
    for _ in range(ITERATIONS):
        excess, step = balance.excess, balance.step(weight)
        largest = np.abs(step).max()
        if not np.isfinite(excess + largest) or stop_flag().any():
            break
        if excess <= 1.0 and np.abs(balance.violation).max(initial=0.0) < 1e-9:
            if np.abs(balance.step(np.inf)).max() < STEP:
                return balance, True
        elif largest < STUCK and np.abs(balance.step(np.inf)).max() < STUCK:
            if pushes == MAX_PUSHES:
                break
            pushes, before = pushes + 1, np.inf
            weight = float(equations.values.rigidity[0, 0])
            step, largest = 10.0**pushes * 0.1 * PUSH * balance.push(), 0.0
        weight = min(weight * GROWTH, 1e250) if excess <= before else weight / 10.0
        before = excess
        q = balance.z.copy()
        q[equations.q] += min(1.0, LONGEST_STEP / max(largest, 1e-300)) * step * equations.size
        balance = Balance(equations, q, spin)
    return balance, False
