"""Files that are written completely or not at all, and that tell if they were altered."""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

import google_crc32c
import platformdirs

from flexband.basics.warning import warn
from flexband.errors import InputError, StoreError

BEGIN = '{"checksum": "'
"""How a JSON file with a checksum begins."""

CACHE_VARIABLE = "NUMBA_CACHE_DIR"
"""Environment variable of the folder for what Numba and flexband keep on disk."""

Content = Sequence[bytes]
"""Of a file: parts, one after another."""


@contextmanager
def replace_file(file: Path) -> Iterator[Path]:
    """Give the path of a new file, which replaces `file` once it is written.

    The folder is made if it is missing. Several processes may write the same file: one of their
    files is there in the end, whole. If writing fails, `file` stays as it was. If it is a symbolic
    link, the link is replaced, and its target stays as it was.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_name(f"{file.stem[:100]}-{uuid4().hex}.partial")
    try:
        yield partial
        partial.replace(file)
    except OSError as error:  # a full disk does not say of which file
        error.filename = str(file)
        error.filename2 = None
        raise
    finally:
        partial.unlink(missing_ok=True)


def user_folder() -> Path:
    """Return the folder of the user, or that in NUMBA_CACHE_DIR, for what is kept on disk."""
    if folder := os.environ.get(CACHE_VARIABLE):
        return Path(folder) / "flexband"
    return platformdirs.user_cache_path("flexband", appauthor=False)


def open_unlinked(file: str | os.PathLike[str], flags: int) -> int:
    """Open a file as `os.open` does; raise `OSError` if it is a symbolic link."""
    if os.path.islink(file):
        raise OSError(errno.ELOOP, "It is a symbolic link, which is not followed", str(file))
    return os.open(file, flags | (0 if sys.platform == "win32" else os.O_NOFOLLOW), 0o666)


def read_unlinked(file: Path) -> bytes:
    """Return the content of a file; raise `OSError` if it is a symbolic link."""
    with open(file, "rb", opener=open_unlinked) as opened:
        return opened.read()


def refuse_links(folder: Path) -> None:
    """Raise `StoreError` if a folder, or anything in it, is a symbolic link."""
    links = [str(folder)] if folder.is_symlink() else []
    for root, folders, files in os.walk(folder):
        links += filter(os.path.islink, (os.path.join(root, name) for name in (*folders, *files)))
    if links:
        raise StoreError(f"{links[0]} is a symbolic link, which is not followed; remove it")


def checksum(data: bytes) -> bytes:
    """Return the CRC-32C of data as eight digits."""
    return b"%08x" % google_crc32c.value(data)


def write_json(file: Path, content: Mapping[str, Any]) -> None:
    """Write numbers and texts by name as a JSON file that begins with the checksum of the rest."""
    rest = json.dumps({"checksum": "", **content}, allow_nan=False).removeprefix(BEGIN)
    with replace_file(file) as partial:
        text = f"{BEGIN}{checksum(rest.encode()).decode()}{rest}"
        partial.write_text(text, encoding="utf-8")


def read_json(file: Path) -> dict[str, Any]:
    """Return what `write_json` has written; raise `ValueError` if it is not as written."""
    data = read_unlinked(file)
    digits = data[len(BEGIN) :][:8]
    rest = data[len(BEGIN) + 8 :]
    if not data.startswith(BEGIN.encode()) or digits != checksum(rest):
        raise ValueError(f"{file} is not as written")
    return json.loads(data)


def try_write(write: Callable[[], object]) -> bool:
    """Write a file; warn and return False if that fails, so that other results are kept."""
    try:
        write()
    except (InputError, OSError) as error:
        warn(str(error))
        return False
    return True


def write_synced(files: Mapping[Path, Content]) -> None:
    """Write files, which are synced at the same time, since a disk does that at once.

    Each is there as a whole, or as it was, whatever happens.
    """
    partials = {file: file.with_name(f"{file.name}-{uuid4().hex}.partial") for file in files}
    try:
        for file, content in files.items():
            try:
                _write_parts(partials[file], content)
            except FileNotFoundError:
                file.parent.mkdir(parents=True, exist_ok=True)
                _write_parts(partials[file], content)
        _together(partials.values())
        for file, partial in partials.items():
            partial.replace(file)
        if os.name == "posix":
            _together({file.parent for file in files})
    except OSError:
        for partial in partials.values():
            partial.unlink(missing_ok=True)
        raise


def _write_parts(file: Path, content: Content) -> None:
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
