"""Expansions by least squares: terms up to a total or hyperbolic order, from a few runs each."""

from __future__ import annotations

import math
from dataclasses import field

import numpy as np
import xarray as xr

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_flag, check_integer, check_numbers
from flexband.basics.words import are, number_of
from flexband.errors import InputError, RunError
from flexband.uncertainty.expansions.direct import DirectExpansion
from flexband.uncertainty.expansions.families import existing_terms
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.index_sets import bounded_terms
from flexband.uncertainty.expansions.regression.sparse_fit import (
    least_squares,
    normalized_values,
    term_scales,
)
from flexband.uncertainty.inputs.sampling import nested_points
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods.method import HELD, Evaluate, ExpansionMethod
from flexband.uncertainty.methods.pcci import MAX_ORDER
from flexband.uncertainty.surrogates.axes import series, units_of
from flexband.uncertainty.surrogates.diagnostics import (
    least_error,
    missed_part,
    share,
    trust,
    unseen_steps,
)
from flexband.uncertainty.surrogates.surrogate import Surrogate


@frozen()
class RegressionPCCI(ExpansionMethod):
    """Regression: the terms of low total order, by least squares, instead of a full tensor product.

    The expansion of Eq. (11) contains the terms whose orders ν in all variables, random and
    interval, satisfy Σ ν_v^q ≤ p^q: all terms up to the total order p for q = 1, and with q < 1
    fewer products of several variables (a hyperbolic basis). Runs are at points of a scrambled
    Sobol' sequence; three tenths of the values of each interval variable are at its bounds.

    Parameters
    ----------
    order : p.
    q_norm : q, above 0 and at most 1.
    oversampling : runs per term, above 1.
    seed : seed of the sequence.
    correct : as of `PCCI`; the finer runs are, for each of step and elements, twice as many as
        there are variables, and 5.

    Raises
    ------
    InputError
        If a number is not as stated, or the runs would not be more than the terms; in `propagate`,
        if there are more than 5000 terms, the runs do not determine all of them, or with `correct`
        if the response has no `refinements`.

    Examples
    --------
    >>> inputs = {name: fb.Normal(1.0, 0.1) for name in "abcd"}
    >>> bands = fb.propagate(lambda **x: sum(x.values()), inputs, fb.methods.RegressionPCCI(1))
    >>> bands["error_bar"].values.round(4)  # 4 ± √4 · 0.1
    array([3.8, 4.2])
    """

    order: int = 3
    q_norm: float = 1.0
    oversampling: float = 2.0
    seed: int = 0
    correct: bool = field(default=False, kw_only=True)

    name = "regression PCCI"
    copies = 3.2
    skips_failed = True

    def __post_init__(self) -> None:
        check_flag("correct", self.correct)
        object.__setattr__(self, "order", check_integer("order", self.order, 0, MAX_ORDER))
        object.__setattr__(self, "seed", check_integer("seed", self.seed, 0))
        for name in ("q_norm", "oversampling"):
            object.__setattr__(self, name, float(check_numbers(name, getattr(self, name))))
        if not 0 < self.q_norm <= 1:
            raise InputError(
                f"q_norm must be above 0 and at most 1 (all terms up to the total order); "
                f"got {self.q_norm:g}"
            )
        if self.oversampling <= 1:
            raise InputError(
                f"oversampling must be above 1: a fit needs more runs than terms; "
                f"got {self.oversampling:g}"
            )

    @property
    def label(self) -> str:
        return f"{self.name} ({self.order}{(f', q = {self.q_norm:g}' if self.q_norm < 1 else '')})"

    def index(self, space: Space) -> np.ndarray:
        """Return the orders of the terms in every variable, η first, shape (terms, m + n)."""
        max_terms = 5000
        dimension = space.interval_dimension + space.random_dimension
        try:
            index = bounded_terms(dimension, self.order, self.q_norm, max_terms)
        except InputError as error:
            raise InputError(f"{error}{space.advice_on_fields}") from None
        return index[existing_terms(index, space.families)]

    def runs(self, space: Space) -> int:
        """Return the number of terms times `oversampling`, rounded up, and 4 with `correct`."""
        return self.fitted_runs(space) + HELD * self.correct

    def fitted_runs(self, space: Space) -> int:
        """Return the number of terms times `oversampling`, rounded up."""
        return math.ceil(self.oversampling * len(self.index(space)))

    def linear_runs(self, space: Space) -> int:
        """Return twice the number of terms of order 0 and 1, or all runs."""
        return min(self.fitted_runs(space), 2 * super().linear_runs(space))

    def expand(self, space: Space, evaluate: Evaluate) -> Surrogate:
        """Return the surrogate, with the error that is expected of it.

        A run's error in the fit to all others is known without another fit (leave-one-out). As the
        terms are given, its root mean square is the error at a new point; the part of it that bands
        are off by is that of the other methods.
        `trusted` is false for outputs of which more than half of the variation is missed.
        """
        # Run at points that earlier runs do not cover.
        index = self.index(space)
        m = space.interval_dimension
        earlier_runs = evaluate.earlier_runs(self.fitted_runs(space) // 2)
        new = self.fitted_runs(space) - len(earlier_runs.xi)
        points = nested_points(new, m, space.families, self.seed, space.discs)
        values = evaluate(*points)
        if len(earlier_runs.xi):
            points = (
                np.concatenate([points[0], earlier_runs.xi]),
                np.concatenate([points[1], earlier_runs.eta]),
            )
            earlier_values = earlier_runs.values.reshape(-1, *values.shape[1:])
            values = xr.concat([values, values[:0].pad(sample=(0, len(earlier_values)))], "sample")
            values.values[new:] = earlier_values
        # Leave out runs that failed.
        finite_mask = np.isfinite(series(values)).all(axis=(1, 2))
        if not finite_mask.all():
            values = values[finite_mask]
            points = (points[0][finite_mask], points[1][finite_mask])
        if len(values) <= len(index):
            raise RunError(
                f"{are(len(values), 'run')} left, too few for {number_of(len(index), 'term')}", {}
            )
        # Fit the terms, and predict each run from all others.
        terms = normalized_values(index, *points, space.families)
        check_determined(terms)
        signal = series(values)
        flat = signal.reshape(len(signal), -1)
        coefficients, left_out = least_squares(terms, flat)
        coefficients /= term_scales(index, space.families)[:, None]
        outputs = np.arange(signal.shape[1])
        polynomials = HybridExpansion(space.families, index, coefficients, space.discs)
        expansion = DirectExpansion(outputs, polynomials)
        missed = left_out.reshape(signal.shape)
        error = share(m) * np.sqrt(np.einsum("rot,rot->ot", missed, missed) / len(missed))
        min_error = least_error(signal, units_of(values))[:, None]
        error = np.maximum(error, np.maximum(min_error, unseen_steps(signal)))
        error = error.reshape(values.shape[1:])
        trusted = trust(
            values,
            missed_part(missed, signal, units_of(values)),
            "its variation in runs that were not fitted",
        )
        dims = values.dims[1:]
        diagnostics = xr.Dataset(
            {
                "mean_expected_error": (dims, error),
                "error_bar_expected_error": (dims, error),
                "trusted": trusted["trusted"],
            },
            attrs={"terms": len(index), **trusted.attrs},
        )
        surrogate = Surrogate(space, values[:0], (expansion,), diagnostics)
        return (
            evaluate.correct_surrogate(surrogate, (*points, signal)) if self.correct else surrogate
        )


def check_determined(terms: np.ndarray) -> None:
    """Raise `InputError` if runs do not determine the coefficients of terms, (runs, terms)."""
    # what is new in a term, in the runs, as a fraction of the same of the term that is newest
    min_pivot = 1e-8
    N, P = terms.shape
    pivots = np.abs(np.diag(np.linalg.qr(terms, mode="r")))
    if pivots.min() < min_pivot * pivots.max():
        raise InputError(
            f"{number_of(N, 'run')} cannot determine {number_of(P, 'term')}; choose a larger "
            "oversampling or a lower order"
        )
