"""The command ``flexband``, which Ctrl-C or SIGTERM ends in every state.

The exit status is 128 and the number of the signal, 130 or 143.

An interrupt is an exception of the main thread, which cleans up. It comes too late where Python is
in a long call of compiled code, and is lost where other code catches all exceptions; a second
thread therefore ends the process a little later in any case.
"""

from __future__ import annotations

import gc
import os
import signal
import socket
import sys
import threading
import time
from importlib import import_module
from typing import NoReturn

GRACE = 1.2
"""Time [s] in which the main thread may clean up."""

ENDING = (signal.SIGINT, signal.SIGTERM)
"""Signals that end the command."""


def main() -> None:
    """Run the command line."""
    for number in ENDING:
        signal.signal(number, lambda received, _: _end(received))  # while modules are imported
    read, write = socket.socketpair()
    write.setblocking(False)
    signal.set_wakeup_fd(write.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_watch, args=(read,), daemon=True).start()
    if sys.platform != "win32":
        mask = signal.pthread_sigmask
        os.register_at_fork(
            before=lambda: mask(signal.SIG_BLOCK, ENDING),
            after_in_parent=lambda: mask(signal.SIG_UNBLOCK, ENDING),
            after_in_child=_leave_to_parent,
        )
    # Idle threads of OpenBLAS keep a core busy for 2^20 ticks, 0.4 ms; by default it is 0.1 s.
    os.environ.setdefault("OPENBLAS_THREAD_TIMEOUT", "20")
    gc.disable()  # nothing that imports make is dropped before the end of the process
    app = import_module("flexband.cli").app
    import_module("flexband.cli.commands").load(sys.argv[1:])
    gc.freeze()
    gc.enable()
    for number in ENDING:
        signal.signal(number, _interrupt)
    app()


def _leave_to_parent() -> None:
    """Let SIGTERM end a forked process alone, which has inherited the socket that is watched."""
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)


def _interrupt(received: int, _: object) -> NoReturn:
    """Raise the first interrupt as an exception, which tells its signal; ignore others."""
    for number in ENDING:
        signal.signal(number, signal.SIG_IGN)
    raise KeyboardInterrupt(received)


def _watch(signals: socket.socket) -> None:
    """End the process some time after an interrupt."""
    while not (received := set(signals.recv(64)).intersection(ENDING)):
        pass
    time.sleep(GRACE)
    _end(min(received))


def _end(received: int) -> NoReturn:
    messages = sys.modules.get("flexband.cli.messages")  # unless it is still being imported
    ending = getattr(messages, "Ending", None)
    if sys.stderr is not None:
        text = getattr(ending, "stopped", "flexband: stopped")
        os.write(sys.stderr.fileno(), f"{text}\n".encode(errors="replace"))
    os._exit(128 + received)


if __name__ == "__main__":
    main()
