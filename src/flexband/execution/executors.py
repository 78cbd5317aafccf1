"""Where runs are made: in this process, or by any executor of `concurrent.futures`, Dask included.

A task is one call of the response. Its outcome is what it returned or raised, with its wall time
and its warnings, which are issued again in the process of the study.
"""

from __future__ import annotations

import sys
import time
import traceback
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, contextmanager
from contextvars import copy_context
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import cloudpickle

from flexband.errors import FlexbandWarning, InputError, RunError, warn
from flexband.execution.fingerprint import fingerprint, modules_of_user

Arguments = dict[str, Any]


class Outcome(NamedTuple):
    """What one call of a response came to."""

    value: Any
    error: Exception | None
    seconds: float
    remarks: tuple[tuple[str, type[FlexbandWarning]], ...] = ()


class Performing(Protocol):
    """Performs tasks: yields their numbers and outcomes as they finish.

    Tasks that are left when the generator is closed are ended.
    """

    def __call__(
        self, response: Callable[..., Any], tasks: list[Callable[[], Arguments]]
    ) -> Generator[tuple[int, Outcome], None, None]: ...


class DaskClient(Protocol):
    """What is called of a client of Dask."""

    def get_executor(self, *, pure: bool) -> Executor: ...


class Workers(ABC):
    """An `executor` of this library, which performs tasks in processes that it starts or knows."""

    @abstractmethod
    def open(self) -> AbstractContextManager[Performing]:
        """Give what performs tasks."""


def perform(response: Callable[..., Any], arguments: Arguments) -> Outcome:
    """Call the response; `SystemExit` is an error as any other."""
    begin = time.perf_counter()
    try:
        value, error = response(**arguments), None
    except Exception as raised:
        value, error = None, raised
    except SystemExit as raised:
        value, error = None, RuntimeError(f"the response called sys.exit({raised.code!r})")
    return Outcome(value, error, time.perf_counter() - begin)


def in_process(
    response: Callable[..., Any], tasks: list[Callable[[], Arguments]]
) -> Generator[tuple[int, Outcome], None, None]:
    """Perform one task after another in this process."""
    for number, arguments in enumerate(tasks):
        yield number, perform(response, arguments())


@lru_cache(maxsize=4)
def unpickled(response: bytes, with_modules: bytes = b"", code: str = "") -> Callable[..., Any]:
    """Return a response that another process of the same study has pickled.

    `with_modules` is the response with the user's modules, for a process that does not have them,
    or has others: then its fingerprint is not `code`.
    """
    try:
        function = cloudpickle.loads(response)
    except (ModuleNotFoundError, AttributeError):
        if not with_modules:
            raise
        return cloudpickle.loads(with_modules)
    return cloudpickle.loads(with_modules) if code and fingerprint(function) != code else function


