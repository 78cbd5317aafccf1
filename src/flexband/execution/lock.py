"""A folder that one process at a time has, until it ends in whatever way."""

from __future__ import annotations

import os
import socket
import sys
import time
from pathlib import Path
from weakref import WeakSet

from flexband.basics.files import open_unlinked, read_unlinked, replace_file
from flexband.errors import StoreError
from flexband.execution.names import FileName

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl


class Lock:
    """An open file that the system locks for this process until it ends; it names its holder.

    A child process, which inherits open files, closes it at once.
    """

    def __init__(self, folder: Path, name: str = FileName.STORE_LOCK, seconds: float = 0.5):
        """Take the folder; wait some seconds for others that only look.

        Raise `StoreError` if another process has it, `OSError` if the file cannot be written to, or
        is a symbolic link.
        """
        self._handle = open_unlinked(folder / name, os.O_RDWR | os.O_CREAT)
        holder = folder / FileName.HOLDER
        end = time.monotonic() + seconds
        while not (has_lock := _try_lock(self._handle)) and time.monotonic() < end:
            time.sleep(seconds / 20)
        if not has_lock:
            self.release()
            try:
                who = read_unlinked(holder).decode()
            except (OSError, ValueError):
                who = "another process"
            raise StoreError(f"{folder} is in use by {who}") from None
        try:
            with replace_file(holder) as partial:
                partial.write_bytes(this_process().encode())
        except BaseException:
            self.release()
            raise
        _locks.add(self)

    def release(self) -> None:
        """Free the folder."""
        _locks.discard(self)
        handle = self._handle
        self._handle = -1
        if handle >= 0:
            os.close(handle)


def is_locked(file: Path) -> bool:
    """Return whether a process has the folder of this file."""
    try:
        handle = open_unlinked(file, os.O_RDWR)
    except OSError:  # there is none, or it is a link, or may only be read
        return False
    try:
        return not _try_lock(handle)
    finally:
        os.close(handle)


def this_process() -> str:
    """Return in words which process on which host this is."""
    return f"process {os.getpid()} on {socket.gethostname()}"


_locks: WeakSet[Lock] = WeakSet()


def _try_lock(handle: int) -> bool:
    """Lock an open file; return whether that succeeded."""
    try:
        if sys.platform == "win32":
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        else:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _close_in_child() -> None:
    for lock in list(_locks):
        lock.release()


if sys.platform != "win32":
    os.register_at_fork(after_in_child=_close_in_child)
