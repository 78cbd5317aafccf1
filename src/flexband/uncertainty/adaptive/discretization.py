"""The error of step and mesh: a few runs are repeated on a discretization twice as fine.

Phases, envelopes and base of the finer runs differ little from those of the coarse ones, and the
difference is nearly linear in the inputs. Added to the expansion, it gives that of the finer
response, and the bands of both tell the error: for a method of order two it is 4/3 of their
difference (Richardson).
"""

from __future__ import annotations

import numpy as np

from flexband.errors import RunError, warn
from flexband.progress import listener
from flexband.uncertainty.adaptive.choice import BestFits
from flexband.uncertainty.adaptive.fits import GrowingDesign, PartsFit
from flexband.uncertainty.adaptive.runs import ResponseRuns, succeeded
from flexband.uncertainty.expansions.expansion import extremes_of
from flexband.uncertainty.methods.pcci import Evaluate
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.surrogates.axes import series
from flexband.uncertainty.surrogates.diagnostics import apart, at_all_times, stacked
from flexband.words import number_of

RICHARDSON = 4 / 3

MAX_TIMES = 600
"""Times at which the bands are compared."""


def thinned(times: int) -> slice:
    """Return at which of so many times bands are compared."""
    return slice(None, None, -(-times // MAX_TIMES))


def at_compared_times(stage: Stage) -> Stage:
    """Return a stage at the times at which bands are compared, without the memory of all times."""
    return stage.at(thinned(stage.base.shape[-1])).copy()


def discretization_error(
    design: GrowingDesign, choice: BestFits, stages: list[Stage], fine: slice
) -> np.ndarray:
    """Return how far interval mean and error bar are off, shape (2, outputs, times).

    Parameters
    ----------
    choice : fits of coarse runs, for the number of carriers of each output.
    stages : coarse runs of the design, and among others some on a finer discretization, at
        `thinned` times.
    fine : the first runs of the design on the finer discretization.
    """
    carriers, times = np.minimum(choice.carriers, len(stages) - 1), choice.missed.shape[-1]
    coarse_expansions, fine_expansions = [], []
    for k in np.unique(carriers):
        stage = stages[k]
        fit = PartsFit.of(design, stage)
        before, after = stage.runs(slice(fine.stop - fine.start)), stage.runs(fine)
        moved = design.small(fit.columns.pack(after) - fit.columns.pack(before))
        finer = fit._replace(parts=fit.formed + moved)
        outputs = np.flatnonzero(carriers == k)
        coarse_expansions.append(fit.of_outputs(outputs).expansion)
        fine_expansions.append(finer.of_outputs(outputs).expansion)
    bounds = (
        stacked(extremes_of(expansions)) for expansions in (coarse_expansions, fine_expansions)
    )
    return RICHARDSON * at_all_times(apart(*bounds), thinned(times), times)


def refinements(evaluate: Evaluate) -> dict[str, Evaluate]:
    """Return a response on finer discretizations, by the name of what is finer."""
    return getattr(evaluate, "refinements", dict)()


def in_words(evaluate: Evaluate) -> str:
    """Return the step and the elements of a response, or what it tells of its discretization."""
    numbers = getattr(evaluate, "discretization", dict)()
    return ", ".join(f"{name} {n:.6g}" for name, n in numbers.items())


def runs_on_finer(evaluate: Evaluate, xi: np.ndarray, eta: np.ndarray) -> dict[str, np.ndarray]:
    """Return runs at points on finer discretizations, (points, outputs, times), by name.

    None are returned if one fails, which is an error where the discretization is left to the
    method.
    """
    runs: dict[str, np.ndarray] = {}
    try:
        for name, response in refinements(evaluate).items():
            listener().stage(
                f"{number_of(len(xi), 'run')} that tell the error of the {name} "
                f"({in_words(response)})"
            )
            finer = ResponseRuns(xi, eta, series(response(xi, eta)))
            runs[name] = succeeded(finer, len(xi)).values
    except RunError as error:
        if getattr(evaluate, "left_out", []):
            raise
        warn(f"the discretization error is not estimated: {error}")
        return {}
    return runs
