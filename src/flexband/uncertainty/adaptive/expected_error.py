"""The error that is expected of bands: what their expansion misses in check runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexband.basics.rounding import ROUNDING, Units
from flexband.uncertainty.adaptive.choice import BestFits
from flexband.uncertainty.expansions.expansion import (
    SIGMAS,
    Expansion,
    Extremes,
    extremes_of,
    join_outputs,
)
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.surrogates.diagnostics import (
    DOUBT,
    Quantities,
    missed_part,
    of_bands,
    rms,
    running_rms,
    share,
    unseen_steps,
    varying_outputs,
)


@dataclass(frozen=True)
class ExpectedError:
    """What is known of the bands of a choice of fits."""

    choice: BestFits
    values: np.ndarray  # error expected of the error bar, shape (outputs, times)
    size: np.ndarray  # root mean square of the runs, (outputs,); ∞ for outputs that do not vary
    window: int  # half of the number of times over which errors are averaged
    missed: np.ndarray  # part of the variation in runs that are not fitted, (outputs,)
    quantities: Quantities  # of which vector or tensor each output is a component
    steps: np.ndarray  # error of counts that are alike in all runs, shape (outputs, times)

    @cached_property
    def extremes(self) -> list[Extremes]:
        """Bounds of μ, μ − σ and μ + σ at some of the times."""
        return extremes_of(self.expansions)

    def slopes(self, families: Sequence[Family]) -> np.ndarray:
        """Return half of how outputs differ one standard deviation to both sides of a median.

        The shape is (n, outputs × times), relative to the error bar's width.
        """
        n = len(families)
        m = self.extremes[0].places.shape[-1]
        xi = of_normals(np.concatenate([np.eye(n), -np.eye(n)]), families)
        at = xi, np.zeros((2 * n, m))
        parts = [expansion.evaluate(*at) for expansion in self.expansions]
        values = join_outputs(self.expansions, parts, 1)
        differences = (values[:n] - values[n:]) / 2 / self.width[:, None]
        return differences.reshape(n, -1)

    def bounds_at(self, eta: np.ndarray) -> np.ndarray:
        """Return the lowest μ − σ and the highest μ + σ at places η, shape (2, outputs, times)."""
        if not len(eta):
            lowest = np.full(self.extremes[0].values.shape[1:], np.inf)
            return np.stack([lowest, -lowest])
        mean, std = self.moments(eta)
        return np.stack([(mean - std).min(axis=0), (mean + std).max(axis=0)])

    def moments(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return μ and σ at places η at some of the times, each (places, outputs, times)."""
        moments = [expansion.moments(eta) for expansion in self.expansions]
        mean, std = (
            join_outputs(self.expansions, values, 1) for values in zip(*moments, strict=True)
        )
        return mean, std

    @cached_property
    def of_integration(self) -> np.ndarray:
        """The error of mean and error bar since moments are integrated, (2, outputs, times).

        It is known at some of the times; others have the largest of the nearest three of these.
        """
        errors = [
            expansion.integration_error(
                [
                    Extremes(e.values[:, expansion.outputs], e.places[:, expansion.outputs])
                    for e in self.extremes
                ],
                SIGMAS,
            )
            for expansion in self.expansions
        ]
        band_errors = of_bands(join_outputs(self.expansions, errors, 2))
        order = np.argsort(self.times)
        edges = [(0, 0)] * 2 + [(1, 1)]
        around = np.pad(band_errors[..., order], edges, mode="edge")
        largest = np.maximum(np.maximum(around[..., :-2], around[..., 1:-1]), around[..., 2:])
        at = np.arange(self.values.shape[-1])
        nearest = np.abs(at[:, None] - self.times[order]).argmin(axis=1)
        return largest[..., nearest]

    @cached_property
    def expansions(self) -> list[Expansion]:
        """The expansions of all outputs at some of the times."""
        return self.choice.expansions(self.times)

    @property
    def times(self) -> np.ndarray:
        """Some of the times, by number, which no oscillation keeps in step with."""
        times = self.values.shape[-1]
        max_count = 48
        if times <= max_count:
            return np.arange(times)
        golden = (5**0.5 - 1) / 2
        k = np.arange(max_count)
        return (times * (k + golden * k % 1) / max_count).astype(int)

    @cached_property
    def width(self) -> np.ndarray:
        """Mean of the error bar's width, shape (outputs,); ∞ for outputs that do not vary.

        That of a tensor's component is the width of the widest one; that of others is at least
        `SMALL` times that of the widest component of the same quantity.
        """
        return self.quantities.at_least(self.component_width, tensors=1.0)

    @cached_property
    def component_width(self) -> np.ndarray:
        """The width without a look at other components."""
        _, lower, upper = self.extremes
        width = (upper.values[1] - lower.values[0]).mean(axis=-1)
        return np.maximum(width, ROUNDING * self.size + 1e-300)

    @property
    def small(self) -> np.ndarray:
        """Which outputs vary, but less than the component by whose width errors are judged."""
        return np.isfinite(self.size) & (self.component_width < self.width)

    @property
    def zero_width_mask(self) -> np.ndarray:
        """Mask of outputs that vary, but have bands of no width for want of terms, (outputs,)."""
        size = np.where(np.isfinite(self.size), self.size, -np.inf)
        width = self.quantities.at_least(self.component_width)
        return width <= ROUNDING * size + 1e-300

    def relative(self, error: np.ndarray, width: np.ndarray | None = None) -> float:
        """Return the largest mean over time of errors (…, outputs, times) relative to the width."""
        return float((error.mean(axis=-1) / (self.width if width is None else width)).max())

    def of_outputs(self, error: np.ndarray) -> np.ndarray:
        """Return the same of each output, of errors (2, outputs, times) of mean and error bar."""
        return (error.mean(axis=-1) / self.width).max(axis=0)

    @staticmethod
    def from_choice(
        choice: BestFits,
        generic: int,
        F: np.ndarray,
        dt: float,
        m: int,
        units: Units,
        quantities: Quantities,
    ) -> ExpectedError:
        """Return the error expected.

        Parameters
        ----------
        generic : number of check runs at generic points, which are the first.
        F : all runs, shape (runs, outputs, times), at steps of dt.
        m : number of interval variables.
        units : of the outputs.
        quantities : of which each output is a component.
        """
        size = rms(F)
        times = F.shape[-1]
        of_runs = choice.missed, choice.later[None]
        missed = np.max([missed_part(errors, F, units, quantities) for errors in of_runs], axis=0)
        groups = np.split(choice.missed, [generic])
        squares = [np.mean(group**2, axis=0) for group in groups if len(group)]
        square = np.max([*squares, choice.later**2], axis=0)
        not_followed = missed >= DOUBT / 2  # a bound may be where most is missed
        largest = np.max(choice.missed[:, not_followed] ** 2, axis=0, initial=0.0)
        square[not_followed] = np.maximum(square[not_followed], largest)
        part = np.where(not_followed, max(1.0, share(m)), share(m))[:, None]
        values = part * np.hypot(np.sqrt(square), choice.overshoot)
        period = 1 / (choice.frequencies[0] * dt) if choice.frequencies else times / 50
        window = min(max(1, round(period)), times)
        values = running_rms(values, window)
        values = np.maximum(values, np.finfo(float).eps * size[:, None])
        size = np.where(varying_outputs(F, units), size, np.inf)
        return ExpectedError(choice, values, size, window, missed, quantities, unseen_steps(F))
