"""Machine code of compiled functions, kept on disk as long as nothing that it was made of changes.

Numba's own cache watches only the file in which a function is written, not the files that it calls
into, so that old code goes on running after an upgrade. Here the name of a file is a hash of all
that its content depends on, and a file that is damaged is dropped.
"""

from __future__ import annotations

import ast
import hashlib
import os
import pickle
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from llvmlite.binding import Linkage
from numba import njit, types
from numba.core import config
from numba.core.caching import NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.serialize import dumps
from numba.misc.appdirs import AppDirs

from flexband.files import replaced

SETTINGS: Any = config
KEPT = 8
"""Files of a function that are kept in a folder, the last used ones: one for each version of the
package, processor and signature."""

PACKAGE = __name__.partition(".")[0]
"""Whose functions those of other packages call."""

DEPENDENCIES = ("numba", "llvmlite", "numpy")
"""Packages whose version the machine code depends on."""

LOADED = time.time()
"""Before the first function is compiled: a file that changed later may not be the code in memory.
"""


OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
"""Of all compiled functions: no interpreter lock, and division as in IEEE 754."""


def cached_on_disk(function: Callable, **options: Any) -> Any:
    """Compile a function that Python calls, and keep its machine code on disk.

    Further options are Numba's.
    """
    options = {**OPTIONS, **options}
    dispatcher: Any = njit(pipeline_class=_SelfContainedCompiler, **options)(function)
    dispatcher._cache = _MachineCode(function, options)
    return dispatcher


class _SelfContained(JITCodeLibrary):
    """Machine code that calls its copies of all functions.

    Of several functions of one name, a process uses the one that was loaded first. It may have been
    optimized for another caller and round otherwise, so that results would depend on whether code
    was just compiled or read from disk, and on what else a process computes.
    """

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.linkonce_odr:
                function.linkage = Linkage.internal
        super()._optimize_final_module()


class _SelfContainedCompiler(Compiler):
    """Numba's compiler, for libraries that are self-contained."""

    def __init__(self, typingctx: Any, targetctx: Any, library: Any, *options: Any) -> None:
        library = _SelfContained(targetctx.codegen(), "self-contained")
        library.enable_object_caching()
        super().__init__(typingctx, targetctx, library, *options)


def compiled(function: Callable, **options: Any) -> Any:
    """Compile a function that only compiled code calls.

    It is compiled once for all constants of a type: Numba would do so again for each whole number.
    """
    options = {**OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, **options}
    dispatcher: Any = njit(**options)(function)
    find = dispatcher.get_call_template
    dispatcher.get_call_template = lambda args, kws: find(
        tuple(map(types.unliteral, args)), {name: types.unliteral(kws[name]) for name in kws}
    )
    return dispatcher


def inlined(function: Callable, **options: Any) -> Any:
    """Inline a function into its callers before compilation.

    It is for the functions between entries and kernels. Otherwise LLVM would optimize the kernels
    once more at every level of calls up to an entry.
    """
    options = {**OPTIONS, "inline": "always", **options}
    return njit(**options)(function)


class _MachineCode(NullCache):
    """The files of one function: a checksum and the pickled code each, in the first of `folders`.

    They are read from every folder, since a package that is installed for all users may come with
    its code, and written to the first folder that can be written to. Numba calls `load_overload`
    and `save_overload` with a signature.
    """

    def __init__(self, function: Callable, options: dict[str, Any]):
        self.start = f"{function.__module__}.{function.__qualname__}".replace("<locals>.", "")
        self.folders = _folders(Path(function.__code__.co_filename))
        self.basis = _basis(function.__module__), sorted(options.items())
        self.usable = self.basis[0] is not None and function.__closure__ is None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled function; None if there is none that fits."""
        target_context.refresh()
        for folder in self.folders if self.usable else ():
            file = folder / self._name(sig, target_context.codegen())
            try:
                content = file.read_bytes()
            except OSError:
                continue
            try:
                if hashlib.sha256(content[32:]).digest() != content[:32]:
                    raise ValueError("the checksum is wrong")
                overload = CompileResult._rebuild(target_context, *pickle.loads(content[32:]))
            except Exception:  # whatever a damaged file raises, its code is compiled again
                with suppress(OSError):
                    file.unlink()
                continue
            with suppress(OSError):
                os.utime(file)
            return overload
        return None

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Write a compiled function to the first folder that can be written to."""
        if not self.usable or cres.library.has_dynamic_globals or cres.lifted:
            return
        content = dumps(cres._reduce())
        name = self._name(sig, cres.codegen)
        for folder in self.folders:
            try:
                with replaced(folder / name) as partial:
                    partial.write_bytes(hashlib.sha256(content).digest() + content)
            except OSError:
                continue
            self._drop_old(folder)
            return

    def _name(self, sig: Any, codegen: Any) -> str:
        """Return the name of the file for a signature and a processor."""
        return f"{self.own}-{_hash((str(sig), codegen.magic_tuple()))}.nbc"

    @property
    def own(self) -> str:
        """The start of the names of files for all signatures and processors."""
        return f"{self.start}-{_hash(self.basis)}"

    def _drop_old(self, folder: Path) -> None:
        """Delete all files of the function but those used last, another process's included."""

        def used(file: Path) -> float:
            try:
                return file.stat().st_mtime
            except OSError:
                return 0.0

        for file in sorted(folder.glob(f"{self.start}-*"), key=used, reverse=True)[KEPT:]:
            with suppress(OSError):
                file.unlink()


