"""Redundant constraints, from the rank of their Jacobian in one configuration."""

from __future__ import annotations

import numpy as np
from scipy.linalg import null_space

from flexband.mechanics.assembly.system import System

RANK = 1e-9
"""Singular values below this fraction of the largest one count as zero."""


def jacobian(system: System, z: np.ndarray, sample: int = 0) -> np.ndarray:
    """Return Φ_q at time zero, shape (multipliers, coordinates).

    Parameters
    ----------
    z : the state of the sample, shape (rows,).
    """
    terms, state = system.structure.terms, system.structure.state
    rows, count = system.values.terms, state.coordinates
    c = rows[:, min(sample, rows.shape[1] - 1)].copy()
    for t, f in enumerate(terms.f):
        if f > 0:
            values = np.atleast_1d(np.asarray(system.functions[f - 1](0.0), dtype=float))
            c[t] *= values[min(sample, len(values) - 1)]
    dense = np.zeros((state.angle, 1 + count))
    plain, vectors = slice(terms.polynomials), system.structure.vectors
    k, i, j = terms.k[plain], terms.i[plain], terms.j[plain]
    np.add.at(dense, (k, i), c[plain] * z[j])
    np.add.at(dense, (k, j), c[plain] * z[i])
    x, y = (v[:, min(sample, v.shape[1] - 1)] for v in system.values.vectors)
    for t in range(terms.polynomials, len(terms.k)):
        a = terms.j[t] - state.angle
        own = slice(vectors.start[a], vectors.start[a + 1])
        q = z[vectors.coordinate[own]]
        nx, ny = x[own] @ q, y[own] @ q
        square = nx * nx + ny * ny
        gradient = (nx * y[own] - ny * x[own]) / square
        if vectors.length[a]:
            gradient = (nx * x[own] + ny * y[own]) / np.sqrt(square)
        np.add.at(dense, (terms.k[t], vectors.coordinate[own]), c[t] * gradient)
    return dense[1 + count :, 1:]


def dependent(system: System, z: np.ndarray, sample: int = 0) -> tuple[int, list[str]]:
    """Return the number of redundant constraints, and the joints among the dependent ones.

    Their multipliers are not unique: forces can be shifted from one joint to another.
    """
    matrix = jacobian(system, z, sample)
    matrix = matrix / np.maximum(np.linalg.norm(matrix, axis=1, keepdims=True), 1e-300)
    ways = null_space(matrix.T, rcond=RANK)
    involved = np.flatnonzero(np.abs(ways).max(axis=1, initial=0.0) > 1e-6)
    owners = dict.fromkeys(system.constraints[k] for k in involved)
    return ways.shape[1], [owner for owner in owners if owner.startswith("joint")]
