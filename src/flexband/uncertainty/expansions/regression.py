"""Sparse regression: few terms out of many, from fewer runs than there are terms.

Terms are taken one after the other by orthogonal matching, each the one that most lowers what is
left of all series together; the leave-one-out error says how many to take (Blatman and Sudret,
2011). A run's error in the fit to all others is r/(1 − h), with its residual r and its leverage h
in the fit to all runs. Where there are nearly as many terms as runs, P and N, its mean square is
too small, and it is corrected by T = N/(N − P) (1 + tr (AᵀA)⁻¹), with the terms' values A.

It is too small as well since the terms were chosen by the same runs, the more so the more there are
to choose from: at 48 runs and 900 candidates, noise is fitted as well as a response. So it counts
with the number of choices, as T e² C(K, P)^{3/N} for P of K candidates, and candidates of few kinds
are tried beside all of them.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
from scipy.special import gammaln

from flexband.uncertainty.expansions.hybrid import term_values
from flexband.uncertainty.expansions.polynomials import (
    chebyshev_values,
    hermite_norms,
    hermite_values,
)

MOST_CANDIDATES = 6000
HIGHEST_PURE = 3

MOST_TAKEN = 0.8
"""As a part of the runs."""

FOUND = 1e-14
"""Part of the energy below which what is left is round-off."""

DEPENDENT = 1e-2
"""Part of a candidate's energy that must be new for it to be taken."""

PREFER_LOW = 0.5
"""Factor of a candidate's merit for each order above one: low orders are likelier."""

CHOICES = 3.0
"""Weight of the number of choices, log C(K, P), over the runs."""


class Fit(NamedTuple):
    """The terms that were taken.

    Attributes
    ----------
    which : numbers of the candidates, shape (terms,).
    coefficients : shape (terms, series).
    left_out : the error of every run in the fit to all others, shape (runs, series).
    correction : √T.
    """

    which: np.ndarray
    coefficients: np.ndarray
    left_out: np.ndarray
    correction: float


def candidates(dimension: int) -> np.ndarray:
    """Return the orders of the terms to choose from, shape (terms, variables), the constant first.

    All up to the total order 3 where these are few enough, else up to 2 and those of order 3 in one
    variable; where pairs are too many, those of the first variables.
    """
    one = np.eye(dimension, dtype=int)
    found = [0 * one[:1]] + [k * one for k in range(1, HIGHEST_PURE + 1)]
    a, b = np.triu_indices(min(dimension, int(math.sqrt(2 * MOST_CANDIDATES))), 1)
    found.append(one[a] + one[b])
    if math.comb(dimension + 3, 3) <= MOST_CANDIDATES:
        triples = list(itertools.combinations(range(dimension), 3))
        found += [2 * one[a] + one[b], one[a] + 2 * one[b]]
        found += [one[np.array(triples)].sum(axis=1)] if triples else []
    return np.concatenate(found)


