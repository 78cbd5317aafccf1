"""An external program as a response."""

from __future__ import annotations

import inspect
import os
import select
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import field
from functools import cached_property
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import Any
from uuid import uuid4

import numpy as np
import xarray as xr

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_function, check_instance, check_numbers, check_positive
from flexband.basics.words import value_text
from flexband.errors import InputError, ModelError
from flexband.models.one_by_one import OneByOne, result_of_one
from flexband.models.template import Template

STDOUT = "stdout.txt"
STDERR = "stderr.txt"
"""Files in which a program's standard output and error are kept."""

SHOWN_LINES = 10
"""Last lines of what a program has written, in messages."""


@frozen()
class ExternalProgram(OneByOne):
    """``response(**values)``: run a program for each sample, in a new folder, and read its results.

    In the arguments, in the files and in the standard input, ``${name}`` or ``${name:format}``
    stands for the value of an input, with a format of Python such as ``.6e``; without one, numbers
    have all their digits. Other braces and dollars stay as they are; ``$${`` becomes ``${``. The
    response's arguments are the names of all placeholders.

    Parameters
    ----------
    command : the program and its arguments, each a text of its own. No shell is involved. It runs
        in the folder of the sample: a program that is given by a relative path is found from the
        current folder, but arguments are passed on as they are.
    read : function of the folder, a `pathlib.Path`, that returns a number, an array or a
        `xarray.DataArray`, the same shape and labels for all samples. What the program prints is in
        the files ``stdout.txt`` and ``stderr.txt`` of the folder.
    files : name of a file in the folder -> its text, the `pathlib.Path` of a file with the text, or
        bytes, which have no placeholders.
    standard_input : text that the program reads.
    time_limit : longest time of a run [s], after which the program and all processes that it has
        started are killed.
    keep : folder to which the folders of failed runs are moved; they are deleted otherwise.

    Raises
    ------
    InputError
        If the program is not found, a placeholder or a file name is not of the form above, or there
        is no placeholder; by a call, if its names are not those of the placeholders, or a value is
        a function of position.
    ModelError
        By a call, if the program cannot be started, exceeds the time limit or does not end with
        status 0, or `read` raises an error. The message shows the last lines that it has printed.
    """

    command: Sequence[str | os.PathLike[str]]
    read: Callable[[Path], Any]
    files: Mapping[str, str | Path | bytes] = field(default_factory=dict, repr=False)
    standard_input: str = field(default="", repr=False)
    time_limit: float | None = None
    keep: str | os.PathLike[str] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.command, list | tuple) or not self.command:
            raise InputError(
                "command must be a list of the program and its arguments, such as "
                f"['solver', 'input.txt']; got {value_text(self.command)}"
            )
        for part in self.command:
            check_instance("command", part, str | os.PathLike, "a list of texts")
        check_function("read", self.read, " of the folder of a sample")
        check_instance("standard_input", self.standard_input, str, "a text")
        if self.time_limit is not None:
            check_positive("time_limit [s]", check_numbers("time_limit [s]", self.time_limit))
        if self.keep is not None:
            check_instance("keep", self.keep, str | os.PathLike, "the path of a folder")
        check_instance("files", self.files, Mapping, "a dict of names and texts")
        program, *arguments = [os.fspath(part) for part in self.command]
        attributes = {
            "command": (_find_program(program), *arguments),
            "files": {
                _checked_name(name): _content(name, content) for name, content in self.files.items()
            },
            "keep": None if self.keep is None else os.path.abspath(self.keep),
        }
        for name, value in attributes.items():
            object.__setattr__(self, name, value)
        if not self.names:
            raise InputError(
                "command, files or standard_input must have a placeholder, such as ${length}"
            )
        kind = inspect.Parameter.KEYWORD_ONLY
        signature = inspect.Signature([inspect.Parameter(name, kind) for name in self.names])
        object.__setattr__(self, "__signature__", signature)  # of the instance, not of the class

    @cached_property
    def names(self) -> list[str]:
        """The names of the inputs: those of all placeholders."""
        return list(
            dict.fromkeys(n for template in self._templates.values() for n in template.names)
        )

    @property
    def identity(self) -> tuple[object, ...]:
        """What the results depend on: also the content of the program and of files it is given."""
        command = [shutil.which(self.command[0]), *self.command[1:]]
        content = tuple(
            sha256(Path(part).read_bytes()).hexdigest() if part and os.path.isfile(part) else ""
            for part in command
        )
        files = tuple(sorted(self.files.items()))
        return self.command, content, files, self.standard_input, self.read

    @cached_property
    def _templates(self) -> dict[tuple[str, object], Template]:
        """Return all texts with placeholders, by what they are."""
        texts: dict[tuple[str, object], Any] = {
            **{("argument", k): text for k, text in enumerate(self.command) if k},
            **{
                ("file", name): content
                for name, content in self.files.items()
                if isinstance(content, str)
            },
            ("standard input", ""): self.standard_input,
        }
        return {of: Template(text, f"{of[0]} {of[1]}".strip()) for of, text in texts.items()}

    def sample(self, **values: Any) -> np.ndarray | xr.DataArray:
        """Run the program once, and return what `read` returns."""
        self._check(values)
        folder = Path(tempfile.mkdtemp(prefix="flexband-"))
        try:
            arguments, standard_input = self._write(folder, values)
            self._run(folder, arguments, standard_input)
            return self._result(folder)
        except (InputError, ModelError) as error:
            if self.keep is None:
                raise
            archive = Path(self.keep, f"run-{uuid4().hex[:12]}")
            archive.parent.mkdir(parents=True, exist_ok=True)
            shutil.move(folder, archive)
            raise type(error)(f"{error}\nThe folder of the run is kept as {archive}") from error
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def _check(self, values: Mapping[str, Any]) -> None:
        if values.keys() != set(self.names):
            raise InputError(
                f"the placeholders are {', '.join(self.names)}; got values of "
                f"{', '.join(values) or 'nothing'}"
            )
        for name, value in values.items():
            if callable(value):
                raise InputError(
                    f"{name} is a function of position, which has no text. Give the program its "
                    "values as inputs of their own, e.g. fb.models.samplewise("
                    f"lambda {name}: program.sample(a={name}(0.0), b={name}(1.0)))"
                )
            if np.ndim(value):
                raise InputError(
                    f"{name} is a pair. Give the program its numbers as inputs of their own, e.g. "
                    f"fb.models.samplewise(lambda {name}: program.sample(x={name}[0], y={name}[1]))"
                )

    def _write(self, folder: Path, values: Mapping[str, Any]) -> tuple[list[str], str]:
        """Write the files; return the arguments and the standard input."""
        filled = {of: template.substitute(values) for of, template in self._templates.items()}
        for name, content in self.files.items():
            file = folder / name
            file.parent.mkdir(parents=True, exist_ok=True)
            text = filled.get(("file", name), "")
            file.write_bytes(content if isinstance(content, bytes) else text.encode())
        arguments = [text for (of, _), text in filled.items() if of == "argument"]
        return arguments, filled["standard input", ""]

    def _run(self, folder: Path, arguments: list[str], standard_input: str) -> None:
        """Run the program to its end; nothing that it has started is left running."""
        program = os.fspath(self.command[0])
        with tempfile.TemporaryFile() as input_file, open(folder / STDOUT, "wb") as out:
            input_file.write(standard_input.encode())
            input_file.seek(0)
            with open(folder / STDERR, "wb") as err:
                try:
                    process = subprocess.Popen(
                        [program, *arguments], cwd=folder, stdin=input_file, stdout=out, stderr=err,
                        start_new_session=True,
                    )  # fmt: skip
                except OSError as error:
                    raise ModelError(f"{program!r} cannot be started: {error}") from error
            try:
                in_time = has_ended(process, self.time_limit)
            finally:
                if process.returncode is None:  # its number is still its own
                    with suppress(ProcessLookupError, PermissionError):
                        os.killpg(process.pid, signal.SIGKILL)
                status = process.wait()
        if not in_time:
            what = f"was killed after its time limit of {self.time_limit:g} s"
        elif status < 0:
            what = f"was ended by signal {-status} ({signal.strsignal(-status)})"
        elif status > 0:
            what = f"ended with status {status}"
        else:
            return
        raise ModelError(f"{program!r} {what}{_last_lines(folder)}")

    def _result(self, folder: Path) -> np.ndarray | xr.DataArray:
        """Return what `read` returns, in memory."""
        try:
            result = result_of_one(self.read(folder))
            return result.load() if isinstance(result, xr.DataArray) else np.array(result)
        except InputError:
            raise
        except Exception as error:
            raise ModelError(
                f"the results of {os.fspath(self.command[0])!r} cannot be read: "
                f"{type(error).__name__}: {error}{_last_lines(folder)}"
            ) from error


