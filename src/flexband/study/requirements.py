"""How the requirements of a study are judged: by its surrogate, or by samples of the parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import xarray as xr

from flexband.analysis.limits.limit_verdicts import LimitCheck
from flexband.analysis.selection import AnySurrogate, surrogates_of
from flexband.analysis.verification.expanded_runs import Runs, RunsOf, runs_as_expanded
from flexband.basics.error_text import error_text
from flexband.basics.files import try_write
from flexband.basics.progress import listener, run_counter
from flexband.errors import InputError
from flexband.execution.names import FileName
from flexband.requirements.requirement import requirement_tuple
from flexband.requirements.verdict import RequirementVerdict
from flexband.study.nominal import around_nominal, discretization_error, with_recorded, with_runs
from flexband.study.progress import StudyProgress
from flexband.study.results.answers import answer_file
from flexband.study.results.netcdf import write_netcdf
from flexband.study.results.reliability import Doubt


def sampled_parts(
    progress: StudyProgress,
    surrogate: AnySurrogate | None,
    doubts: Sequence[Doubt],
    **execution: Any,
) -> xr.Dataset | None:
    """Write how numbers are distributed over the parts, where bands do not answer what is asked.

    That is so if the mechanism has contacts, the runs that judge the surrogate do not confirm it,
    and the horizon of predictability is within the run or a share of the parts is required. The
    runs of `predictability_horizon` are recorded with the others, those of `sample_parts`, at
    more times, in a folder of theirs. Both results are in one dataset, with a dim "choice"
    of the combinations of options if there are choices. None otherwise; failed runs cause a
    warning.

    Parameters
    ----------
    execution : of the runs: batch, executor, failed.
    """
    file = answer_file(progress.folder.path, "parts")
    parts = None
    if surrogate is not None and any(doubt.rare_values for doubt in doubts):
        try:
            parts = _sample_parts(progress, surrogate, **execution)
        except Exception as error:  # whatever a response raises; the bands are there
            progress.fail("parts", f"parts are not sampled: {error_text(error)}")
    file.unlink(missing_ok=True)
    if parts is not None:
        try_write(lambda: write_netcdf(parts, file))
    return parts


def _sample_parts(
    progress: StudyProgress, surrogate: AnySurrogate, **execution: Any
) -> xr.Dataset | None:
    """Return the distribution and the horizon; None if bands answer what is asked."""
    study = progress.study
    cases = surrogates_of(surrogate)
    spaces = {label: case.space for label, case in cases.items()}
    values = (space.arguments_at(*space.nominal()) for space in spaces.values())
    if not any(study.source.description(**nominal).impacts for nominal in values):
        return None
    # only here, as below: most studies do not need it, and it takes a while to import
    from flexband.analysis.parts import horizon, part_distribution, points  # noqa: PLC0415

    horizon_options = horizon.HorizonOptions()
    options = part_distribution.SamplingOptions()
    folder = progress.folder.path
    store = progress.store
    requirements = around_nominal(study.requirements, folder, surrogate, study.display)

    def run(runs_of: RunsOf, name: str, label: str, count: int) -> Runs:
        listener().stage(name)
        name = f"{name}, {label}" if label else name
        return runs_of(cases[label], label, run_counter(progress.task(name), count))

    how = {"store": store, **execution}
    with runs_as_expanded(study.response, study.inputs, **how) as runs_of:
        horizons = dict[str, xr.Dataset]()
        for label, space in spaces.items():
            neighbours = run(runs_of, "neighbouring runs", label, horizon_options.runs(space))
            horizons[label] = horizon.horizon_of(neighbours, space, None, 0, horizon_options)
    predictable = all(case["predictable"].all() for case in horizons.values())
    decide = (part_distribution.samples_decide(requirements, case) for case in cases.values())
    if predictable and not all(decide):
        return None
    if store is not None:
        how["store"] = replace(store, folder=folder / FileName.SAMPLES)
    made = list[xr.Dataset]()
    with runs_as_expanded(study.response, study.inputs, more_times=True, **how) as runs_of:
        for label, space in spaces.items():
            parts = points.Parts.from_scatter(space, study.scatter)
            count = options.count(requirements)
            samples = run(runs_of, "samples of the parts", label, count)
            error = discretization_error(cases[label]) if predictable else 0.0
            case = part_distribution.distribution(
                samples,
                parts,
                requirements,
                options=options,
                case=label,
                error=error,
                labels=cases[label].labels,
            )
            near_case = horizons[label]
            case = case.assign(near_case.variables).assign_attrs({**near_case.attrs, **case.attrs})
            made.append(case.assign_coords(choice=label) if label else case)
    return xr.concat(made, "choice") if len(made) > 1 else made[0]


def checked_requirements(
    progress: StudyProgress,
    surrogate: AnySurrogate | None,
    doubts: Sequence[Doubt],
    parts: xr.Dataset | None,
    *,
    verifying: bool,
    **execution: Any,
) -> tuple[LimitCheck | None, tuple[RequirementVerdict, ...]]:
    """Return whether the requirements of a study are kept, or the verdicts if that is not known.

    Parameters
    ----------
    parts : result of `sampled_parts`, from which yields are taken.
    verifying : whether runs are made that judge; they decide about probabilities too.
    execution : of the runs: batch, executor, failed.
    """
    study = progress.study
    folder = progress.folder.path

    def skip_checks(why: str) -> tuple[None, tuple[RequirementVerdict, ...]]:
        return None, tuple(
            RequirementVerdict.not_checked(requirement, why)
            for requirement in requirement_tuple(study.requirements)
        )

    if not study.requirements:
        return None, ()
    if surrogate is None:
        return skip_checks("the method expands no response")
    from flexband.analysis.parts.part_distribution import yield_of  # noqa: PLC0415
    from flexband.study.results.limits import check_requirements_in  # noqa: PLC0415

    # Margins that runs confirm where the surrogate does not decide.
    production = None if parts is None else yield_of(parts)
    try:
        requirements = around_nominal(study.requirements, folder, surrogate, study.display)

        def run_margin(margins: xr.Dataset) -> xr.Dataset:
            withheld = any(doubt.rare_values for doubt in doubts)
            if withheld and progress.store is not None:
                margins = with_recorded(surrogate, requirements, margins, folder)
            if study.runs_elsewhere:
                return margins
            how = {"store": progress.store, **execution}
            return with_runs(study, surrogate, requirements, margins, **how)[0]

        # Runs decide about probabilities as well.
        judge = {}
        if verifying and not study.runs_elsewhere:
            judge = {"response": study.response, "store": progress.store}
            judge["executor"] = execution.get("executor")
        check = check_requirements_in(
            folder,
            surrogate,
            requirements,
            scatter=study.scatter,
            run_margin=run_margin,
            production=production,
            judge=judge,
        )
    except InputError as error:  # the bands are there
        return skip_checks(str(error))
    except Exception as error:  # whatever a response raises, or a disk that is full
        progress.failures.append("requirements")
        return skip_checks(error_text(error))
    return check, ()
