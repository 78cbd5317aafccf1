"""The motion of a study's mechanism."""

from __future__ import annotations

from flexband.analysis.resampling import OverOutput
from flexband.analysis.selection import AnySurrogate, surrogates_of
from flexband.analysis.verification.expanded_runs import as_expanded
from flexband.errors import without_warnings
from flexband.mechanics.response import SensorResponse
from flexband.report.page.arrays import JsonRecord
from flexband.report.page.motion.motion import SAMPLES, motion_data
from flexband.study.study import Study
from flexband.uncertainty.inputs.choices import Choice
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import first_case


def study_motion(
    study: Study,
    surrogate: AnySurrogate | None = None,
    *,
    samples: int = SAMPLES,
) -> tuple[JsonRecord | None, list[str]]:
    """Return `motion_data` of a study, at first options and on its surrogate's discretization."""
    response, inputs, remarks = study.source, study.inputs, []
    if not isinstance(response, SensorResponse):
        return motion_data(response, Space({}))
    chosen = {
        name: choice.options[0] for name, choice in inputs.items() if isinstance(choice, Choice)
    }
    if chosen:
        options = ", ".join(f"{name} = {option}" for name, option in chosen.items())
        remarks = [f"The animation is that of {options}."]
    if surrogate is None:
        space = Space(first_case(study.located().inputs))
    else:
        first_surrogate = next(iter(surrogates_of(surrogate).values()))
        space, (response, _) = first_surrogate.space, as_expanded(first_surrogate, response)
    course = ()
    if isinstance(study.response, OverOutput):
        with without_warnings():
            course = study.response.course(**space.arguments_at(*space.nominal()))
    motion, more = motion_data(response, space, samples=samples, course=course)
    return motion, [*remarks, *more]
