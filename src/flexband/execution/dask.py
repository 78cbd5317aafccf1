"""Runs on a Dask cluster, perhaps each within a time limit."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import cloudpickle

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_numbers, check_positive
from flexband.basics.response import ResponseFunction
from flexband.basics.words import value_text
from flexband.errors import InputError, RunError
from flexband.execution.calls import (
    Outcome,
    Outcomes,
    Performing,
    Tasks,
    Workers,
    lost_with,
    perform_elsewhere,
    receive_outcome,
    sent_by,
    unpickle_response,
)

if TYPE_CHECKING:
    from dask.distributed import Future


@runtime_checkable
class DaskClient(Protocol):
    """What is called of a client of Dask, which is not imported for it."""

    def get_executor(self, *, pure: bool) -> Executor: ...

    def submit(self, function: Callable[..., Any], /, *arguments: Any, pure: bool) -> Any: ...


@frozen()
class Dask(Workers):
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
        If the client is not a Dask client, or the time limit is not positive.
    """

    client: DaskClient | str
    time_limit: float

    def __post_init__(self) -> None:
        if not isinstance(self.client, str | DaskClient):
            raise InputError(
                "client must be a Dask client, or the address of a scheduler; got "
                f"{value_text(self.client)}"
            )
        check_positive("time_limit [s]", check_numbers("time_limit [s]", self.time_limit))

    @contextmanager
    def open(self) -> Iterator[Performing]:
        with dask_client(self.client) as client:
            yield _Timed(client, float(self.time_limit)).perform


class _Timed:
    """Performs tasks; each worker thread has one at a time, so that its time is known.

    A task is tried `attempts` times. All waits for `restart` seconds while a worker is restarted.
    It must have started and loaded the response within `start` seconds, and is looked for every
    `look` seconds: importing flexband takes 2 s, and many times as long where others use the cores.
    """

    def __init__(
        self,
        client: Any,
        time_limit: float,
        *,
        attempts: int = 2,
        restart: float = 10.0,
        start: float = 60.0,
        look: float = 0.2,
    ):
        self.client = client
        self.time_limit = time_limit
        self.attempts = attempts
        self.restart = restart
        self.start = start
        self.look = look
        self.excluded: set[str] = set()
        self.loaded: set[tuple[str, int]] = set()
        self.returning_until = float("-inf")

    def perform(self, response: ResponseFunction, tasks: Tasks) -> Outcomes:
        """Yield the numbers and outcomes of tasks as they finish."""
        pickled, modules = sent_by(response)
        waiting = deque(range(len(tasks)))
        attempts = Counter[int]()
        running: dict[Future, tuple[int, float]] = {}  # number and deadline
        try:
            while waiting or running:
                workers = self.workers(pickled, *modules)
                while waiting and len(running) < sum(workers.values()):
                    number = waiting.popleft()
                    attempts[number] += 1
                    future = self.client.submit(
                        perform_elsewhere, pickled, cloudpickle.dumps(tasks[number]()), *modules,
                        pure=False, workers=list(workers),
                    )  # fmt: skip
                    running[future] = number, time.monotonic() + self.time_limit
                for future, reason in self.wait_for_tasks(running):
                    number, _ = running.pop(future)
                    late = Outcome(None, TimeoutError(reason), 0.0, lost=True)
                    outcome = late if reason else _outcome(future)
                    if not outcome.lost:
                        yield number, outcome
                    elif attempts[number] < self.attempts:
                        waiting.append(number)
                    else:
                        yield number, outcome._replace(seconds=self.time_limit)
        finally:
            for future in running:
                future.cancel()

    def workers(self, response: bytes, with_modules: bytes, code: str) -> dict[str, int]:
        """Return the threads of each worker that has loaded a response; one is waited for."""
        while True:
            threads = {k: n for k, n in self.client.nthreads().items() if k not in self.excluded}
            key = hash(response)
            loading = {
                worker: self.client.submit(
                    load_response, response, with_modules, code, pure=False, workers=[worker]
                )
                for worker in threads
                if (worker, key) not in self.loaded
            }
            self._wait(list(loading.values()), self.start, "ALL_COMPLETED")
            self.loaded |= {(worker, key) for worker, future in loading.items() if future.done()}
            for worker in [worker for worker in loading if (worker, key) not in self.loaded]:
                loading[worker].cancel()
                self.replace(worker)
            if ready := {k: n for k, n in threads.items() if (k, key) in self.loaded}:
                return ready
            if time.monotonic() > self.returning_until:
                raise RunError("the executor cannot go on: no Dask worker is left that answers", {})
            time.sleep(self.look)

    def wait_for_tasks(self, running: dict[Future, tuple[int, float]]) -> list[tuple[Future, str]]:
        """Wait for tasks; return those that are finished, or that took too long, with a reason."""
        remaining = min(deadline for _, deadline in running.values()) - time.monotonic()
        self._wait(list(running), max(0.0, remaining), "FIRST_COMPLETED")
        if finished_futures := [future for future in running if future.done()]:
            return [(future, "") for future in finished_futures]
        late = [k for k, (_, deadline) in running.items() if deadline <= time.monotonic()]
        at = {key: worker for worker, keys in self.client.processing().items() for key in keys}
        late_workers = {at[future.key] for future in late if future.key in at}
        for future in late:
            future.cancel()
        for worker in late_workers:
            self.replace(worker)
        reason = f"the run was ended after its time limit of {self.time_limit:g} s"
        return [(future, reason) for future in late]

    @staticmethod
    def _wait(futures: list[Future], seconds: float, until: str) -> None:
        """Wait until futures are done, at most so long."""
        from dask.distributed import wait  # noqa: PLC0415

        if futures:
            with suppress(TimeoutError):
                wait(futures, seconds, return_when=until)

    def replace(self, worker: str) -> None:
        """Restart a worker, or give it no more tasks."""
        self.returning_until = time.monotonic() + self.start
        self.loaded = {entry for entry in self.loaded if entry[0] != worker}
        try:
            self.client.restart_workers([worker], timeout=self.restart)
        except TimeoutError:  # it comes back later, perhaps, unless it hangs still
            if worker in self.client.nthreads():
                self.excluded.add(worker)
        except Exception:  # it has no nanny
            self.excluded.add(worker)


def load_response(response: bytes, with_modules: bytes, code: str) -> None:
    """Load a response in a worker, so that this takes none of the time of its first call."""
    with suppress(Exception):  # which `perform_elsewhere` reports
        unpickle_response(response, with_modules, code)


def _outcome(future: Future) -> Outcome:
    """Return the outcome of a task that is done."""
    try:
        return receive_outcome(future.result())
    except Exception as error:
        return lost_with(error)


@contextmanager
def dask_client(client: DaskClient | str) -> Iterator[Any]:
    """Give a Dask client, or a new one for an address."""
    if not isinstance(client, str):
        yield client
        return
    try:
        from dask.distributed import Client  # noqa: PLC0415
        from distributed.comm.addressing import resolve_address  # noqa: PLC0415
    except ImportError:
        raise InputError(
            f"executor {client!r} requires Dask: pip install 'flexband[dask]'"
        ) from None
    try:
        resolve_address(client)  # a Client that cannot start waits for itself when it is deleted
        opened = Client(client, timeout=10)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"executor {client!r} is no Dask scheduler: {error}") from None
    with opened:
        yield opened
