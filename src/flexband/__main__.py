"""The command ``flexband``, which Ctrl-C ends in every state, with exit status 130.

An interrupt is an exception of the main thread, which cleans up. It comes too late where Python is
in a long call of compiled code, and is lost where other code catches all exceptions; a second
thread therefore ends the process a little later in any case.
"""

from __future__ import annotations

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


def main() -> None:
    """Run the command line."""
    signal.signal(signal.SIGINT, lambda *_: _end())  # while modules are imported
    read, write = socket.socketpair()
    write.setblocking(False)
    signal.set_wakeup_fd(write.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_watch, args=(read,), daemon=True).start()
    app = import_module("flexband.cli").app
    import_module("flexband.cli.commands").load(sys.argv[1:])
    signal.signal(signal.SIGINT, _interrupt)
    app()


def _interrupt(*_: object) -> NoReturn:
    """Raise the first interrupt as an exception; ignore others."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    raise KeyboardInterrupt


def _watch(signals: socket.socket) -> None:
    """End the process some time after an interrupt."""
    while signal.SIGINT not in signals.recv(64):
        pass
    time.sleep(GRACE)
    _end()


def _end() -> NoReturn:
    messages = sys.modules.get("flexband.cli.messages")  # unless it is still being imported
    ending = getattr(messages, "Ending", None)
    if sys.stderr is not None:
        text = getattr(ending, "stopped", "flexband: stopped")
        os.write(sys.stderr.fileno(), f"{text}\n".encode(errors="replace"))
    os._exit(130)


if __name__ == "__main__":
    main()
