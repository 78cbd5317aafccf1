"""The phase-resolved method: a hybrid expansion of phases, envelopes and what is left."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.signal import fftconvolve

from flexband.errors import InputError
from flexband.uncertainty.bands import SIGMAS, bands
from flexband.uncertainty.bounds import Extremes
from flexband.uncertainty.decomposition import Stage, decompose
from flexband.uncertainty.expansion import HybridExpansion
from flexband.uncertainty.methods import Evaluate, ImprovedPCCI
from flexband.uncertainty.phase_bounds import phase_extremes
from flexband.uncertainty.phase_expansion import PhaseExpansion, left_out
from flexband.uncertainty.polynomials import hermite_nodes
from flexband.uncertainty.space import Space

GAIN = 0.8
"""A carrier is used for an output where it brings the error of prediction below this part."""

DOUBT, CAUTION = 0.5, 0.3
"""Where base and envelopes are off by more than `DOUBT` of the response at the check runs, the
expansion is not trusted, and `CAUTION` of their error counts in the estimate."""


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

    def solve(self, space: Space, evaluate: Evaluate) -> xr.Dataset:
        """Return the bands, the error expected of them, and how many carriers each output has.

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
        shape = values.shape[1:]
        F = values.values.reshape(len(values), -1, shape[-1] if shape else 1)
        step = _step(values)
        found = [_Candidate.of(stage, random_orders, nodes, check) for stage in decompose(F, step)]
        answer = _Answer(found, F, step)
        result = bands(space, values, answer.extremes)
        dims = values.dims[1:]
        outer = dims[:-1], shape[:-1]
        return result.assign(
            mean_expected_error=(dims, answer.estimate[0].reshape(shape)),
            error_bar_expected_error=(dims, answer.estimate[1].reshape(shape)),
            carriers=(outer[0], answer.carriers.reshape(outer[1])),
            trusted=(outer[0], answer.trusted.reshape(outer[1])),
        ).assign_attrs(carrier_frequencies=answer.frequencies)


class _Candidate(NamedTuple):
    """The expansion with some number of carriers, and how well it predicts runs."""

    full: PhaseExpansion
    lower: PhaseExpansion
    check: tuple[np.ndarray, np.ndarray]
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
        size = _rms(stage.signal) + 1e-300
        error = (
            np.hypot(_rms(left_out(runs, full)), _rms(full.evaluate(*check) - checked.signal))
            / size
        )
        base, carriers = full.layout.unpack(full.evaluate_parts(*check))
        steady = np.abs(checked.base - base)
        for (_, re, im), c in zip(carriers, checked.carriers, strict=True):
            steady = steady + np.abs(c.envelope - (re + 1j * im))
        return _Candidate(full, lower, check, checked, error, np.sqrt(np.mean(steady**2, axis=0)))


class _Answer:
    """For every output, the extremes by the best candidate and the error expected of them.

    The estimate is the largest of the change of the bands with the lower model, their change with
    next-order terms that meet the check runs, and, where the expansion is not trusted, a part of
    the error of base and envelopes at the check runs; its root mean square over a period to each
    side counts. The bands have the next-order terms where there are two check runs: one does not
    tell in which variable the response bends.
    """

    def __init__(self, found: list[_Candidate], F: np.ndarray, step: float):
        outputs, times = F.shape[1:]
        self.frequencies = [c.frequency for c in found[-1].checked.carriers]
        period = 1 / (self.frequencies[0] * step) if self.frequencies else times / 50
        self.thin = slice(None, None, max(1, int(period / 2)))  # times looked at for the estimate
        self.carriers = _chosen(found)
        m = found[0].full.parts.interval_dimension
        values = np.empty((len(SIGMAS), 2, outputs, times))
        places = np.empty((len(SIGMAS), 2, outputs, times, m))
        self.estimate = np.empty((2, outputs, times))
        self.trusted = np.empty(outputs, dtype=bool)
        size = _rms(F) + 1e-300
        for k in np.unique(self.carriers):
            which = np.flatnonzero(self.carriers == k)
            one = found[k]
            full = one.full.of(which)
            terms = one.full.corrected(one.checked, *one.check).of(which)
            two = len(one.check[0]) > 1
            best = _extremes(terms if two else full)
            other = _thinned(full if two else terms, self.thin)
            values[:, :, which] = np.stack([e.values for e in best])
            places[:, :, which] = np.stack([e.places for e in best])
            here = np.stack([e.values for e in best])[..., self.thin]
            plain = other if two else here
            changes = [_apart(other, here), _apart(_thinned(one.lower.of(which), self.thin), plain)]
            repeated = np.repeat(np.maximum(*changes), self.thin.step, axis=-1)[..., :times]
            off = _rms(one.steady[None, which]) / size[which]
            self.trusted[which] = off < DOUBT
            doubt = np.where(off[:, None] < DOUBT, 0.0, CAUTION * one.steady[which])
            self.estimate[:, which] = np.maximum(repeated, doubt)
        self.estimate = _running(self.estimate, max(1, round(period), self.thin.step))
        self.extremes = [
            Extremes(v.reshape(2, -1), p.reshape(2, outputs * times, m))
            for v, p in zip(values, places, strict=True)
        ]


