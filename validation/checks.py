"""Comparison of computed numbers with published ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class Check(NamedTuple):
    """A computed number and its reference; the tolerance is absolute."""

    name: str
    reference: float
    result: float
    tolerance: float

    @property
    def difference(self) -> float:
        """Absolute difference between the two."""
        return abs(self.result - self.reference)

    @property
    def holds(self) -> bool:
        """Whether the difference is within the tolerance; False for NaN."""
        return self.difference <= self.tolerance


def differences(
    name: str, results: np.ndarray, reference: Sequence[float], tolerance: float
) -> list[Check]:
    """Return one check for each component of a plane vector."""
    return [
        Check(f"{name} {axis}", float(r), float(o), tolerance)
        for axis, o, r in zip("XY", results, reference, strict=True)
    ]
