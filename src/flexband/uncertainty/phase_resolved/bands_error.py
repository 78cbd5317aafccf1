"""The error that is expected of bands over a tensor product of runs: it vanishes at the nodes.

What interpolation misses is Σ_v a_v w_v(x_v) to first order. The node polynomial w_v is zero at all
nodes of a variable v, and has a mean square of one. Check runs, which lie between the nodes,
tell the mean squares of the a_v. Bounds often rest on the ends of intervals, which are nodes, and
the node polynomial of a random variable is orthogonal to all that is expanded, so that bands are
often far more accurate than the expansion is at an arbitrary point. See docs/explanation/phase.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.adaptive.expected_error import ExpectedError
from flexband.uncertainty.adaptive.response_runs import ResponseRuns
from flexband.uncertainty.expansions.expansion import SIGMAS
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion, tensor_points
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.surrogates.diagnostics import rms, running_rms, share
from flexband.uncertainty.surrogates.sigmas import growth


class BandErrorOptions(NamedTuple):
    """How the error between the nodes is judged by check runs."""

    # least and largest error of μ and σ as a part of what is missed in a random variable, where
    # this is small: only polynomials above the first that is missed are not orthogonal at the nodes
    random_shares: tuple[float, float] = (0.1, 0.3)
    at_nodes: float = 0.03  # least w at the place of a bound: products of variables are missed, too
    # least mean square of a variable's a relative to the mean of all: few runs tell them apart
    min_share: float = 0.1
    steps: int = 10  # towards the likeliest a
    min_variance: float = 1e-9  # relative to the mean one, that is as good as none
    max_places: int = 256  # at which it is checked whether a bound could rest on them


@dataclass(frozen=True)
class TensorDesign:
    """Runs at a tensor product of nodes, and the expansion with one term for each.

    Of every variable v there is a node polynomial w_v, zero at all nodes and of unit mean square.
    The nodes of a random variable are the roots of the polynomial of the next order of its family.
    """

    nodes: Sequence[np.ndarray]
    families: Sequence[Family]
    orders: Sequence[int]

    @property
    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """ξ and η of the runs, shapes (runs, n) and (runs, m)."""
        return HybridExpansion.design(self.families, self.orders, self.nodes)

    def __len__(self) -> int:
        return len(self.points[0])

    def fit(self, stage: Stage) -> HybridExpansion:
        """Return the expansion of the parts of runs at these points."""
        arguments = PartColumns.of_stage(stage).pack(stage), self.families, self.orders, self.nodes
        return HybridExpansion.fit(*arguments, overwrite=bool(stage.carriers))

    def of_intervals(self, eta: np.ndarray) -> np.ndarray:
        """Return w² at η, shape (…, m)."""
        columns = np.moveaxis(eta, -1, 0)
        values = [_of_nodes(nodes, x) for nodes, x in zip(self.nodes, columns, strict=True)]
        return np.stack(values, axis=-1) if values else np.zeros(eta.shape)

    def of_random(self, xi: np.ndarray) -> np.ndarray:
        """Return w² at ξ, shape (runs, n)."""
        variables = zip(self.families, self.orders, xi.T, strict=True)
        values = [f.values(k + 1, x)[:, -1] ** 2 / f.norms(k + 1)[-1] for f, k, x in variables]
        return np.stack(values, axis=-1) if values else np.zeros(xi.shape)

    def variance_components(
        self,
        holdout: ResponseRuns,
        missed: np.ndarray,
        *,
        options: BandErrorOptions = BandErrorOptions(),
    ) -> np.ndarray:
        """Return the mean square of a_v of each variable, intervals first, (outputs, variables).

        The likeliest ones are sought from equal ones on, if what is missed of a check run is
        normally distributed, with the variance Σ_v a_v² w_v²; as few steps as these do not separate
        what the runs cannot. What is missed has the shape (runs, outputs, times).
        """
        w = np.concatenate([self.of_intervals(holdout.eta), self.of_random(holdout.xi)], axis=1)
        square = np.mean(missed**2, axis=2)
        mean = np.maximum(square.mean(axis=0) / max(w.sum(axis=1).mean(), 0.1 * w.shape[1]), 1e-300)
        parts = np.ones((square.shape[1], w.shape[1]))
        for _ in range(options.steps):
            variance = np.maximum(w @ parts.T, options.min_variance)
            # none of options, which all are nodes
            weight_sums = np.maximum(w.T @ (1 / variance), 1e-300)
            parts *= np.sqrt((w.T @ (square / mean / variance**2)) / weight_sums).T
        return np.maximum(parts, options.min_share) * mean[:, None]

    def places(self, max_places: int = BandErrorOptions().max_places) -> np.ndarray:
        """Return η at nodes, between them and at the ends, (places, m); some, if there are many."""
        coordinates = [
            np.unique([-1.0, 1.0, *x, *(x[1:] + x[:-1]) / 2]) for x in map(np.sort, self.nodes)
        ]
        if np.prod([float(len(x)) for x in coordinates]) <= max_places:
            return tensor_points(coordinates)
        rng = np.random.default_rng(0)
        return np.stack([rng.choice(x, max_places) for x in coordinates], axis=-1)


def error_of_bands(
    design: TensorDesign,
    holdout: ResponseRuns,
    error: ExpectedError,
    *,
    options: BandErrorOptions = BandErrorOptions(),
) -> np.ndarray:
    """Return the error expected of mean and error bar, shape (2, outputs, times).

    It follows from the error of the expansion in check runs.
    """
    intervals = len(design.nodes)
    random = len(design.families)
    if not intervals + random:
        return np.stack([error.values, error.values])
    missed = error.choice.missed
    square = design.variance_components(holdout, missed, options=options)
    in_time = running_rms(np.sqrt(np.mean(missed**2, axis=0)), error.window)
    in_time /= np.maximum(in_time.mean(axis=-1, keepdims=True), 1e-300)
    # How much the bounds move if values at other places are off by what is missed there.
    eta = design.places(options.max_places)
    mean, std = error.moments(eta)
    parts = np.zeros((2, len(square)))
    if intervals:
        of_intervals = square[:, :intervals]
        some = in_time[:, error.times]
        missed = np.sqrt(design.of_intervals(eta) @ of_intervals.T)[..., None] * some
        # lower and upper end of interval mean and error bar: which of μ + cσ, which bound of it
        for k, ends in enumerate((((0, 0), (0, 1)), ((1, 0), (2, 1)))):
            for which, bound in ends:
                extremes = error.extremes[which]
                side = 2 * bound - 1
                beyond = side * (mean + SIGMAS[which] * std)
                rise = (beyond + missed).max(axis=0)
                rise -= np.maximum(side * extremes.values[bound], beyond.max(axis=0))
                w = design.of_intervals(extremes.places[bound])
                w = np.maximum(w, options.at_nodes**2)
                there = np.sqrt(np.einsum("otv,ov->ot", w, of_intervals)) * some
                parts[k] += np.maximum(rise, there).mean(axis=-1) / 2
    if random:
        of_random = np.sqrt(square[:, intervals:].sum(axis=1))
        parts = np.hypot(parts, _of_random(of_random, std, options))
    overshoot = share(intervals) * running_rms(error.choice.overshoot, error.window)
    values = np.hypot(parts[..., None] * in_time, overshoot)
    values[0] *= growth(0) if random else 1.0  # without σ, the mean is the error bar
    return np.maximum(values, np.finfo(float).eps * rms(holdout.values)[:, None])


def largest_error(error: ExpectedError, m: int) -> np.ndarray:
    """Return the error of μ ± σ anywhere that the worst of all check runs tells.

    Its shape is (outputs, times). The mean square of few runs is often that of one alone: where it
    is far from all others, the mean is far too small. There are m interval variables.
    """
    worst = np.abs(error.choice.missed).max(axis=0)
    return share(m) * running_rms(np.hypot(worst, error.choice.overshoot), error.window)


def _of_random(a: np.ndarray, std: np.ndarray, options: BandErrorOptions) -> np.ndarray:
    """Return the error of μ and σ that is due to random variables, shape (outputs,).

    What is missed at first is orthogonal to what is expanded, so that it makes √(σ² + a²) of σ. The
    polynomials after it are the smaller the faster the expansion converges.
    """
    sigma = np.maximum(std.mean(axis=(0, 2)), 1e-300)
    part = np.clip(np.sqrt(2 * a / sigma), *options.random_shares)
    return np.maximum(np.hypot(sigma, a) - sigma, a * part)


def _of_nodes(nodes: np.ndarray, eta: np.ndarray) -> np.ndarray:
    """Return the square of Π (η − node), of unit mean square over [−1, 1]."""
    monic = np.polynomial.Polynomial.fromroots(nodes)
    square = (monic * monic).integ()
    return monic(eta) ** 2 / ((square(1.0) - square(-1.0)) / 2)
