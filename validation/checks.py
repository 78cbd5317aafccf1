"""What a reference problem gives: numbers of ours beside published ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class Check(NamedTuple):
    """One number beside its reference; the tolerance is absolute."""

    name: str
    reference: float
    ours: float
    tolerance: float

    @property
    def difference(self) -> float:
        """How far the two are apart."""
        return abs(self.ours - self.reference)

    @property
    def holds(self) -> bool:
        """Whether that is within the tolerance; a NaN is not."""
        return self.difference <= self.tolerance


def differences(
    name: str, ours: np.ndarray, reference: Sequence[float], tolerance: float
) -> list[Check]:
    """Return a check for each component of a vector of the plane."""
    return [
        Check(f"{name} {axis}", float(r), float(o), tolerance)
        for axis, o, r in zip("XY", ours, reference, strict=True)
    ]