def perform_elsewhere(
    response: bytes, arguments: bytes, with_modules: bytes = b"", code: str = ""
) -> bytes:
    """Perform a task that another process of the same study has pickled; return its outcome."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", FlexbandWarning)
        try:
            own = unpickled(response, with_modules, code)
            outcome = perform(own, cloudpickle.loads(arguments))
        except Exception as error:  # a module that is missing there
            outcome = Outcome(None, error, 0.0)
    own = [w for w in caught if issubclass(w.category, FlexbandWarning)]
    outcome = outcome._replace(remarks=tuple((str(w.message), w.category) for w in own))
    if outcome.error is not None:
        lines = traceback.format_exception(outcome.error)
        outcome.error.add_note(f"In a worker process:\n{''.join(lines)}")
    try:
        return _returning(outcome)
    except Exception as reason:
        error = outcome.error or reason
        plain = RuntimeError(f"{type(error).__name__}: {error}")
        return cloudpickle.dumps(outcome._replace(value=None, error=plain))


def _returning(outcome: Outcome) -> bytes:
    data = cloudpickle.dumps(outcome)
    if outcome.error is not None:
        cloudpickle.loads(data)  # some errors can be pickled, but not made again
    return data


def received(data: bytes) -> Outcome:
    """Return an outcome of `perform_elsewhere`, and issue its warnings."""
    try:
        outcome: Outcome = cloudpickle.loads(data)
        for text, kind in outcome.remarks:
            warn(text, kind)
    except Exception as error:  # an unknown class, or a warning that is to be an error
        return Outcome(None, error, 0.0)
    return outcome


def dumped(response: Callable[..., Any]) -> bytes:
    """Return a response for another process; raise `InputError` if that is not possible."""
    try:
        return cloudpickle.dumps(response)
    except Exception as error:
        raise InputError(
            f"the response cannot be sent to another process: {type(error).__name__}: {error}"
        ) from None


def dumped_with_modules(response: Callable[..., Any]) -> bytes:
    """Return a response with the modules of the user that it needs; b"" if that is not possible."""
    done = cloudpickle.list_registry_pickle_by_value()
    named = {m.__name__: m for m in modules_of_user()}
    modules = [named[name] for name in named.keys() & sys.modules.keys() - done]
    for module in modules:
        cloudpickle.register_pickle_by_value(module)
    try:
        return cloudpickle.dumps(response)
    except Exception:  # what a module has besides the response may be anything
        return b""
    finally:
        for module in modules:
            cloudpickle.unregister_pickle_by_value(module)


def sent_by(response: Callable[..., Any]) -> tuple[bytes, tuple[bytes, str]]:
    """Return a response for another process, and what `unpickled` takes besides."""
    pickled, whole = dumped(response), dumped_with_modules(response)
    by_value = whole if whole != pickled else b""
    return pickled, (by_value, fingerprint(response) if by_value else "")


def with_executor(executor: Executor, in_flight: int = 256) -> Performing:
    """Return what performs tasks by an executor, which has up to `in_flight` of them at a time.

    Tasks whose workers died are performed once more, one after another: an executor cannot tell
    which of several tasks ended a worker.
    """

    def performing(
        response: Callable[..., Any], tasks: list[Callable[[], Arguments]]
    ) -> Generator[tuple[int, Outcome], None, None]:
        shared = isinstance(executor, ThreadPoolExecutor)
        pickled, sent = (b"", (b"", "")) if shared else sent_by(response)
        running: dict[Future, int] = {}
        waiting, lost = iter(range(len(tasks))), list[int]()

        def submit(number: int) -> None:
            arguments = tasks[number]()
            try:
                if shared:
                    future = executor.submit(copy_context().run, perform, response, arguments)
                else:
                    future = executor.submit(
                        perform_elsewhere, pickled, cloudpickle.dumps(arguments), *sent
                    )
            except RuntimeError as error:  # it is shut down or broken
                raise _gone(error) from error
            running[future] = number

        try:
            for number, _ in zip(waiting, range(in_flight), strict=False):
                submit(number)
            while running:
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    number, outcome = running.pop(future), outcome_of(future, shared=shared)
                    if isinstance(outcome, Outcome):
                        yield number, outcome
                    else:
                        lost.append(number)
                    if (following := next(waiting, None)) is not None:
                        submit(following)
            for number in lost:
                submit(number)
                future = next(iter(running))
                outcome = outcome_of(future, shared=shared)
                running.clear()
                yield (
                    number,
                    outcome if isinstance(outcome, Outcome) else Outcome(None, outcome, 0.0),
                )
        finally:
            for future in running:
                future.cancel()

    return performing


def outcome_of(future: Any, *, shared: bool = False) -> Outcome | RuntimeError:
    """Return the outcome of a task, or an error which tells that workers died of it."""
    try:
        return future.result() if shared else received(future.result())
    except Exception as error:
        if type(error).__name__ == "KilledWorker":  # of Dask
            return RuntimeError(f"the process of the response ended: {error}")
        raise _gone(error) from error


def _gone(error: Exception) -> RunError:
    return RunError(f"the executor cannot go on: {type(error).__name__}: {error}", {})


@contextmanager
def performing(executor: Any) -> Iterator[Performing]:
    """Give what performs the tasks of a study, by what a user passed as `executor`.

    Raises
    ------
    InputError
        If it is none.
    """
    if executor is None:
        yield in_process
    elif isinstance(executor, Executor):
        yield with_executor(executor)
    elif isinstance(executor, Workers):
        with executor.open() as performer:
            yield performer
    elif isinstance(executor, str) or is_dask_client(executor):
        with dask_client(executor) as client:
            yield with_executor(client.get_executor(pure=False))
    else:
        raise InputError(
            "executor must be None, execution.Processes(…), execution.Dask(…), an executor of "
            f"concurrent.futures, or a Dask client or its address; got {executor!r}"
        )


ExecutorLike = Workers | Executor | DaskClient | str | None
"""Where runs are made, as users give it."""


def is_dask_client(client: object) -> bool:
    """Return whether an object is a client of Dask, which is not imported for it."""
    return hasattr(client, "get_executor")


@contextmanager
def dask_client(client: Any) -> Iterator[Any]:
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
