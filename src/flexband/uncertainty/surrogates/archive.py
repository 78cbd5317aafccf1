"""Named arrays and a text in one file: NumPy's .npz, read without trust in what it says."""

from __future__ import annotations

import hashlib
import json
import math
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flexband.basics.files import replace_file

TEXT = "about"
"""Name of the array that holds the text."""

DIGEST = "digest"
"""Name of the array that holds the digest of all others."""

SMALL_SIZE = 2**26
"""Bytes that the arrays of any file may have."""


class Archive(NamedTuple):
    """The content of a file, and whether it is what was written."""

    about: Any
    arrays: dict[str, np.ndarray]
    intact: bool


def write_archive(file: Path, about: Any, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays and a record of numbers and texts, compressed unless that is suspicious."""
    contents: dict[str, Any] = {TEXT: np.array(json.dumps(about)), **arrays}
    contents[DIGEST] = np.array(digest(contents))
    for save in (np.savez_compressed, np.savez):
        with replace_file(file) as partial:
            with partial.open("wb") as stream:
                save(stream, **contents)
            with zipfile.ZipFile(partial) as archive:
                if _is_plausible(archive, partial):
                    return


def digest(arrays: Mapping[str, np.ndarray]) -> str:
    """Return a number, as text, that changes with any name, kind, shape and value of arrays."""
    checksum = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        checksum.update(json.dumps([name, array.dtype.str, array.shape]).encode())
        checksum.update(array.tobytes())
    return checksum.hexdigest()


def read_archive(file: Path) -> Archive:
    """Return the record and the arrays of a file; some error tells that it is damaged."""
    with zipfile.ZipFile(file) as archive:
        if not _is_plausible(archive, file):
            raise ValueError("the file is much smaller than its content")
        names = archive.namelist()
        if len(set(names)) < len(names):
            raise ValueError("two arrays of one name")
        arrays = {name.removesuffix(".npy"): _array(archive.read(name)) for name in names}
    stored_digest = str(arrays.pop(DIGEST, ""))
    intact = stored_digest == digest(arrays)
    text = str(arrays.pop(TEXT))
    return Archive(json.loads(text, parse_constant=_refuse), arrays, intact)


def _is_plausible(archive: zipfile.ZipFile, file: Path) -> bool:
    # of the size of the arrays to that of the file: a small file cannot fill the memory
    max_ratio = 200
    size = sum(member.file_size for member in archive.infolist())
    return size <= max(SMALL_SIZE, max_ratio * file.stat().st_size)


def _array(content: bytes) -> np.ndarray:
    """Return the array of a .npy file, whose header must be true to the size of the content."""
    stream = BytesIO(content)
    version = np.lib.format.read_magic(stream)
    read = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }[version]
    shape, _, dtype = read(stream)
    if dtype.kind not in "biufUMm" or min(shape, default=0) < 0:
        raise ValueError(f"an array of {dtype} and shape {shape}")
    if math.prod(shape) * dtype.itemsize != len(content) - stream.tell():
        raise ValueError("an array that is not as large as it says")
    stream.seek(0)
    array = np.lib.format.read_array(stream, allow_pickle=False)
    if dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError("an array with numbers that are not finite")
    return array


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is no finite number")
