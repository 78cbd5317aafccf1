"""A worker process: ``python -m flexband.execution.worker`` performs the tasks of one study."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from contextlib import suppress
from multiprocessing.connection import Client

import cloudpickle


def main() -> None:
    """Perform tasks until the connection ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the study, which ends its workers
    address, key, study, path = cloudpickle.loads(sys.stdin.buffer.read())
    sys.path[:] = path
    threading.Thread(target=_watch, args=(study,), daemon=True).start()
    from flexband.execution.calls import perform_elsewhere, unpickle_response  # noqa: PLC0415

    connection = Client(address, authkey=key)
    response = b""
    try:
        while True:
            response = connection.recv_bytes() or response
            arguments = connection.recv_bytes()
            with suppress(Exception):  # which `perform_elsewhere` reports
                unpickle_response(response)  # what it imports takes none of the task's time
            connection.send_bytes(b"")
            connection.send_bytes(perform_elsewhere(response, arguments))
    except (EOFError, OSError):
        return


def _watch(study: int, period: float = 1.0) -> None:
    """End this process, in the midst of a task even, once that of the study is gone."""
    while os.getppid() == study:
        time.sleep(period)
    os._exit(1)


if __name__ == "__main__":
    main()
