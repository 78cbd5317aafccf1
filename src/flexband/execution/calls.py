"""Calls of a response, in this process or another, and what they came to.

A task is one call of the response. Its outcome is what it returned or raised, with its wall time
and its warnings, which are issued again in the process of the study.
"""

from __future__ import annotations

import sys
import time
import traceback
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Sequence
from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any, NamedTuple

import cloudpickle

from flexband.basics.response import ResponseFunction
from flexband.basics.warning import warn
from flexband.errors import FlexbandWarning, InputError, RunError
from flexband.execution.fingerprint import fingerprint, modules_of_user
from flexband.remarks.collection import catch_remarks
from flexband.remarks.remark import Remark

Arguments = dict[str, Any]
Tasks = Sequence[Callable[[], Arguments]]


class Outcome(NamedTuple):
    """What one call of a response came to."""

    value: Any
    error: Exception | None
    seconds: float  # wall time [s]
    remarks: tuple[Remark, ...] = ()
    warnings: tuple[tuple[str, type[FlexbandWarning]], ...] = ()  # of another process
    lost: bool = False  # whether its worker died of it


Outcomes = Generator[tuple[int, Outcome], None, None]
"""Numbers and outcomes of tasks as they finish; those left are ended when it is closed."""

Performing = Callable[[ResponseFunction, Tasks], Outcomes]


class Workers(ABC):
    """An `executor` of this library, which performs tasks in processes that it starts or knows."""

    @abstractmethod
    def open(self) -> AbstractContextManager[Performing]:
        """Give what performs tasks."""


def in_process(response: ResponseFunction, tasks: Tasks) -> Outcomes:
    """Perform one task after another in this process; `SystemExit` is an error as any other."""
    for number, task in enumerate(tasks):
        arguments = task()
        begin = time.perf_counter()
        with catch_remarks() as remarks:
            try:
                value = response(**arguments)
                error = None
            except Exception as raised:
                value = None
                error = raised
            except SystemExit as raised:
                value = None
                error = RuntimeError(f"the response called sys.exit({raised.code!r})")
        yield number, Outcome(value, error, time.perf_counter() - begin, tuple(remarks))


def perform(response: ResponseFunction, arguments: Arguments) -> Outcome:
    """Perform one task in this process."""
    return next(in_process(response, [lambda: arguments]))[1]


@lru_cache(maxsize=4)
def unpickle_response(
    response: bytes, with_modules: bytes = b"", code: str = ""
) -> ResponseFunction:
    """Return a pickled response, with the user's modules where its fingerprint is not `code`."""
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
            function = unpickle_response(response, with_modules, code)
            outcome = perform(function, cloudpickle.loads(arguments))
        except Exception as error:  # a module that is missing there
            outcome = Outcome(None, error, 0.0)
    library_warnings = [w for w in caught if issubclass(w.category, FlexbandWarning)]
    outcome = outcome._replace(
        warnings=tuple((str(w.message), w.category) for w in library_warnings)
    )
    if outcome.error is not None:
        lines = traceback.format_exception(outcome.error)
        outcome.error.add_note(f"In a worker process:\n{''.join(lines)}")
    try:
        data = cloudpickle.dumps(outcome)
        if outcome.error is not None:
            cloudpickle.loads(data)  # some errors can be pickled, but not made again
        return data
    except Exception as reason:
        error = outcome.error or reason
        plain = RuntimeError(f"{type(error).__name__}: {error}")
        return cloudpickle.dumps(outcome._replace(value=None, error=plain))


def receive_outcome(data: bytes) -> Outcome:
    """Return an outcome of `perform_elsewhere`, and issue its warnings."""
    try:
        outcome: Outcome = cloudpickle.loads(data)
        for text, kind in outcome.warnings:
            warn(text, kind)
    except Exception as error:  # an unknown class, or a warning that is to be an error
        return Outcome(None, error, 0.0)
    return outcome


def dump_response(response: ResponseFunction) -> bytes:
    """Return a response for another process; raise `InputError` if that is not possible."""
    try:
        return cloudpickle.dumps(response)
    except Exception as error:
        raise InputError(
            f"the response cannot be sent to another process: {type(error).__name__}: {error}"
        ) from None


def dumped_with_modules(response: ResponseFunction) -> bytes:
    """Return a response with the modules of the user that it needs; b"" if that is not possible."""
    by_value = cloudpickle.list_registry_pickle_by_value()
    module_by_name = {m.__name__: m for m in modules_of_user()}
    modules = [
        module_by_name[name] for name in module_by_name.keys() & sys.modules.keys() - by_value
    ]
    for module in modules:
        cloudpickle.register_pickle_by_value(module)
    try:
        return cloudpickle.dumps(response)
    except Exception:  # what a module has besides the response may be anything
        return b""
    finally:
        for module in modules:
            cloudpickle.unregister_pickle_by_value(module)


def sent_by(response: ResponseFunction) -> tuple[bytes, tuple[bytes, str]]:
    """Return a response for another process, and what `unpickle_response` takes besides."""
    pickled = dump_response(response)
    with_modules = dumped_with_modules(response)
    by_value = with_modules if with_modules != pickled else b""
    return pickled, (by_value, fingerprint(response) if by_value else "")


def lost_with(error: Exception) -> Outcome:
    """Return the outcome of a task whose worker died of it; raise other errors of an executor."""
    if type(error).__name__ == "KilledWorker":  # of Dask
        ended = RuntimeError(f"the process of the response ended: {error}")
        return Outcome(None, ended, 0.0, lost=True)
    raise gone(error) from error


def gone(error: Exception) -> RunError:
    """Return the error of an executor that is shut down or broken."""
    return RunError(f"the executor cannot go on: {type(error).__name__}: {error}", {})
