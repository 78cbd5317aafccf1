"""Compiled work in threads, for which Ctrl-C does not wait."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from queue import SimpleQueue
from typing import TypeVar

Part = TypeVar("Part")


def in_threads(work: Callable[[Part], object], parts: Iterable[Part]) -> None:
    """Call `work` with every part, in as many threads as cores; raise an error at once.

    After an error or Ctrl-C, threads end after the part that they are at.
    """
    all_parts = list(parts)
    queue, outcomes, stop = iter(all_parts), SimpleQueue(), threading.Event()

    def run() -> None:
        for part in queue:
            try:
                work(part)
                outcomes.put(None)
            except BaseException as error:
                outcomes.put(error)
            if stop.is_set():
                return

    try:
        for _ in range(min(len(all_parts), os.cpu_count() or 1)):
            threading.Thread(target=run, daemon=True).start()
        for _ in all_parts:
            error = outcomes.get()
            if error is not None:
                raise error
    finally:
        stop.set()
