"""Exceptions, warnings, and checks that refuse bad input where it enters."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from flexband.basics.namespaces import unknown_name
from flexband.basics.words import number_of

__all__ = [
    "AssemblyError", "FlexbandWarning", "FormerNameWarning", "InputError", "ModelError",
    "ResolutionWarning", "RunError", "RunsNeeded", "SimulationError", "StoreError",
    "StrainWarning", "ToleranceWarning",
]  # fmt: skip

if not TYPE_CHECKING:

    def __getattr__(name):
        raise unknown_name(__name__, name)

    def __dir__():
        return __all__


class InputError(ValueError):
    """An invalid argument; the message states its name, its value and what is allowed."""


class FlexbandWarning(UserWarning):
    """A result or an input that is likely not what was meant; the message states why."""


class ResolutionWarning(FlexbandWarning):
    """Steps or elements are too large; the message states where, and by how much."""


class StrainWarning(FlexbandWarning):
    """A flexible member is strained beyond linear elasticity; the message states by how much."""


class ToleranceWarning(FlexbandWarning):
    """The error that is expected of a result is above its tolerance; the message states both."""


class FormerNameWarning(FlexbandWarning, FutureWarning):
    """A name is used that has a new one; the message states it."""


class StoreError(RuntimeError):
    """The folder of a study cannot be used; the message states why, and what can be done."""


class ModelError(RuntimeError):
    """A model outside of flexband fails; the message states which one, and why."""


class RunError(RuntimeError):
    """Some runs failed; the message states the inputs, the time and the reason of each.

    Attributes
    ----------
    failures : dict
        Number of the sample in the batch -> (time [s], reason).
    results : DataArray or None
        The values of all runs of the batch, NaN for those that failed.
    """

    def __init__(self, message: str, failures: dict[int, tuple[float, str]], results: Any = None):
        super().__init__(message)
        self.failures = failures
        self.results = results

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.failures, self.results)


class RunsNeeded(RuntimeError):  # noqa: N818  (nothing is wrong)
    """Runs are needed of a response that other people run: see `elsewhere`.

    Attributes
    ----------
    points : the inputs' numbers of every run, shape (runs, inputs).
    names : of the inputs.
    setting : the options of a `Choice`.
    """

    def __init__(self, points: np.ndarray, names: Iterable[str], setting: str = ""):
        self.points = points
        self.names = list(names)
        self.setting = setting
        where = f" with {setting}" if setting else ""
        super().__init__(
            f"{number_of(len(points), 'run')} of {', '.join(self.names)}{where} must come from "
            "elsewhere: "
            "`flexband export-points` writes them, `flexband import-results` records their results"
        )


class AssemblyError(RunError):
    """The constraints cannot be satisfied, or do not determine their multipliers."""


class SimulationError(RunError):
    """Some runs diverged during the integration."""
