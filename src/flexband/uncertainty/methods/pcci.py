"""Expansions in tensor products: PCCI and improved PCCI, and the orders of their variables."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace

import numpy as np
import xarray as xr

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_flag, check_integer
from flexband.errors import InputError
from flexband.uncertainty.expansions.direct import DirectExpansion
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.polynomials import chebyshev_zeros, scaled_chebyshev_zeros
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods.method import HELD, Evaluate, ExpansionMethod
from flexband.uncertainty.surrogates.axes import axes_of, series
from flexband.uncertainty.surrogates.surrogate import Surrogate

MAX_ORDER = 100
"""Norms of Hermite polynomials overflow not far above it."""

Order = int | Mapping[str, int]
"""One order for all variables of a kind, or one order per input, by name."""


class OrdersByName(dict[str, int]):
    """Orders by name, hashable like every field of a method."""

    def __hash__(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        return hash(frozenset(self.items()))


def order_text(order: Order) -> str:
    """Return the text of an order, or of the orders of all inputs, with slashes between them."""
    return "/".join(map(str, order.values())) if isinstance(order, Mapping) else str(order)


def checked_order(name: str, order: Order) -> Order:
    """Return an order, or the orders by name; raise `InputError` unless all are from 0 to 100."""
    if not isinstance(order, Mapping):
        return check_integer(name, order, 0, MAX_ORDER)
    orders = {
        key: check_integer(f"{name} of {key!r}", input_order, 0, MAX_ORDER)
        for key, input_order in order.items()
    }
    return OrdersByName(sorted(orders.items()))


def of_variables(name: str, order: Order, space: Space, *, random: bool) -> list[int]:
    """Return the order of every variable of a kind: that of its input."""
    inputs = space.of_kind(random=random)
    orders = order if isinstance(order, Mapping) else dict.fromkeys(inputs, order)
    if orders.keys() != inputs.keys():
        kind = "random" if random else "interval"
        raise InputError(
            f"{name} must name all {kind} inputs, {', '.join(inputs) or 'none'}; "
            f"got {', '.join(orders) or 'none'}"
        )
    return [orders[k] for k, input_ in inputs.items() for _ in range(input_.dimension)]


@frozen()
class PCCI(ExpansionMethod):
    """Polynomial-Chaos–Chebyshev-Interval method, Eqs. (11)–(18).

    Parameters
    ----------
    random_order, interval_order : orders k and q of the expansion in every random and interval
        variable: one number for all, or a mapping from the name of each random or interval input to
        its order. The method takes Π (k+1) Π (q+1) runs.
    correct : whether the error of step and elements is corrected and the error of the bands
        estimated, as by `AdaptivePCCI`. This takes 4 check runs, and for each of step and
        elements that is refined as many runs on finer discretizations as there are variables of
        order 1 or more, and 4; one more if both are.

    Raises
    ------
    InputError
        If an order is not a whole number from 0 to 100; in `propagate`, if a mapping does not name
        exactly the random or interval inputs, or with `correct` if the response has no
        `refinements`.

    Examples
    --------
    >>> inputs = {"a": fb.Interval(0.0, 1.0), "b": fb.Normal(0.0, 1.0)}
    >>> bands = fb.propagate(lambda a, b: np.exp(a) + b, inputs, fb.PCCI({"b": 1}, {"a": 5}))
    >>> bands["mean"].values.round(3)  # from 1 to e
    array([1.   , 2.718])
    """

    random_order: Order = 3
    interval_order: Order = 3
    correct: bool = field(default=False, kw_only=True)

    name = "PCCI"
    copies = 2.5

    @property
    def label(self) -> str:
        return f"{self.name} ({order_text(self.random_order)}, {order_text(self.interval_order)})"

    def __post_init__(self) -> None:
        for name in ("random_order", "interval_order"):
            object.__setattr__(self, name, checked_order(name, getattr(self, name)))
        check_flag("correct", self.correct)

    @staticmethod
    def interval_nodes(order: int) -> np.ndarray:
        """Return the points of an interval variable, Eq. (14)."""
        return chebyshev_zeros(check_integer("order", order, 0, MAX_ORDER))

    def orders(self, space: Space) -> tuple[list[int], list[int]]:
        """Return k of every random and q of every interval variable.

        A random input with K options has the order K − 1, which is exact.
        """
        random = of_variables("random_order", self.random_order, space, random=True)
        last = (family.last_order for family in space.families)
        random = [
            k if last_order == math.inf else int(last_order)
            for k, last_order in zip(random, last, strict=True)
        ]
        return random, of_variables("interval_order", self.interval_order, space, random=False)

    def runs(self, space: Space) -> int:
        """Return Π (k+1) Π (q+1), and 4 with `correct`."""
        product = math.prod(order + 1 for orders in self.orders(space) for order in orders)
        return product + HELD * self.correct

    def linear_runs(self, space: Space) -> int:
        """Return 1 and the number of variables of order 1 or more."""
        return 1 + sum(order > 0 for orders in self.orders(space) for order in orders)

    def expand(self, space: Space, evaluate: Evaluate) -> Surrogate:
        """Return the surrogate, with `truncation`, an indicator of the error of the expansion.

        With `correct` it tells what is corrected, and the error of its bands, as `AdaptivePCCI`
        does, with 4 check runs.
        """
        random_orders, interval_orders = self.orders(space)
        nodes = [self.interval_nodes(q) for q in interval_orders]
        random = space.families, random_orders
        points = HybridExpansion.design(*random, nodes)
        values = evaluate(*points)
        flat = values.values.reshape(len(values), -1)
        expansion = replace(HybridExpansion.fit(flat, *random, nodes), discs=space.discs)
        direct = DirectExpansion(np.arange(math.prod(axes_of(values).shape)), expansion)
        indicator = expansion.truncation().reshape(values.shape[1:])
        diagnostics = xr.Dataset({"truncation": (values.dims[1:], indicator)})
        surrogate = Surrogate(space, values[:0], (direct,), diagnostics)
        if not self.correct:
            return surrogate
        return evaluate.correct_surrogate(surrogate, (*points, series(values)), nodes)


@frozen()
class ImprovedPCCI(PCCI):
    """Improved PCCI: the points of interval variables reach their bounds, Eqs. (19)–(21).

    Parameters and number of runs are those of `PCCI`.
    """

    name = "improved PCCI"

    @staticmethod
    def interval_nodes(order: int) -> np.ndarray:
        """Return the points of an interval variable, Eq. (19)."""
        return scaled_chebyshev_zeros(check_integer("order", order, 0, MAX_ORDER))
