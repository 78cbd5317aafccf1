"""Random variables as interval variables: an expansion on a box of all its variables."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, eye_array

from flexband.uncertainty.expansions.bounds.scan import lobatto
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.polynomials import chebyshev_values


def on_box(expansion: HybridExpansion, lower: np.ndarray, upper: np.ndarray) -> HybridExpansion:
    """Return the same polynomial without random variables, in η and in t with ξ from a to b.

    Parameters
    ----------
    lower, upper : a and b of ξ = (a + b)/2 + t (b − a)/2, shape (n,).
    """
    m, index = expansion.interval_dimension, expansion.index
    transform = eye_array(len(index), format="csr")
    for k, family in enumerate(expansion.families):
        orders = index[:, m + k]
        highest = int(orders.max(initial=0))
        t = lobatto(highest + 1)
        xi = (lower[k] + upper[k]) / 2 + t * (upper[k] - lower[k]) / 2
        matrix = np.linalg.solve(chebyshev_values(highest, t), family.values(highest, xi))
        row, col = np.nonzero(np.arange(highest + 1)[:, None] <= orders)
        new = index[col]
        new[:, m + k] = row
        index, which = np.unique(new, axis=0, return_inverse=True)
        entries = matrix[row, orders[col]], (which.ravel(), col)
        transform = csr_array(entries, shape=(len(index), len(orders))) @ transform
    return HybridExpansion((), index, np.asarray(transform @ expansion.coefficients))
