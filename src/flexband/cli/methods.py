"""The methods by name, and their options as options of a command."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Annotated, Any

import typer

import flexband as fb
from flexband.study.options import method_classes, method_options

METHODS = method_classes([  # the public ones, without all that else is public
    fb.AdaptivePCCI, fb.ImprovedPCCI, fb.LHSScanning, fb.MonteCarlo, fb.PCCI,
    fb.PerturbationChebyshev, fb.PhaseResolvedPCCI, fb.RegressionPCCI, fb.SobolScanning,
])  # fmt: skip


def with_method_options(command: Any) -> Callable:
    """Put the options of all methods in place of the ``**values`` of a command."""
    signature = inspect.signature(command, eval_str=True)
    parameters = list(signature.parameters.values())[:-1]
    for name, (kind, defaults) in method_options(METHODS).items():
        takers = ", ".join(f"{method} ({value})" for method, value in defaults.items())
        info = typer.Option(help=takers, rich_help_panel="Options of methods (default)")
        parameters.append(
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=None,
                annotation=Annotated[kind | None, info],  # type: ignore[valid-type]
            )
        )
    command.__signature__ = signature.replace(parameters=parameters)
    return command
