"""Sparse regression: few terms out of many, from fewer runs than there are terms.

Terms are taken one after the other by orthogonal matching, each the one that most reduces the
residual of all series together; the leave-one-out error determines how many to take (Blatman and
Sudret, 2011). A run's error in the fit to all others is r/(1 − h), with its residual r and its
leverage h in the fit to all runs. If there are nearly as many terms P as runs N, its mean square is
too small; it is corrected by the factor T = N/(N − P) (1 + tr (AᵀA)⁻¹), with the terms' values A.

It is also too small because the same runs have chosen the terms, the more so the more candidates
there are: with 48 runs and 900 candidates, noise is fitted as well as a response. So sets of terms
are compared by T e² C(K, P)^{3/N} for P of K candidates, which grows with the number of choices,
and small sets of candidates are tried besides all of them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.expansions.families import Family, mean_squares
from flexband.uncertainty.expansions.hybrid import term_values
from flexband.uncertainty.expansions.polynomials import chebyshev_values
from flexband.uncertainty.expansions.regression.few_variables import sets_of_variables


class SparseFitOptions(NamedTuple):
    """How terms are chosen."""

    max_candidates: int = 6000
    """Terms to choose from."""
    max_pure_order: int = 3
    """Highest order of candidates in one variable."""
    max_term_share: float = 0.8
    """Most terms, as a fraction of the runs."""
    round_off: float = 1e-14
    """Fraction of the energy below which a residual is round-off."""
    min_new_energy: float = 1e-2
    """Fraction of a candidate's energy that must be orthogonal to the terms taken before it."""
    merit_per_order: float = 0.5
    """Factor of a candidate's merit for each order above one: low orders are more likely."""
    few_variables: int = 4
    """With more, terms of a few variables alone are tried, too."""
    choice_weight: float = 3.0
    """Weight of the number of choices, log C(K, P), over the runs."""


class SparseFit(NamedTuple):
    """A sparse fit."""

    which: np.ndarray  # numbers of the candidates that were taken, shape (terms,)
    coefficients: np.ndarray  # shape (terms, series)
    correction: float  # √T

    @property
    def active_terms(self) -> np.ndarray:
        """Numbers of the candidates whose coefficients are not all zero."""
        return self.which[self.coefficients.any(axis=1)]


def candidates(dimension: int, *, options: SparseFitOptions = SparseFitOptions()) -> np.ndarray:
    """Return the orders of the terms to choose from, (terms, variables), the constant first.

    These are all up to the total order 3, or 2 and those of order 3 in one variable, or less.
    """
    unit = np.eye(dimension, dtype=int)
    terms = [0 * unit[:1]] + [k * unit for k in range(1, options.max_pure_order + 1)]
    a, b = np.triu_indices(min(dimension, int(math.sqrt(2 * options.max_candidates))), 1)
    terms.append(unit[a] + unit[b])
    if math.comb(dimension + 3, 3) <= options.max_candidates:
        triples = list(itertools.combinations(range(dimension), 3))
        terms += [2 * unit[a] + unit[b], unit[a] + 2 * unit[b]]
        terms += [unit[np.array(triples)].sum(axis=1)] if triples else []
    return np.concatenate(terms)


def normalized_values(
    index: np.ndarray, xi: np.ndarray, eta: np.ndarray, families: Sequence[Family]
) -> np.ndarray:
    """Return terms of unit mean square over ξ and η = cos πu at points, shape (points, terms)."""
    orders = index.max(axis=0)
    values = [chebyshev_values(q, x) for q, x in zip(orders, eta.T, strict=False)]
    random = zip(families, orders[len(values) :], xi.T, strict=True)
    values += [family.values(k, x) for family, k, x in random]
    return term_values(values, index, len(xi)) / term_scales(index, families)


def term_scales(index: np.ndarray, families: Sequence[Family]) -> np.ndarray:
    """Return the root mean squares of the terms that `normalized_values` divides by, (terms,)."""
    m = index.shape[1] - len(families)
    square = 0.5 ** (index[:, :m] > 0).sum(axis=1)
    return np.sqrt(square * mean_squares(index[:, m:], families))


