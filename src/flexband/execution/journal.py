"""Runs on disk at once, before they are in the arrays: records appended to a file.

Whatever is appended survives the end of the process. Arrays are written from time to time only;
then a new file begins, and the old ones are removed once the arrays are on disk.
"""

from __future__ import annotations

import json
import os
import struct
from pathlib import Path
from typing import NamedTuple

import google_crc32c
import numpy as np

from flexband.basics.files import read_unlinked

FRAME = struct.Struct("<QI")
"""Length and checksum of a record."""


class Finished(NamedTuple):
    """Runs that are finished together: all done, or all failed for a reason."""

    setting: str
    inputs: np.ndarray  # (runs, inputs)
    values: np.ndarray | None  # (runs, …)
    reason: str
    seconds: float  # a run
    time: float  # when, since 1970 [s]
    remarks: tuple[str, ...] = ()  # of each run, see `layout`; none if no run has one


class Journal:
    """The files of a folder whose names begin with "journal"."""

    def __init__(self, folder: Path):
        """Find the files that there are; a new one begins with the first record."""
        self.folder = folder
        self.number = max((_number(file) for file in self._files()), default=0)
        self._file = None

    def read(self, runs: int) -> list[Finished]:
        """Return the records of runs from this number on, without those that are damaged."""
        records = []
        for file in self._files():
            data = read_unlinked(file)
            place = 0
            while place + FRAME.size <= len(data):
                length, checksum = FRAME.unpack_from(data, place)
                body = data[place + FRAME.size : place + FRAME.size + length]
                place += FRAME.size + length
                if len(body) == length > 0 and google_crc32c.value(body) == checksum:
                    first, record = _decode(body)
                    if first >= runs:
                        records.append(record)
        return records

    def append(self, first: int, finished: Finished, *, sync: bool, large: int = 1_000_000) -> None:
        """Append runs numbered from `first` on; records below `large` bytes are written at once."""
        body = _encode(first, finished)
        checksum = 0
        for part in body:
            checksum = google_crc32c.extend(checksum, part)
        if self._file is None:
            self.number += 1
            file = self.folder / f"journal-{self.number:06d}"
            self._file = open(file, "ab", buffering=0, opener=_open_new)  # noqa: SIM115
        end = os.fstat(self._file.fileno()).st_size
        size = sum(part.nbytes for part in body)
        parts = [FRAME.pack(size, checksum), *body]
        try:
            for part in parts if size > large else [b"".join(parts)]:
                remaining = memoryview(part).cast("B")
                while remaining:
                    remaining = remaining[self._file.write(remaining) :]
            if sync:
                os.fsync(self._file.fileno())
        except BaseException:
            self._file.truncate(end)
            raise

    def rotate(self) -> list[Path]:
        """Begin a new file with the next record; return the files that there are."""
        file = self._file
        self._file = None  # also if it cannot be closed
        if file is not None:
            file.close()
        return self._files()

    def _files(self) -> list[Path]:
        return sorted(self.folder.glob("journal-*"), key=_number)


def _open_new(file: str, flags: int) -> int:
    return os.open(file, flags | os.O_EXCL, 0o666)


def _number(file: Path) -> int:
    end = file.name.removeprefix("journal-")
    return int(end) if end.isdecimal() else 0


def _encode(first: int, record: Finished) -> list[np.ndarray]:
    about = {
        "first": first,
        "setting": record.setting,
        "inputs": record.inputs.shape,
        "values": None if record.values is None else record.values.shape,
        "reason": record.reason,
        "seconds": record.seconds,
        "time": record.time,
        "remarks": record.remarks,
    }
    header = json.dumps(about).encode()
    arrays = [record.inputs] if record.values is None else [record.inputs, record.values]
    head = np.frombuffer(struct.pack("<I", len(header)) + header, np.uint8)
    return [head, *(np.ascontiguousarray(v, "<f8") for v in arrays)]


def _decode(body: bytes) -> tuple[int, Finished]:
    length = struct.unpack_from("<I", body)[0]
    about = json.loads(body[4 : 4 + length])
    numbers = np.frombuffer(body, "<f8", offset=4 + length)
    rows, columns = about["inputs"]
    inputs = numbers[: rows * columns].reshape(rows, columns)
    values = None
    if about["values"] is not None:
        values = numbers[rows * columns :].reshape(about["values"])
    return about["first"], Finished(
        setting=about["setting"],
        inputs=inputs,
        values=values,
        reason=about["reason"],
        seconds=about["seconds"],
        time=about["time"],
        remarks=tuple(about.get("remarks", ())),
    )
