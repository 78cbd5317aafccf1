"""The phase-resolved method: a hybrid expansion of phases, envelopes and what is left."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.adaptive.expected_error import (
    CAUTION,
    DOUBT,
    apart,
    at_all_times,
    chosen_carriers,
    diagnostics,
    rms,
    running,
    series,
    stacked,
    steady_miss,
    step,
    thinned,
)
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.polynomials import hermite_nodes
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods import Evaluate, ImprovedPCCI, Order
from flexband.uncertainty.phases.decomposition import Stage, decompose
from flexband.uncertainty.phases.expansion import PhaseExpansion, left_out
from flexband.uncertainty.surrogates.surrogate import Group, Surrogate, extremes_of


@dataclass(frozen=True)
class PhaseResolvedPCCI(ImprovedPCCI):
    """Improved PCCI of ringing responses: it expands phases and envelopes rather than values.

    A response that rings with a frequency that depends on the inputs is, at a fixed time, a fast
    oscillating function of them; its phase, its envelopes and its slow part are gentle ones. Every
    run is split into them along the last dimension of the response, which is equidistant times;
    for each output as many carriers are used as predict runs best, none where it does not ring. One
    or two check runs between the points of the expansion tell how large the error is. See
    docs/phase.md.

    Parameters
    ----------
    random_order, interval_order : as of `PCCI`. Orders of 1 or 2 are enough for most responses.

    Raises
    ------
    InputError
        As `PCCI` does; in `propagate`, where the times are not equidistant.
    """

    random_order: Order = 1
    interval_order: Order = 1

    name = "phase-resolved PCCI"

    def runs(self, space: Space) -> int:
        """Return Π (k+1) Π (q+1), and the check runs."""
        return super().runs(space) + len(self.check_points(space)[0])

    def check_points(self, space: Space) -> tuple[np.ndarray, np.ndarray]:
        """Return ξ and η of the check runs, between the points nearest to the middle.

        Where some order is 2 or more there are two, the second mirrored; else one, in the middle.
        """
        random_orders, interval_orders = self.orders(space)
        xi = np.array([[_gap(hermite_nodes(k)) for k in random_orders]])
        eta = np.array([[_gap(self.interval_nodes(q)) for q in interval_orders]])
        xi, eta = xi.reshape(1, -1), eta.reshape(1, -1)
        if max(np.abs(xi).max(initial=0.0), np.abs(eta).max(initial=0.0)) < 1e-9:
            return xi, eta
        return np.concatenate([xi, -xi]), np.concatenate([eta, -eta])

    def expand(self, space: Space, evaluate: Evaluate) -> Surrogate:
        """Return the surrogate, the error expected of its bands, and each output's carriers.

        `mean_expected_error` and `error_bar_expected_error` have the response's dims, `carriers`
        and `trusted` those before the last. ``attrs["carrier_frequencies"]`` are in cycles a unit
        of time.
        """
        random_orders, interval_orders = self.orders(space)
        nodes = [self.interval_nodes(q) for q in interval_orders]
        xi, eta = HybridExpansion.design(random_orders, nodes)
        check = self.check_points(space)
        points = (np.concatenate(pair) for pair in zip((xi, eta), check, strict=True))
        values = evaluate(*points)
        F, dt = series(values), step(values)
        found = [_Candidate.of(stage, random_orders, nodes, check) for stage in decompose(F, dt)]
        carriers = chosen_carriers([one.error for one in found])
        groups, others = _models(found, carriers)
        frequencies = [c.frequency for c in found[-1].checked.carriers]
        times = thinned(frequencies, dt, F.shape[-1])
        estimate, trusted = _expected(F, found, carriers, groups, others, *times)
        told = diagnostics(values, estimate, carriers, trusted, frequencies)
        return Surrogate(space, values[:0], tuple(groups), told)


class _Candidate(NamedTuple):
    """The expansion with some number of carriers, and how well it predicts runs."""

    full: PhaseExpansion
    lower: PhaseExpansion
    corrected: PhaseExpansion
    checked: Stage  # the check runs, split
    error: np.ndarray  # of predicting left-out and check runs, (outputs,)
    steady: np.ndarray  # of base and envelopes at the check runs, (outputs, times)

    @staticmethod
    def of(stage: Stage, random_orders, nodes, check) -> _Candidate:
        """Expand the runs of a stage but the check runs, which come last."""
        count = len(stage.base) - len(check[0])
        runs, checked = stage.runs(slice(count)), stage.runs(slice(count, None))
        full = PhaseExpansion.fit(runs, random_orders, nodes)
        lower = PhaseExpansion.fit(runs, random_orders, nodes, lower=True)
        size = rms(stage.signal) + 1e-300
        missed = rms(full.evaluate(*check) - checked.signal)
        error = np.hypot(rms(left_out(runs, full)), missed) / size
        corrected = full.corrected(checked, *check)
        return _Candidate(
            full, lower, corrected, checked, error, steady_miss(full, checked, *check)
        )


def _models(
    found: list[_Candidate], carriers: np.ndarray
) -> tuple[list[Group], list[tuple[Group, Group]]]:
    """Return, for each number of carriers, the best model, and pairs that tell its error.

    The best has the next-order terms where there are two check runs: one does not tell in which
    variable the response bends. The pairs are the models without and with these terms, and the
    lower one.
    """
    best, others = [], []
    for k in np.unique(carriers):
        which, one = np.flatnonzero(carriers == k), found[k]
        full, terms, lower = (e.of(which) for e in (one.full, one.corrected, one.lower))
        two = len(one.checked.base) > 1
        best.append(Group(which, terms if two else full))
        others.append((Group(which, full if two else terms), Group(which, lower)))
    return best, others


def _expected(
    F: np.ndarray, found, carriers, groups, others, thin: slice, period: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the errors expected, (2, outputs, times), and which outputs are trusted.

    The largest of the change of the bands with the lower model, their change with the next-order
    terms that meet the check runs, and, where the expansion is not trusted, a part of the error of
    base and envelopes at the check runs; its root mean square over a period to each side counts.
    """
    here = stacked(extremes_of(groups, thin))
    other, lower = (stacked(extremes_of(pair, thin)) for pair in zip(*others, strict=True))
    two = len(found[0].checked.base) > 1
    change = np.maximum(apart(other, here), apart(lower, other if two else here))
    steady = np.stack([found[k].steady[o] for o, k in enumerate(carriers)])
    trusted = np.sqrt(np.mean(steady**2, axis=1)) < DOUBT * (rms(F) + 1e-300)
    doubt = np.where(trusted[:, None], 0.0, CAUTION * steady)
    estimate = np.maximum(at_all_times(change, thin, F.shape[-1]), doubt)
    return running(estimate, max(period, thin.step)), trusted


def _gap(nodes: np.ndarray) -> float:
    """Return the middle between two nodes that is nearest to zero."""
    if len(nodes) == 1:
        return float(nodes[0])
    nodes = np.sort(nodes)
    return float(np.abs((nodes[1:] + nodes[:-1]) / 2).min())
