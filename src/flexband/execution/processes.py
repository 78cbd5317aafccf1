"""Local worker processes, for responses that are not vectorized.

Each worker has a connection of its own and one task at a time. It is therefore known which task
ended a process, or takes too long: that worker is replaced, and the others go on.
"""

from __future__ import annotations

import os
import secrets
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, Listener
from multiprocessing.connection import wait as wait_for

import cloudpickle

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_integer, check_numbers, check_positive
from flexband.basics.cores import available_cores
from flexband.basics.response import ResponseFunction
from flexband.execution.calls import (
    Outcome,
    Outcomes,
    Performing,
    Tasks,
    Workers,
    dump_response,
    receive_outcome,
)


@frozen()
class Processes(Workers):
    """Local worker processes, as an `executor`.

    They serve responses that run one sample at a time, as `samplewise` makes them; a vectorized
    response is called with a whole `batch` by each worker. A worker that dies is replaced, and its
    task is tried once more.

    Parameters
    ----------
    workers : number of processes, or None for one per core.
    time_limit : time [s] that one call of the response may take; then its process is killed, and
        the runs have failed.

    Raises
    ------
    InputError
        If a number is out of its range.
    """

    workers: int | None = None
    time_limit: float | None = None

    def __post_init__(self) -> None:
        if self.workers is not None:
            check_integer("workers", self.workers, 1, 4096)
        if self.time_limit is not None:
            check_positive("time_limit [s]", check_numbers("time_limit [s]", self.time_limit))

    @contextmanager
    def open(self) -> Iterator[Performing]:
        pool = _Pool(self.workers or available_cores(), self.time_limit)
        try:
            yield pool.perform
        finally:
            pool.close()


class _Worker:
    """A process, its connection, and what it does."""

    def __init__(self, seconds: float = 60.0) -> None:
        """Start the process; raise `RuntimeError` if it is not ready within some seconds."""
        single = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
        environment = {**dict.fromkeys(single, "1"), **os.environ}
        key = secrets.token_bytes(32)
        listener = Listener(authkey=key)
        self.process = subprocess.Popen(
            [sys.executable, "-m", "flexband.execution.worker"],
            stdin=subprocess.PIPE,
            stdout=2,  # what a response prints is no result
            env=environment,
        )
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            message = listener.address, key, os.getpid(), sys.path
            self.process.stdin.write(cloudpickle.dumps(message))
            self.process.stdin.close()
        try:
            self.connection: Connection = self._accept(listener, seconds)
        finally:
            listener.close()
        self.task: int | None = None
        self.response: int | None = None
        self.deadline = float("inf")

    def _accept(self, listener: Listener, seconds: float) -> Connection:
        """Accept the connection of the process; raise `RuntimeError` if it ends before."""
        connections: list[Connection] = []

        def accept() -> None:
            with suppress(Exception):  # it ended before
                connections.append(listener.accept())

        accepting = threading.Thread(target=accept, daemon=True)
        accepting.start()
        end = time.monotonic() + seconds
        while not connections and time.monotonic() < end and self.process.poll() is None:
            accepting.join(0.1)
        if not connections:
            self.process.kill()
            raise RuntimeError(
                f"a worker process did not start; its exit status is {self.process.wait()}"
            )
        return connections[0]

    def end(self) -> str:
        """Kill the process if it lives; return in words how it ended."""
        with suppress(OSError):
            self.connection.close()
        status = None
        with suppress(subprocess.TimeoutExpired):
            status = self.process.wait(0.5)
        if status is None:
            self.process.kill()
            self.process.wait()
            return "it was killed"
        return f"signal {-status} ended it" if status < 0 else f"its exit status is {status}"


class _Pool:
    """Workers, each with a task or idle; a task whose process dies is tried `attempts` times."""

    def __init__(self, count: int, limit: float | None, attempts: int = 2):
        self.limit = limit
        self.count = count
        self.attempts = attempts
        self.workers: list[_Worker] = []

    def close(self) -> None:
        """End all processes at once."""
        for worker in self.workers:
            worker.process.kill()
        for worker in self.workers:
            worker.end()
        self.workers = []

    def perform(self, response: ResponseFunction, tasks: Tasks) -> Outcomes:
        """Perform tasks; tasks that are left when the caller stops are ended."""
        pickled = dump_response(response)
        waiting = deque(range(len(tasks)))
        attempts = [0] * len(tasks)
        done = 0
        try:
            while done < len(tasks):
                self._give(waiting, tasks, attempts, pickled)
                for worker in self._ready():
                    number = worker.task
                    assert number is not None
                    outcome = self._heard(worker)
                    if outcome is None:
                        continue
                    if outcome.lost and attempts[number] < self.attempts:
                        waiting.appendleft(number)
                    else:
                        done += 1
                        yield number, outcome
        finally:
            for worker in [worker for worker in self.workers if worker.task is not None]:
                worker.process.kill()
                self._replace(worker)

    def _give(
        self,
        waiting: deque[int],
        tasks: Tasks,
        attempts: list[int],
        pickled: bytes,
    ) -> None:
        """Give every idle worker a task; start workers as long as there are fewer than asked."""
        while waiting:
            idle = [worker for worker in self.workers if worker.task is None]
            if not idle:
                if len(self.workers) == self.count:
                    return
                self.workers.append(_start_worker())
                continue
            worker = idle[0]
            number = waiting.popleft()
            worker.task = number
            attempts[number] += 1
            has_response = worker.response == hash(pickled)
            worker.response = hash(pickled)
            with suppress(OSError):  # a worker that is dead is found when it is waited for
                worker.connection.send_bytes(b"" if has_response else pickled)
                worker.connection.send_bytes(cloudpickle.dumps(tasks[number]()))

    def _ready(self) -> list[_Worker]:
        """Wait until workers have something to say, died, or used up their time; return these."""
        busy = [worker for worker in self.workers if worker.task is not None]
        remaining = min(worker.deadline for worker in busy) - time.monotonic()
        connections = [worker.connection for worker in busy]
        ready_connections = wait_for(
            connections, None if remaining == float("inf") else max(0.0, remaining)
        )
        now = time.monotonic()
        return [w for w in busy if w.connection in ready_connections or w.deadline <= now]

    def _heard(self, worker: _Worker) -> Outcome | None:
        """Return the outcome of a task, lost if its process ended; None if it only began."""
        if not worker.connection.poll():
            worker.process.kill()
            self._replace(worker)
            text = f"the response took longer than time_limit = {self.limit:g} s"
            return Outcome(None, TimeoutError(text), self.limit or 0.0)
        try:
            data = worker.connection.recv_bytes()
        except (EOFError, OSError):
            return Outcome(None, RuntimeError(self._replace(worker)), 0.0, lost=True)
        if not data:
            worker.deadline = time.monotonic() + (self.limit or float("inf"))
            return None
        worker.task = None
        worker.deadline = float("inf")
        return receive_outcome(data)

    def _replace(self, worker: _Worker) -> str:
        """Forget a worker; return how its process ended. A new one starts when it is needed."""
        if worker in self.workers:
            self.workers.remove(worker)
        return f"the process of the response ended: {worker.end()}"


def _start_worker() -> _Worker:
    """Start a worker, once more if it ends at once."""
    with suppress(RuntimeError):
        return _Worker()
    return _Worker()
