"""The arrays of a store: their metadata, and their chunks as bytes with a checksum.

See zarr-specs.readthedocs.io, version 3.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import google_crc32c
import numpy as np

from flexband.errors import InputError

CODES = {"float64": "<f8", "int64": "<i8", "int8": "|i1", "bool": "|b1"}
"""NumPy's names of kinds of numbers."""


@dataclass(frozen=True)
class Array:
    """What an array is: one with the first dim "run" grows."""

    most_rows: ClassVar[int] = 4096
    """Runs in a chunk, at most."""
    bytes: ClassVar[int] = 1_000_000
    """Size of a chunk of outputs, unless a run is larger."""

    kind: str  # a key of `CODES`, or "string"
    # of all dims, the number of runs left at 0
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    attrs: Mapping[str, Any]
    # of the numbers in the name of a chunk; "/" makes a folder of each, which is slower
    separator: str = "."

    @property
    def grows(self) -> bool:
        """Whether there is one entry a run."""
        return self.dims[:1] == ("run",)

    @cached_property
    def rows(self) -> int:
        """Runs in a chunk."""
        size = 8 * int(np.prod(self.shape[1:], dtype=float))
        return max(1, min(self.most_rows, self.bytes // max(1, size))) if self.grows else 0

    @property
    def chunk(self) -> tuple[int, ...]:
        """Shape of a chunk."""
        shape = (self.rows, *self.shape[1:]) if self.grows else self.shape
        return tuple(max(1, n) for n in shape)

    def metadata(self, runs: int) -> dict[str, Any]:
        """Return the content of zarr.json."""
        shape = (runs, *self.shape[1:]) if self.grows else self.shape
        keys = {"name": "default", "configuration": {"separator": self.separator}}
        numbers = {"name": "bytes", "configuration": {"endian": "little"}}
        texts = {"name": "vlen-utf8", "configuration": {}}
        return {
            "zarr_format": 3,
            "node_type": "array",
            "shape": list(shape),
            "data_type": self.kind,
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(self.chunk)}},
            "chunk_key_encoding": keys,
            "fill_value": {"float64": "NaN", "bool": False, "string": ""}.get(self.kind, 0),
            "codecs": [texts if self.kind == "string" else numbers, {"name": "crc32c"}],
            "attributes": dict(self.attrs),
            "dimension_names": list(self.dims),
            "storage_transformers": [],
        }

    @classmethod
    def from_metadata(cls, metadata: Mapping[str, Any]) -> Array:
        """Return the array of a zarr.json."""
        dims = tuple(metadata["dimension_names"])
        shape = tuple(metadata["shape"])
        if dims[:1] == ("run",):
            shape = (0, *shape[1:])
        separator = metadata["chunk_key_encoding"]["configuration"]["separator"]
        return cls(metadata["data_type"], dims, shape, metadata["attributes"], separator)

    def name(self, chunk: int) -> str:
        """Return the name of the file of the chunk with this number along the first dim."""
        places = [chunk, *(0 for _ in self.dims[1:])][: len(self.dims)]
        return self.separator.join(["c", *map(str, places)])

    def encode(self, values: np.ndarray) -> list[bytes]:
        """Encode a chunk with these first entries, the others the fill value: content, checksum."""
        if self.kind == "string":
            texts = values.ravel()
            count = int(np.prod(self.chunk))
            utf8_texts = {text: str(text).encode() for text in set(texts)}
            framed = {
                text: struct.pack("<I", len(utf8)) + utf8 for text, utf8 in utf8_texts.items()
            }
            parts = [struct.pack("<I", count), *(framed[text] for text in texts)]
            content = b"".join(parts) + struct.pack("<I", 0) * (count - len(texts))
        else:
            numbers = np.ascontiguousarray(values, CODES[self.kind])
            if numbers.shape != self.chunk:
                empty = np.nan if self.kind == "float64" else 0
                numbers = np.full(self.chunk, empty, CODES[self.kind])
                numbers[tuple(map(slice, values.shape))] = values
            content = numbers.tobytes()
        return [content, struct.pack("<I", google_crc32c.value(content))]

    def decode(self, data: bytes) -> np.ndarray:
        """Decode the values of a chunk; raise `ValueError` if it is damaged."""
        content = data[:-4]
        checksum = data[-4:]
        if struct.pack("<I", google_crc32c.value(content)) != checksum:
            raise ValueError("the checksum is wrong")
        if self.kind != "string":
            return np.frombuffer(content, CODES[self.kind]).reshape(self.chunk).copy()
        texts = []
        place = 4
        for _ in range(struct.unpack("<I", content[:4])[0]):
            end = place + 4 + struct.unpack("<I", content[place : place + 4])[0]
            texts.append(content[place + 4 : end].decode())
            place = end
        return np.array(texts, dtype=object).reshape(self.chunk)


def describe_coordinate(name: str, values: np.ndarray) -> tuple[str, np.ndarray, dict[str, Any]]:
    """Return the kind, the stored values and the attributes of a coordinate."""
    kind = values.dtype.kind
    if kind in "fiub":
        stored_kind = {"f": "float64", "b": "bool"}.get(kind, "int64")
        return stored_kind, values.astype(CODES[stored_kind]), {}
    if kind in "Mm":
        since = {"units": "nanoseconds" + (" since 1970-01-01" if kind == "M" else "")}
        return "int64", values.astype(f"{kind}8[ns]").astype("int64"), since
    texts = [str(value) for value in values.ravel()]
    if texts != list(values.ravel()):
        raise InputError(f"coordinate {name!r} must be numbers, times or texts to be recorded")
    return "string", np.array(texts, dtype=object).reshape(values.shape), {}
