"""The methods by name, and their options as options of a command."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Annotated, Any

import typer

import flexband as fb
from flexband.cli.messages import print_table, print_text
from flexband.study.options import method_classes, method_options

METHODS = method_classes([  # the public ones, without all that else is public
    fb.AdaptivePCCI, fb.ImprovedPCCI, fb.LHSScanning, fb.MonteCarlo, fb.PCCI,
    fb.methods.PerturbationChebyshev, fb.methods.PhaseResolvedPCCI, fb.methods.RegressionPCCI,
    fb.methods.SobolScanning,
])  # fmt: skip


def print_methods(requested: bool) -> None:
    """Print the values of --method and the options of methods, if that is requested; then exit."""
    if not requested:
        return
    print_text(f"Values of --method: {', '.join(METHODS)}")
    rows = []
    for name, (kind, defaults) in method_options(METHODS).items():
        option = f"--{'[no-]' * (kind is bool)}{name}".replace("_", "-")
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
    """Put the options of all methods in place of the ``**values`` of a command.

    They are not in its help page; --help-methods, which is added as well, lists them.
    """
    signature = inspect.signature(command, eval_str=True)
    parameters = list(signature.parameters.values())[:-1]
    options: dict[str, Any] = {
        name: Annotated[kind | None, typer.Option(hidden=True)]
        for name, (kind, _) in method_options(METHODS).items()
    }
    parameters += [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        for kind_of, default in ((options, None), ({"help_methods": HelpMethods}, False))
        for name, kind in kind_of.items()
    ]
    command.__signature__ = signature.replace(parameters=parameters)
    return command