def _find_program(program: str) -> str:
    """Find a program from any folder; raise `InputError` if there is none."""
    path = shutil.which(program)
    if path is None:
        raise InputError(f"command must begin with a program that exists; got {program!r}")
    return program if os.path.isabs(path) else os.path.abspath(path)


def _checked_name(name: object) -> str:
    path = PurePosixPath(name) if isinstance(name, str) else PurePosixPath("/")
    if path.is_absolute() or ".." in path.parts or not path.parts or name in (STDOUT, STDERR):
        raise InputError(
            f"files must be named by paths inside the folder of a sample, other than {STDOUT} and "
            f"{STDERR}; got {value_text(name)}"
        )
    return str(path)


def _content(name: str, content: object) -> str | bytes:
    if isinstance(content, Path):
        try:
            return content.read_bytes().decode()
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"files[{name!r}] must be a text in UTF-8: {error}") from None
    check_instance(f"files[{name!r}]", content, str | bytes, "a text, a Path or bytes")
    return content  # pyright: ignore[reportReturnType]


def _last_lines(folder: Path) -> str:
    """Return the last lines of standard error, or of standard output if there are none."""
    for name in (STDERR, STDOUT):
        with suppress(OSError), open(folder / name, "rb") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - 200 * SHOWN_LINES))
            lines = file.read().decode(errors="replace").strip().splitlines()[-SHOWN_LINES:]
            if lines:
                return "\n".join(
                    [f". The last lines of {name}:", *(f"    {line}" for line in lines)]
                )
    return ""


def has_ended(process: subprocess.Popen, time_limit: float | None) -> bool:
    """Return whether a process has ended within a time limit [s]; it keeps its number if it can."""
    try:
        descriptor = os.pidfd_open(process.pid)
    except (AttributeError, OSError):  # not Linux, or a Python that was built on an old one
        try:
            process.wait(time_limit)
        except subprocess.TimeoutExpired:
            return False
        return True
    try:
        poll = select.poll()
        poll.register(descriptor, select.POLLIN)
        return bool(poll.poll(None if time_limit is None else min(1e3 * time_limit, 2**31 - 1)))
    finally:
        os.close(descriptor)
