"""The command that checks requirements by the surrogate of a study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

import flexband as fb
from flexband.analysis.probability import COARSEST, FINEST
from flexband.basics.checks import check_integer
from flexband.cli.answers.frame import CommandOutput, SomeSigmas, answer_command
from flexband.cli.answers.saved_result import SavedResult
from flexband.cli.command_options import Trust
from flexband.cli.folders import check_folder, draw_limits
from flexband.cli.messages import UsageError, usage
from flexband.errors import InputError
from flexband.execution.names import FileName

if TYPE_CHECKING:  # imported when a command is called
    import xarray as xr

    from flexband.analysis.limits.least_margin import margins_in_words
    from flexband.analysis.limits.limit_verdicts import requirement_verdicts, uncertain_inputs
    from flexband.analysis.probability.model import MAX_RUNS, MIN_RUNS
    from flexband.analysis.probability.texts import verdict_on
    from flexband.analysis.selection import labels_of, surrogates_of
    from flexband.report.page.answers import limits_table
    from flexband.report.progress import progress_bars
    from flexband.requirements.requirement import corridors, requirement_tuple
    from flexband.requirements.verdict import RequirementVerdict
    from flexband.study.nominal import around_nominal
    from flexband.study.results.limits import check_requirements_in, has_probability
    from flexband.uncertainty.surrogates.sigmas import checked_sigmas


Side = Annotated[
    list[str] | None,
    typer.Option(help="OUTPUT=LIMIT, or LIMIT if there is one output; can be repeated."),
]
During = Annotated[
    tuple[float, float] | None,
    typer.Option(
        metavar="FIRST LAST",
        help="First and last time at which the limits hold, such as 0 0.5 or 0,0.5.",
    ),
]
Only = Annotated[
    list[str] | None,
    typer.Option(help="Use only the study's requirements on this output; can be repeated."),
]


@answer_command("check")
def check(
    result: SavedResult,
    below: Side = None,
    above: Side = None,
    during: During = None,
    only: Only = None,
    sigmas: SomeSigmas = None,
    accuracy: Annotated[
        float,
        typer.Option(
            min=FINEST, max=COARSEST, help="Relative standard error of the probabilities."
        ),
    ] = 0.025,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random numbers.")] = 0,
    runs: Annotated[
        int,
        typer.Option(help="Number of runs that correct each bound of a probability; 0 for none."),
    ] = 0,
    trust: Trust = False,
) -> CommandOutput:
    """Check whether requirements are met, and the probability of violating them.

    Without --below and --above, these are the requirements of the study in FOLDER. The margin is
    that of μ ± kσ, for all values of the interval inputs. The probability is that of violating a
    limit at any time. No runs are made unless --runs is given; they are recorded with those of the
    study. limits.nc, probability.nc and limits.png are written, but never in place of those of the
    study's own requirements.
    """
    surrogate = result.surrogate
    place = result.folder
    with usage():
        sigmas = None if sigmas is None else checked_sigmas(sigmas)
    # The limits, and how they are checked.
    requested_limits = limits_of(below or [], above or [], during, result, only or [], trust=trust)
    options: dict[str, Any] = {"accuracy": accuracy, "seed": seed}
    if runs and not has_probability(surrogate):
        raise UsageError(
            "--runs corrects probabilities, which need random inputs, and no Compensator"
        )
    if runs:
        with usage():
            check_integer("--runs", runs, MIN_RUNS, MAX_RUNS, or_zero=True)
        purpose = "corrects probabilities; --runs 0 does without"
        response, store = result.response_and_store(purpose, trust=trust)
        options |= {"response": response, "store": store, "runs": runs}
    check_folder(place)
    # Check the limits, and write the answers.
    with progress_bars() as task:
        if runs:
            options["progress"] = task("correcting runs")
        options["of_study"] = not (below or above or only)
        try:
            checked = check_requirements_in(
                place, surrogate, requested_limits, sigmas=sigmas, **options
            )
        except InputError as error:  # the limits fit, but margins cannot be computed
            why = str(error)
            verdicts = [
                RequirementVerdict.not_checked(requirement, why) for requirement in requested_limits
            ]
            return CommandOutput({}, verdicts=verdicts)
    draw_limits(checked, place, result.display)
    margins = checked.margins
    probability = checked.probability
    # The outcome in words and tables, in display units.
    display_margins = result.display.data(margins)
    likely = None if probability is None else result.display.data(probability)
    sentences = [
        margins_in_words(display_margins),
        *([] if likely is None else [verdict_on(likely)]),
    ]
    verification = result.dataset(FileName.VERIFICATION)
    return CommandOutput(
        {"limits": as_rows(margins), "probability": as_rows(probability)},
        [("Requirements", limits_table(display_margins, likely))],
        "\n".join(sentences),
        verdicts=requirement_verdicts(
            checked._replace(margins=display_margins),
            uncertain_inputs(result.dataset(FileName.CONTRIBUTIONS), surrogate),
            None if verification is None else result.display.data(verification),
        ),
    )


def limits_of(
    below: list[str],
    above: list[str],
    during: tuple[float, float] | None,
    result: SavedResult,
    only: list[str],
    *,
    trust: bool,
) -> list[fb.Requirement]:
    """Return limits one by one, or those of the study for the outputs `only`; refuse misfits."""
    if only and (below or above or during is not None):
        raise UsageError(
            "--only selects requirements of the study; omit --below, --above and --during"
        )
    sides: dict[str | None, dict[str, Any]] = {}
    for side, texts in (("below", below), ("above", above)):
        for text in texts:
            name, _, number = text.rpartition("=")
            try:
                value = float(number)
            except ValueError:
                raise UsageError(f"--{side} must be OUTPUT=NUMBER; got {text!r}") from None
            known_limits = sides.setdefault(name or None, {})
            if side in known_limits:
                raise UsageError(f"--{side} must be given once for {name or 'the output'}")
            known_limits[side] = value
    if not sides:
        has_study = during is None and (result.folder / FileName.STUDY).is_file()
        if has_study and (
            known_limits := requirement_tuple(result.study(trust=trust).requirements)
        ):
            study_limits = select_limits(known_limits, only, labels_of(result.surrogate))
            return around_nominal(study_limits, result.folder, result.surrogate, result.display)
        raise UsageError(
            "check requires --below or --above, as in --below F_X=345, unless the study has "
            "requirements"
        )
    with usage():
        output_limits = [
            fb.Requirement(
                name or "response",
                name,
                below=bounds.get("below"),
                above=bounds.get("above"),
                during=during,
            )
            for name, bounds in sides.items()
        ]
        corridors(output_limits, next(iter(surrogates_of(result.surrogate).values())).labels)
    return output_limits


def select_limits(
    requirements: Sequence[fb.Requirement], only: list[str], labels: xr.DataArray
) -> list[fb.Requirement]:
    """Return the requirements on some outputs, all if none is named; refuse other names."""
    outputs = [requirement.output_in(labels)[0] or "response" for requirement in requirements]
    names = dict.fromkeys(outputs)
    for name in only:
        if name not in names:
            raise UsageError(
                f"--only must be an output with a requirement in the study: {', '.join(names)}; "
                f"got {name!r}"
            )
    pairs = zip(requirements, outputs, strict=True)
    return [requirement for requirement, output in pairs if not only or output in only]


def as_rows(result: xr.Dataset | None) -> dict[str, Any] | None:
    """Return attributes and the variables that do not depend on time, as plain data."""
    if result is None:
        return None
    dims = {"limit", "bound", "input"}
    variables = {
        str(k): v.values.tolist() for k, v in result.variables.items() if set(v.dims) <= dims
    }
    return variables | {str(k): v for k, v in result.attrs.items()}
