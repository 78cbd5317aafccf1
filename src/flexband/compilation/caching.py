"""Machine code of compiled functions, kept on disk as long as nothing that it was made of changes.

The name of a file is a hash of all that its content depends on, so that no old code runs after an
upgrade. A wheel for a platform comes with the code of most functions, in the folder `SHIPPED`.
"""

from __future__ import annotations

import hashlib
import os
import struct
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from ctypes import CFUNCTYPE, c_int, c_void_p, cast
from functools import cache, singledispatch
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import binding, ir

from flexband.basics.computation import PACKAGE, Source, sources
from flexband.basics.files import CACHE_VARIABLE, replace_file, user_folder
from flexband.compilation.functions import compiled, machine_code
from flexband.compilation.targets import ENTRY, SETTINGS, instruction_set, target_machine

KEPT = 8
"""Files of a function that are kept in a folder, the last used ones: one for each version of the
package, processor and kind of arguments."""

SHIPPED = Path(__file__).with_name("objects")
"""Folder of the code that flexband was installed with."""

DEPENDENCIES = ("numba", "llvmlite", "numpy")
"""Packages whose version the code that is compiled on this machine depends on."""

LOADED = time.time()
"""Before the first function is compiled: a file that changed later may not be the code in memory.
"""

compiling: set[str] = set()
"""Names of the functions that are being compiled."""

_lock = threading.RLock()


class Addressed:
    """An argument of compiled code that is passed as the address of a table of numbers.

    Attributes
    ----------
    kind : what is where in the table.
    address : of the table.
    """

    kind: str
    address: int


Code = tuple[Callable[[int], int], binding.ExecutionEngine]
"""A C function of the address of a table of arguments, which returns a positive number if it fails,
and what keeps it in memory."""


class Entry:
    """A function that Python calls and that returns nothing, with machine code on disk.

    Attributes
    ----------
    codes : what has been called so far, for each kind of arguments.
    """

    def __init__(self, function: Callable, types_in: tuple[str, ...], options: dict):
        self.function = compiled(function, **options)
        self.types_in = types_in
        self.options = sorted(options.items())
        self.module = function.__module__
        self.name = f"{function.__module__}.{function.__qualname__}".replace("<locals>.", "")
        self.source = Path(function.__code__.co_filename)
        self.is_closure = function.__closure__ is not None
        self.codes: dict[str, Code] = {}

    def __call__(self, *arguments: object) -> None:
        """Call the function, whose machine code is read or made before it is called first."""
        code, numbers = self._prepare(arguments)
        table = np.array(numbers, np.int64)
        if code[0](table.ctypes.data) > 0:
            raise MemoryError(f"{self.name} found no memory for its arrays")

    def at_address(self, array: np.ndarray, *others: object) -> tuple[int, object]:
        """Return the address of a C function of the address of an array, the first argument.

        It calls this function with an array there of the same kind, and with the other arguments.
        The second value is what keeps it in memory. If there is no memory left, it does nothing.
        """
        code, numbers = self._prepare((array, *others))
        number = ir.IntType(64)
        data = 4  # the place of an array's address among its numbers
        module = ir.Module(ENTRY)
        module.triple = binding.get_process_triple()
        function = ir.Function(module, ir.FunctionType(ir.VoidType(), [number]), ENTRY)
        builder = ir.IRBuilder(function.append_basic_block())
        table = builder.alloca(number, len(numbers))
        for place, value in enumerate(numbers):
            row = builder.gep(table, [number(place)])
            builder.store(function.args[0] if place == data else number(value), row)
        called: Any = code[0]
        address = cast(called, c_void_p).value
        kind = ir.FunctionType(ir.IntType(32), [table.type]).as_pointer()
        builder.call(builder.inttoptr(number(address), kind), [table])
        builder.ret_void()
        engine = binding.create_mcjit_compiler(
            binding.parse_assembly(str(module)), target_machine()
        )
        engine.finalize_object()
        return engine.get_function_address(ENTRY), (engine, code)

    def _prepare(self, arguments: tuple) -> tuple[Code, list[int]]:
        """Read or make the machine code for arguments; return it and the numbers it reads."""
        numbers: list[int] = []
        kind = ", ".join([_add_numbers(argument, numbers) for argument in arguments])
        code = self.codes.get(kind)
        if code is None:
            with _lock:
                code = self.codes.get(kind) or self._code(kind, arguments)
                self.codes[kind] = code
        return code, numbers

    def _code(self, kind: str, arguments: tuple) -> Code:
        for file in self.files(_hash(kind)) if self.usable else ():
            with suppress(OSError):
                content = file.read_bytes()
                if content != add_checksum(content[32:]):
                    file.unlink()  # it is damaged
                    continue
                if not _svml_is_there(content):
                    continue
                with suppress(OSError):
                    os.utime(file)
                return _load_code(content[32:])
        compiling.add(self.name)
        try:
            for name in self.types_in:
                import_module(name)
            content = machine_code.object_code(self.function.dispatcher, arguments)
        finally:
            compiling.discard(self.name)
        if self.usable:
            self.keep(content, _hash(kind))
        return _load_code(content)

    def keep(self, content: bytes, kind: str) -> None:
        """Write an object to the first folder that can be written to, and drop old ones there."""
        for file in self.files(kind)[1:]:
            try:
                with replace_file(file) as partial:
                    partial.write_bytes(add_checksum(content))
            except OSError:
                continue
            for old in sorted(file.parent.glob(f"{self.name}-*"), key=_last_use)[:-KEPT]:
                with suppress(OSError):
                    old.unlink()
            return

    @property
    def usable(self) -> bool:
        """Whether it is known what the code depends on, which a closure is not."""
        return not self.is_closure and self._basis is not None

    @property
    def _basis(self) -> tuple[tuple[str, str], ...] | None:
        return _basis(self.module, *self.types_in)

    def files(self, kind: str) -> list[Path]:
        """Return where code may be: as it was installed, then as it was made on this machine.

        What is made here depends on the versions of the packages and of Python, too. It is in
        NUMBA_CACHE_DIR if that is set, else beside the source, or in the folder of the user.
        """
        settings = sys.platform, instruction_set(), SETTINGS.boundscheck
        made_of = self.options, self._basis, settings
        versions = *map(_version, (self.module.partition(".")[0], *DEPENDENCIES)), sys.version
        beside = [] if os.environ.get(CACHE_VARIABLE) else [self.source.parent / "__pycache__"]
        name = f"{self.name}-{_hash((made_of, versions))}-{kind}.o"
        return [
            SHIPPED / f"{self.name}-{_hash(made_of)}-{kind}.o",
            *(folder / name for folder in (*beside, user_folder())),
        ]


