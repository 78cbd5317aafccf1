"""Runs that are made again on finer discretizations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from flexband.basics.progress import listener
from flexband.basics.warning import warn
from flexband.basics.words import number_of
from flexband.errors import RunError
from flexband.uncertainty.adaptive.response_runs import ResponseRuns, evaluate_runs
from flexband.uncertainty.methods.method import Evaluate


class RefinedRuns(NamedTuple):
    """Runs on a discretization, and again where something of it is finer."""

    coarse: ResponseRuns  # the first ones at points of the design, the others held out
    fine: np.ndarray  # on the discretization twice as fine, shape (runs, outputs, times)
    finest: np.ndarray  # first check runs, twice as fine again, (≤ held, outputs, times)
    fitted: int  # number of runs at points of the design

    @property
    def fine_run_count(self) -> int:
        """Number of runs on finer discretizations."""
        return len(self.fine) + len(self.finest)

    @property
    def change(self) -> np.ndarray:
        """Root mean square of the change on the finer discretization, (outputs, times)."""
        return np.sqrt(np.mean((self.fine - self.coarse.values) ** 2, axis=0))

    @property
    def third_level(self) -> slice:
        """The runs that are made on three levels."""
        return slice(self.fitted, self.fitted + len(self.finest))

    @property
    def levels(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Values of the coarse, the fine and the finest runs."""
        return self.coarse.values, self.fine, self.finest

    def with_design(self, design: ResponseRuns, evaluate: Evaluate, name: str) -> RefinedRuns:
        """Return these runs after others at points of the design, which are made here.

        `evaluate` is the response on the finer discretization, and `name` what is finer.
        """
        fine = _make_runs(evaluate, design, f"tell the error of the {name}")
        coarse = ResponseRuns.concatenate(design, self.coarse)
        return RefinedRuns(coarse, np.concatenate([fine, self.fine]), self.finest, len(fine))

    def with_finest(self, count: int, evaluate: Evaluate, name: str) -> RefinedRuns:
        """Return these runs, the first held-out ones on a third level, too.

        Nothing is added if one of them fails, or the response has no third level. Parameters are
        those of `with_design`.
        """
        try:
            finest_response = evaluate.refinements().get(name)
            if finest_response is None:
                return self
            holdout = self.coarse.which(slice(self.fitted, self.fitted + count))
            return self._replace(
                finest=_make_runs(finest_response, holdout, f"show the order of the {name}")
            )
        except RunError as error:
            if not evaluate.description.left_out:  # otherwise a finer level is tried
                warn(f"the error of the {name} is not corrected: {error}")
            return self


def refined_runs(evaluate: Evaluate, coarse: ResponseRuns, fitted: int) -> dict[str, RefinedRuns]:
    """Return runs again on finer discretizations, by the name of what is finer.

    None are returned if one fails, which is an error where the discretization is left to the
    method. The first ones are `fitted`, at points of the design; the others are held out.
    """
    runs: dict[str, RefinedRuns] = {}
    try:
        for name, response in evaluate.refinements().items():
            fine = _make_runs(response, coarse, f"tell the error of the {name}")
            runs[name] = RefinedRuns(coarse, fine, fine[:0], fitted)
    except RunError as error:
        if evaluate.description.left_out:
            raise
        warn(f"the discretization error is not estimated: {error}")
        return {}
    return runs


def refined_together(
    evaluate: Evaluate, run: ResponseRuns, names: Sequence[str]
) -> np.ndarray | None:
    """Return a run where all that is named is finer at once, (outputs, times); None if it fails."""
    for name in names:
        evaluate = evaluate.refinements()[name]
    try:
        return _make_runs(evaluate, run, f"tell the error of {' and '.join(names)} together")[0]
    except RunError:
        return None


def _make_runs(response: Evaluate, coarse: ResponseRuns, purpose: str) -> np.ndarray:
    """Make runs on a finer discretization; return them, shape (runs, outputs, times)."""
    xi, eta, _ = coarse
    listener().stage(f"{number_of(len(xi), 'run')} that {purpose}")
    return evaluate_runs(response, xi, eta, len(xi)).values