def _chosen(found: list[_Candidate]) -> np.ndarray:
    """Return how many carriers each output gets: more only where that pays."""
    errors = np.stack([one.error for one in found])
    chosen = np.zeros(errors.shape[1], dtype=int)
    for k in range(1, len(found)):
        now = errors[chosen, np.arange(errors.shape[1])]
        chosen = np.where(errors[k] < GAIN * now, k, chosen)
    return chosen


def _extremes(surrogate: PhaseExpansion) -> list[Extremes]:
    """Return extremes with values (2, outputs, times) and places (2, outputs, times, m)."""
    shape = (2, surrogate.layout.outputs, surrogate.layout.times)
    return [
        Extremes(e.values.reshape(shape), e.places.reshape(*shape, -1))
        for e in phase_extremes(surrogate, SIGMAS)
    ]


def _thinned(surrogate: PhaseExpansion, times: slice) -> np.ndarray:
    """Return the extremes' values at some times, (sigmas, 2, outputs, times)."""
    outputs = np.arange(surrogate.layout.outputs)
    return np.stack([e.values for e in _extremes(surrogate.of(outputs, times))])


def _apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return how far interval means and error bars differ, mean of both bounds, (2, …)."""
    d = np.abs(a - b)
    return np.stack([d[0, 0] + d[0, 1], d[1, 0] + d[2, 1]]) / 2


def _running(v: np.ndarray, half: int) -> np.ndarray:
    """Return the root mean square over ±half times."""
    window = np.ones((1, 2 * half + 1))
    square = v.reshape(-1, v.shape[-1]) ** 2
    top = fftconvolve(square, window, mode="same", axes=-1)
    count = fftconvolve(np.ones((1, v.shape[-1])), window, mode="same", axes=-1)
    return np.sqrt(np.maximum(top / count, 0.0)).reshape(v.shape)


def _rms(v: np.ndarray) -> np.ndarray:
    """Return the root mean square over runs and times, (outputs,)."""
    return np.sqrt(np.mean(v**2, axis=(0, 2)))


def _gap(nodes: np.ndarray) -> float:
    """Return the middle between two nodes that is nearest to zero."""
    if len(nodes) == 1:
        return float(nodes[0])
    nodes = np.sort(nodes)
    return float(np.abs((nodes[1:] + nodes[:-1]) / 2).min())


def _step(values: xr.DataArray) -> float:
    """Return the step of the last dimension; 1 where it has no coordinate."""
    last = values.dims[-1]
    if values.ndim < 2 or values.shape[-1] < 2 or last not in values.coords:
        return 1.0
    times = values[last].values
    if not np.issubdtype(times.dtype, np.number):
        return 1.0
    steps = np.diff(times)
    if np.ptp(steps) > 1e-6 * np.abs(steps).max():
        raise InputError(
            f"a phase-resolved expansion needs equidistant values of {last!r}; "
            f"got steps from {steps.min():g} to {steps.max():g}"
        )
    return float(np.mean(steps))
