"""The runs of a response: evaluated, counted, and checked for what no method can see."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.metadata import version
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from flexband.errors import (
    InputError,
    ResolutionWarning,
    function,
    warn,
    whole,
    without_warnings,
)
from flexband.uncertainty.inputs.choices import cases
from flexband.uncertainty.inputs.constants import Constant
from flexband.uncertainty.inputs.effects import never_read, probes, without_effect
from flexband.uncertainty.inputs.evaluation import evaluate
from flexband.uncertainty.inputs.repetition import check_repetition, middle
from flexband.uncertainty.inputs.space import Response, Space, check_names, locate_fields
from flexband.uncertainty.inputs.unfolding import in_words
from flexband.uncertainty.methods import Method
from flexband.uncertainty.surrogates.extrapolation import reached

Result = TypeVar("Result")

MOST_RUNS = 1_000_000

PACKAGES = ("flexband", "numpy", "scipy", "numba", "xarray")
"""Those whose versions are told in results."""


def _count(runs: int) -> str:
    """Return a number of runs as text; a power of ten if it is astronomical."""
    return str(runs) if runs < 10**12 else f"about 10^{math.log10(runs):.0f}"


def check_method(method: object) -> None:
    """Raise `InputError` if an object is no method."""
    if isinstance(method, type) or not callable(getattr(method, "solve", None)):
        raise InputError(f"method must be one like AdaptivePCCI(0.01); got {method!r}")


def check_runs(method: Method, space: Space, most_runs: int = MOST_RUNS, count: int = 1) -> None:
    """Raise `InputError` if a method takes more runs; it names what a scan could take instead.

    `count` is the number of combinations of options, each with runs of its own.
    """
    runs = count * method.runs(space)
    if runs > most_runs:
        advice = getattr(method, "fitting", None)
        sampled = f". {advice(space, most_runs // count)}" if callable(advice) else ""
        told = sampled or space.advice_on_fields
        raise InputError(
            f"{method!r} would take {_count(runs)} runs, with {space.random_dimension} random and "
            f"{space.interval_dimension} interval variables; most_runs is {most_runs}{told}"
        )


def in_cases(
    solve: Callable[[Runs], Result],
    response: Response,
    inputs: Mapping[str, Any],
    method: Method,
    batch: int,
    most_runs: int,
    progress: Callable[[int, int], object] | None,
) -> dict[str, Result]:
    """Return what is solved for every combination of options, by its label.

    The other arguments and errors are those of `propagate`.
    """
    found: dict[str, Result] = {}
    finished, labels, all_inputs = 0, None, cases(inputs)
    if progress is not None:
        function("progress", progress)

    def advance(done: int, total: int) -> None:
        if progress is not None:
            progress(finished + done, finished + total * (len(all_inputs) - len(found)))

    for label, own in all_inputs.items():
        runs = Runs(response, own, method, batch, most_runs, len(all_inputs), advance)
        runs.labels = labels
        found[label] = solve(runs)
        labels, finished = runs.labels, finished + runs.done
    return found


Call = tuple[np.ndarray, np.ndarray, np.ndarray]
"""ξ, η and values of evaluations."""


class Runs:
    """Evaluations of the response and of its refinements, counted."""

    def __init__(self, response, inputs, method, batch, most_runs, count, progress):
        """Check the arguments of `propagate`, and find the domains of fields.

        `count` is the number of combinations of options, each with runs of its own.
        """
        batch = whole("batch", batch, 1)
        whole("most_runs", most_runs, 1)
        function("response", response)
        check_names(response, inputs)
        with without_warnings(ResolutionWarning):
            located, self.explored = locate_fields(response, inputs)
        self.space = space = Space(located)
        self.done, self.total, self.labels = 0, method.runs(space), None
        check_runs(method, space, most_runs, count)
        self.total += 1  # one run is made again
        self.response, self.method, self.batch = response, method, batch
        self.progress = progress
        self.calls: list[tuple[Response, list[Call]]] = []
        self.repeated = 0
        left_out = self.start.left_out
        if left_out and not getattr(method, "finds_discretization", False):
            raise InputError(
                f"{' and '.join(left_out)} must be given for {method!r}; "
                "only AdaptivePCCI chooses them"
            )

    @property
    def start(self) -> Level:
        """The response as it is given."""
        return Level(self, self.response)

    def __call__(self, response: Response, xi: np.ndarray, eta: np.ndarray) -> xr.DataArray:
        """Evaluate the response, or one that differs from it by the discretization."""
        self.total = max(self.total, self.done + len(xi))
        values = evaluate(response, self.space, xi, eta, self.batch, self._advance, self.labels)
        self.labels = values[:0]
        return values

    def keep(self, response: Response, call: Call) -> None:
        """Keep runs; of the first ones, one is made again."""
        if not self.calls:
            self._repeat(response, *call)
        own = [calls for kept, calls in self.calls if kept is response]
        if own:
            own[0].append(call)
        else:
            self.calls.append((response, [call]))

    def _repeat(
        self, response: Response, xi: np.ndarray, eta: np.ndarray, values: np.ndarray
    ) -> None:
        """Make one of the runs again, alone, and refuse or remark what makes a difference."""
        run = middle(values)

        def again(copies: int) -> np.ndarray:
            self.repeated += copies
            points = (np.repeat(v[run : run + 1], copies, axis=0) for v in (xi, eta))
            with without_warnings():
                return self(response, *points).values

        samples = not callable(getattr(self.method, "expand", None))
        check_repetition(values, again, run, noise_allowed=samples)

    def _advance(self, runs: int) -> None:
        self.done += runs
        self.progress(self.done, self.total)

    def attributes(self) -> dict[str, object]:
        """Return the number of runs and the method, and report that all runs are done.

        Inputs that change no output are warned of.
        """
        self._check_inputs()
        if self.done < self.total:
            self.progress(self.done, self.done)
        xi = np.concatenate([call[0] for _, calls in self.calls for call in calls])
        counts = {"runs": self.done + self.explored, "runs_repeated": self.repeated}
        versions = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
        told = {
            "method": repr(self.method),
            "inputs": in_words(self.space.given),
            "versions": versions,
        }
        return {**counts, **told, **reached(xi)}

    def _check_inputs(self) -> None:
        """Warn of inputs that change no output; the budget may pay for runs that prove it."""
        unread = never_read(self.response, self.space.inputs)
        response, calls = max(self.calls, key=lambda own: sum(len(call[0]) for call in own[1]))
        idle, likely = self._without_effect(calls)
        likely = [name for name in likely if name not in unread]
        further = probes(self.space, likely)
        if likely and self.done + len(further[0]) <= self.total:
            with suppress(Exception), without_warnings(ResolutionWarning):  # failures prove nothing
                values = self(response, *further).values
                still = self._without_effect([(*further, values)])[1]
                idle |= {name: len(further[0]) for name in likely if name in still}
        for name, one in self.space.inputs.items():
            if isinstance(one, Constant):
                continue
            if name in unread:
                warn(f"input {name!r} changes no output: the response never reads it")
            elif name in idle:
                where = " at the two values of it that were run" if idle[name] == 2 else ""
                warn(f"input {name!r} changes no output{where}")

    def _without_effect(self, calls: list[Call]) -> tuple[dict[str, int], list[str]]:
        parts = zip(*calls, strict=True)
        xi, eta, values = (p[0] if len(p) == 1 else np.concatenate(p) for p in parts)
        return without_effect(self.space, (xi, eta), values)


class Level:
    """The response on one discretization, as a function of ξ and η."""

    def __init__(self, runs: Runs, response: Response):
        self.runs, self.response = runs, response
        self.left_out: list[str] = self._of_nominal("left_out", [])

    def __call__(self, xi: np.ndarray, eta: np.ndarray) -> xr.DataArray:
        with without_warnings(ResolutionWarning, when=bool(self.left_out)):
            values = self.runs(self.response, xi, eta)
        self.runs.keep(self.response, (xi, eta, values.values))
        return values

    def refinements(self) -> dict[str, Level]:
        """Return the response on finer discretizations, by the name of what is finer."""
        refined = getattr(self.response, "refined", None)
        whole = {"discretization": refined()} if callable(refined) else {}
        finer = self._of_nominal("refinements", whole)
        return {name: Level(self.runs, response) for name, response in finer.items()}

    def discretization(self) -> dict[str, float]:
        """Return the numbers of the discretization, such as the step, by name."""
        return self._of_nominal("discretization", {})

    def _of_nominal(self, name: str, default: Any) -> Any:
        """Return what a method of the response tells for inputs at their means and midpoints."""
        method, space = getattr(self.response, name, None), self.runs.space
        if not callable(method):
            return default
        return method(**space.arguments_at(*space.nominal()))
