"""What a method is, and what it runs: the response as a function of standard variables."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from flexband.basics.response import Description
from flexband.basics.words import number_of
from flexband.errors import InputError
from flexband.remarks.collection import CollectedRemark
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.diagnostics import Quantities
from flexband.uncertainty.surrogates.surrogate import Surrogate

MAX_RUNS = 1_000_000
"""Runs that a method may take if nothing else is said."""

REFINEMENTS = "a response that has `refinements`, as that of dynamic_response"
"""What a correction needs."""

HELD = 4
"""Runs that methods with given orders hold out, if they do."""


class EarlierRuns(NamedTuple):
    """Runs that a store has of other inputs or methods."""

    xi: np.ndarray = np.zeros((0, 0))
    eta: np.ndarray = np.zeros((0, 0))
    values: np.ndarray = np.zeros((0, 0))  # (runs, …)
    remarks: Sequence[CollectedRemark] = ()


class Evaluate(ABC):
    """The response at points of the standard variables, and what it says about itself."""

    @cached_property
    def description(self) -> Description:
        """What the response says about itself."""
        return Description()

    @abstractmethod
    def __call__(self, xi: np.ndarray, eta: np.ndarray) -> xr.DataArray:
        """Return the outputs at ξ of shape (runs, n) and η of shape (runs, m): (sample, ...)."""

    def refinements(self) -> Mapping[str, Evaluate]:
        """Return the response on discretizations twice as fine, by the name of what is finer."""
        return {}

    def discretization_in_words(self) -> str:
        """Return the numbers of the discretization as text."""
        numbers = self.description.discretization.items()
        return ", ".join(f"{name} {n:.6g}" for name, n in numbers)

    def earlier_runs(self, max_runs: int) -> EarlierRuns:
        """Return up to so many earlier runs at generic points."""
        return EarlierRuns()

    def at_more_times(self, xi: np.ndarray, eta: np.ndarray) -> xr.DataArray | None:
        """Return uncounted runs at all steps, evenly between the response's times, or None."""
        return None

    def correct_surrogate(
        self,
        surrogate: Surrogate,
        runs: tuple[np.ndarray, np.ndarray, np.ndarray],
        nodes: Sequence[np.ndarray] | None = None,
    ) -> Surrogate:
        """Return a surrogate whose error of step and elements is corrected by finer runs.

        It was fitted to runs: ξ, η and values. If they are at a tensor product with Gauss points of
        the random variables, `nodes` are those of each interval variable.
        """
        raise InputError(f"correct=True needs {REFINEMENTS}")


def quantities(evaluate: Evaluate, outputs: int) -> Quantities:
    """Return of which vector or tensor each output is a component."""
    names = evaluate.description.quantities
    tensors = evaluate.description.tensors
    if len(names) != outputs:
        return Quantities.alone(outputs)
    return Quantities(np.unique(names, return_inverse=True)[1], np.isin(names, tensors))


class Method(ABC):
    """At which points the response is run, and how bands are computed from its values.

    Attributes
    ----------
    name : of the method.
    expands : whether it makes a surrogate.
    chooses_discretization : whether it chooses what the response leaves out of its discretization,
        so that it finds out how many runs it needs.
    skips_failed : whether it goes on without runs that fail.
    correct : whether the error of step and elements is corrected.
    copies : how many times all outputs are in memory while they are fitted.
    copies_per_carrier : the same for each carrier that is tried.
    """

    name: str = ""
    expands: bool = False
    chooses_discretization: bool = False
    skips_failed: bool = False
    correct: bool = False
    copies: float = 2.0
    copies_per_carrier: float = 0.0

    @property
    def label(self) -> str:
        """Name and orders, for tables and figures."""
        return self.name

    @property
    def aimed_error(self) -> float | None:
        """The error of the bands at which it stops, relative to the error bar's width, or None."""
        return None

    @abstractmethod
    def runs(self, space: Space) -> int:
        """Return the number of runs, or the most there may be."""

    def finer_runs(self, space: Space, names: int) -> int:
        """Return the most runs of a correction if this many of step and elements can be finer."""
        return 0

    @abstractmethod
    def solve(self, space: Space, evaluate: Evaluate, sigmas: float = 1.0) -> xr.Dataset:
        """Run the response at the points of the method and return the bands, of μ ± kσ."""

    def peak_memory(self, intervals: int, runs: int, run_bytes: float) -> tuple[float, float]:
        """Return the bytes at the peak of a study, and those that each carrier adds.

        They are beside Python and its libraries. Carriers that are tried count, also if they are
        not used in the end. While a method fits outputs, it has `copies` of them. Then there are
        bands, whose places grow with the number of intervals. `benchmarks/memory/study_memory.py`
        measures both. `run_bytes` are those of the outputs of one run.
        """
        smallest = 4e6  # of a study with the smallest outputs
        bounds = 6 * (1 + intervals)  # of μ, μ − σ and μ + σ: each has a value and a place
        in_result = 12 + 4 * intervals  # ends of bands and errors; places of the ends of both bands
        peak_runs = max(self.copies * runs, (1 + self.expands) * runs + bounds + in_result)
        return smallest + run_bytes * peak_runs, run_bytes * runs * self.copies_per_carrier

    def advice(self, space: Space, most_runs: int) -> str:
        """Return which options take at most so many runs, as text; "" if that is not known."""
        return ""