def kept(function: Any) -> bool:
    """Return whether there is machine code of a function, for some signature, or there can be none.

    Parameters
    ----------
    function : what `cached_on_disk` returned.
    """
    code = function._cache
    files = (file for folder in code.folders for file in folder.glob(f"{code.own}-*"))
    return not code.usable or any(files) or not any(map(_may_write, code.folders))


def _may_write(folder: Path) -> bool:
    """Return whether files may be written to a folder, which is made if it is missing."""
    there = next(place for place in (folder, *folder.parents) if place.exists())
    return there.is_dir() and os.access(there, os.W_OK)


def _hash(content: object) -> str:
    return hashlib.sha256(repr(content).encode()).hexdigest()[:16]


def _folders(source: Path) -> list[Path]:
    """Return where code may be: NUMBA_CACHE_DIR if set; else beside the source or of the user."""
    beside = [] if SETTINGS.CACHE_DIR else [source.parent / "__pycache__"]
    return [*beside, user_folder()]


def user_folder() -> Path:
    """Return the folder of the user, or that in NUMBA_CACHE_DIR, for what is kept on disk."""
    if SETTINGS.CACHE_DIR:
        return Path(SETTINGS.CACHE_DIR) / "flexband"
    return Path(AppDirs("flexband", False).user_cache_dir)


@cache
def _basis(module: str) -> tuple[object, ...] | None:
    """Return what the code of a module's functions depends on; None if it cannot be known.

    This is the content of the modules of its package and of this one that it imports, directly or
    not, and of all other files in their folders, since types and overloads are not imported where
    they are used; the versions of the packages and of Python; and Numba's settings.
    """
    top = module.partition(".")[0]
    known_files, waiting, folders = set(), [module], set()
    try:
        while waiting:
            name = waiting.pop()
            file = _file(name) if name.partition(".")[0] in (top, PACKAGE) else None
            if file and file not in known_files:
                known_files.add(file)
                folders.add(file.parent)
                waiting += _read(file)[1]
        files = sorted(file for folder in folders for file in folder.glob("*.py"))
        if not files or max(file.stat().st_ctime for file in files) > LOADED:
            return None
        contents = [(file.name, _read(file)[0]) for file in files]
    except (OSError, SyntaxError, ValueError):
        return None
    versions = map(_version, (top, *DEPENDENCIES))
    return *contents, *versions, sys.version, SETTINGS.OPT, SETTINGS.BOUNDSCHECK


@cache
def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _file(module: str) -> Path | None:
    """Return the file of a module; None if it has none."""
    top, *names = module.split(".")
    origin = getattr(sys.modules.get(top), "__file__", None)
    if origin is None:
        return None
    path = Path(origin).parent.joinpath(*names)
    candidates = (path / "__init__.py", path.with_suffix(".py"))
    return next((file for file in candidates if file.is_file()), None)


@cache
def _read(file: Path) -> tuple[str, list[str]]:
    """Return a hash of a file, and the modules that it imports.

    The names of what it imports may be modules too. Expressions import nothing.
    """
    source, modules = file.read_bytes(), []
    waiting: list[ast.AST] = [ast.parse(source)]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import):
            modules += (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            modules += (node.module, *(f"{node.module}.{alias.name}" for alias in node.names))
        for part in ("body", "orelse", "handlers", "finalbody", "cases"):
            waiting += getattr(node, part, ())
    return hashlib.sha256(source).hexdigest(), modules
