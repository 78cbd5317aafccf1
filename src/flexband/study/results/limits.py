"""Limits checked by the surrogate of a study, in its folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import xarray as xr

from flexband.analysis.allocation.adjustment import compensators
from flexband.analysis.limits.least_margin import MarginRecord
from flexband.analysis.limits.limit_verdicts import LimitCheck
from flexband.analysis.limits.margins import check_requirements
from flexband.analysis.limits.production import production_of
from flexband.analysis.probability.failure import RUNS, limit_probabilities
from flexband.analysis.selection import AnySurrogate, surrogates_of
from flexband.basics.files import try_write
from flexband.requirements.criteria import Probability, ShareOfParts
from flexband.requirements.requirement import Requirement, by_name
from flexband.requirements.scatter import Scatter
from flexband.study.results.answers import OF_QUESTION, OF_STUDY, answer_file
from flexband.study.results.netcdf import read_netcdf, write_netcdf


def has_limits_of_study(folder: Path) -> bool:
    """Return whether the limits that were checked in a folder are those of its study.

    Raise `InputError` if the file is not as written.
    """
    try:
        return MarginRecord.read(read_netcdf(answer_file(folder, "limits"))).of == OF_STUDY
    except FileNotFoundError:
        return False


def has_probability(surrogate: AnySurrogate) -> bool:
    """Return whether violating limits has a probability: inputs scatter, and none is adjusted.

    None is computed over a play.
    """
    spaces = [case.space for case in surrogates_of(surrogate).values()]
    return all(
        space.random_dimension and not (compensators(space) or space.discs) for space in spaces
    )


def _deciding_arguments(
    limits: Sequence[Requirement], criterion: type, judge: Mapping[str, Any] | None
) -> dict[str, Any]:
    """Return the arguments of probabilities of which runs decide about those with a criterion."""
    names = [
        name
        for name, requirement in by_name(limits).items()
        if type(requirement.criterion) is criterion
    ]
    return {**judge, "decided": dict.fromkeys(names, RUNS)} if names and judge else {}


def check_requirements_in(
    folder: Path,
    surrogate: AnySurrogate,
    limits: Sequence[Requirement],
    *,
    of_study: bool = True,
    sigmas: float | None = None,
    scatter: Scatter | None = None,
    run_margin: Callable[[xr.Dataset], xr.Dataset] = lambda margins: margins,
    production: xr.Dataset | None = None,
    judge: Mapping[str, Any] | None = None,
    **options: Any,
) -> LimitCheck:
    """Check limits, and write limits.nc, probability.nc and yield.nc into a folder.

    The limits are those `of_study`, or of a question; `scatter` is as for `production_yield`, and
    `options` as for `failure_probability`. `run_margin` returns margins with what runs tell of
    them; `production` is the yield, if it is known from sampled parts. `judge` has the response,
    store and executor of runs that decide about probabilities and shares that are required.
    """
    margins = run_margin(check_requirements(surrogate, limits, sigmas=sigmas))
    probability = None
    spaces = [case.space for case in surrogates_of(surrogate).values()]
    written = of_study or not has_limits_of_study(folder)
    margins = margins.assign_attrs(
        random=int(any(space.random_dimension for space in spaces)),
        of=OF_STUDY if of_study else OF_QUESTION,
    )
    if written:
        try_write(lambda: write_netcdf(margins, answer_file(folder, "limits")))
    if production is None and has_probability(surrogate):
        by_runs = _deciding_arguments(limits, Probability, judge)
        probability = limit_probabilities(surrogate, limits, **options, **by_runs)
    if scatter and production is None:
        by_runs = _deciding_arguments(limits, ShareOfParts, judge)
        production = production_of(surrogate, limits, scatter, **options, **by_runs)
    for name, answer in (("probability", probability), ("yield", production)):
        file = answer_file(folder, name)
        if written and answer is not None:
            try_write(lambda answer=answer, file=file: write_netcdf(answer, file))
        elif written and (name == "probability" or scatter is not None):
            file.unlink(missing_ok=True)
    return LimitCheck(margins, probability, written, production)
