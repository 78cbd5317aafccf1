"""Which share of their time 1000 workers work, for runs of 20 ms, 0.5 s and 5 s.

The workers are threads of two other processes, and sleep. They are behind an executor of which
flexband knows nothing but `submit`. The CPU time per run is that of the client.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from itertools import count
from multiprocessing import Pipe, Process
from multiprocessing.connection import Connection
from threading import Lock, Thread
from typing import Any

import numpy as np

import flexband as fb
from benchmarks.harness import options, report

INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}
TIME = np.linspace(0.0, 1.0, 200)


class Remote(Executor):
    """Two processes with many threads each, in place of processes on other machines."""

    def __init__(self, workers: int) -> None:
        self.futures: dict[int, Future[Any]] = {}
        self.numbers = count()
        self.connections = []
        for _ in range(2):
            connection, other = Pipe()
            Process(target=serve, args=(other, workers // 2), daemon=True).start()
            Thread(target=self.receive, args=(connection,), daemon=True).start()
            self.connections.append(connection)

    def submit(self, function: Any, /, *arguments: Any, **_: Any) -> Future[Any]:
        number = next(self.numbers)
        future = Future[Any]()
        self.futures[number] = future
        self.connections[number % 2].send((number, function, arguments))
        return future

    def receive(self, connection: Connection) -> None:
        """Set the results of futures."""
        with suppress(EOFError):  # the end of the other process
            while True:
                number, result = connection.recv()
                self.futures.pop(number).set_result(result)


def serve(connection: Connection, threads: int) -> None:
    """Call functions in threads, and send what they return."""
    lock = Lock()

    def call(number: int, function: Any, arguments: tuple[Any, ...]) -> None:
        result = function(*arguments)
        with lock:
            connection.send((number, result))

    with ThreadPoolExecutor(threads) as pool:
        while True:
            pool.submit(call, *connection.recv())


def response(a: float, b: float, seconds: float = 0.0) -> np.ndarray:
    """Return an output at 200 times, after a sleep."""
    time.sleep(seconds)
    return a * np.sin(TIME) + b * TIME


def main() -> None:
    arguments = options(__doc__, 1000, rounds=(12, "runs per worker"))
    rows = []
    measurements = {}
    for seconds in (0.02, 0.5, 5.0):
        executor = Remote(arguments.samples)
        for with_store in (False, True):
            with tempfile.TemporaryDirectory() as folder:
                numbers = measure(executor, arguments, seconds, folder if with_store else None)
            name = f"{seconds:g} s, {'recorded' if with_store else 'not recorded'}"
            measurements[name] = numbers
            wall, cpu, share = numbers
            rows.append([name, f"{wall:.1f}", f"{100 * share:.0f} %", f"{1e3 * cpu:.2f}"])
            print(*rows[-1], flush=True)
    header = ["time of a run", "wall [s]", "work of the workers' time", "CPU time per run [ms]"]
    report(arguments.output, "workers", header, rows, measurements)


def measure(
    executor: Remote, arguments: argparse.Namespace, seconds: float, folder: str | None
) -> tuple[float, float, float]:
    """Return the wall time [s] of a study, the CPU time per run [s], and the share of work."""
    workers = arguments.samples
    runs = workers * arguments.rounds
    model = fb.models.samplewise(partial(response, seconds=seconds))
    method = fb.LHSScanning(runs // 4, 4)
    begin = time.perf_counter()
    cpu = time.process_time()
    fb.propagate(model, INPUTS, method, executor=executor, store=folder)
    wall = time.perf_counter() - begin
    cpu = time.process_time() - cpu
    wall -= seconds  # one run is made again, alone
    return wall, cpu / runs, runs * seconds / (workers * wall)


if __name__ == "__main__":
    main()