def normalized_values(index: np.ndarray, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
    """Return the terms at points of shape (points, n) and (points, m), shape (points, terms).

    They have unit mean square over ξ ~ N(0, I) and η = cos πu.
    """
    orders = index.max(axis=0)
    values = [chebyshev_values(q, x) for q, x in zip(orders, eta.T, strict=False)]
    values += [hermite_values(k, x) for k, x in zip(orders[len(values) :], xi.T, strict=True)]
    return term_values(values, index) / term_scales(index, eta.shape[1])


def term_scales(index: np.ndarray, interval_dimension: int) -> np.ndarray:
    """Return what `normalized_values` divides the terms by, shape (terms,)."""
    m = interval_dimension
    square = 0.5 ** (index[:, :m] > 0).sum(axis=1)
    return np.sqrt(square * hermite_norms(int(index.max()))[index[:, m:]].prod(axis=1))


def sparse_fit(
    values: np.ndarray, index: np.ndarray, series: np.ndarray, weight: np.ndarray | float = 1.0
) -> Fit:
    """Return the fit of the series by some of the candidates.

    Candidates are those of order one, those in one variable, all, or those of order one with the
    products of what does most: whichever are found best.

    Parameters
    ----------
    values : of the candidates in the runs, shape (runs, candidates), the constant first.
    index : their orders, shape (candidates, variables).
    series, weight : shape (runs, series), and how much each counts, shape (series,).
    """
    y, orders = compressed(weight * series), index.sum(axis=1)
    merit = PREFER_LOW ** np.maximum(orders - 1, 0)

    def path(kind: np.ndarray) -> tuple[float, float, np.ndarray]:
        error, correction, which = _taken(values[:, kind], y, merit[kind])
        return error, correction, np.flatnonzero(kind)[which]

    pure = np.count_nonzero(index, axis=1) <= 1
    found = [path(orders <= 1), path(pure), path(orders >= 0)]
    first = index[found[0][2][1:2]].any(axis=0)  # the variable that does most, if any
    found.append(path((orders <= 1) | (orders == 2) & index[:, first].any(axis=1)))
    _, correction, which = min(found, key=lambda path: path[0])
    coefficients, left_out = least_squares(values[:, which], series)
    return Fit(which, coefficients, left_out, correction)


def least_squares(A: np.ndarray, series: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients, and the error of every run in the fit to all others."""
    Q, R = np.linalg.qr(A)
    projected = Q.T @ series
    lever = np.minimum(np.sum(Q**2, axis=1), 1 - 1e-9)
    return np.linalg.solve(R, projected), (series - Q @ projected) / (1 - lever)[:, None]


def compressed(series: np.ndarray) -> np.ndarray:
    """Return as many series as runs or fewer, with the same products between the runs.

    The mean over the runs is left out: the constant term is always there.
    """
    rest = series - series.mean(axis=0)
    energy, modes = np.linalg.eigh(rest @ rest.T)
    keep = energy > FOUND * energy[-1]
    return modes[:, keep] * np.sqrt(energy[keep])


def _taken(values: np.ndarray, y: np.ndarray, merit: np.ndarray) -> tuple[float, float, np.ndarray]:
    """Return the error, √T, and which candidates are taken.

    The columns of Q span what is taken. Of the candidates only their products with what is left and
    the energy of their new part are kept up: a new column changes both by what it shares with them.
    """
    runs, choices = values.shape
    energy = np.sum(values**2, axis=0)
    rest, new, match = y, energy, values.T @ y
    Q, inverse = np.zeros((runs, 0)), np.zeros((0, 0))
    which: list[int] = []
    best = np.inf, 1.0, 1
    while len(which) < max(1, int(MOST_TAKEN * runs)):
        free = new > DEPENDENT * energy
        free[which] = False
        if not free.any():
            break
        gain = merit * np.sum(match**2, axis=1) / np.maximum(new, 1e-300)
        which.append(int(np.argmax(np.where(free, gain, -1.0))) if which else 0)
        Q, inverse = _with_column(Q, inverse, values[:, which[-1]])
        q = Q[:, -1]
        here, shared = q @ rest, values.T @ q
        rest, new = rest - np.outer(q, here), new - shared**2
        match = match - np.outer(shared, here)
        P = len(which)
        lever = np.minimum(np.sum(Q**2, axis=1), 1 - 1e-9)
        T = runs / (runs - P) * (1 + np.sum(inverse**2))
        error = T * np.sum((rest / (1 - lever)[:, None]) ** 2)
        error *= math.exp(CHOICES / runs * _log_choices(choices - 1, P - 1))
        if error < best[0]:
            best = error, math.sqrt(T), P
        if np.sum(rest**2) <= FOUND * np.sum(y**2):
            break
    return best[0], best[1], np.array(which[: best[2]])


def _with_column(
    Q: np.ndarray, inverse: np.ndarray, a: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return Q and R⁻¹ of A = Q R with a further column, twice orthogonalized."""
    along = Q.T @ a
    q = a - Q @ along
    again = Q.T @ q
    q, along = q - Q @ again, along + again
    length = np.linalg.norm(q)
    column = np.append(-inverse @ along, 1.0) / length
    inverse = np.pad(inverse, ((0, 1), (0, 1)))
    inverse[:, -1] = column
    return np.column_stack([Q, q / length]), inverse


def _log_choices(many: int, few: int) -> float:
    """Return log C(many, few)."""
    return float(gammaln(many + 1) - gammaln(few + 1) - gammaln(many - few + 1))
