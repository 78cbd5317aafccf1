"""The phase-resolved surrogate: base, envelopes and phases expanded, and put together again.

    F = base + Σ_c Re[Z_c e^{iφ_c}]

The parts, real and imaginary part of Z apart, are series of one `HybridExpansion`, so they share
its design and its fit. `join` puts the values of the parts together; it is the identity without
carriers.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import factorial, sqrt

import numpy as np
from numpy.polynomial import chebyshev, hermite_e

from flexband.uncertainty.expansions.hybrid import HybridExpansion, tensor_values
from flexband.uncertainty.phases.carriers import Carrier
from flexband.uncertainty.phases.decomposition import Stage


@dataclass(frozen=True)
class Layout:
    """Where the parts are among the series: base, then φ, Re Z and Im Z of each carrier."""

    outputs: int
    times: int
    carriers: int

    @staticmethod
    def of(stage: Stage) -> Layout:
        """Return the layout of the parts of runs."""
        _, outputs, times = stage.base.shape
        return Layout(outputs, times, len(stage.carriers))

    @property
    def size(self) -> int:
        """Number of series."""
        return self.times * (self.outputs * (1 + 2 * self.carriers) + self.carriers)

    def pack(self, stage: Stage) -> np.ndarray:
        """Return runs as series, shape (runs, series)."""
        runs = len(stage.base)
        parts = [stage.base]
        for c in stage.carriers:
            parts += [c.phase, np.real(c.envelope), np.imag(c.envelope)]
        return np.concatenate([p.reshape(runs, -1) for p in parts], axis=1)

    def unpack(self, series: np.ndarray) -> tuple[np.ndarray, list[tuple[np.ndarray, ...]]]:
        """Return the base and φ, Re Z, Im Z of each carrier; shapes (…, outputs or 1, times)."""
        outer, size = series.shape[:-1], self.outputs * self.times
        full, one = (*outer, self.outputs, self.times), (*outer, 1, self.times)
        base, at, carriers = series[..., :size].reshape(full), size, []
        for _ in range(self.carriers):
            ends = [at, at + self.times, at + self.times + size, at + self.times + 2 * size]
            phase, re, im = (series[..., a:b] for a, b in itertools.pairwise(ends))
            carriers.append((phase.reshape(one), re.reshape(full), im.reshape(full)))
            at = ends[-1]
        return base, carriers

    def join(self, series: np.ndarray) -> np.ndarray:
        """Return F, shape (…, outputs, times), of values of the parts."""
        base, carriers = self.unpack(series)
        F = base.copy()
        for phase, re, im in carriers:
            F += re * np.cos(phase)
            F -= im * np.sin(phase)
        return F

    def parts(self) -> Iterator[np.ndarray]:
        """Yield the series of base, phases and envelopes, (outputs or 1, times) or both of Z."""
        base, carriers = self.unpack(np.arange(self.size))
        yield base
        for phase, re, im in carriers:
            yield phase
            yield np.concatenate([re, im])

    def columns(self, outputs: np.ndarray, times: slice) -> np.ndarray:
        """Return the series of some outputs and times."""
        base, carriers = self.unpack(np.arange(self.size))
        parts = [base[outputs][:, times]]
        for phase, re, im in carriers:
            parts += [phase[:, times], re[outputs][:, times], im[outputs][:, times]]
        return np.concatenate([p.ravel() for p in parts])


@dataclass(frozen=True)
class PhaseExpansion:
    """The surrogate of a response.

    Attributes
    ----------
    parts : expansion of the parts.
    layout : where they are.
    interval_nodes : of the design, for the next orders.
    next_terms : coefficients of one term of the next order in each variable that is expanded,
        (variables, series), η first; None where there are no check runs to tell them.
    """

    parts: HybridExpansion
    layout: Layout
    interval_nodes: tuple[np.ndarray, ...]
    next_terms: np.ndarray | None = None

    @staticmethod
    def fit(
        stage: Stage,
        random_orders: Sequence[int],
        interval_nodes: Sequence[np.ndarray],
        *,
        lower: bool = False,
    ) -> PhaseExpansion:
        """Return the expansion through the runs of a design.

        Where `lower`, only terms up to a total order of the largest order of a variable are kept,
        by least squares: the difference tells the error.
        """
        layout = Layout.of(stage)
        values = layout.pack(stage)
        parts = HybridExpansion.fit(values, random_orders, interval_nodes)
        if lower:
            keep, A = lower_terms(parts), design_values(parts, interval_nodes)
            coefficients = np.zeros((len(keep), values.shape[1]))
            coefficients[keep] = np.linalg.lstsq(A[:, keep], values)[0]
            parts = replace(parts, coefficients=coefficients.reshape(parts.coefficients.shape))
        return PhaseExpansion(parts, layout, tuple(interval_nodes))

    @staticmethod
    def direct(expansion: HybridExpansion, outputs: int) -> PhaseExpansion:
        """Return an expansion of values as one without carriers."""
        times = expansion.coefficients.shape[2] // outputs
        return PhaseExpansion(expansion, Layout(outputs, times, 0), ())

    def evaluate(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return F at points (points, n) and (points, m), shape (points, outputs, times)."""
        return self.layout.join(self.evaluate_parts(xi, eta))

    def evaluate_parts(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the parts at points, shape (points, series)."""
        values = self.parts.evaluate(xi, eta)
        if self.next_terms is not None:
            values = values + self.next_values(xi, eta) @ self.next_terms
        return values

    def complete(self) -> HybridExpansion:
        """Return the parts with the terms of the next order as terms like the others."""
        if self.next_terms is None:
            return self.parts
        m, index = self.parts.interval_dimension, self.parts.index().T
        terms = self.parts.coefficients.reshape(len(index), -1)
        own = iter(self.next_terms)
        more = []  # variable, orders, coefficients
        for v, nodes in enumerate(self.interval_nodes):
            if len(nodes) > 1:
                roots = chebyshev.chebfromroots(nodes) / _largest(nodes)
                more.append((v, np.arange(len(roots)), roots[:, None] * next(own)))
        for v, k in enumerate(self.parts.random_orders):
            if k:
                more.append((m + v, [k + 1], next(own)[None] / sqrt(factorial(k + 1))))
        for v, orders, values in more:
            alone = np.zeros((len(orders), index.shape[1]), dtype=int)
            alone[:, v] = orders
            index, terms = np.concatenate([index, alone]), np.concatenate([terms, values])
        index, which = np.unique(index, axis=0, return_inverse=True)
        summed = np.zeros((len(index), terms.shape[1]))
        np.add.at(summed, which.ravel(), terms)
        return HybridExpansion.of_terms(index, summed, m)

    def next_values(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return terms of the next order that vanish at all runs, shape (points, variables).

        Π_i (η − η_i), largest value one, and He_{k+1}(ξ)/√(k+1)!, of variables that are expanded.
        """
        values = [np.zeros((len(xi), 0))]
        for nodes, e in zip(self.interval_nodes, eta.T, strict=True):
            if len(nodes) > 1:
                product = np.prod(e[:, None] - nodes, axis=1, keepdims=True)
                values.append(product / _largest(nodes))
        for k, x in zip(self.parts.random_orders, xi.T, strict=True):
            if k:
                term = hermite_e.hermeval(x, np.eye(k + 2)[k + 1]) / sqrt(factorial(k + 1))
                values.append(term[:, None])
        return np.concatenate(values, axis=1)

    def corrected(self, check: Stage, xi: np.ndarray, eta: np.ndarray) -> PhaseExpansion:
        """Return the surrogate with next-order terms that meet the parts of check runs.

        Of all terms c with Σ_v c_v B_v(check) = miss, those of least Σ_v |c_v|²/w_v, where w_v is
        the energy of the highest terms in variable v: what bends most so far is expected to go on.
        """
        miss = self.layout.pack(check) - self.parts.evaluate(xi, eta)
        B, highest = self.next_values(xi, eta), self.parts.highest()
        square = self.parts.coefficients.reshape(highest.shape[1], -1) ** 2
        energy = highest[np.array(self.parts.orders) > 0].astype(float) @ square
        terms = np.zeros((B.shape[1], miss.shape[1]))
        for columns in map(np.ravel, self.layout.parts()):
            w = energy[:, columns].sum(axis=1)
            w = w / max(w.sum(), 1e-300) + 1e-6
            gain = (w[:, None] * B.T) @ np.linalg.pinv((B * w) @ B.T, rcond=1e-3)
            terms[:, columns] = gain @ miss[:, columns]
        return replace(self, next_terms=terms)

    def of(self, outputs: np.ndarray, times: slice = slice(None)) -> PhaseExpansion:
        """Return the surrogate of some outputs and times."""
        columns = self.layout.columns(outputs, times)
        coefficients = self.parts.coefficients[:, :, columns]
        return replace(
            self,
            parts=replace(self.parts, coefficients=coefficients),
            layout=replace(
                self.layout, outputs=len(outputs), times=len(range(self.layout.times)[times])
            ),
            next_terms=None if self.next_terms is None else self.next_terms[:, columns],
        )


def _largest(nodes: np.ndarray) -> float:
    """Return the largest value of |Π_i (η − η_i)| in [−1, 1]."""
    fine = np.linspace(-1, 1, 101)[:, None]
    return float(np.abs((fine - nodes).prod(axis=1)).max())


def lower_terms(parts: HybridExpansion) -> np.ndarray:
    """Return which terms the lower model keeps: those up to the largest order of a variable in all.

    Where these are all terms, as with one variable, those below the largest order.
    """
    total, most = parts.index().sum(axis=0), max(parts.orders, default=0)
    keep = total <= most
    return keep if not keep.all() else total < max(most, 1)


def design_values(parts: HybridExpansion, interval_nodes: Sequence[np.ndarray]) -> np.ndarray:
    """Return all terms at the points of the design, shape (runs, M N)."""
    xi, eta = HybridExpansion.design(parts.random_orders, interval_nodes)
    return tensor_values([parts.chebyshev(eta), parts.hermite(xi)])


def left_out(stage: Stage, expansion: PhaseExpansion) -> np.ndarray:
    """Return errors of predicting every run from all others by the lower model, as of `base`.

    y − ŷ without a run is r/(1 − h), with its residual r and its leverage h in the fit to all runs.
    """
    parts = expansion.parts
    A = design_values(parts, expansion.interval_nodes)[:, lower_terms(parts)]
    project = A @ np.linalg.pinv(A)
    lever = 1 - np.minimum(np.diag(project), 1 - 1e-9)

    def predicted(y: np.ndarray) -> np.ndarray:
        flat = y.reshape(len(y), -1)
        return y + ((project @ flat - flat) / lever[:, None]).reshape(y.shape)

    carriers = [
        Carrier(predicted(c.phase), predicted(c.envelope), c.frequency) for c in stage.carriers
    ]
    return Stage(carriers, predicted(stage.base)).signal - stage.signal
