"""Margins of limits for all values of the inputs in a box, and where they are least."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexband.analysis.allocation.adjustment import SIGNS, Adjusted, bars_of, series_with_limits
from flexband.analysis.allocation.tolerances import Tolerances
from flexband.analysis.sampled import SampledSeries
from flexband.requirements.corridors import Corridor
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.inputs.narrowing import fix_inputs, part_of
from flexband.uncertainty.surrogates.surrogate import Surrogate

SAME = 1e-4
"""Distance in η up to which places are the same."""


@dataclass(frozen=True, eq=False)
class WatchedPlaces:
    """Where margins are watched."""

    series: np.ndarray  # numbers of outputs and times among those that are limited, (points,)
    side: np.ndarray  # 0 where the lower limit is near, 1 where the upper one is, (points,)
    places: np.ndarray  # in the box, −1 to 1 in every η, (points, m); η of compensators

    @staticmethod
    def none(m: int) -> WatchedPlaces:
        return WatchedPlaces(np.zeros(0, int), np.zeros(0, int), np.zeros((0, m)))

    def select(self, which: np.ndarray) -> WatchedPlaces:
        return WatchedPlaces(self.series[which], self.side[which], self.places[which])

    def with_new(self, points: WatchedPlaces, adjusted: Sequence[int] = ()) -> WatchedPlaces:
        """Return these points and those of others that differ from them.

        Points that differ in the `adjusted` variables alone are the same.
        """
        keys = {key.tobytes() for key in self.keys(adjusted)}
        new = points.select(
            np.array([k.tobytes() not in keys for k in points.keys(adjusted)], bool)
        )
        return WatchedPlaces(
            np.concatenate([self.series, new.series]),
            np.concatenate([self.side, new.side]),
            np.concatenate([self.places, new.places]),
        )

    def keys(self, adjusted: Sequence[int] = ()) -> np.ndarray:
        """Return whole numbers that tell points apart, (points, 2 + m)."""
        rounded = np.round(self.places / SAME)
        rounded[:, list(adjusted)] = 0.0
        return np.column_stack([self.series, self.side, rounded]).astype(int)

    def __len__(self) -> int:
        return len(self.series)


@dataclass(frozen=True, eq=False)
class WorstCaseBounds:
    """The margins of μ ± kσ, or, without random inputs, of the response, for given tolerances."""

    tolerances: Tolerances
    expansions: tuple[Expansion, ...]  # of the outputs and times that are limited
    numbers: np.ndarray  # of their series in the response, (series,)
    bounds: np.ndarray  # lower and upper limit, (2, series)
    scale: np.ndarray  # by which margins of each series are divided in a search, (series,)
    sigmas: float  # k; 0 without random inputs

    @staticmethod
    def from_surrogate(
        surrogate: Surrogate, tolerances: Tolerances, corridor: Corridor, sigmas: float
    ) -> WorstCaseBounds:
        """Return the margins of a corridor on a surrogate."""
        expansions, numbers, bounds = series_with_limits(surrogate, corridor)
        k = sigmas if surrogate.space.random_dimension else 0.0
        bare = WorstCaseBounds(
            tolerances, tuple(expansions), numbers, bounds, np.ones(len(numbers)), k
        )
        low, high, _ = bare._extremes(np.zeros_like(tolerances.bounds[1]))
        width = (high - low).reshape(-1, bare.times).mean(axis=1)
        size = np.maximum(abs(low), abs(high)).reshape(-1, bare.times).max(axis=1)
        return replace(bare, scale=np.repeat(np.maximum(width, 1e-9 * size + 1e-300), bare.times))

    @property
    def times(self) -> int:
        """Number of times."""
        return len(self.numbers) // sum(len(expansion.outputs) for expansion in self.expansions)

    def margins(self, bars: np.ndarray) -> np.ndarray:
        """Return the margins of lower and upper ends, both (…, 2, series)."""
        return SIGNS[:, None] * (bars - self.bounds)

    def tighten_limits(self, by: np.ndarray) -> WorstCaseBounds:
        """Return the bounds with limits that are tighter by so much, (2, series) or a number."""
        return replace(self, bounds=self.bounds + SIGNS[:, None] * by)

    def _narrow_expansions(
        self, x: np.ndarray, *, random_alone: bool = False
    ) -> Sequence[Expansion]:
        inputs = self.tolerances.inputs(x, random_alone=random_alone)
        if not inputs:
            return self.expansions
        part = part_of(self.tolerances.space, inputs)
        return [
            expansion.substitute(part.substitutions, part.space.families)
            for expansion in self.expansions
        ]

    def bars(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return lower and upper end of μ ± kσ in the box, (series,), and where they are.

        With compensators these are the ends where margins are least after these are adjusted.
        """
        if not self.tolerances.compensators:
            return self._extremes(x)
        return self.with_compensators(self._narrow_expansions(x)).worst(vertices=True)

    def with_compensators(self, expansions: Sequence[Expansion]) -> Adjusted:
        """Return the response with compensators, in the variables of narrower inputs or of all."""
        columns = self.tolerances.compensators.values()
        m = self.tolerances.space.interval_dimension
        return Adjusted(expansions, self.bounds, self.scale, self.sigmas, list(columns), m)

    def _extremes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return what `bars` does without compensators."""
        multiples = [-self.sigmas, self.sigmas] if self.sigmas else [0.0]
        extremes = [
            expansion.extremes(multiples) * (3 - len(multiples))
            for expansion in self._narrow_expansions(x)
        ]
        m = self.tolerances.space.interval_dimension
        ends = [[(pair[k].values[k], pair[k].places[k]) for pair in extremes] for k in (0, 1)]
        low, high = (np.concatenate([values.ravel() for values, _ in end]) for end in ends)
        places = [
            np.concatenate([eta.reshape(values.size, m) for values, eta in end]) for end in ends
        ]
        return low, high, np.stack(places)

    def least_margins(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the least margins in the box, (2, series), and where they are, (2, series, m)."""
        low, high, places = self.bars(x)
        return self.margins(np.stack([low, high])), places

    def lowest(self, margins: np.ndarray, places: np.ndarray, threshold: float) -> WatchedPlaces:
        """Return the points of local minima over time of margins below `threshold` scales."""
        side, series = np.nonzero(self._lowest(margins[None], threshold)[0])
        return WatchedPlaces(series, side, places[side, series])

    def at_places(self, x: np.ndarray, points: WatchedPlaces, threshold: float) -> WatchedPlaces:
        """Return what `lowest` does at each of the places of some points on its own.

        The best compensators make several margins the least, also at neighbouring times.
        """
        places = np.unique(points.places, axis=0)
        eta = self.tolerances.center(x) + self.tolerances.radius(x) * places
        margins = self.margins(self.bars_at(eta, x))
        scaled = margins / self.scale
        smallest_margins = scaled.min(axis=(1, 2), keepdims=True)
        lowest = self._lowest(margins, threshold) | (scaled < smallest_margins + SAME * SAME)
        place, side, series = np.nonzero(lowest)
        return WatchedPlaces(series, side, places[place])

    def _lowest(self, margins: np.ndarray, threshold: float) -> np.ndarray:
        """Return which margins (rows, 2, series) are local minima over time below `threshold`."""
        scaled_margins = margins.reshape(-1, self.times) / np.tile(
            self.scale.reshape(-1, self.times), (2 * len(margins), 1)
        )
        padded = np.pad(scaled_margins, ((0, 0), (1, 1)), constant_values=np.inf)
        lowest = (
            (scaled_margins <= padded[:, :-2])
            & (scaled_margins < padded[:, 2:])
            & (scaled_margins < threshold)
        )
        return lowest.reshape(margins.shape)

    def values(self, x: np.ndarray, points: WatchedPlaces) -> np.ndarray:
        """Return the margins at points for several tolerances (rows, names), (rows, points)."""
        margins = np.empty((len(x), len(points)))
        if not self.sigmas:
            return self._without_scatter(x, points)
        scatters, which = np.unique(self.tolerances.scatter(x), axis=0, return_inverse=True)
        time_numbers, index = np.unique(points.series % self.times, return_inverse=True)
        for k in range(len(scatters)):
            rows = np.flatnonzero(which.ravel() == k)
            eta = self._eta(x[rows], points)
            for expansion, row in self._rows(
                self._narrow_expansions(x[rows[0]], random_alone=True)
            ):
                output = points.series // self.times - row
                columns = np.flatnonzero((output >= 0) & (output < len(expansion.outputs)))
                if len(columns):
                    mean, std = expansion.select(expansion.outputs, time_numbers).moments(eta)
                    bar = np.stack([mean - self.sigmas * std, mean + self.sigmas * std], axis=1)
                    bar = bar.reshape(len(rows), len(points), *bar.shape[1:])
                    side = points.side[columns]
                    series = points.series[columns]
                    bar_values = bar[:, columns, side, output[columns], index[columns]]
                    margins[np.ix_(rows, columns)] = SIGNS[side] * (
                        bar_values - self.bounds[side, series]
                    )
        return margins

    def _without_scatter(self, x: np.ndarray, points: WatchedPlaces) -> np.ndarray:
        """Return what `values` does without random inputs: each series at its own places."""
        margins = np.empty((len(x), len(points)))
        sign = SIGNS[points.side]
        eta = self._eta(x, points).reshape(*margins.shape, points.places.shape[1])
        for number, series in enumerate(self._sampled_series):
            columns = np.flatnonzero(points.series // self.times == number)
            times = np.tile(points.series[columns] % self.times, len(x))
            flat = eta[:, columns].reshape(len(times), eta.shape[-1])
            values = series.values(series.basis(np.zeros((1, 0))), flat, times).reshape(len(x), -1)
            margins[:, columns] = sign[columns] * (
                values - self.bounds[points.side[columns], points.series[columns]]
            )
        return margins

    @cached_property
    def _sampled_series(self) -> list[SampledSeries]:
        return [
            series
            for expansion in self.expansions
            for series in SampledSeries.of_outputs(expansion)
        ]

    def _eta(self, x: np.ndarray, points: WatchedPlaces) -> np.ndarray:
        """Return η of points for several tolerances, one after the other, (rows points, m)."""
        tolerances = self.tolerances
        eta = tolerances.center(x)[:, None, :] + tolerances.radius(x)[:, None, :] * points.places
        return eta.reshape(len(x) * len(points), eta.shape[-1])

    def bars_at(self, eta: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return lower and upper end of μ ± kσ at η, (points, 2, series), with a scatter."""
        return bars_of(self._narrow_expansions(x, random_alone=True), eta, self.sigmas)

    def _rows(self, expansions: Sequence[Expansion]) -> list[tuple[Expansion, int]]:
        """Return each expansion with the number of its first output."""
        counts = [len(expansion.outputs) for expansion in expansions]
        return list(zip(expansions, np.cumsum([0, *counts]).tolist()[:-1], strict=True))

    def violation(self, names: Sequence[str], side: int, series: int) -> float:
        """Return by how much a limit is violated with some inputs at their nominal values."""
        output, at = divmod(series, self.times)
        expansion, row = [pair for pair in self._rows(self.expansions) if pair[1] <= output][-1]
        part = expansion.select(expansion.outputs[[output - row]], np.array([at]))
        part = part.substitute(*fix_inputs(self.tolerances.space, names))
        value = part.extremes([-self.sigmas, self.sigmas])[side].values[side].item()
        return float(SIGNS[side] * (self.bounds[side, series] - value))
