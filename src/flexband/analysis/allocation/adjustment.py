"""Margins with compensators: inputs that are adjusted for each value of the others.

A machine with tolerances x is adjusted once, for its whole motion. Its margin is the largest over
the compensators c of the least one over all limits and times. What a limit leaves is the least of
this over all x:  min_x max_c min_t margin(x, c, t).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from flexband.analysis.descent import descend, local_minima
from flexband.analysis.peaks import BESIDE
from flexband.errors import InputError
from flexband.requirements.corridors import Corridor
from flexband.uncertainty.expansions.bounds.scan import lobatto, scan, scatter_points, tensor_grid
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.inputs.choices import Compensator
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.surrogate import Surrogate

SIGNS = np.array([1.0, -1.0])
"""Of a value in the margins of the lower and of the upper limit."""


@dataclass(frozen=True)
class AdjustmentOptions:
    """How compensators are adjusted, and the worst place is searched."""

    first_points: int = 9
    """Points of each compensator that are tried first."""
    last_step: float = 1e-7
    """Last step of the search of a compensator."""
    shrinkages: tuple[float, float] = (0.5, 0.8)
    """Factors of the step for one compensator, a bisection, and for two."""
    scan_order: int = 3
    """Order of the expansion for which places are scanned."""
    max_vertices: int = 256
    """Most places where vertices alone are scanned."""
    starts: int = 4
    """Places from which the worst one is searched."""
    tolerance: float = 1e-9
    """Part of the scale that counts as no gain of this search."""
    margins_at_once: int = 4_000_000
    """Margins that are computed together."""


def compensators(space: Space) -> dict[str, int]:
    """Return the number of η of each `Compensator`, by name; raise `InputError` if over two."""
    adjusted = [name for name, size in space.design_inputs.items() if isinstance(size, Compensator)]
    columns = {name: k for name, k in space.columns(random=False).items() if name in adjusted}
    if len(columns) > 2:
        raise InputError(f"at most 2 inputs can be a Compensator; got {', '.join(columns)}")
    return columns


def bars_of(expansions: Sequence[Expansion], eta: np.ndarray, sigmas: float) -> np.ndarray:
    """Return lower and upper end of μ ± kσ at η, (points, 2, series); the response if k is 0."""
    bars = []
    for expansion in expansions:
        if sigmas:
            mean, std = expansion.moments(eta)
            bar = np.stack([mean - sigmas * std, mean + sigmas * std], axis=1)
        else:
            values = expansion.evaluate(np.zeros((len(eta), 0)), eta)
            bar = np.stack([values, values], axis=1)
        bars.append(bar.reshape(len(eta), 2, -1))
    return np.concatenate(bars, axis=2)


def series_with_limits(
    surrogate: Surrogate, corridor: Corridor
) -> tuple[list[Expansion], np.ndarray, np.ndarray]:
    """Select the series that have limits: expansions, their numbers in the response, and limits.

    Outputs that have any are expanded at all times at which one of them is limited, and the times
    `BESIDE` them. The numbers have the shape (series,), the lower and upper limits (2, series).
    """
    times = surrogate.times
    bounds = np.stack([corridor.lower, corridor.upper]).reshape(2, -1, times)
    is_limited = np.asarray(np.isfinite(bounds).any(axis=0))
    beside = np.ones(2 * BESIDE + 1)
    at = np.flatnonzero(np.convolve(is_limited.any(axis=0), beside)[BESIDE:-BESIDE] > 0)
    expansions = []
    numbers = []
    for expansion in surrogate.expansions:
        outputs = expansion.outputs[is_limited[expansion.outputs].any(axis=1)]
        if len(outputs):
            expansions.append(expansion.select(outputs, at))
            numbers.append((outputs[:, None] * times + at).ravel())
    series = np.concatenate(numbers)
    return expansions, series, bounds.reshape(2, -1)[:, series]


@dataclass(frozen=True, eq=False)
class Adjusted:
    """A response whose compensators are adjusted to meet requirements."""

    expansions: Sequence[Expansion]  # of the series that are limited, in η from −1 to 1
    bounds: np.ndarray  # lower and upper limit, (2, series)
    scale: np.ndarray  # by which margins are divided to be compared, (series,)
    sigmas: float  # k of μ ± kσ; 0 without random inputs
    columns: Sequence[int]  # numbers of the compensators among the m variables η
    m: int
    options: AdjustmentOptions = field(default_factory=AdjustmentOptions)

    def worst(self, *, vertices: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return lower and upper end of μ ± kσ where margins are least, (series,), and their η.

        With `vertices`, places are searched from vertices alone, and not from a whole scan.
        """
        others = [k for k in range(self.m) if k not in self.columns]
        options = self.options
        if not vertices:
            points, beside = scan((options.scan_order,) * len(others))
        elif 2 ** len(others) <= options.max_vertices:
            points, beside = tensor_grid([2] * len(others))
        else:
            points, beside = scatter_points(options.max_vertices, np.ones(len(others), bool))

        def embed_places(places: np.ndarray) -> np.ndarray:
            eta = np.zeros((len(places), self.m))
            eta[:, others] = places
            return eta

        def margin(places: np.ndarray, _: np.ndarray) -> np.ndarray:
            return self.best(embed_places(places))[0]

        # Scan the other inputs, and descend from the places where margins are smallest.
        values = margin(points, points)
        starts = np.unique(local_minima(values[:, None], beside, options.starts))
        which = np.zeros(len(starts), int)
        gain = np.full(len(starts), options.tolerance)
        _, minima = descend(margin, which, points[starts], values[starts], gain)
        _, eta = self.best(embed_places(np.concatenate([points, minima])))
        # Take the smallest margin of each series and side over all these places.
        bars = self._bars(eta)
        margins = SIGNS[:, None] * (bars - self.bounds)
        row = margins.argmin(axis=0)
        low, high = np.take_along_axis(bars, row[None], axis=0)[0]
        return low, high, eta[row]

    def best(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the least margin at η, (points,), and η with the best compensators."""
        columns = list(self.columns)
        # Try a grid first, then the neighbours of the best point with smaller and smaller steps.
        first = lobatto(self.options.first_points)
        shrinkage = self.options.shrinkages[len(columns) - 1]
        grid = np.array(list(product(first, repeat=len(columns))))
        around = np.array(list(product((-1.0, 0.0, 1.0), repeat=len(columns))))
        around = around[np.abs(around).max(axis=1) > 0]
        best = eta.copy()
        values = np.full(len(eta), -np.inf)
        step = float(np.diff(first).max())
        trials = np.tile(grid, (len(eta), 1, 1))
        while True:
            candidates = np.repeat(best[:, None], trials.shape[1], axis=1)
            candidates[..., columns] = trials
            margins = self._least_margins(candidates.reshape(-1, self.m)).reshape(len(eta), -1)
            at = margins.argmax(axis=1)
            better = np.take_along_axis(margins, at[:, None], axis=1)[:, 0] > values
            rows = np.flatnonzero(better)
            values[rows] = margins[rows, at[rows]]
            best[rows] = candidates[rows, at[rows]]
            step *= shrinkage
            if step < self.options.last_step:
                return values, best
            trials = np.clip(best[:, None, columns] + step * around, -1.0, 1.0)

    def _least_margins(self, eta: np.ndarray) -> np.ndarray:
        """Return the least margin of all series at each η, relative to the scale, (points,)."""
        block = max(1, self.options.margins_at_once // self.bounds.size)
        blocks = (self._bars(eta[k : k + block]) for k in range(0, len(eta), block))
        margins = (SIGNS[:, None] * (bars - self.bounds) / self.scale for bars in blocks)
        return np.concatenate([block_margins.min(axis=(1, 2)) for block_margins in margins])

    def _bars(self, eta: np.ndarray) -> np.ndarray:
        return bars_of(self.expansions, eta, self.sigmas)
