"""Which constraints are redundant, from the rank of their Jacobian in one configuration."""

from __future__ import annotations

import numpy as np
from scipy.linalg import null_space

from flexband.mechanics.assembly import System

RANK = 1e-9
"""Singular values below this part of the largest count as zero."""


def jacobian(system: System, state: np.ndarray, sample: int = 0) -> np.ndarray:
    """Return Φ_q at time zero, shape (multipliers, coordinates).

    Parameters
    ----------
    state : [1, q, …] of the sample, shape (rows,).
    """
    terms, count = system.structure.terms, system.structure.coordinates
    rows = system.rows["coefficient"]
    c = rows[:, min(sample, rows.shape[1] - 1)].copy()
    for t, f in enumerate(terms.f):
        if f > 0:
            values = np.atleast_1d(np.asarray(system.functions[f - 1](0.0), dtype=float))
            c[t] *= values[min(sample, len(values) - 1)]
    dense = np.zeros((1 + count + system.structure.multipliers, 1 + count))
    np.add.at(dense, (terms.k, terms.i), c * state[terms.j])
    np.add.at(dense, (terms.k, terms.j), c * state[terms.i])
    return dense[1 + count :, 1:]


def dependent(system: System, state: np.ndarray, sample: int = 0) -> tuple[int, list[str]]:
    """Return how many constraints are redundant, and the joints among those that depend on others.

    Their multipliers are not unique: forces may be shifted from one to the other.
    """
    matrix = jacobian(system, state, sample)
    matrix = matrix / np.maximum(np.linalg.norm(matrix, axis=1, keepdims=True), 1e-300)
    ways = null_space(matrix.T, rcond=RANK)
    involved = np.flatnonzero(np.abs(ways).max(axis=1, initial=0.0) > 1e-6)
    owners = dict.fromkeys(system.constraints[k] for k in involved)
    return ways.shape[1], [owner for owner in owners if owner.startswith("joint")]
