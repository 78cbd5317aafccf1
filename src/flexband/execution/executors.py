"""Where runs are made: in this process, or by any executor of `concurrent.futures`, or Dask."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from queue import SimpleQueue
from typing import Any

import cloudpickle

from flexband.basics.response import ResponseFunction
from flexband.errors import InputError
from flexband.execution.calls import (
    Arguments,
    Outcome,
    Outcomes,
    Performing,
    Tasks,
    Workers,
    gone,
    in_process,
    lost_with,
    perform,
    perform_elsewhere,
    receive_outcome,
    sent_by,
)
from flexband.execution.dask import DaskClient, dask_client

ExecutorLike = Workers | Executor | DaskClient | str | None
"""Where runs are made, as users give it."""


class _Flow:
    """Calls of a response by an executor, as many at a time as keep its workers busy.

    `first` submissions are under way before any has finished. One that has waited for less time
    than it worked shows that workers may be idle, and one more is under way from then on. Calls
    that take less than the time `least_work` [s] are submitted several at a time, unless workers
    would be without.
    """

    def __init__(
        self,
        executor: Executor,
        response: ResponseFunction,
        tasks: Tasks,
        client: DaskClient | None,
        first: int,
        least_work: float,
    ) -> None:
        self.executor = executor
        self.response = response
        self.tasks = tasks
        self.shared = isinstance(executor, ThreadPoolExecutor)
        self.sent: tuple[Any, ...] = ()
        if not self.shared:
            pickled, modules = sent_by(response)
            self.sent = pickled, *modules
        if client is not None:  # each worker gets it once, from the scheduler or another worker
            self.sent = tuple(client.submit(_identity, part, pure=False) for part in self.sent)
        self.limit = first
        self.least_work = least_work
        self.work = 0.0
        self.calls = 0
        self.begin = time.perf_counter()
        self.running: dict[Future, tuple[list[int], float]] = {}  # calls, and when submitted [s]
        self.finished: SimpleQueue[tuple[Future, float]] = SimpleQueue()

    def perform(self) -> Outcomes:
        """Yield the numbers and outcomes of calls as they finish."""
        waiting = deque(range(len(self.tasks)))
        lost_tasks = list[int]()
        try:
            while waiting or self.running:
                while waiting and len(self.running) < self.limit:
                    self.submit([waiting.popleft() for _ in range(self.size(len(waiting)))])
                for number, outcome in self.next_outcomes():
                    if outcome.lost:
                        lost_tasks.append(number)
                    else:
                        yield number, outcome
            for number in lost_tasks:
                self.submit([number])
                yield from self.next_outcomes()
        finally:
            for future in self.running:
                future.cancel()

    def size(self, waiting: int) -> int:
        """Return the number of calls of the next submission, of so many that are waiting."""
        if not self.calls:
            return 1
        batch_size = self.least_work * self.calls / max(self.work, 1e-6)
        busy = max(1.0, self.work / (time.perf_counter() - self.begin))  # workers, on average
        return max(1, int(min(batch_size, waiting / (2 * busy))))

    def submit(self, numbers: list[int]) -> None:
        """Submit calls, which one worker makes."""
        arguments = [self.tasks[number]() for number in numbers]
        try:
            if self.shared:
                within = copy_context().run
                future = self.executor.submit(within, _in_turn, self.response, arguments)
            else:
                pickled = [cloudpickle.dumps(values) for values in arguments]
                future = self.executor.submit(_in_turn_elsewhere, pickled, *self.sent)
        except RuntimeError as error:  # it is shut down or broken
            raise gone(error) from error
        self.running[future] = numbers, time.perf_counter()
        future.add_done_callback(lambda done: self.finished.put((done, time.perf_counter())))

    def next_outcomes(self) -> list[tuple[int, Outcome]]:
        """Wait for a submission; return the numbers and outcomes of its calls."""
        future, end = self.finished.get()
        numbers, begin = self.running.pop(future)
        try:
            result = future.result()
            outcomes = result if self.shared else list(map(receive_outcome, result))
        except Exception as error:
            outcomes = [lost_with(error)] * len(numbers)
        work = sum(outcome.seconds for outcome in outcomes)
        self.calls = self.calls + len(numbers)
        self.work = self.work + work
        if end - begin < 2 * work:
            self.limit += 1
        return list(zip(numbers, outcomes, strict=True))


def _in_turn(response: ResponseFunction, arguments: list[Arguments]) -> list[Outcome]:
    return [perform(response, values) for values in arguments]


def _in_turn_elsewhere(arguments: list[bytes], *sent: Any) -> list[bytes]:
    """Perform tasks that another process has pickled; return their outcomes."""
    response, *modules = sent
    return [perform_elsewhere(response, values, *modules) for values in arguments]


def _identity(part: bytes | str) -> bytes | str:
    return part


def with_executor(
    executor: Executor,
    client: DaskClient | None = None,
    *,
    first: int = 1000,
    least_work: float = 1.0,
) -> Performing:
    """Return what performs tasks by an executor, once more if their worker dies.

    They are then performed one after another: an executor cannot tell which one ended a worker.
    """
    return lambda response, tasks: _Flow(
        executor, response, tasks, client, first, least_work
    ).perform()


@contextmanager
def performer_of(executor: ExecutorLike) -> Iterator[Performing]:
    """Give what performs the tasks of a study; raise `InputError` if `executor` is none."""
    if executor is None:
        yield in_process
    elif isinstance(executor, Executor):
        yield with_executor(executor)
    elif isinstance(executor, Workers):
        with executor.open() as performer:
            yield performer
    elif isinstance(executor, str | DaskClient):
        with dask_client(executor) as client:
            yield with_executor(client.get_executor(pure=False), client)
    else:
        raise InputError(
            "executor must be None, execution.Processes(…), execution.Dask(…), an executor of "
            f"concurrent.futures, or a Dask client or its address; got {executor!r}"
        )
