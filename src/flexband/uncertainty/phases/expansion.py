"""The phase expansion: base, envelopes and phases are expanded, and put together again.

    F = base + Σ_c Re[Z_c e^{iφ_c}]

The parts, real and imaginary part of Z apart, are series of one `HybridExpansion`, so they share
its design and its fit. A moment of F oscillates in η as fast as the phases turn, but the phases and
the smooth moments that it is made of do not. They are computed at few η, expanded in polynomials,
and put together where the extremes are searched.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexband.errors import InputError
from flexband.uncertainty.expansions.direct import DirectExpansion
from flexband.uncertainty.expansions.expansion import Expansion, Extremes
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.substitution import Substitution, substitute
from flexband.uncertainty.expansions.threads import in_threads
from flexband.uncertainty.phases.carriers import CarrierOptions
from flexband.uncertainty.phases.integration.rules import scan_points
from flexband.uncertainty.phases.integration.second_rule import integration_error
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.phases.moment_orders import MomentPolynomials, moment_orders
from flexband.uncertainty.phases.moments import mean_and_std
from flexband.uncertainty.phases.phase_bounds import search
from flexband.uncertainty.phases.phase_options import SEARCH
from flexband.uncertainty.phases.terms import PartTerms


@dataclass(frozen=True)
class PhaseExpansion:
    """The `Expansion` of outputs that share one or more carriers."""

    outputs: np.ndarray  # numbers of the response's outputs
    parts: HybridExpansion  # of base, phases and envelopes
    columns: PartColumns  # where the parts are among its series

    @property
    def carriers(self) -> int:
        """The number of carriers."""
        return self.columns.carriers

    @property
    def hybrid(self) -> HybridExpansion:
        """The expansion of the parts."""
        return self.parts

    def evaluate(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        return self.columns.join(self.parts.evaluate(xi, eta))

    def evaluate_quickly(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        return self.columns.join(self.parts.evaluate_in_thread(xi, eta), single=True)

    def moments(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        blocks = PartTerms.from_expansion(self.parts, self.columns).blocks()
        moments = [mean_and_std(terms.table(eta), terms.moments) for _, terms in blocks]
        mean, std = (np.moveaxis(np.concatenate(v), 0, 2) for v in zip(*moments, strict=True))
        return mean, std

    def extremes(self, sigmas: Sequence[float]) -> list[Extremes]:
        targets = np.array([(c, sign) for c in sigmas for sign in (1.0, -1.0)])
        terms = PartTerms.from_expansion(self.parts, self.columns)
        shape = len(targets), self.columns.outputs, len(terms.coefficients)
        values, places = np.empty(shape), np.empty((*shape, terms.interval_dimension))
        blocks = terms.blocks()
        orders = moment_orders([block_terms for _, block_terms in blocks])

        def solve(number: int) -> None:
            times, block_terms = blocks[number]
            values[..., times], places[..., times, :] = _search(
                block_terms, orders[number], targets, self.columns.outputs
            )

        in_threads(solve, range(len(blocks)))
        return [Extremes(values[k : k + 2], places[k : k + 2]) for k in range(0, len(targets), 2)]

    def integration_error(self, bounds: Sequence[Extremes], sigmas: Sequence[float]) -> np.ndarray:
        return integration_error(PartTerms.from_expansion(self.parts, self.columns), bounds, sigmas)

    def select(
        self, outputs: np.ndarray, times: slice | np.ndarray = slice(None)
    ) -> PhaseExpansion:
        which = self.columns.of_outputs(np.searchsorted(self.outputs, outputs))
        parts = self.parts.of_rows(self.columns.width, which, times)
        return PhaseExpansion(
            outputs, parts, PartColumns.from_outputs(len(outputs), self.columns.carriers)
        )

    def substitute(
        self, substitutions: Mapping[int, Substitution], families: Sequence[Family]
    ) -> PhaseExpansion:
        return replace(self, parts=substitute(self.parts, substitutions, families))

    def of_hybrid(self, hybrid: HybridExpansion) -> PhaseExpansion:
        return replace(self, parts=hybrid)

    def arrays(self) -> dict[str, np.ndarray]:
        carriers = np.array(self.columns.carriers)
        return {"outputs": self.outputs, "carriers": carriers, **self.parts.arrays()}

    @staticmethod
    def of_arrays(
        inputs: Sequence[Family], outputs: np.ndarray, carriers: np.ndarray, **parts: np.ndarray
    ) -> PhaseExpansion:
        max_carriers = CarrierOptions().max_carriers
        if not 1 <= carriers <= max_carriers:
            raise InputError(f"vibration frequencies must be 1 to {max_carriers}; got {carriers}")
        columns = PartColumns.from_outputs(len(outputs), int(carriers))
        return PhaseExpansion(outputs, HybridExpansion.of_arrays(inputs, **parts), columns)


def expansion_of(outputs: np.ndarray, parts: HybridExpansion, columns: PartColumns) -> Expansion:
    """Return the expansion of outputs by their parts: the plain one if there are no carriers."""
    if columns.carriers:
        return PhaseExpansion(outputs, parts, columns)
    return DirectExpansion(outputs, parts)


def _search(
    terms: PartTerms, index: np.ndarray, targets: np.ndarray, outputs: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds of one block of times, (targets, outputs, times), and their places.

    `index` has the orders of the polynomials in η for smooth moments.
    """
    m = terms.interval_dimension
    orders = terms.orders
    reach = terms.reach()
    polynomials = MomentPolynomials.from_index(index)
    expansion = polynomials.expansion
    smooth = polynomials.coefficients(terms)
    size = np.maximum(smooth.max(axis=0), -smooth.min(axis=0))
    matter = np.any(size > SEARCH.negligible_coefficient * size.max(axis=0), axis=1)
    # Scan with the terms that matter, and search from the best points.
    points, beside = scan_points(2 * orders[:m], reach[:m] * (not terms.averages_vanish))
    basis = np.ascontiguousarray(expansion.chebyshev(points)[:, expansion.i[matter]])
    if not matter.all():
        smooth = _compress(smooth, matter)
        index = index[matter]
    scan = (basis, points, beside)
    moments = (terms.moments, terms.phase_combinations)
    values = np.empty((len(targets), outputs, len(smooth)))
    places = np.empty((*values.shape, m))
    search(smooth, index, *scan, *moments, targets, SEARCH.descents, values, places)
    return values, places


def _compress(table: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return some terms of a table (times, terms, width), in the memory of all of them."""
    times, _, width = table.shape
    terms = np.count_nonzero(mask)
    compressed = table.reshape(-1)[: times * terms * width].reshape(times, terms, width)
    for row, all_terms in zip(compressed, table, strict=True):
        row[:] = all_terms[mask]
    return compressed
