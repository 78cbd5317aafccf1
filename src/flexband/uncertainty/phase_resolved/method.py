"""The phase-resolved method: a hybrid expansion of phases, envelopes and the slow part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.expansions.expansion import Expansion, extremes_of
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods import Evaluate, ImprovedPCCI, Order
from flexband.uncertainty.phase_resolved.change import (
    CAUTION,
    DOUBT,
    chosen_carriers,
    steady_miss,
    thinned,
)
from flexband.uncertainty.phase_resolved.models import PartModels
from flexband.uncertainty.phases.decomposition import Stage, decompose
from flexband.uncertainty.phases.expansion import expansion_of
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.surrogates.diagnostics import (
    apart,
    at_all_times,
    diagnostics,
    rms,
    running,
    series,
    stacked,
    step,
    trust,
)
from flexband.uncertainty.surrogates.surrogate import Surrogate


@dataclass(frozen=True)
class PhaseResolvedPCCI(ImprovedPCCI):
    """Improved PCCI of ringing responses: it expands phases and envelopes rather than values.

    If the frequency of a ringing response depends on the inputs, its value at a fixed time is a
    rapidly oscillating function of them; its phase, its envelopes and its slow part are smooth
    functions. Every run is split into these along the last dimension of the response, which must be
    equidistant times. Each output gets as many carriers as predict runs best, and none if it does
    not ring. One or two check runs between the points of the expansion show how large the error is.
    See docs/phase.md.

    Parameters
    ----------
    random_order, interval_order : as of `PCCI`. Orders of 1 or 2 suffice for most responses.

    Raises
    ------
    InputError
        As `PCCI` does; in `propagate`, if the times are not equidistant.
    """

    random_order: Order = 1
    interval_order: Order = 1

    name = "phase-resolved PCCI"

    def runs(self, space: Space) -> int:
        """Return Π (k+1) Π (q+1) plus the number of check runs."""
        return super().runs(space) + len(self.check_points(space)[0])

    def check_points(self, space: Space) -> tuple[np.ndarray, np.ndarray]:
        """Return ξ and η of the check runs, between the points nearest to the middle.

        If some order is 2 or more there are two, the second mirrored; otherwise one, in the middle.
        """
        random_orders, interval_orders = self.orders(space)
        own = zip(space.families, random_orders, strict=True)
        xi = np.array([[_gap(family.gauss(k + 1)[0]) for family, k in own]])
        eta = np.array([[_gap(self.interval_nodes(q)) for q in interval_orders]])
        xi, eta = xi.reshape(1, -1), eta.reshape(1, -1)
        if max(np.abs(xi).max(initial=0.0), np.abs(eta).max(initial=0.0)) < 1e-9:
            return xi, eta
        return np.concatenate([xi, -xi]), np.concatenate([eta, -eta])

    def expand(self, space: Space, evaluate: Evaluate) -> Surrogate:
        """Return the surrogate, the expected error of its bands, and the carriers of each output.

        `mean_expected_error` and `error_bar_expected_error` have the response's dims, `carriers`
        and `trusted` those before the last. ``attrs["carrier_frequencies"]`` are in cycles per unit
        of time.
        """
        random_orders, interval_orders = self.orders(space)
        nodes = [self.interval_nodes(q) for q in interval_orders]
        random = space.families, random_orders
        design, check = HybridExpansion.design(*random, nodes), self.check_points(space)
        values = evaluate(*(np.concatenate(pair) for pair in zip(design, check, strict=True)))
        F, dt = series(values), step(values)
        stages = decompose(F, dt)
        found = [_Candidate.of_stage(stage, *random, nodes, check) for stage in stages]
        carriers = chosen_carriers([one.error for one in found])
        models = [found[k].of(np.flatnonzero(carriers == k)) for k in np.unique(carriers)]
        full, corrected, lower = zip(*models, strict=True)
        frequencies = [c.frequency for c in found[-1].checked.carriers]
        thin, period = thinned(frequencies, dt, F.shape[-1])
        here, more, less = (stacked(extremes_of(v, thin)) for v in (full, corrected, lower))
        change = np.maximum(apart(more, here), apart(less, here))
        change = at_all_times(change, thin, F.shape[-1])
        steady = np.stack([found[k].steady[o] for o, k in enumerate(carriers)])
        missed = np.sqrt(np.mean(steady**2, axis=1)) / (rms(F) + 1e-300)
        doubt = np.where(missed[:, None] < DOUBT, 0.0, CAUTION * steady)
        error = running(np.maximum(change, doubt), max(period, thin.step))
        # one check run does not show in which variable the response bends
        best = corrected if len(check[0]) > 1 else full
        trusted = trust(values, missed, "base and envelopes in check runs")
        reported = diagnostics(values, error, carriers, trusted, frequencies)
        return Surrogate(space, values[:0], best, reported)


class _Candidate(NamedTuple):
    """The models with some number of carriers, and how well they predict runs.

    full, corrected, lower : the expansion, the one with next-order terms, and the lower model.
    checked : the check runs, split into base and carriers.
    error : of left-out and check runs, relative, shape (outputs,).
    steady : error of base and envelopes in the check runs, shape (outputs, times).
    """

    full: Expansion
    corrected: Expansion
    lower: Expansion
    checked: Stage
    error: np.ndarray
    steady: np.ndarray

    @staticmethod
    def of_stage(stage: Stage, families, orders, nodes, check) -> _Candidate:
        """Expand the runs of a stage without the check runs, which are the last."""
        count = len(stage.base) - len(check[0])
        runs, checked = stage.runs(slice(count)), stage.runs(slice(count, None))
        columns = PartColumns.of_stage(stage)
        models = PartModels(columns, columns.pack(runs), families, orders, nodes)
        predicted, outputs = models.full.evaluate(*check), np.arange(columns.outputs)
        missed = rms(columns.join(predicted) - checked.signal)
        left_out = rms(columns.join(models.left_out()) - runs.signal)
        corrected = models.next_order(columns.pack(checked), *check)
        return _Candidate(
            full=expansion_of(outputs, models.full, columns),
            corrected=expansion_of(outputs, corrected, columns),
            lower=expansion_of(outputs, models.lower(), columns),
            checked=checked,
            error=np.hypot(left_out, missed) / (rms(stage.signal) + 1e-300),
            steady=steady_miss(predicted, checked),
        )

    def of(self, outputs: np.ndarray) -> tuple[Expansion, Expansion, Expansion]:
        """Return the models of some of the outputs."""
        return self.full.of(outputs), self.corrected.of(outputs), self.lower.of(outputs)


def _gap(nodes: np.ndarray) -> float:
    """Return the midpoint between two nodes that is nearest to zero."""
    if len(nodes) == 1:
        return float(nodes[0])
    nodes = np.sort(nodes)
    return float(np.abs((nodes[1:] + nodes[:-1]) / 2).min())
