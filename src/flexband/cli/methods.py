"""The options of methods as options of a command."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Annotated, Any

import typer

from flexband.cli.messages import print_table, print_text

_commands: list[Any] = []
"""Functions of commands that take options of methods."""


def print_methods(requested: bool) -> None:
    """Print the values of --method and the options of methods, if that is requested; then exit."""
    if not requested:
        return
    from flexband.cli.plan import METHODS  # noqa: PLC0415
    from flexband.study.method_options import method_options  # noqa: PLC0415

    print_text(f"Values of --method: {', '.join(METHODS)}")
    rows = []
    for name, (kind, defaults) in method_options(METHODS).items():
        option = f"--{('[no-]' if kind is bool else '')}{name}".replace("_", "-")
        rows += [
            [option * (k == 0), kind.__name__ * (k == 0), f"{method} ({value})"]
            for k, (method, value) in enumerate(defaults.items())
        ]
    print_table("Options of methods", (["option", "value", "method (default)"], rows))
    raise typer.Exit


HelpMethods = Annotated[
    bool,
    typer.Option(
        "--help-methods", callback=print_methods, is_eager=True, help="List methods and options."
    ),
]


def with_method_options(command: Any) -> Callable:
    """Put --help-methods in place of the ``**values`` of a command; the others are hidden."""
    _with_options(command, {"help_methods": HelpMethods}, False)
    _commands.append(command)
    return command


def add_method_options() -> None:
    """Add the options of all methods to the commands that take them, if any is loaded."""
    if not _commands:
        return
    from flexband.cli.plan import METHODS  # noqa: PLC0415
    from flexband.study.method_options import method_options  # noqa: PLC0415

    options: dict[str, Any] = {
        name: Annotated[kind | None, typer.Option(hidden=True)]
        for name, (kind, _) in method_options(METHODS).items()
    }
    while _commands:
        _with_options(_commands.pop(), options, None)


def _with_options(command: Any, options: dict[str, Any], default: object) -> None:
    """Put options in place of the ``**values`` of a command, or beside others."""
    signature = inspect.signature(command, eval_str=True)
    parameters = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    parameters += [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        for name, kind in options.items()
    ]
    command.__signature__ = signature.replace(parameters=parameters)
