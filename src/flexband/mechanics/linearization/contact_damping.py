"""The damping of contacts that are closed at rest: c n nᵀ with c = 2 ζ √(k m).

n is the gradient of the gap, k the tangent stiffness of the contact, and m = 1/(n W nᵀ) the
effective mass, where W is the inverse of the mass matrix with joints. A simulation has the same
force once an impact is over, see `contact.contact_law`.
"""

from __future__ import annotations

import numpy as np

from flexband.mechanics.kernels.friction.modes import MODE
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.kernels.laws.forces import GAP
from flexband.mechanics.kernels.laws.states import MARK
from flexband.mechanics.kernels.state import rows_of_gaps
from flexband.mechanics.linearization.linearize import Equations, Linear


def contact_damping(equations: Equations, z: np.ndarray, linear: Linear) -> np.ndarray:
    """Return the damping matrix of all closed contacts, shape (coordinates, coordinates)."""
    laws = equations.system.structure.laws
    rows = rows_of_gaps.py_func(equations.state)
    contacts = np.flatnonzero(np.isin(laws.gap_kind, (GAP.length, GAP.angle)))
    z = z.copy()
    D = np.zeros_like(linear.D)
    z[equations.senses] = MODE.inactive
    z[rows.mode + contacts] = 1.0
    equations.loads(z[:, None])
    depths = -equations.work.z[rows.value + contacts, 0]
    for gap, depth in zip(contacts, depths, strict=True):
        if depth > 0:
            first = laws.parameter_start[laws.gap_law[gap]]
            K, exponent, _, _, ratio = equations.values.laws[first : first + 5, 0]
            n = _gradient(equations, z, rows.mode + gap)
            stiffness = exponent * K * depth ** (exponent - 1.0)
            mobility = n @ _acceleration(linear, equations.mass, n)
            if mobility > 0:
                D += 2.0 * ratio * np.sqrt(stiffness / mobility) * np.outer(n, n)
    return D


def _gradient(equations: Equations, z: np.ndarray, mode: int) -> np.ndarray:
    """Return the gradient of a gap: the generalized force of a contact whose force is 1."""
    states = np.repeat(z[:, None], WIDTH, axis=1)
    states[mode, 0] = -MARK.unit
    Q = equations.loads(states)
    return Q[:, 0] - Q[:, 1]


def _acceleration(linear: Linear, M: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return the acceleration by a force with the joints."""
    n = len(M)
    m = len(linear.Phi)
    matrix = np.block([[M, linear.Phi.T], [linear.Phi, np.zeros((m, m))]])
    return np.linalg.lstsq(matrix, np.append(force, np.zeros(m)), rcond=None)[0][:n]
