"""What flexband computes: numbers that rise when results change on purpose, and hashes of code.

What is on file has the numbers with which it was computed. Runs and answers of lower ones are not
used, whatever the code: a hash of the code changes with every commit, and does not tell whether its
results do. Comments, docstrings and layout do not change it. What is known of a file is kept on
disk, so that only files that have changed are read and parsed.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from functools import cache, lru_cache
from pathlib import Path
from typing import NamedTuple

from flexband.basics.files import read_unlinked, replace_file, user_folder
from flexband.errors import InputError

PACKAGE = Path(__file__).parents[1]

MEMORY = "sources.json"
"""File of what is known of sources, by path, modification time, change time and size."""


class Numbering(NamedTuple):
    """The numbers of what computes."""

    runs: int
    """Of mechanics. Raise it where a motion, a rest or a mode is another one than before."""
    answers: int
    """Of all that is made of runs. Raise it where a band, a claim or a verdict is another one."""


NUMBERING = Numbering(runs=3, answers=4)


class OutdatedError(InputError):
    """What is on file was computed with lower numbers."""


def check_numbering(name: str, numbers: Sequence[int] | None) -> None:
    """Raise `OutdatedError` if what is on file was computed otherwise than it would be now.

    What states no numbers has 1 and 1.
    """
    before = Numbering(*map(int, (1, 1) if numbers is None else numbers))
    changed = [
        field for field in Numbering._fields if getattr(before, field) < getattr(NUMBERING, field)
    ]
    if changed:
        raise OutdatedError(
            f"{name} has results of an older version of flexband, which computes "
            f"{' and '.join(changed)} otherwise now; `flexband run` computes them again"
        )


class Source(NamedTuple):
    """What is known of a file: a hash of its code, and the modules that it imports."""

    hash: str
    modules: list[str]


@cache
def source_hash(*folders: str) -> str:
    """Return a hash of the code in folders of flexband: it changes with what is computed."""
    files = sorted(path for folder in folders for path in (PACKAGE / folder).rglob("*.py"))
    total = hashlib.sha256()
    for file, source in sources(files).items():
        total.update(f"{file.relative_to(PACKAGE)} {source.hash}\n".encode())
    return total.hexdigest()[:32]


def sources(files: Iterable[Path], *, settled: float = 2.0) -> dict[Path, Source]:
    """Return what is known of files, and remember it.

    A file that changed in the last `settled` seconds is not remembered: another change at once
    might leave its times as they are.
    """
    memory_file = user_folder() / MEMORY
    memory = _read_memory(memory_file)
    source_by_file: dict[Path, Source] = {}
    new: dict[str, Source] = {}
    for file in files:
        key, change_time = _state(file)
        if key in memory:
            source_by_file[file] = Source(*memory[key])
            continue
        source_by_file[file] = parse_source(file.read_bytes())
        if change_time + settled < time.time():
            new[key] = source_by_file[file]
    if new:
        memory = {key: value for key, value in memory.items() if _exists(key)} | new
        with suppress(OSError), replace_file(memory_file) as partial:
            partial.write_text(json.dumps(memory), encoding="utf-8")
    return source_by_file


def parse_source(code: bytes) -> Source:
    """Parse code; return its hash and imports. The names of what it imports may be modules too."""
    imports: list[ast.Import | ast.ImportFrom] = []
    structure = repr(_structure(ast.parse(code), imports))
    modules: list[str] = []
    for node in imports:
        if isinstance(node, ast.Import):
            modules += (alias.name for alias in node.names)
        elif node.module and not node.level:
            modules += (node.module, *(f"{node.module}.{alias.name}" for alias in node.names))
    return Source(hashlib.sha256(structure.encode()).hexdigest()[:32], modules)


def _structure(node: object, imports: list[ast.Import | ast.ImportFrom]) -> object:
    """Return a syntax tree without texts that are statements: docstrings and descriptions.

    Fields without a value are left out, since versions of Python differ in them. All imports of the
    tree are appended to those given.
    """
    if isinstance(node, list):
        return [_structure(part, imports) for part in node if not _is_text(part)]
    if not isinstance(node, ast.AST):
        return node
    if isinstance(node, ast.Import | ast.ImportFrom):
        imports.append(node)
    fields = [(name, _structure(getattr(node, name), imports)) for name in node._fields]
    return type(node).__name__, *(field for field in fields if field[1] not in (None, []))


def _is_text(node: object) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _read_memory(file: Path) -> dict[str, list]:
    with suppress(OSError, ValueError, TypeError):
        return _read(file, _state(file)[0])
    return {}


@lru_cache(maxsize=1)
def _read(file: Path, _: str) -> dict[str, list]:
    """Return what a file in a state has, which is read once."""
    return dict(json.loads(read_unlinked(file)))


def _state(file: str | os.PathLike[str]) -> tuple[str, float]:
    """Return a text that a change of a file alters, and the time [s] of the last change."""
    state = os.stat(file)
    text = f"{state.st_mtime_ns} {state.st_ctime_ns} {state.st_ino} {state.st_size}"
    return f"{file} {text}", max(state.st_mtime, state.st_ctime)


def _exists(key: str) -> bool:
    """Return whether a file that is remembered is there, and as it was."""
    with suppress(OSError):
        return _state(key.rsplit(" ", 4)[0])[0] == key
    return False
