"""Arrays that grow along the dim "run", in Zarr's format, and survive whatever kills a program.

Chunks are written to new files, synced and renamed. The sizes of all arrays are in one file, the
consolidated metadata of their group, which is replaced last: whoever opens the group, at any
moment, finds every array with the same number of runs. A chunk that was written before its group
knows of it is written again. Chunks end with a checksum, so that damaged ones are found. What is
not an entry of a run, and could not be made again, is written twice.

The format is written here, since Zarr's own library neither syncs nor changes several arrays at
once, and takes several milliseconds for each change.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import google_crc32c
import numpy as np

from flexband.basics.files import Content, refuse_links, write_synced
from flexband.errors import StoreError
from flexband.execution.chunks import CODES, Array

FORMAT = 1
"""Of the store; a program refuses stores with a larger number."""

GROUP = "zarr.json"
COPY = "zarr.json.copy"
"""Files of the consolidated metadata."""


class GrowingArrays:
    """A group of arrays in a folder, and the number of runs that they have."""

    def __init__(self, folder: Path):
        """Open the group, or begin one that has no arrays, which the first `commit` writes."""
        self.folder = folder
        self.runs = 0
        self.attrs: dict[str, Any] = {"format": FORMAT}
        self.arrays: dict[str, Array] = {}
        self._last: dict[str, np.ndarray] = {}
        self._blank: set[Path] = set()  # chunks of empty texts that are on disk
        refuse_links(folder)
        reason = None
        for name in (GROUP, COPY):
            try:
                self._read_metadata(folder / name)
                return
            except (OSError, ValueError, KeyError, TypeError) as error:
                reason = reason or error
        if any(file.suffix != ".partial" for file in folder.glob("*")):
            raise StoreError(
                f"{folder / GROUP} and its copy are missing or damaged: {reason}. The runs are in "
                "the other files of this folder; put back a copy of this one, or take another "
                "folder"
            )

    def _read_metadata(self, file: Path) -> None:
        metadata = json.loads(file.read_bytes())
        attrs = metadata["attributes"]
        members = metadata["consolidated_metadata"]["metadata"]
        if attrs["format"] > FORMAT:
            raise StoreError(
                f"{self.folder} was written by a newer version of flexband (format "
                f"{attrs['format']}, this one reads {FORMAT})"
            )
        if _checksum(metadata) != attrs["checksum"]:
            raise ValueError("the checksum is wrong")
        arrays = {name: Array.from_metadata(member) for name, member in dict(members).items()}
        grown = [members[name]["shape"][0] for name, array in arrays.items() if array.grows]
        self.attrs = attrs
        self.arrays = arrays
        self.runs = max(grown, default=0)

    @property
    def sessions(self) -> list[dict[str, Any]]:
        """What is known of each program that has written runs."""
        return self.attrs.setdefault("sessions", [])

    def add(self, name: str, array: Array, values: np.ndarray | None = None) -> None:
        """Add an array: with the values of one that does not grow, else with fill values."""
        file = self._file(name, 0, array)
        folder = self.folder / name
        files: dict[Path, Content] = {folder / "zarr.json": [_json(array.metadata(self.runs))]}
        if values is not None and values.size:
            content = array.encode(np.asarray(values))
            files |= {file: content, folder / "copy": content}
        if array.grows and self.runs:
            empty = array.encode(np.zeros((0, *array.chunk[1:])))
            chunks = range(-(-self.runs // array.rows))
            files |= {self._file(name, chunk, array): empty for chunk in chunks}
        write_synced(files)
        self.arrays[name] = array

    def append(self, columns: Mapping[str, np.ndarray]) -> None:
        """Append runs; arrays that are not named get their fill value."""
        count = len(next(iter(columns.values())))
        files: dict[Path, Content] = {}
        last = dict(self._last)
        blank = set[Path]()
        # Fill the last chunk of each array, then new ones. Blank texts are written once only.
        for name, values in columns.items():
            array = self.arrays[name]
            done = 0
            while done < count:
                chunk, offset = divmod(self.runs + done, array.rows)
                part = values[done : done + array.rows - offset]
                if offset:
                    before = last.get(name)
                    if before is None or len(before) != offset:
                        before = self._read_chunk(name, chunk)[:offset]
                    part = np.concatenate([before, part])
                file = self._file(name, chunk)
                if array.kind != "string" or np.any(part != ""):
                    files[file] = array.encode(part)
                    self._blank.discard(file)
                elif file not in self._blank:
                    files[file] = array.encode(part)
                    blank.add(file)
                done += len(part) - offset
                last[name] = part
        # The runs count once the metadata is on disk.
        write_synced(files)
        self.runs += count
        try:
            self.commit()
        except BaseException:
            self.runs -= count
            raise
        self._last = last
        self._blank |= blank

    def commit(self, files: Sequence[str] = (COPY, GROUP)) -> None:
        """Write the runs and attributes of the group; it is there for others once the copy is."""
        members = {name: array.metadata(self.runs) for name, array in self.arrays.items()}
        consolidated = {"kind": "inline", "must_understand": False, "metadata": members}
        metadata = {
            "zarr_format": 3,
            "node_type": "group",
            "attributes": self.attrs,
            "consolidated_metadata": consolidated,
        }
        self.attrs["checksum"] = _checksum(metadata)
        content = [_json(metadata)]
        write_synced({self.folder / file: content for file in files})

    def finish(self) -> None:
        """Write the metadata of every array, for readers that do not know that of the group."""
        for name, array in self.arrays.items():
            write_synced({self.folder / name / "zarr.json": [_json(array.metadata(self.runs))]})

    def read(self, name: str, runs: np.ndarray | None = None) -> np.ndarray:
        """Return the values of an array, of all or of some runs."""
        array = self.arrays[name]
        if not array.grows:
            empty = 0 in array.shape
            return np.zeros(array.shape) if empty else self._read_chunk(name, 0)
        run_numbers = np.arange(self.runs) if runs is None else np.asarray(runs)
        values = np.empty((len(run_numbers), *array.shape[1:]), CODES.get(array.kind, object))
        chunks = run_numbers // array.rows
        for chunk in np.unique(chunks):
            mask = chunks == chunk
            values[mask] = self._read_chunk(name, int(chunk))[
                run_numbers[mask] - chunk * array.rows
            ]
        return values

    def replace(self, name: str, runs: np.ndarray, value: float) -> None:
        """Give some runs another value."""
        array = self.arrays[name]
        for chunk in np.unique(runs // array.rows):
            values = self._read_chunk(name, int(chunk))
            values[runs[runs // array.rows == chunk] - chunk * array.rows] = value
            write_synced({self._file(name, int(chunk)): array.encode(values)})
        self._last.pop(name, None)

    def find_damage(self) -> tuple[np.ndarray, list[tuple[str, int]]]:
        """Mend what the copy has; return the runs and chunks that remain damaged."""
        for file in self.folder.rglob("*.partial"):
            file.unlink(missing_ok=True)
        bad = np.zeros(self.runs, bool)
        chunks = []
        for name, array in self.arrays.items():
            if not array.grows:
                self.read(name)
                continue
            for chunk in range(-(-self.runs // array.rows)):
                try:
                    self._read_chunk(name, chunk)
                except StoreError:
                    bad[chunk * array.rows : (chunk + 1) * array.rows] = True
                    chunks.append((name, chunk))
        return bad, chunks

    def clear(self, name: str, chunk: int) -> None:
        """Give all runs of a chunk the fill value."""
        array = self.arrays[name]
        write_synced({self._file(name, chunk): array.encode(np.zeros((0, *array.chunk[1:])))})

    def _read_chunk(self, name: str, chunk: int) -> np.ndarray:
        file = self._file(name, chunk)
        array = self.arrays[name]
        try:
            return array.decode(file.read_bytes())
        except (OSError, ValueError, struct.error, IndexError) as error:
            reason = f"{file} is missing or damaged: {error}"
        try:
            values = array.decode((self.folder / name / "copy").read_bytes())
        except (OSError, ValueError, struct.error, IndexError):
            raise StoreError(reason) from None
        write_synced({file: array.encode(values)})
        return values

    def _file(self, name: str, chunk: int, array: Array | None = None) -> Path:
        return self.folder / name / (array or self.arrays[name]).name(chunk)


def _checksum(metadata: Mapping[str, Any]) -> int:
    attrs = {k: v for k, v in metadata["attributes"].items() if k != "checksum"}
    return google_crc32c.value(_json({**metadata, "attributes": attrs}))


def _json(content: Mapping[str, Any]) -> bytes:
    return json.dumps(content, sort_keys=True).encode()
