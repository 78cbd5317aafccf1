"""The discretization of a response that has a default: it is refined where that is too coarse.

A few runs are made on it and again where it is finer. Their change over the range of the outputs
tells the error, in parts of the error bar's width.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.inputs.sampling import points_at_ends
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.diagnostics import Quantities, largest_of, rms


class RefinementOptions(NamedTuple):
    """When what has a default is refined."""

    share: float = 0.1  # part of the tolerance of a method that this error may have
    tolerance: float = 0.01  # of methods without one, in parts of the error bar's width
    runs: int = 8  # that tell the error, as many as are simulated at once
    fall: float = 3.0  # of the error with every refinement, which is expected
    least_fall: float = 1.5  # of outputs that count: other errors do not fall
    most: int = 5  # refinements
    rounding: float = 1e-9  # range of an output, relative to its values, that is none


OPTIONS = RefinementOptions()

Run = Callable[[int, np.ndarray, np.ndarray], np.ndarray | None]
"""Returns the outputs (runs, outputs, times) with so many refinements, None if a run fails."""


def refinements_needed(
    run: Run, space: Space, tolerance: float | None, of: Callable[[int], Quantities]
) -> int:
    """Return how often the discretization must be refined.

    `tolerance` is that of the method, `of` tells the vectors of so many outputs. Outputs whose
    range is due to rounding do not count, and those whose error does not fall ask for nothing
    finer.
    """
    allowed = OPTIONS.share * (tolerance or OPTIONS.tolerance)
    points = points_at_ends(OPTIONS.runs, space.interval_dimension, space.families, seed=0)
    before, coarse, counted = np.inf, run(0, *points), None
    for refinements in range(OPTIONS.most):
        fine = None if coarse is None else run(refinements + 1, *points)
        if coarse is None or fine is None:
            return refinements
        error = errors(coarse, fine, of(coarse.shape[1]))
        falls = error * OPTIONS.least_fall < before
        counted = falls if counted is None else counted & falls
        worst = np.max(error, where=counted, initial=0.0)
        if worst <= allowed:
            return refinements
        if worst <= OPTIONS.fall * allowed:
            return refinements + 1
        before, coarse = error, fine
    return OPTIONS.most


def errors(coarse: np.ndarray, fine: np.ndarray, of: Quantities) -> np.ndarray:
    """Return the errors of coarse runs over the ranges of their outputs, (outputs,)."""
    error = rms(coarse - fine) * OPTIONS.fall / (OPTIONS.fall - 1.0)
    spread = rms((fine.max(axis=0) - fine.min(axis=0))[None])
    size = np.abs(fine).max(axis=(0, 2))
    spread, size = largest_of(spread, of.of), largest_of(size, of.of)
    none = spread <= OPTIONS.rounding * size
    return np.where(none, 0.0, error / np.where(none, 1.0, spread))
