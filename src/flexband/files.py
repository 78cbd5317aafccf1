"""Files that are written completely or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4


@contextmanager
def replaced(file: Path) -> Iterator[Path]:
    """Give the path of a new file, which takes the place of `file` once it is written.

    The folder is made if it is missing. Several processes may write the same file: one of their
    files is there in the end, whole. If writing fails, `file` stays as it was.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_name(f"{file.stem[:100]}-{uuid4().hex}.partial")
    try:
        yield partial
        partial.replace(file)
    except OSError as error:  # a full disk does not say of which file
        error.filename, error.filename2 = str(file), None
        raise
    finally:
        partial.unlink(missing_ok=True)
