"""Models of lower and of next order beside an expansion: how far they differ shows its error."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt

import numpy as np
from numpy.polynomial import chebyshev

from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion, tensor_values
from flexband.uncertainty.phases.layout import PartColumns


@dataclass(frozen=True)
class PartModels:
    """The expansion of parts through the runs of a design, and others of the same runs.

    Attributes
    ----------
    columns : those of the parts.
    values : the parts in the runs of the design, shape (runs, series).
    families, random_orders : polynomials and order of each random variable.
    nodes : points of each interval variable.
    """

    columns: PartColumns
    values: np.ndarray
    families: Sequence[Family]
    random_orders: Sequence[int]
    nodes: Sequence[np.ndarray]

    @cached_property
    def full(self) -> HybridExpansion:
        """The expansion through the runs."""
        return HybridExpansion.fit(self.values, self.families, self.random_orders, self.nodes)

    @cached_property
    def _lower_terms(self) -> np.ndarray:
        """Which terms the lower model has: those up to the largest order of a variable in total.

        If these are all terms, as with one variable, those below the largest order.
        """
        total, most = self.full.index.sum(axis=1), max(self.full.orders, default=0)
        keep = total <= most
        return keep if not keep.all() else total < max(most, 1)

    @cached_property
    def _lower_design(self) -> np.ndarray:
        """The terms of the lower model in the runs, shape (runs, terms)."""
        xi, eta = HybridExpansion.design(self.families, self.random_orders, self.nodes)
        terms = tensor_values([self.full.chebyshev(eta), self.full.orthogonal(xi)])
        return terms[:, self._lower_terms]

    def lower(self) -> HybridExpansion:
        """Return the lower model: the least-squares fit of fewer terms."""
        coefficients = np.zeros((self._lower_terms.size, self.values.shape[1]))
        coefficients[self._lower_terms] = np.linalg.lstsq(self._lower_design, self.values)[0]
        return replace(self.full, coefficients=coefficients)

    def left_out(self) -> np.ndarray:
        """Return every run as the lower model of all other runs predicts it, (runs, series).

        Its error is r/(1 − h), with the run's residual r and leverage h in the fit to all runs.
        """
        project = self._lower_design @ np.linalg.pinv(self._lower_design)
        lever = 1 - np.minimum(np.diag(project), 1 - 1e-9)
        return self.values + (project @ self.values - self.values) / lever[:, None]

    def next_order(self, checked: np.ndarray, xi: np.ndarray, eta: np.ndarray) -> HybridExpansion:
        """Return the expansion with terms of the next order, fitted to the parts of check runs.

        The terms c_v B_v vanish in the runs of the design. Of all that meet the check runs, those
        of least Σ_v |c_v|²/w_v are taken, where w_v is the energy of the highest terms in variable
        v: the variable with the largest curvature so far is expected to have the largest next term.
        """
        miss = checked - self.full.evaluate(xi, eta)
        B, highest = self._next_values(xi, eta), self.full.highest()
        square = self.full.coefficients**2
        energy = highest[np.array(self.full.orders) > 0].astype(float) @ square
        added = np.zeros((B.shape[1], miss.shape[1]))
        for series in map(np.ravel, self.columns.parts(miss.shape[1])):
            w = energy[:, series].sum(axis=1)
            w = w / max(w.sum(), 1e-300) + 1e-6
            gain = (w[:, None] * B.T) @ np.linalg.pinv((B * w) @ B.T, rcond=1e-3)
            added[:, series] = gain @ miss[:, series]
        corrected = self.full
        for v, orders, own in self._next_terms(added):
            index = orders[:, None] * (np.arange(len(self.full.orders)) == v)
            corrected = corrected + HybridExpansion(tuple(self.families), index, own)
        return corrected

    def _next_values(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return B_v of every variable that is expanded, shape (points, variables), η first.

        Π_i (η − η_i), scaled to the largest value one, and P_{k+1}(ξ)/√γ_{k+1}.
        """
        values = [np.zeros((len(xi), 0))]
        for nodes, e in zip(self.nodes, eta.T, strict=True):
            if len(nodes) > 1:
                product = np.prod(e[:, None] - nodes, axis=1, keepdims=True)
                values.append(product / _largest(nodes))
        for family, k, x in zip(self.families, self.random_orders, xi.T, strict=True):
            if k:
                values.append(family.values(k + 1, x)[:, k + 1 :] / sqrt(family.norms(k + 1)[-1]))
        return np.concatenate(values, axis=1)

    def _next_terms(self, added: np.ndarray) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
        """Yield c_v B_v of every variable that is expanded, in polynomials.

        The variable, the orders of the polynomials, and their coefficients (orders, series).
        """
        own = iter(added)
        for v, nodes in enumerate(self.nodes):
            if len(nodes) > 1:
                factors = chebyshev.chebfromroots(nodes) / _largest(nodes)
                yield v, np.arange(len(factors)), factors[:, None] * next(own)
        random = zip(self.families, self.random_orders, strict=True)
        for v, (family, k) in enumerate(random, start=len(self.nodes)):
            if k:
                yield v, np.array([k + 1]), next(own)[None] / sqrt(family.norms(k + 1)[-1])


def _largest(nodes: np.ndarray) -> float:
    """Return the largest value of |Π_i (η − η_i)| in [−1, 1]."""
    fine = np.linspace(-1, 1, 101)[:, None]
    return float(np.abs((fine - nodes).prod(axis=1)).max())