def sparse_fit(
    values: np.ndarray,
    index: np.ndarray,
    series: np.ndarray,
    weight: np.ndarray | float = 1.0,
    *,
    options: SparseFitOptions = SparseFitOptions(),
) -> SparseFit:
    """Return the best of some fits of weighted series, (runs, series), by candidates.

    The candidates, (runs, candidates) with orders `index`, are those of order one, those in one
    variable, all, those of order one with the products of the most important variable, and those of
    a few variables alone.
    """
    y, orders = weight * series, index.sum(axis=1)
    y -= y.mean(axis=0)  # the constant term is always taken
    y = principal(y, options.round_off)
    merit = options.merit_per_order ** np.maximum(orders - 1, 0)

    def path(kind: np.ndarray) -> tuple[float, float, np.ndarray]:
        error, correction, which = _take_candidates(values[:, kind], y, merit[kind], options)
        return error, correction, np.flatnonzero(kind)[which]

    pure = np.count_nonzero(index, axis=1) <= 1
    fits = [path(orders <= 1), path(pure), path(orders >= 0)]
    first = index[fits[0][2][1:2]].any(axis=0)  # the most important variable, if any
    fits.append(path((orders <= 1) | (orders == 2) & index[:, first].any(axis=1)))
    if index.shape[1] > options.few_variables:
        for variables in sets_of_variables(index, values, y):
            others = ~np.isin(np.arange(index.shape[1]), variables)
            fits.append(path(np.asarray(~index[:, others].any(axis=1))))
    _, correction, which = min(fits, key=lambda path: path[0])
    Q, R = np.linalg.qr(values[:, which])
    return SparseFit(which, np.linalg.solve(R, Q.T @ series), correction)


def least_squares(A: np.ndarray, series: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients and the error of every run in the fit to all others."""
    Q, R = np.linalg.qr(A)
    products = Q.T @ series
    lever = np.minimum(np.sum(Q**2, axis=1), 1 - 1e-9)
    errors = Q @ products
    np.subtract(series, errors, out=errors)
    errors /= (1 - lever)[:, None]
    return np.linalg.solve(R, products), errors


def principal(series: np.ndarray, round_off: float = 1e-14) -> np.ndarray:
    """Return at most as many series as rows, with equal products but for `round_off` energy."""
    energy, modes = np.linalg.eigh(series @ series.T)
    keep = energy > round_off * energy[-1]
    return modes[:, keep] * np.sqrt(energy[keep])


def _take_candidates(
    values: np.ndarray, y: np.ndarray, merit: np.ndarray, options: SparseFitOptions
) -> tuple[float, float, np.ndarray]:
    """Return the error, √T, and the numbers of the candidates that are taken.

    The columns of Q span the terms taken. For each candidate its products with the residual and the
    energy orthogonal to Q are updated with every new column.
    """
    runs, choices = values.shape
    energy = np.sum(values**2, axis=0)
    residual = y
    new = energy
    match = values.T @ y
    Q = np.zeros((runs, 0))
    inverse = np.zeros((0, 0))
    which: list[int] = []
    best = np.inf, 1.0, 1
    while len(which) < max(1, int(options.max_term_share * runs)):
        # Take the candidate that reduces the residual most.
        candidate_mask = new > options.min_new_energy * energy
        candidate_mask[which] = False
        if not candidate_mask.any():
            break
        gain = merit * np.sum(match**2, axis=1) / np.maximum(new, 1e-300)
        which.append(int(np.argmax(np.where(candidate_mask, gain, -1.0))) if which else 0)
        Q, inverse = _with_column(Q, inverse, values[:, which[-1]])
        # Update residual, energies and products with the new column.
        q = Q[:, -1]
        projection = q @ residual
        overlap = values.T @ q
        residual = residual - np.outer(q, projection)
        new = new - overlap**2
        match = match - np.outer(overlap, projection)
        # Judge the fit by the corrected leave-one-out error.
        P = len(which)
        lever = np.minimum(np.sum(Q**2, axis=1), 1 - 1e-9)
        T = runs / (runs - P) * (1 + np.sum(inverse**2))
        error = T * np.sum((residual / (1 - lever)[:, None]) ** 2)
        error *= math.exp(options.choice_weight / runs * math.log(math.comb(choices - 1, P - 1)))
        if error < best[0]:
            best = error, math.sqrt(T), P
        if np.sum(residual**2) <= options.round_off * np.sum(y**2):
            break
    return best[0], best[1], np.array(which[: best[2]])


def _with_column(
    Q: np.ndarray, inverse: np.ndarray, a: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return Q and R⁻¹ of A = Q R with a further column, twice orthogonalized."""
    along = Q.T @ a
    q = a - Q @ along
    correction = Q.T @ q
    q = q - Q @ correction
    along = along + correction
    length = np.linalg.norm(q)
    column = np.append(-inverse @ along, 1.0) / length
    inverse = np.pad(inverse, ((0, 1), (0, 1)))
    inverse[:, -1] = column
    return np.column_stack([Q, q / length]), inverse
