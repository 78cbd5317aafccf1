"""Hashes of flexband's own code, which comments, docstrings and layout do not change."""

from __future__ import annotations

import ast
import hashlib
import json
from contextlib import suppress
from functools import cache
from pathlib import Path

from flexband.files import read_unlinked, replaced

PACKAGE = Path(__file__).parent

MEMORY = "source_hashes.json"
"""File of the hashes of syntax trees, by path, modification time and size."""


@cache
def source_hash(*folders: str) -> str:
    """Return a hash of the code in folders of flexband: it changes with what is computed.

    Hashes of files are kept on disk, so that only files that have changed are parsed.
    """
    file = _memory_file()
    memory = _remembered(file)
    hashes: dict[str, str] = {}
    total = hashlib.sha256()
    for source in sorted(path for folder in folders for path in (PACKAGE / folder).rglob("*.py")):
        state = source.stat()
        key = f"{source} {state.st_mtime_ns} {state.st_size}"
        hashes[key] = memory.get(key) or syntax_hash(source.read_bytes())
        total.update(f"{source.relative_to(PACKAGE)} {hashes[key]}\n".encode())
    if not hashes.keys() <= memory.keys():
        kept = {key: value for key, value in memory.items() if _exists(key)}
        with suppress(OSError), replaced(file) as partial:
            partial.write_text(json.dumps(kept | hashes), encoding="utf-8")
    return total.hexdigest()[:32]


def syntax_hash(code: bytes) -> str:
    """Return a hash of the syntax tree of code, without docstrings."""
    tree = _WithoutTexts().visit(ast.parse(code))
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()[:32]


class _WithoutTexts(ast.NodeTransformer):
    """Removes statements that are nothing but a text: docstrings, and descriptions of constants."""

    def visit_Expr(self, node: ast.Expr) -> ast.Expr | None:
        return None if isinstance(node.value, ast.Constant) else node


def _memory_file() -> Path:
    from flexband.caching import user_folder  # noqa: PLC0415  (imports Numba)

    return user_folder() / MEMORY


def _remembered(file: Path) -> dict[str, str]:
    with suppress(OSError, ValueError):
        content = json.loads(read_unlinked(file))
        if isinstance(content, dict):
            return content
    return {}


def _exists(key: str) -> bool:
    """Return whether a file that is remembered is there, and as it was."""
    path, time, size = key.rsplit(" ", 2)
    with suppress(OSError):
        state = Path(path).stat()
        return (str(state.st_mtime_ns), str(state.st_size)) == (time, size)
    return False
