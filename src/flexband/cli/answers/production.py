"""The command that computes which share of the parts meets the requirements."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

import flexband as fb
from flexband.analysis.probability import COARSEST, FINEST
from flexband.basics.checks import check_integer
from flexband.cli.answers.check import During, Only, Side, as_rows, limits_of
from flexband.cli.answers.frame import CommandOutput, answer_command
from flexband.cli.answers.saved_result import SavedResult
from flexband.cli.command_options import Trust
from flexband.cli.messages import Table, UsageError, usage
from flexband.errors import InputError

if TYPE_CHECKING:  # imported when a command is called
    import xarray as xr

    from flexband.analysis.labelled_answers import AnswerRecord
    from flexband.analysis.probability.model import MAX_RUNS, MIN_RUNS
    from flexband.analysis.selection import surrogates_of
    from flexband.report.page.answers import yield_cell
    from flexband.report.progress import progress_bars
    from flexband.report.text.headline import RANDOM_SAMPLES
    from flexband.requirements.scatter import Scatter
    from flexband.uncertainty.inputs.inputs import Interval
    from flexband.uncertainty.inputs.space import Space


@answer_command("yield")
def production_yield(
    result: SavedResult,
    scatter: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=uniform, NAME=triangular, NAME=CP, or NAME=CP:CPK:SIDE, where SIDE is the "
            "end, lower or upper, that the mean is nearer to; can be repeated. The study's unless "
            "given."
        ),
    ] = None,
    below: Side = None,
    above: Side = None,
    during: During = None,
    only: Only = None,
    accuracy: Annotated[
        float, typer.Option(min=FINEST, max=COARSEST, help="Relative standard error of the shares.")
    ] = 0.025,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random numbers.")] = 0,
    runs: Annotated[
        int,
        typer.Option(help="Number of runs that correct the share of each requirement; 0 for none."),
    ] = 0,
    trust: Trust = False,
) -> CommandOutput:
    """Compute the share of parts that meet the requirements if tolerances scatter.

    Without --below and --above, the requirements are those of the study in FOLDER. No runs are made
    unless --runs is given; they are recorded with those of the study. yield.nc is written if
    requirements and scatter are the study's.
    """
    surrogate = result.surrogate
    requirements = limits_of(below or [], above or [], during, result, only or [], trust=trust)
    options: dict[str, Any] = {"accuracy": accuracy, "seed": seed}
    if runs:
        with usage():
            check_integer("--runs", runs, MIN_RUNS, MAX_RUNS)
        purpose = "corrects shares; --runs 0 does without"
        response, store = result.response_and_store(purpose, trust=trust)
        options |= {"response": response, "store": store, "runs": runs}
    space = next(iter(surrogates_of(surrogate).values())).space
    spread = scatter_of(scatter, space) if scatter else result.study(trust=trust).scatter
    if not spread:
        raise UsageError("the study has no scatter; give --scatter NAME=uniform, or another one")
    with progress_bars() as task, usage():
        if runs:
            options["progress"] = task("correcting runs")
        production = fb.production_yield(surrogate, requirements, spread, **options)
    of_study = not (below or above or only or scatter)
    remarks = [f"Scatter: {production.attrs['scatter']}", RANDOM_SAMPLES]
    if runs:
        remarks.append(f"Runs of the model that correct it: {int(production['runs'].max())}")
    if doubt := AnswerRecord.read(production).surrogate_not_reliable:
        remarks.append(str(doubt))
    return CommandOutput(
        {"yield": as_rows(production)},
        [("Yield", yield_table(production))],
        ". ".join(remarks) + ".",
        name="yield",
        data=production if of_study else None,
    )


def yield_table(production: xr.Dataset) -> Table:
    """Return one row per requirement: the share of the parts that meets it, and its interval."""
    rows = []
    for k, name in enumerate(production["limit"].values.tolist()):
        part = production.isel(limit=k)
        ends = [part] if "bound" not in part.dims else [part.isel(bound=b) for b in range(2)]
        rows.append([name, *map(yield_cell, ends)])
    column = "yield (95 % confidence)"
    option_cases = ["best options", "worst options"]
    heads = [column] if "bound" not in production.dims else [f"{column}, {s}" for s in option_cases]
    return ["requirement", *heads], rows


def scatter_of(texts: list[str], space: Space) -> Scatter:
    """Return the distributions of tolerances; raise `UsageError` if a text is none of the forms."""
    scatter: dict[str, Any] = {}
    tolerances = space.of_kind(random=False)
    for text in texts:
        name, _, form = text.partition("=")
        if name not in tolerances:
            raise UsageError(f"--scatter must be of {', '.join(tolerances)}; got {text!r}")
        if name in scatter:
            raise UsageError(f"--scatter must be given once for {name}")
        try:
            scatter[name] = _scatter(form, tolerances[name])
        except InputError as error:
            raise UsageError(f"--scatter {text}: {error}") from None
        except ValueError:
            forms = "NAME=uniform, NAME=triangular, NAME=CP or NAME=CP:CPK:SIDE"
            raise UsageError(f"--scatter must be {forms}; got {text!r}") from None
    return scatter


def _scatter(form: str, interval: Any) -> Any:
    """Return the distribution of parts within an interval; raise `ValueError` for other forms."""
    tolerance: Interval = interval
    lower = tolerance.lower
    upper = tolerance.upper
    if form == "uniform":
        return fb.Uniform(lower, upper)
    if form == "triangular":
        return fb.Triangular(lower, (lower + upper) / 2, upper)
    cp, *cpk_and_side = form.split(":")
    if len(cpk_and_side) not in (0, 2):
        raise ValueError
    side = {"cpk": float(cpk_and_side[0]), "side": cpk_and_side[1]} if cpk_and_side else {}
    return fb.analysis.Capability(cp=float(cp), **side)
