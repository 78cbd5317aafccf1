"""The application that commands are registered with, and its options."""

from __future__ import annotations

import codecs
import io
import sys
from collections.abc import Sequence
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command_from_info, get_command_name

import flexband as fb
from flexband.cli.commands import FORMER_COMMANDS, asks_for_help, commands, load
from flexband.cli.messages import Ending, print_remark, print_text


class _Commands(TyperGroup):
    """The commands, by name and help text until their modules are imported; all take --debug."""

    def __init__(self, **options: Any):
        super().__init__(**options)
        command_stubs = {
            name: TyperCommand(name, help=text) for name, (_, text) in commands().items()
        }
        self.commands = {**command_stubs, **self.commands}

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        if new := FORMER_COMMANDS.get(args[0]):
            print_remark(
                f"`flexband {args[0]}` is now called `flexband {new}`; the former name works until "
                "the next release"
            )
            args = [new, *args[1:]]
        load(args)
        for info in app.registered_commands:  # only this one: Typer takes long to make all of them
            if info.callback and args[0] == (info.name or get_command_name(info.callback.__name__)):
                self.commands[args[0]] = get_command_from_info(
                    info, pretty_exceptions_short=True, rich_markup_mode=app.rich_markup_mode
                )
        if asks_for_help(args):
            args = [args[0], "--help"]
        return super().resolve_command(ctx, args)

    def parse_args(self, ctx: Any, args: Sequence[str]) -> list[str]:
        options = args[: args.index("--")] if "--" in args else args
        Ending.debug = "--debug" in options
        arguments = _split_during([a for a in options if a != "--debug"])
        return super().parse_args(ctx, [*arguments, *args[len(options) :]])

    def main(self, *arguments: Any, **options: Any) -> Any:
        print_anywhere()
        return super().main(*arguments, **options)


def _split_during(args: Sequence[str]) -> list[str]:
    """Split the two times of --during, with a blank or a comma between, into two arguments."""
    arguments: list[str] = []
    for arg in args:
        name, equals, value = arg.partition("=")
        parts = [name, value] if name == "--during" and equals else [arg]
        for part in parts:
            arguments += part.split(",") if arguments[-1:] == ["--during"] else [part]
    return arguments


def print_anywhere() -> None:
    """Let standard output and error replace characters that they cannot encode."""
    codecs.register_error("flexband", _replacement)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="flexband")


def _replacement(error: UnicodeError) -> tuple[str, int]:
    # What is printed in place of a character that a terminal does not know; otherwise "?"
    plain = {
        "…": "...", "–": "-", "−": "-", "×": "x", "μ": "mu", "σ": "sigma", "ξ": "xi", "η": "eta",
    }  # fmt: skip
    if not isinstance(error, UnicodeEncodeError):
        raise error
    unknown = error.object[error.start : error.end]
    return "".join(plain.get(character, "?") for character in unknown), error.end


app = typer.Typer(
    cls=_Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",  # texts have units in brackets
)


def _print_version(requested: bool) -> None:
    if requested:
        print_text(fb.__version__)
        raise typer.Exit


@app.callback(
    epilog="Exit status: 0 done; 1 error; 2 wrong usage; 3 finished, but a requirement is "
    "undecided, or the result misses its tolerance, is not trusted, or is not confirmed by "
    "verification runs; 4 points are waiting to be run elsewhere; 5 finished, and a requirement is "
    "violated; 130 stopped by Ctrl-C; 143 stopped by SIGTERM."
)
def main(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
    debug: Annotated[
        bool,
        typer.Option("--debug", help="Print the traceback of an error; works with every command."),
    ] = False,
) -> None:
    """Compute how uncertain the motion of a mechanism is."""
