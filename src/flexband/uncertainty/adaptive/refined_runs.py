"""Runs that are made again on finer discretizations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.errors import RunError, warn
from flexband.progress import listener
from flexband.uncertainty.adaptive.runs import ResponseRuns, succeeded
from flexband.uncertainty.methods.method import Evaluate
from flexband.uncertainty.surrogates.axes import series
from flexband.words import number_of


class RefinedRuns(NamedTuple):
    """Runs on a discretization, and again where something of it is finer.

    Attributes
    ----------
    coarse : the first ones at points of the design, the others held out.
    fine : on the discretization twice as fine, shape (runs, outputs, times).
    finest : the first held-out runs where it is twice as fine again, (≤ held, outputs, times).
    held : number of runs that are held out of the correction.
    """

    coarse: ResponseRuns
    fine: np.ndarray
    finest: np.ndarray
    held: int = 0

    @property
    def count(self) -> int:
        """Number of finer runs."""
        return len(self.fine) + len(self.finest)

    @property
    def fitted(self) -> int:
        """Number of runs at points of the design."""
        return len(self.fine) - self.held

    @property
    def third_level(self) -> slice:
        """The runs that are made on three levels."""
        return slice(self.fitted, self.fitted + len(self.finest))

    @property
    def levels(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Values of the coarse, the fine and the finest runs."""
        return self.coarse.values, self.fine, self.finest

    def with_held(
        self, coarse: ResponseRuns, fine: np.ndarray, finest: np.ndarray
    ) -> RefinedRuns:
        """Return the runs with others that are held out."""
        joined = ResponseRuns.joined(self.coarse, coarse)
        return RefinedRuns(joined, np.concatenate([self.fine, fine]), finest, len(fine))


def in_words(evaluate: Evaluate) -> str:
    """Return the step and the elements of a response, or what it tells of its discretization."""
    return ", ".join(f"{name} {n:.6g}" for name, n in evaluate.discretization().items())


def refined_runs(evaluate: Evaluate, coarse: ResponseRuns) -> dict[str, RefinedRuns]:
    """Return runs again on finer discretizations, by the name of what is finer.

    None are returned if one fails, which is an error where the discretization is left to the
    method.
    """
    runs: dict[str, RefinedRuns] = {}
    try:
        for name, response in evaluate.refinements().items():
            fine = _made(response, coarse.xi, coarse.eta, f"tell the error of the {name}")
            runs[name] = RefinedRuns(coarse, fine, fine[:0])
    except RunError as error:
        if evaluate.left_out:
            raise
        warn(f"the discretization error is not estimated: {error}")
        return {}
    return runs


def with_held_out(
    runs: RefinedRuns, name: str, evaluate: Evaluate, held: ResponseRuns, finest: int
) -> RefinedRuns:
    """Return refined runs with others that are held out, the first of them on a third level.

    Nothing is added if one of them fails.

    Parameters
    ----------
    name : of what is finer.
    held : runs that are held out.
    finest : number of them on the third level.
    """
    why = f"judge the correction of the {name}"
    try:
        response = evaluate.refinements()[name]
        fine = _made(response, held.xi, held.eta, why)
        finer = response.refinements()[name]
        third = _made(finer, held.xi[:finest], held.eta[:finest], why)
    except RunError as error:
        warn(f"the error of the {name} is not corrected: {error}")
        return runs
    return runs.with_held(held, fine, third)


def _made(response: Evaluate, xi: np.ndarray, eta: np.ndarray, purpose: str) -> np.ndarray:
    """Return runs on a finer discretization, shape (runs, outputs, times)."""
    listener().stage(f"{number_of(len(xi), 'run')} that {purpose} ({in_words(response)})")
    finer = ResponseRuns(xi, eta, series(response(xi, eta)))
    return succeeded(finer, len(xi)).values
