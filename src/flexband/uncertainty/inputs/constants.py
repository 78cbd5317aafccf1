"""Inputs whose value is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeGuard

import numpy as np

from flexband.uncertainty.inputs.inputs import Input


@dataclass(frozen=True)
class Constant(Input):
    """A plain number among the inputs, or an option of a choice; an array (n,) for the response."""

    constant: float | int | bool | str

    @property
    def dimension(self) -> int:
        return 0

    def __repr__(self) -> str:
        return repr(self.constant)

    def value(self, standard: np.ndarray) -> np.ndarray:
        return np.full(len(standard), self.constant)

    def as_numbers(self, name: str, standard: np.ndarray) -> dict[str, np.ndarray]:
        return {}

    def run_numbers(self, name: str, standard: np.ndarray) -> dict[str, np.ndarray]:
        """Return the value, unless it is a text."""
        if isinstance(self.constant, str):
            return {}
        return {name: np.full(len(standard), float(self.constant))}

    def standard(self, value: np.ndarray) -> np.ndarray:
        return np.zeros((np.size(value), 0))


def is_number(value: object) -> TypeGuard[float]:
    """Return whether an object is a plain finite number."""
    kinds = int | float | np.integer | np.floating
    if isinstance(value, bool | np.timedelta64) or not isinstance(value, kinds):
        return False
    try:
        return bool(np.isfinite(float(value)))  # pyright: ignore[reportArgumentType]
    except OverflowError:  # of an int
        return False
