"""Named tuples for compiled code, passed as one address.

The engine needs hundreds of numbers and arrays. Compiled code would pass each number of a named
tuple, and seven or more of each array, with every call, and passing arguments takes most of the
compile time. A `Record` is the address of a table of all of them, which kernels read where they
need one. Nothing in it changes while they run, so that LLVM may move what it reads out of loops.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from flexband.compilation.caching import Addressed
from flexband.compilation.functions import Deferred
from flexband.mechanics.kernels.lane_arrays import address

types = Deferred("flexband.mechanics.kernels.types.record")


class Record(Addressed):
    """A named tuple, which may be nested, of numbers and contiguous arrays, for compiled code."""

    def __init__(self, fields: Any):
        self.fields = fields
        numbers: list[int] = []
        self.kind = _add_numbers(fields, numbers)
        self.numbers = np.array(numbers, np.int64)
        self.address = address(self.numbers)

    @property
    def _numba_type_(self) -> Any:  # by which Numba knows what a record is
        return types.RecordType(self.fields)


def _add_numbers(fields: Any, numbers: list[int]) -> str:
    """Append what compiled code reads of the fields to a list of numbers, and return their kind."""
    kinds = []
    for field in fields:
        if isinstance(field, np.ndarray):
            numbers.append(address(field))
            if field.dtype.kind == "f":
                kinds.append("n")
            else:
                numbers += field.shape
                kinds.append(f"{field.dtype.char}{field.ndim}")
        elif isinstance(field, tuple):
            kinds.append(_add_numbers(field, numbers))
        else:
            numbers.append(field)
            kinds.append("n")
    return f"{type(fields).__name__}({','.join(kinds)})"
