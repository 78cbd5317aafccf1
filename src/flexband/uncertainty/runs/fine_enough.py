"""The discretization of a response that has a default: it is refined where that is too coarse.

A few runs are made on it and again where it is finer. Their change over the range of the outputs
tells the error, relative to the error bar's width.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.basics.progress import listener
from flexband.errors import InputError, RunError
from flexband.uncertainty.inputs.sampling import points_at_ends
from flexband.uncertainty.methods.method import quantities
from flexband.uncertainty.runs.counted_runs import CountedRuns, Level
from flexband.uncertainty.surrogates.axes import series
from flexband.uncertainty.surrogates.diagnostics import Quantities, largest_of, rms


class DefaultOptions(NamedTuple):
    """When what has a default is refined."""

    share: float = 0.1  # part of the tolerance of a method that this error may have
    tolerance: float = 0.01  # of methods without one, relative to the error bar's width
    runs: int = 8  # that tell the error, as many as are simulated at once
    fall: float = 3.0  # of the error with every refinement, which is expected
    least_fall: float = 1.5  # of outputs that count: other errors do not fall
    max_refinements: int = 5
    rounding: float = 1e-9  # range of an output, relative to its values, that is none


OPTIONS = DefaultOptions()


def start_fine_enough(runs: CountedRuns) -> None:
    """Let runs start on a discretization whose error is small enough for their method.

    Outputs whose range is due to rounding do not count, and those whose error does not fall ask for
    nothing finer. A discretization on which a run fails is not taken.
    """
    listener().stage("the first runs, which tell if the default of the step is short enough")
    max_error = OPTIONS.share * (runs.method.aimed_error or OPTIONS.tolerance)
    coarse = _outputs(runs, runs.start)
    before = np.inf
    output_mask = np.array(True)
    for _ in range(OPTIONS.max_refinements):
        # Run the next finer level, and compare.
        next_level = runs.start
        for name in runs.base_level.description.by_default:
            next_level = next_level.refinements()[name]
        fine = None if coarse is None else _outputs(runs, next_level)
        if coarse is None or fine is None:
            return
        error = errors(coarse, fine, quantities(runs.base_level, coarse.shape[1]))
        output_mask = output_mask & (error * OPTIONS.least_fall < before)
        # Stop if this error is allowed, or that of the finer level, which is smaller.
        worst = np.max(error, where=output_mask, initial=0.0)
        if worst <= max_error:
            return
        runs.start = next_level
        if worst <= OPTIONS.fall * max_error:
            return
        before = error
        coarse = fine


def _outputs(runs: CountedRuns, level: Level) -> np.ndarray | None:
    """Return the outputs of uncounted runs, (runs, outputs, times); None if one fails."""
    space = runs.space
    xi, eta = points_at_ends(OPTIONS.runs, space.interval_dimension, space.families, seed=0)
    try:
        values = runs.at_other_times(level.response, xi, eta)
    except (RunError, InputError, MemoryError):
        return None
    return series(values) if len(values) == len(xi) else None


def errors(coarse: np.ndarray, fine: np.ndarray, of: Quantities) -> np.ndarray:
    """Return the errors of coarse runs over the ranges of their outputs, (outputs,)."""
    error = rms(coarse - fine) * OPTIONS.fall / (OPTIONS.fall - 1.0)
    spread = rms((fine.max(axis=0) - fine.min(axis=0))[None])
    size = np.abs(fine).max(axis=(0, 2))
    spread = largest_of(spread, of.of)
    size = largest_of(size, of.of)
    zero_mask = spread <= OPTIONS.rounding * size
    return np.where(zero_mask, 0.0, error / np.where(zero_mask, 1.0, spread))
