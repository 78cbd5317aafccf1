"""Margins of samples: how far a surrogate stays inside a corridor, at every output and time."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import TypeVar

import numpy as np

from flexband.analysis.labelled_answers import beyond_neighbours
from flexband.analysis.peaks import LeastBetween, TimeAxis, least_between, lowest_of_impacts
from flexband.analysis.probability.discrepancy import DiscrepancyModel
from flexband.requirements.corridors import Corridor
from flexband.requirements.scatter import ScatteringTolerances
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.threads import in_threads
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.surrogate import Surrogate

Reduced = TypeVar("Reduced")


@dataclass(frozen=True, eq=False)
class LimitedOutputs:
    """Some outputs of one expansion at some times, and where they must be.

    All arrays have the shape (outputs, times), and the outputs' units; `beyond`, (2, 2, outputs,
    times), is by how much values go below and above two neighbouring ones, from each time to the
    next: the least and the most of some runs. Times outside of a window tell of its ends.
    """

    expansion: Expansion
    lower: np.ndarray
    upper: np.ndarray
    error: np.ndarray  # what is expected to be missed of a run
    scale: np.ndarray  # unit of the margins
    series: np.ndarray  # numbers of outputs and times in the response
    beyond: np.ndarray
    inside: np.ndarray  # which of the times are limited, (times,)
    axis: TimeAxis | None  # their times; None where there is nothing between them

    def sides(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return margins to both limits relative to the scale, (points, 2, outputs, times)."""
        values = self.expansion.evaluate_quickly(xi, eta)
        return np.stack([values - self.lower, self.upper - values], axis=1) / self.scale

    def least_between(self, sides: np.ndarray, *, impacts: bool) -> np.ndarray:
        """Return the least margins of samples between the times, (3, points), ∞ if not known.

        They are an estimate, what they are at most, and at least: curves between the times tell,
        and what outputs do there in some runs.
        """
        least_margins = np.full((3, len(sides)), np.inf)
        if self.axis is None:
            return least_margins
        for side, curve in enumerate((self.lower, self.upper)):
            rows = np.asarray(np.isfinite(curve).all(axis=1))
            if not rows.any():
                continue
            curves = least_between(sides[:, side, rows], self.axis, impacts=impacts)
            estimates = self._margins_between(curves, side, rows, impacts=impacts)
            least_margins = np.minimum(
                least_margins, [margins.min(axis=(1, 2), initial=np.inf) for margins in estimates]
            )
        if impacts:
            lowest = lowest_of_impacts(sides.min(axis=1), self.axis)
            least_margins[2] = np.minimum(least_margins[2], lowest.min(axis=1))
        return least_margins

    def _margins_between(
        self, curves: LeastBetween, side: int, rows: np.ndarray, *, impacts: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        beyond = (self.beyond / self.scale)[:, side, rows, :-1]
        highest, lowest = curves.ends - beyond[:, None]
        if impacts:
            return highest, highest, np.minimum(lowest, curves.lowest)
        if not self.beyond.any():
            highest = np.minimum(highest, curves.at_most)
        return np.minimum(highest, curves.estimate), highest, np.minimum(lowest, curves.lowest)

    def margins(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return margins relative to the scale, (points, outputs, times), ∞ out of the window."""
        return self.margins_of(self.expansion.evaluate_quickly(xi, eta))

    def margins_of(self, values: np.ndarray) -> np.ndarray:
        """Return the margins of values (points, outputs, times), of the same shape."""
        margins = np.minimum(values - self.lower, self.upper - values)
        margins /= self.scale
        margins[..., ~self.inside] = np.inf
        return margins

    def at(self, times: np.ndarray) -> LimitedOutputs:
        """Return the part at some of its times, of which nothing is known between them."""
        expansion = self.expansion.select(self.expansion.outputs, times)
        names = ("lower", "upper", "error", "scale", "series", "beyond", "inside")
        arrays = {k: getattr(self, k)[..., times] for k in names}
        return replace(self, expansion=expansion, axis=None, **arrays)

    def tighter(self, count: float) -> LimitedOutputs:
        """Return the part with limits that are tighter by so many of its errors."""
        moved = count * self.error
        return replace(self, lower=self.lower + moved, upper=self.upper - moved)


def with_eta(u: np.ndarray, eta: np.ndarray) -> np.ndarray:
    """Return samples u (points, n) with η (m,), or (points, m), beside them, (points, n + m)."""
    return np.concatenate([u, np.broadcast_to(eta, (len(u), np.shape(eta)[-1]))], axis=1)


def least_of(margins: list[np.ndarray]) -> np.ndarray:
    """Return the least of some margins of each sample, (points,)."""
    return np.min([part_margins.min(axis=(1, 2)) for part_margins in margins], axis=0)


@dataclass(frozen=True, eq=False)
class LimitState:
    """The margins of a surrogate, as functions of standard normal variables u and of η.

    The margins of an output are given relative to its standard deviation over all inputs, so that
    those of different outputs can be compared. Where tolerances scatter, u has their variables
    after those of ξ, and η has no effect.
    """

    families: tuple[Family, ...]  # of the random variables
    parts: tuple[LimitedOutputs, ...]
    impacts: bool  # whether outputs may turn at once between times
    tolerances: ScatteringTolerances | None = None  # how they scatter, if they do
    missed: DiscrepancyModel | None = None  # of least margins, as a function of u and η
    unit: float = 1.0  # of these, in that of the margins, on average
    beyond: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # runs that violate limits

    @staticmethod
    def from_surrogate(
        surrogate: Surrogate,
        corridors: Sequence[Corridor],
        error: np.ndarray,
        rng: np.random.Generator,
    ) -> LimitState:
        """Return the limit state of a surrogate; `error` has the shape of the response.

        All corridors count.
        """
        labels = surrogate.labels
        space = surrogate.space
        times = surrogate.times
        number = np.arange(math.prod(labels.shape[1:])).reshape(-1, times)
        beyond = beyond_neighbours(surrogate.diagnostics, labels).reshape(2, 2, -1, times)
        pilot = 256  # samples that tell how much each output varies
        u = rng.standard_normal((pilot, space.random_dimension))
        eta = rng.uniform(-1, 1, (pilot, space.interval_dimension))
        parts = []
        for corridor, expansion in product(corridors, surrogate.expansions):
            lower, upper = corridor.curves.reshape(2, -1, times)
            limited = np.any(np.isfinite([lower, upper]), axis=(0, 2))
            outputs = expansion.outputs[limited[expansion.outputs]]
            if not len(outputs):
                continue
            # Select the times in and next to the window.
            axis = TimeAxis.from_labels(labels, corridor.window)
            window_times = slice(None)
            if axis is not None:
                window_times = (at := axis.window_slice())
                axis = axis.at(at)
            at = np.arange(times)[window_times]
            part = expansion.select(outputs, at)
            # Find the scale of each output: its standard deviation, unless that is round-off.
            values = part.evaluate(of_normals(u, space.families), eta)
            spread = values.std(axis=0).max(axis=1, keepdims=True)
            size = np.abs(values).max(axis=(0, 2))[:, None]
            scale = np.maximum(spread, 1e-12 * size + 1e-300)
            index = np.ix_(outputs, at)
            part_error = error.reshape(-1, times)[index]
            scale = np.broadcast_to(scale, part_error.shape)
            bounds = lower[index], upper[index], part_error, scale, number[index]
            inside = np.broadcast_to(corridor.inside, times)[window_times]
            parts.append(LimitedOutputs(part, *bounds, beyond[:, :, *index], inside, axis))
        impacts = bool(BandRecord.read(surrogate.diagnostics).impacts)
        return LimitState(space.families, tuple(parts), impacts)

    @property
    def exact(self) -> bool:
        """Whether the expected error is negligible, in the tails as well.

        Terms left out of an expansion are up to 300 times as large at 5σ as in the root mean
        square.
        """
        return all(np.all(part.error <= 1e-5 * part.scale) for part in self.parts)

    @property
    def width(self) -> int:
        """Number of margins of a sample."""
        return sum(part.series.size for part in self.parts)

    @property
    def series(self) -> np.ndarray:
        """Numbers of outputs and times in the response, (series,)."""
        return np.concatenate([part.series.ravel() for part in self.parts])

    @property
    def inside(self) -> np.ndarray:
        """Which of these are limited, (series,)."""
        masks = [np.broadcast_to(part.inside, part.series.shape) for part in self.parts]
        return np.concatenate([mask.ravel() for mask in masks])

    def tighter(self, count: float) -> LimitState:
        """Return the state with limits that are tighter by so many of the expected errors."""
        return replace(self, parts=tuple(part.tighter(count) for part in self.parts))

    def reduce_margins(
        self,
        u: np.ndarray,
        eta: np.ndarray,
        reduce: Callable[[slice, list[np.ndarray]], Reduced],
        of: Callable[[LimitedOutputs, np.ndarray, np.ndarray], np.ndarray] = LimitedOutputs.margins,
    ) -> list[Reduced]:
        """Return the results of a function of the margins of blocks of samples, in several threads.

        It is given a block and its margins, one array (points, outputs, times) per part, or what
        `of` returns of a part. The shapes of u and η are (points, n), and (points, m) or (m,).
        """
        eta = np.atleast_2d(eta)
        block = max(256, 100_000 // self.width)  # samples whose margins stay in the cache
        blocks = [slice(k, min(k + block, len(u))) for k in range(0, len(u), block)]
        results: dict[int, Reduced] = {}

        def solve(number: int) -> None:
            rows = blocks[number]
            places = self.places(u[rows], eta if len(eta) == 1 else eta[rows])
            results[number] = reduce(rows, [of(part, *places) for part in self.parts])

        if len(blocks) == 1:  # less work than starting a thread
            solve(0)
        else:
            in_threads(solve, range(len(blocks)))
        return [results[number] for number in range(len(blocks))]

    def places(self, u: np.ndarray, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ξ and η of samples u; these η unless tolerances scatter."""
        n = len(self.families)
        if self.tolerances is not None:
            eta = self.tolerances.eta(u[:, n:])
        return of_normals(u[:, :n], self.families), eta

    def least_margins(self, u: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the least margin of each sample, shape (points,)."""
        blocks = self.reduce_margins(u, eta, lambda _, margins: least_of(margins))
        least_margins = np.concatenate([np.zeros(0), *blocks])
        if self.missed is not None and len(u):
            least_margins += self.missed.predict(with_eta(u, eta)) / self.unit
        return least_margins

    def least_of_response(self, values: np.ndarray) -> np.ndarray:
        """Return the least margin of runs of the response, shape (points, …), in (points,)."""
        flat = values.reshape(len(values), -1)
        return least_of([part.margins_of(flat[:, part.series]) for part in self.parts])

    def scatter(self, u: np.ndarray, eta: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return means and standard deviations of margins over u, (places, outputs, times) each.

        These are ∞ and 1 out of the window.
        There are samples u at each η; their shapes are (points, n) and (places, m).
        """
        samples = np.tile(u, (len(eta), 1)), np.repeat(eta, len(u), axis=0)
        blocks = self.reduce_margins(*samples, lambda _, margins: margins)
        moments = []
        for part, margins in zip(self.parts, zip(*blocks, strict=True), strict=True):
            samples = np.concatenate(margins).reshape(len(eta), -1, *part.series.shape)
            inside = np.broadcast_to(part.inside, part.series.shape)
            mean, std = np.full((2, len(eta), *part.series.shape), np.inf)
            std[:] = 1.0
            mean[:, inside] = samples[..., inside].mean(axis=1)
            std[:, inside] = np.maximum(samples[..., inside].std(axis=1), 1e-3)
            moments.append((mean, std))
        return moments

    def in_parts_of(self, scatter: list[np.ndarray]) -> LimitState:
        """Return the state with margins relative to these, each (outputs, times)."""
        pairs = zip(self.parts, scatter, strict=True)
        parts = tuple(replace(p, scale=p.scale * unit) for p, unit in pairs)
        mean = float(np.mean(np.concatenate([unit.ravel() for unit in scatter])))
        return replace(self, parts=parts, unit=self.unit * mean)

    def decisive_times(self, u: np.ndarray, eta: np.ndarray, slack: float) -> list[np.ndarray]:
        """Return the masks of the times of each part that decide about some samples, (times,).

        These are the times of the least margin of a sample, and of margins below `slack`.
        """

        def decide(_: slice, margins: list[np.ndarray]) -> list[np.ndarray]:
            thresholds = np.maximum(least_of(margins)[:, None, None], slack)
            return [np.any(part_margins <= thresholds, axis=(0, 1)) for part_margins in margins]

        part_masks = zip(*self.reduce_margins(u, eta, decide), strict=True)
        return [np.any(masks, axis=0) for masks in part_masks]

    def at(self, times: list[np.ndarray]) -> LimitState:
        """Return the state at some times of each part, and their neighbours."""
        parts = []
        for part, mask in zip(self.parts, times, strict=True):
            neighbourhood = mask.copy()
            neighbourhood[1:] |= mask[:-1]
            neighbourhood[:-1] |= mask[1:]
            if neighbourhood.any():
                parts.append(part.at(np.flatnonzero(neighbourhood)))
        return replace(self, parts=tuple(parts))
