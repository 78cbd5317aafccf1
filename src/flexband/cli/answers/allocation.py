"""The command that allocates tolerances by the surrogate of a study."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

import flexband as fb
from flexband.cli.answers.check import During, Only, Side, limits_of
from flexband.cli.answers.frame import CommandOutput, SomeSigmas, answer_command, one_of
from flexband.cli.answers.saved_result import SavedResult
from flexband.cli.command_options import Trust
from flexband.cli.messages import UsageError, usage

if TYPE_CHECKING:  # imported when a command is called
    from flexband.analysis.allocation.costs import checked_costs
    from flexband.analysis.allocation.stated_probability import checked_probability
    from flexband.analysis.allocation.tolerances import Tolerances
    from flexband.analysis.labelled_answers import AnswerRecord
    from flexband.report.page.answers import allocation_table
    from flexband.report.plot.figures import allocation_figure
    from flexband.report.text.numbers import number
    from flexband.uncertainty.surrogates.sigmas import checked_sigmas


@answer_command("allocate")
def allocate(
    result: SavedResult,
    cost: Annotated[
        list[str],
        typer.Option(
            help="NAME=B for the cost B/tolerance, or NAME=TOLERANCE:COST,... for grades; can be "
            "repeated."
        ),
    ],
    below: Side = None,
    above: Side = None,
    during: During = None,
    only: Only = None,
    sigmas: SomeSigmas = None,
    probability: Annotated[
        float | None,
        typer.Option(
            help="Largest probability of violating a limit at any time, instead of --sigmas."
        ),
    ] = None,
    confirm: Annotated[
        bool,
        typer.Option(
            "--confirm/--no-confirm",
            help="Confirm the tolerances by runs where they just meet a limit.",
        ),
    ] = True,
    trust: Trust = False,
) -> CommandOutput:
    """Find the cheapest tolerances that meet the requirements, and confirm them by runs.

    A tolerance is half the width of an interval, or a standard deviation. None becomes larger than
    in the study. Without --below and --above, the requirements are those of the study; --only
    selects some by their output. Free sizes (Sizing) are chosen as well. allocation.nc and
    allocation.png are written. Runs are recorded with those of the study.
    """
    surrogate = result.surrogate
    k = one_of(sigmas, probability, 3.0)
    costs = costs_of(cost)
    limits = limits_of(below or [], above or [], during, result, only or [], trust=trust)
    if isinstance(surrogate, fb.Surrogate):
        with usage():
            checked_sigmas(k)
            tolerances = Tolerances.from_costs(surrogate.space, checked_costs(costs))
            if probability is not None:
                checked_probability(probability, tolerances)
    purpose = "confirms the tolerances; --no-confirm does without"
    response, store = result.response_and_store(purpose, trust=trust) if confirm else (None, None)
    allocation = fb.analysis.allocate(
        surrogate,  # pyright: ignore[reportArgumentType]  # one with choices is refused
        limits,
        costs,
        sigmas=k,
        probability=probability,
        response=response,
        store=store,
    )
    dims = {"name", "sizing", "limit", "binding", "input"}
    plain = {k: v.values.tolist() for k, v in allocation.variables.items() if set(v.dims) <= dims}
    display_allocation = result.display.data(allocation)
    sizes = [
        f"size {name} = {number(display_allocation['size'].sel(sizing=name))} "
        f"{units.get(name, '')}".rstrip()
        for units in [result.display.input_units()]
        for name in (
            display_allocation["sizing"].values.tolist() if "sizing" in display_allocation else []
        )
    ]
    cost_in_words = f"cost {allocation.attrs['cost']:.5g}"
    return CommandOutput(
        {str(k): v for k, v in (plain | allocation.attrs).items()},
        [("Tolerances", allocation_table(display_allocation))],
        ". ".join([", ".join([cost_in_words, *sizes]), AnswerRecord.read(allocation).outcome]),
        name="allocation",
        data=allocation,
        figure=lambda: allocation_figure(display_allocation),
    )


def costs_of(texts: list[str]) -> dict[str, float | fb.analysis.Grades]:
    """Return the cost of each tolerance; raise `UsageError` if a text is none of the forms."""
    costs: dict[str, float | fb.analysis.Grades] = {}
    for text in texts:
        name, _, value = text.partition("=")
        pairs = [tuple(grade.split(":")) for grade in value.split(",")]
        if name in costs:
            raise UsageError(f"--cost must be given once for {name}")
        try:
            if len(pairs) == 1 and len(pairs[0]) == 1:
                costs[name] = float(value)
                continue
            grades = {t: (float(t), float(c)) for t, c in pairs}
        except ValueError:
            forms = "NAME=NUMBER or NAME=TOLERANCE:COST,TOLERANCE:COST"
            raise UsageError(f"--cost must be {forms}; got {text!r}") from None
        with usage():
            costs[name] = fb.analysis.Grades(grades)
    return costs
