"""Work in threads that Ctrl-C stops.

Python sees Ctrl-C only where its main thread runs Python code. Compiled code, and the compiler,
therefore run in threads of their own, for which the caller waits. They are daemons: one that never
ends, in a force law of the user, does not keep the process alive.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from multiprocessing import parent_process
from queue import Empty, SimpleQueue
from typing import TypeVar

import numpy as np

from flexband.basics.checks import check_integer
from flexband.basics.cores import available_cores
from flexband.basics.progress import Progress
from flexband.compilation.caching import compiling
from flexband.mechanics.kernels.lane_arrays import zeros

Result = TypeVar("Result")

GRACE = 0.2
"""Time [s] in which threads may end after Ctrl-C."""

BEAT = 1.0
"""Time [s] between two looks at how far threads are."""

_local = threading.local()


def stop_flag() -> np.ndarray:
    """Return one row of lanes, which is not zero once the work of this thread has to stop."""
    return _local.__dict__.setdefault("stop", zeros(1))


def in_parallel(
    run: Callable[[int], int],
    blocks: int,
    samples: int,
    threads: int,
    progress: Progress | None = None,
    beat: Callable[[], object] | None = None,
) -> None:
    """Run all blocks; `run` returns how many samples it has finished.

    `beat` is called every second while there is nothing else to tell.
    An error, or Ctrl-C, stops all blocks at their next step.
    """
    numbers, finished, stop = iter(range(blocks)), SimpleQueue(), zeros(1)

    def work() -> None:
        _local.stop = stop
        for block in numbers:
            try:
                finished.put((run(block), None))
            except BaseException as error:
                stop[:] = 1.0
                finished.put((0, error))
            if stop.any():
                break

    # Start the workers and collect what they finish.
    workers = [threading.Thread(target=work, daemon=True) for _ in range(min(threads, blocks))]
    done = 0
    try:
        for worker in workers:
            worker.start()
        for _ in range(blocks):
            ran, error = _next(finished, beat)
            if error is not None:
                raise error
            done += ran
            if progress is not None:
                progress(done, samples)
    finally:
        # Stop what still runs, and wait for it.
        stop[:] = 1.0
        end = time.monotonic() + GRACE
        for worker in workers:
            worker.join(max(0.0, end - time.monotonic()))


def _next(finished: SimpleQueue, beat: Callable[[], object] | None) -> tuple:
    """Return the next result, and call `beat` every second until there is one."""
    while beat is not None:
        try:
            return finished.get(timeout=BEAT)
        except Empty:
            beat()
    return finished.get()


def interruptible(work: Callable[[], Result]) -> Result:
    """Return the result of `work`, which runs in another thread."""
    results: list[Result] = []

    def run(block: int) -> int:
        results.append(work())
        return 1

    in_parallel(run, 1, 1, 1)
    return results[0]


def while_compiling(work: Callable[[], Result], after: float = 2.0) -> Result:
    """Return the result of `work`; one process says so if the engine compiles for seconds."""
    text = "flexband: compiling the engine (once per machine, up to a minute) ..."

    def announce() -> None:
        if compiling and parent_process() is None:
            print(text, file=sys.stderr, flush=True)

    timer = threading.Timer(after, announce)
    timer.daemon = True
    timer.start()
    try:
        return interruptible(work)
    finally:
        timer.cancel()


def thread_count(threads: int | None) -> int:
    """Return the number of threads; raise `InputError` if it is neither None nor 1 or more."""
    return available_cores() if threads is None else check_integer("threads", threads, 1)
