"""Arrays inside a web page: compressed, as text, which `assets/arrays.js` reads."""

from __future__ import annotations

import zlib
from base64 import b64encode
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

JsonRecord = dict[str, Any]
"""What JSON can hold: texts, numbers, lists, packed arrays and other records, by name."""


def pack(values: ArrayLike, quantum: float | None = None) -> JsonRecord:
    """Return an array as a JSON record: its `shape`, compressed `data` and `bytes` per number.

    Numbers are rounded to multiples of `quantum`, if these are finite and have at most 32 bits; by
    default they keep all their digits.
    """
    array = np.ascontiguousarray(values, dtype="<f8")
    record = {"shape": list(array.shape)}
    kind = "<f8"
    if quantum:
        with np.errstate(over="ignore", invalid="ignore"):
            multiples = np.rint(array / quantum)
        largest = np.abs(multiples).max(initial=0.0)
        if largest < 2**31:  # not NaN either
            kind = "<i2" if largest < 2**15 else "<i4"
            array = multiples.astype(kind)
            record = record | {"quantum": quantum}
    size = array.dtype.itemsize
    planes = array.view(np.uint8).reshape(-1, size).T if array.size else array
    data = b64encode(zlib.compress(planes.tobytes())).decode()
    return record | {"bytes": size, "data": data}