class ExpansionMethod(Method):
    """A method that expands the response, and computes bands from the surrogate."""

    expands = True

    @abstractmethod
    def expand(self, space: Space, evaluate: Evaluate) -> Surrogate:
        """Run the response at the points of the method and return the surrogate."""

    def linear_runs(self, space: Space) -> int:
        """Return how many runs tell how the error of the discretization depends on the inputs."""
        return 1 + space.interval_dimension + space.random_dimension

    def finer_runs(self, space: Space, names: int) -> int:
        """Return the most runs of a correction; one of them is finer in all that can be.

        Of each name these are `linear_runs`, two held-out ones, and one of these on a third level.
        """
        corrects = self.correct and not self.chooses_discretization
        return ((self.linear_runs(space) + 3) * names + (names > 1)) * corrects

    def solve(self, space: Space, evaluate: Evaluate, sigmas: float = 1.0) -> xr.Dataset:
        """Return the bands and the diagnostics."""
        return self.expand(space, evaluate).bands(sigmas)


class UserMethod(Method):
    """An object with `name`, `label`, `runs` and `solve` as a method.

    Further attributes that it has are those of a `Method`.
    """

    def __init__(self, method: Any) -> None:
        self.method = method
        self.name = method.name
        for name in ("chooses_discretization", "skips_failed", "copies", "copies_per_carrier"):
            setattr(self, name, getattr(method, name, getattr(Method, name)))

    def __repr__(self) -> str:
        return repr(self.method)

    @property
    def label(self) -> str:
        return self.method.label

    def runs(self, space: Space) -> int:
        return self.method.runs(space)

    def solve(self, space: Space, evaluate: Evaluate, sigmas: float = 1.0) -> xr.Dataset:
        return self.method.solve(space, evaluate, sigmas)


class UserExpansion(UserMethod, ExpansionMethod):
    """A `UserMethod` with `expand`."""

    def expand(self, space: Space, evaluate: Evaluate) -> Surrogate:
        return self.method.expand(space, evaluate)


def as_method(method: Any) -> Method:
    """Return an object as a method; raise `InputError` if it is none."""
    if isinstance(method, Method):
        return method
    if isinstance(method, type) or not callable(getattr(method, "solve", None)):
        name = method.__name__ if isinstance(method, type) else ""
        text = f"the class {name}: write {name}(…)" if name else repr(method)
        raise InputError(f"method must be one like AdaptivePCCI(0.01); got {text}")
    expands = callable(getattr(method, "expand", None))
    return UserExpansion(method) if expands else UserMethod(method)


def check_runs(
    method: Method, space: Space, most_runs: int = MAX_RUNS, count: int = 1, names: int = 0
) -> None:
    """Raise `InputError` if a method takes more runs, or a scan of `count` combinations does."""
    runs = count * (method.runs(space) + method.finer_runs(space, names))
    if runs > most_runs:
        advice = as_method(method).advice(space, most_runs // count)
        suggestion = f". {advice}" if advice else space.advice_on_fields
        power = f"about 10^{math.log10(runs):.0f}"
        count_of_runs = number_of(runs, "run") if runs < 10**12 else power + " runs"
        raise InputError(
            f"{method!r} would take {count_of_runs}, with {space.random_dimension} random and "
            f"{number_of(space.interval_dimension, 'interval variable')}; most_runs is "
            f"{most_runs}{suggestion}"
        )