def cached_on_disk(function: Callable, *, types_in: tuple[str, ...] = (), **options: Any) -> Any:
    """Compile a function that Python calls, and keep its machine code on disk.

    Its arguments are numbers, arrays, tuples of them, and tables; it returns nothing. Types of
    other kinds are in the modules of the names `types_in`. Further options are Numba's.
    """
    return Entry(function, types_in, options)


def add_checksum(content: bytes) -> bytes:
    """Prepend the checksum to an object, as in a file."""
    return hashlib.sha256(content).digest() + content


def is_compiled(entry: Any) -> bool:
    """Return whether an entry has machine code, for some arguments, or can have none.

    Parameters
    ----------
    entry : what `cached_on_disk` returned.
    """
    if not entry.usable:
        return True
    files = entry.files("*")
    there = (kept_file for file in files for kept_file in file.parent.glob(file.name))
    return any(there) or not any(_may_write(file.parent) for file in files[1:])


@singledispatch
def _add_numbers(argument: Any, numbers: list[int]) -> str:
    """Append the numbers that an argument is to compiled code, and return its kind."""
    numbers.append(int(argument))
    return "int64" if type(argument) is int else np.asarray(argument).dtype.name


@_add_numbers.register
def _(argument: float, numbers: list[int]) -> str:
    numbers += struct.unpack("q", struct.pack("d", argument))
    return "float64"


@_add_numbers.register
def _(argument: np.ndarray, numbers: list[int]) -> str:
    flags = argument.flags
    data = argument.ctypes.data
    size = argument.size
    numbers += (0, 0, size, argument.itemsize, data, *argument.shape, *argument.strides)
    layout = "C" if flags.c_contiguous else "F" if flags.f_contiguous else "A"
    access = "" if flags.writeable else ", read only"
    return f"{argument.dtype.str}{argument.ndim}{layout}{access}"


@_add_numbers.register
def _(argument: tuple, numbers: list[int]) -> str:
    kinds = [_add_numbers(part, numbers) for part in argument]
    return f"{type(argument).__name__}({', '.join(kinds)})"


@_add_numbers.register
def _(argument: Addressed, numbers: list[int]) -> str:
    numbers.append(argument.address)
    return argument.kind


def _load_code(content: bytes) -> Code:
    """Load an object and return its entry.

    Each object has another engine: of several symbols of one name, an engine uses the first.
    """
    engine = binding.create_mcjit_compiler(binding.parse_assembly(""), target_machine())
    engine.add_object_file(binding.ObjectFileRef.from_data(content))
    engine.finalize_object()
    return CFUNCTYPE(c_int, c_void_p)(engine.get_function_address(ENTRY)), engine


def _svml_is_there(content: bytes) -> bool:
    """Return whether Intel's SVML is loaded, which Numba does, where an object needs it."""
    return b"__svml_" not in content or machine_code.USES_SVML


def _last_use(file: Path) -> float:
    """Return when a file was last used."""
    try:
        return file.stat().st_mtime
    except OSError:
        return 0.0


def _may_write(folder: Path) -> bool:
    """Return whether files may be written to a folder, which is made if it is missing."""
    there = next(place for place in (folder, *folder.parents) if place.exists())
    return there.is_dir() and os.access(there, os.W_OK)


def _hash(content: object) -> str:
    return hashlib.sha256(repr(content).encode()).hexdigest()[:16]


@cache
def _basis(*modules: str) -> tuple[tuple[str, str], ...] | None:
    """Return the files that the code of modules' functions is made of; None if it is not known.

    These are the modules of their package and of this one that they import, directly or not, and
    all other files in their folders, since overloads are not imported where they are used.
    """
    tops = modules[0].partition(".")[0], PACKAGE.name  # whose functions those of others call
    source_by_file: dict[Path, Source] = {}
    waiting = set(modules)
    followed = set()
    try:
        while files := {file for name in waiting if (file := _file(name))} - followed:
            source_by_file |= sources(
                other for folder in {f.parent for f in files} for other in folder.glob("*.py")
            )
            followed |= files
            names = {name for file in files for name in source_by_file[file].modules}
            waiting = {name for name in names if name.partition(".")[0] in tops}
        if not source_by_file or max(file.stat().st_ctime for file in source_by_file) > LOADED:
            return None
    except (OSError, SyntaxError, ValueError):
        return None
    return tuple(sorted((file.name, source.hash) for file, source in source_by_file.items()))


@cache
def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


@cache
def _file(module: str) -> Path | None:
    """Return the file of a module; None if it has none."""
    top, *names = module.split(".")
    origin = getattr(sys.modules.get(top), "__file__", None)
    if origin is None:
        return None
    path = Path(origin).parent.joinpath(*names)
    candidates = (path / "__init__.py", path.with_suffix(".py"))
    return next((file for file in candidates if file.is_file()), None)
