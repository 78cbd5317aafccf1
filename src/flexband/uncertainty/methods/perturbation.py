"""First-order perturbation of random variables about their means, with intervals in Chebyshev."""

from __future__ import annotations

import math
from dataclasses import field

import numpy as np
import xarray as xr

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_flag, check_numbers
from flexband.errors import InputError
from flexband.uncertainty.expansions.direct import DirectExpansion
from flexband.uncertainty.expansions.hybrid import (
    HybridExpansion,
    tensor_index,
    tensor_points,
    transform_tensor,
)
from flexband.uncertainty.expansions.polynomials import (
    chebyshev_values,
    chebyshev_zeros,
    scaled_chebyshev_zeros,
)
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods.method import HELD, Evaluate, ExpansionMethod
from flexband.uncertainty.methods.pcci import Order, checked_order, of_variables, order_text
from flexband.uncertainty.surrogates.axes import axes_of, series
from flexband.uncertainty.surrogates.surrogate import Surrogate


@frozen()
class PerturbationChebyshev(ExpansionMethod):
    """The perturbation–Chebyshev method: random variables to first order, intervals in Chebyshev.

    At fixed interval variables the response is linearized about the means of the random variables,

        u(ξ) ≈ u(E ξ) + Σ ∂u/∂ξ_i (ξ_i − E ξ_i),   μ = u(E ξ),   σ² = Σ (∂u/∂ξ_i)² Var ξ_i,

    with central differences. u(E ξ) and ∂u/∂ξ_i are expanded in Chebyshev polynomials of the
    interval variables. What is linearized is the response as a function of the standard variables
    ξ. It is exact where the response is linear in them. Curvature moves the mean, which this method
    does not see; that of a skewed input itself, such as `LogNormal`, counts too.

    Parameters
    ----------
    interval_order : order q of the expansion in every interval variable: one number for all, or a
        mapping from the name of each interval input to its order. The method takes
        (1 + 2n) Π (q+1) runs, with n random variables.
    step : half of the distance of central differences, in standard deviations.
    improved : whether the points reach the bounds, Eq. (19), or are Chebyshev zeros, Eq. (14).
    correct : as of `PCCI`.

    Raises
    ------
    InputError
        If an order is not a whole number from 0 to 100, or the step is not above 0 and at most 1;
        in `propagate`, if a mapping does not name exactly the interval inputs, or with `correct` if
        the response has no `refinements`.

    Examples
    --------
    >>> inputs = {"a": fb.Interval(0.0, 1.0), "b": fb.Normal(0.0, 0.1)}
    >>> bands = fb.propagate(lambda a, b: a + 2 * b, inputs, fb.methods.PerturbationChebyshev(1))
    >>> bands["error_bar"].values.round(4)
    array([-0.2,  1.2])
    """

    interval_order: Order = 3
    step: float = 0.1
    improved: bool = False
    correct: bool = field(default=False, kw_only=True)

    name = "perturbation–Chebyshev"
    copies = 2.6

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "interval_order", checked_order("interval_order", self.interval_order)
        )
        step = float(check_numbers("step", self.step))
        if not 0 < step <= 1:
            raise InputError(f"step must be above 0 and at most 1 standard deviation; got {step:g}")
        object.__setattr__(self, "step", step)
        for name in ("improved", "correct"):
            check_flag(name, getattr(self, name))

    @property
    def label(self) -> str:
        return (
            f"{self.name} ({order_text(self.interval_order)}"
            f"{(', improved' if self.improved else '')})"
        )

    def runs(self, space: Space) -> int:
        """Return (1 + 2n) Π (q+1), and 4 with `correct`."""
        product = math.prod(q + 1 for q in self.orders(space))
        return (1 + 2 * space.random_dimension) * product + HELD * self.correct

    def orders(self, space: Space) -> list[int]:
        """Return q of every interval variable."""
        return of_variables("interval_order", self.interval_order, space, random=False)

    def linear_runs(self, space: Space) -> int:
        """Return 1 and the number of variables, but for intervals of order 0."""
        return 1 + space.random_dimension + sum(q > 0 for q in self.orders(space))

    def expand(self, space: Space, evaluate: Evaluate) -> Surrogate:
        """Return the surrogate, with `truncation`, an indicator of what the expansion leaves out.

        It is the size of the terms of highest order in an interval variable, as for `PCCI`, and of
        the curvature ½ ∂²u/∂ξ_i² Var ξ_i, which moves the mean. Products of random variables do not
        show in it.
        """
        orders = self.orders(space)
        zeros = scaled_chebyshev_zeros if self.improved else chebyshev_zeros
        nodes = [zeros(q) for q in orders]
        xi, linear, bend = self._differences(space)
        eta = tensor_points(nodes)
        points = np.tile(xi, (len(eta), 1)), np.repeat(eta, len(xi), axis=0)
        values = evaluate(*points)
        flat = values.values.reshape(len(values), -1)
        chebyshev = [np.linalg.inv(chebyshev_values(len(x) - 1, x)) for x in nodes]
        n = space.random_dimension
        terms = tensor_index(orders)
        first = np.eye(n + 1, n, -1, dtype=int)  # the constant, and order 1 in each ξ
        index = np.hstack([np.repeat(terms, n + 1, axis=0), np.tile(first, (len(terms), 1))])
        coefficients = transform_tensor(flat, [*chebyshev, linear])
        expansion = HybridExpansion(space.families, index, coefficients, space.discs)
        # The indicator of what is left out.
        curved = np.abs(bend @ flat.reshape(len(eta), len(xi), -1)).sum(axis=1).max(axis=0)
        highest = np.asarray(expansion.highest()[: len(orders)].any(axis=0))
        indicator = curved + expansion.size_of(highest)
        direct = DirectExpansion(np.arange(math.prod(axes_of(values).shape)), expansion)
        diagnostics = xr.Dataset(
            {"truncation": (values.dims[1:], indicator.reshape(values.shape[1:]))}
        )
        surrogate = Surrogate(space, values[:0], (direct,), diagnostics)
        return (
            evaluate.correct_surrogate(surrogate, (*points, series(values)))
            if self.correct
            else surrogate
        )

    def _differences(self, space: Space) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ξ at which to run, (1 + 2n, n), and the differences of values there.

        These are the coefficients of 1 and of every P_1(ξ_i), (1 + n, 1 + 2n), and
        ½ ∂²u/∂ξ_i² Var ξ_i, (n, 1 + 2n). P_1 is a (ξ − E ξ), with Var ξ = γ_1 / a².
        """
        families = space.families
        n = space.random_dimension
        mean = np.array([family.gauss(1)[0][0] for family in families])
        a = np.array(
            [np.diff(family.values(1, np.array([0.0, 1.0]))[:, 1])[0] for family in families]
        )
        h = self.step * np.sqrt([family.norms(1)[1] for family in families]) / np.abs(a)
        ahead = mean + np.diag(h)
        behind = mean - np.diag(h)
        center = mean.reshape(1, n)
        zero = np.zeros((n, 1))
        identity = np.eye(n)
        slope = identity / (2 * h * a)
        linear = np.block([[np.eye(1), zero.T, zero.T], [zero, slope, -slope]])
        bend = np.hstack([zero - 1, identity / 2, identity / 2]) / self.step**2
        return np.concatenate([center, ahead, behind]), linear, bend
