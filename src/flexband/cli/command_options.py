"""Options that several commands take."""

from typing import Annotated

import typer

POLICIES = ("stop", "half-step", "skip")
"""Values of --failed; blanks stand for hyphens where `propagate` takes them."""

Method = Annotated[
    str | None, typer.Option(help="Method, instead of the study's; see --help-methods.")
]
Sigmas = Annotated[float | None, typer.Option(help="k of μ ± kσ.  [default: the study's]")]
Failed = Annotated[
    str, typer.Option(help=f"What to do if a run fails: {', '.join(POLICIES)}.", show_default=False)
]
Trust = Annotated[
    bool,
    typer.Option("--trust", help="Run the study's file that the folder names, wherever it is."),
]
