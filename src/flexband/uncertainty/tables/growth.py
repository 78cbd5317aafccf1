"""How much larger an error may be where the inputs are than where the rows of a table are.

What a fit misses is like a polynomial of the next order. Beyond the rows, as in the tails of
distributions or at the ends of intervals, what it misses of such a polynomial grows; so does what
cross-validation finds, at the outermost rows. The error grows by the ratio of both.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri

from flexband.uncertainty.expansions.families import Family, existing_terms
from flexband.uncertainty.expansions.regression.sparse_fit import normalized_values
from flexband.uncertainty.inputs.sampling import of_normals, sobol


def growth_beyond_rows(
    index: np.ndarray,
    points: tuple[np.ndarray, np.ndarray],
    families: Sequence[Family],
    fold: np.ndarray,
    weight: np.ndarray,
) -> float:
    """Return the error over the inputs as a multiple of that of cross-validation, at least 1.

    Half of all η are at the ends of their intervals, where most bounds are.

    Parameters
    ----------
    index : orders of the terms of the fit, η first.
    points : ξ and η of the rows.
    fold, weight : of each row, (rows,).
    """
    (xi, eta), count = points, 4096
    m = eta.shape[1]
    n = len(families)
    u = sobol(count, m + n, seed=5)
    inside = 2 * u[:, :m] - 1
    at_ends = np.where(np.abs(inside) < 0.5, 2 * inside, np.sign(inside))
    places = of_normals(ndtri(u[:, m:]), families), at_ends
    # What the fit misses of the next terms where the inputs are.
    next_orders = np.eye(m + n, dtype=int) * (1 + _highest_alone(index))[:, None]
    next_orders = next_orders[existing_terms(next_orders, families)]
    everything = np.concatenate([index, next_orders])
    of_rows, of_places = (
        normalized_values(everything, *at, families) for at in ((xi, eta), places)
    )
    terms, next_terms = np.split(of_rows, [len(index)], axis=1)
    beyond = of_places[:, len(index) :] - of_places[:, : len(index)] @ _solve(terms, next_terms)
    # The same in cross-validation, for terms that the rows show.
    missed = np.empty_like(next_terms)
    for k in np.unique(fold):
        rows = fold == k
        missed[rows] = next_terms[rows] - terms[rows] @ _solve(terms[~rows], next_terms[~rows])
    size = weight @ missed**2
    mask = size > 1e-12 * np.mean(next_terms**2, axis=0)
    growth = np.mean(beyond**2, axis=0)[mask] / size[mask]
    return float(np.sqrt(max(1.0, growth.max(initial=1.0))))


def _solve(terms: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the coefficients of values in terms by least squares."""
    return np.linalg.lstsq(terms, values, rcond=1e-10)[0]


def _highest_alone(index: np.ndarray) -> np.ndarray:
    """Return the highest order of each variable in terms of it alone."""
    alone = index[np.count_nonzero(index, axis=1) == 1]
    return alone.max(axis=0, initial=0)
