"""Files that are there as a whole, or as they were, whatever kills the program or the machine."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from uuid import uuid4


def write_synced(files: Mapping[Path, Sequence[Any]]) -> None:
    """Write files, which are synced at the same time, since a disk does that at once.

    Each is there as a whole, or as it was, whatever happens. Its content is bytes or arrays, one
    after another.
    """
    partials = {file: file.with_name(f"{file.name}-{uuid4().hex}.partial") for file in files}
    try:
        for file, content in files.items():
            try:
                _write(partials[file], content)
            except FileNotFoundError:
                file.parent.mkdir(parents=True, exist_ok=True)
                _write(partials[file], content)
        _together(partials.values())
        for file, partial in partials.items():
            partial.replace(file)
        if os.name == "posix":
            _together({file.parent for file in files})
    except OSError:
        for partial in partials.values():
            partial.unlink(missing_ok=True)
        raise


def _write(file: Path, content: Sequence[Any]) -> None:
    with file.open("wb") as opened:
        opened.writelines(content)


def _together(paths: Iterable[Path]) -> None:
    """Sync files or folders."""
    with ThreadPoolExecutor(16) as threads:
        list(threads.map(_sync, paths))


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDWR if path.is_file() else os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
