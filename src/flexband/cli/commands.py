"""The commands by name; the module of a command is imported when it is called.

A study needs most of flexband, which takes more than a second to import. A help page needs nothing
of it: what a module with commands imports below ``if TYPE_CHECKING`` is imported at run time, too,
but only if a command is called.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

from flexband.basics.namespaces import imports_for_types
from flexband.cli.methods import add_method_options

MODULES = (  # the order of the help page
    "run_commands", "status", "report", "exchange.export", "comparison", "exchange.points",
    "exchange.from_table",
    "answers.rankings",
    "answers.narrowing", "answers.check", "answers.distributions", "answers.allocation",
    "answers.derived", "answers.paths", "answers.production",
)  # fmt: skip

FORMER_COMMANDS = {"limits": "check"}
"""The new names of commands, by former ones, which work for one release."""


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
        if isinstance(decorator, ast.Call) and ast.unparse(decorator.func) in (
            "app.command",
            "answer_command",
        ):
            explicit_names = [ast.literal_eval(argument) for argument in decorator.args[:1]]
            yield (explicit_names or [function.name.replace("_", "-")])[0]


def load(arguments: Sequence[str]) -> None:
    """Import the module of the first argument that is a command, which adds its commands."""
    name = next((argument for argument in arguments if argument in commands()), None)
    if name is None:
        return
    import_module(commands()[name][0])
    if not asks_for_help(arguments):
        add_method_options()
        for module in MODULES:
            if loaded := sys.modules.get(f"flexband.cli.{module}"):
                _complete(loaded)


def asks_for_help(arguments: Sequence[str]) -> bool:
    """Return whether a help page is requested, and nothing else."""
    return "--help" in (arguments[: arguments.index("--")] if "--" in arguments else arguments)


@cache
def _complete(module: ModuleType) -> None:
    """Import what a module imports below ``if TYPE_CHECKING``."""
    assert module.__file__ is not None
    imports = ast.Module(imports_for_types(module.__file__), type_ignores=[])
    exec(compile(imports, module.__file__, "exec"), module.__dict__)
