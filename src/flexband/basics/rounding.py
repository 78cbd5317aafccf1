"""What is constant but for rounding: one rule for runs, verdicts, warnings and tables.

What is zero in theory, as the height of a slider on a level guide, is rounding errors of other
outputs of its unit. Where all outputs of a unit are zero, the model knows how large these errors
are: it says so in an attribute of the coordinate "unit".
"""

from __future__ import annotations

import math
import re
from collections.abc import Hashable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

ROUNDING = 1e-13
"""An output that varies by less than this part of the largest one of its unit is constant."""

ROUNDING_ERRORS = "rounding_errors"
"""Attribute of a coordinate "unit", as text: "1e-15 m, 3e-14 rad"."""

NUMBER_AND_UNIT = re.compile(r"(\d+(?:\.\d+)?(?:e[-+]?\d+)?) ([^,]+)")


class Units(NamedTuple):
    """The units of outputs.

    `of` is the number of the unit of each output; `rounding` has the errors of outputs of this
    unit, as far as the model knows them; both have shape (outputs,).
    """

    of: np.ndarray
    rounding: np.ndarray

    @staticmethod
    def unknown(outputs: int) -> Units:
        """Return units that differ, of which nothing is known."""
        return Units(np.arange(outputs), np.zeros(outputs))

    @staticmethod
    def along(values: xr.DataArray | xr.Dataset, dims: Sequence[Hashable]) -> Units:
        """Return the units of the outputs along some dims; unknown ones differ."""
        sizes = [values.sizes[d] for d in dims]
        unit = values.coords.get("unit")
        count = math.prod(sizes)
        if unit is None or not set(unit.dims) <= set(dims):
            return Units.unknown(count)
        unit_dims = [d for d in dims if d in unit.dims]
        shape = [values.sizes[d] if d in unit_dims else 1 for d in dims]
        texts = np.broadcast_to(unit.transpose(*unit_dims).values.reshape(shape), sizes).ravel()
        names = list(map(str, texts))
        levels = rounding_levels(unit)
        unit_numbers = {name: k for k, name in enumerate(names) if name.strip()}
        of = np.array([unit_numbers.get(name, k) for k, name in enumerate(names)], dtype=int)
        return Units(of, np.array([levels.get(name, 0.0) for name in names]))

    def least_variation(self, size: np.ndarray, part: float = ROUNDING) -> np.ndarray:
        """Return by how much outputs vary at least that are not constant, (outputs,).

        It is `part` of the largest size, (outputs,), of the outputs of the same unit.
        """
        largest = np.maximum(largest_of(size, self.of), ROUNDING * size.max(initial=0.0))
        return np.maximum(part * largest, self.rounding)

    def varies(self, spread: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Return which outputs vary by more than rounding, (outputs,); the others are constant.

        `spread` is by how much each output varies, and `size` how large it is, (outputs,).
        """
        return spread > self.least_variation(size)


def largest_of(sizes: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return for each output the largest finite size in its group, which is a number."""
    largest = np.zeros(groups.max(initial=-1) + 1)
    np.maximum.at(largest, groups, np.where(np.isfinite(sizes), sizes, 0.0))
    return largest[groups]


def rounding_attributes(levels: Mapping[str, float]) -> dict[str, str]:
    """Return the attribute of a coordinate "unit" that tells rounding errors by unit."""
    return {ROUNDING_ERRORS: ", ".join(f"{level!r} {unit}" for unit, level in levels.items())}


def rounding_levels(unit: xr.DataArray) -> dict[str, float]:
    """Return the rounding errors by unit that a coordinate "unit" tells."""
    pairs = NUMBER_AND_UNIT.findall(str(unit.attrs.get(ROUNDING_ERRORS, "")))
    return {name: float(level) for level, name in pairs}


def unit_of_variable(variable: xr.DataArray, default: str = "") -> str:
    """Return the unit of a variable or coordinate, its attribute "units"."""
    return str(variable.attrs.get("units", default))
