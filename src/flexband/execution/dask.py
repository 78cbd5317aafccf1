"""Runs on a Dask cluster, each within a time limit."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from typing import Any

import cloudpickle

from flexband.arguments import frozen
from flexband.errors import InputError, RunError, check_numbers, check_positive, shown
from flexband.execution.executors import (
    Arguments,
    Outcome,
    Performing,
    dask_client,
    outcome_of,
    perform_elsewhere,
    sent_by,
)

ATTEMPTS = 2
"""How often a task is tried."""

RESTART = 10.0
"""Time [s] in which a worker must have been restarted; otherwise it gets no more tasks."""


@frozen()
class Dask:
    """A Dask cluster whose calls have a time limit, as an `executor`.

    A worker that exceeds it, because the response or the whole worker hangs, is restarted, or gets
    no more calls where it has no nanny that could. The call is made once more, by another worker if
    there is one; if that takes too long as well, its runs have failed.

    Parameters
    ----------
    client : Dask client, or the address of a scheduler.
    time_limit : time [s] that one call of the response may take, its way to the worker included.

    Raises
    ------
    InputError
        If the client is none, or the time limit is not positive.
    """

    client: Any
    time_limit: float

    def __post_init__(self) -> None:
        if not isinstance(self.client, str) and not hasattr(self.client, "get_executor"):
            raise InputError(
                "client must be a Dask client, or the address of a scheduler; got "
                f"{shown(self.client)}"
            )
        check_positive("time_limit [s]", check_numbers("time_limit [s]", self.time_limit))

    @contextmanager
    def open(self) -> Iterator[Performing]:
        """Give what performs tasks."""
        with dask_client(self.client) as client:
            yield _Timed(client, float(self.time_limit)).perform


class _Timed:
    """Performs tasks; each worker thread has one at a time, so that its time is known."""

    def __init__(self, client: Any, time_limit: float):
        self.client, self.time_limit = client, time_limit
        self.excluded: set[str] = set()

    def perform(
        self, response: Callable[..., Any], tasks: list[Callable[[], Arguments]]
    ) -> Generator[tuple[int, Outcome], None, None]:
        """Yield the numbers and outcomes of tasks as they finish."""
        pickled, modules = sent_by(response)
        waiting, attempts = deque(range(len(tasks))), Counter[int]()
        running: dict[Any, tuple[int, float]] = {}  # number and deadline
        try:
            while waiting or running:
                workers = self.workers()
                while waiting and len(running) < sum(workers.values()):
                    number = waiting.popleft()
                    attempts[number] += 1
                    future = self.client.submit(
                        perform_elsewhere, pickled, cloudpickle.dumps(tasks[number]()), *modules,
                        pure=False, workers=list(workers),
                    )  # fmt: skip
                    running[future] = number, time.monotonic() + self.time_limit
                for future, reason in self.ended(running):
                    number, _ = running.pop(future)
                    outcome = TimeoutError(reason) if reason else outcome_of(future)
                    if isinstance(outcome, Outcome):
                        yield number, outcome
                    elif attempts[number] < ATTEMPTS:
                        waiting.append(number)
                    else:
                        yield number, Outcome(None, outcome, self.time_limit)
        finally:
            for future in running:
                future.cancel()

    def workers(self) -> dict[str, int]:
        """Return the number of threads of each worker that is in use."""
        threads = {k: n for k, n in self.client.nthreads().items() if k not in self.excluded}
        if not threads:
            raise RunError("the executor cannot go on: no Dask worker is left that answers", {})
        return threads

    def ended(self, running: dict[Any, tuple[int, float]]) -> list[tuple[Any, str]]:
        """Wait; return the tasks that are finished, and those that took too long, with a reason."""
        from dask.distributed import wait  # noqa: PLC0415

        remaining = min(deadline for _, deadline in running.values()) - time.monotonic()
        try:
            done: Any = wait(list(running), max(0.0, remaining), return_when="FIRST_COMPLETED")
            return [(future, "") for future in done.done]
        except TimeoutError:
            late = [k for k, (_, deadline) in running.items() if deadline <= time.monotonic()]
        at = {key: worker for worker, keys in self.client.processing().items() for key in keys}
        slow = {at[future.key] for future in late if future.key in at}
        for future in late:
            future.cancel()
        for worker in slow:
            self.replace(worker)
        reason = f"the run was ended after its time limit of {self.time_limit:g} s"
        return [(future, reason) for future in late]

    def replace(self, worker: str) -> None:
        """Restart a worker, or give it no more tasks."""
        try:
            self.client.restart_workers([worker], timeout=RESTART)
        except Exception:  # it has no nanny, or does not come back
            self.excluded.add(worker)
