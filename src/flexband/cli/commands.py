"""The commands by name; the module of a command is imported when it is called.

A study needs most of flexband, which takes more than a second to import, its help page nothing.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path

MODULES = (  # the order of the help page
    "runs", "status", "report", "export", "comparison", "points", "answers.ranking",
    "answers.narrowing", "answers.limits", "answers.ranges", "answers.allocation",
    "answers.derived", "answers.paths",
)  # fmt: skip


@cache
def commands() -> dict[str, tuple[str, str]]:
    """Return the module and the help of each command, read from functions with ``@app.command``."""
    entries = {}
    for module in MODULES:
        file = Path(__file__).parent.joinpath(*module.split(".")).with_suffix(".py")
        for function in ast.parse(file.read_bytes()).body:
            if isinstance(function, ast.FunctionDef):
                for name in _names(function):
                    entries[name] = f"flexband.cli.{module}", ast.get_docstring(function) or ""
    return entries


def _names(function: ast.FunctionDef) -> Iterator[str]:
    """Yield the name of the command that a function is, if it is one."""
    for decorator in function.decorator_list:
        if isinstance(decorator, ast.Call) and ast.unparse(decorator.func) == "app.command":
            yield (
                ast.literal_eval(decorator.args[0])
                if decorator.args
                else function.name.replace("_", "-")
            )


def load(arguments: Iterable[str]) -> None:
    """Import the module of the first argument that is a command, which adds it to the application.

    Parameters
    ----------
    arguments : those of the command line, options included.
    """
    name = next((argument for argument in arguments if argument in commands()), None)
    if name is not None:
        import_module(commands()[name][0])
