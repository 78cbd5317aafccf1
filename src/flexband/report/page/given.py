"""What a report shows of the study's own code: its question, inputs, mechanism and motion.

All of it is text and numbers in ``page.json``, so that a report can be written again without that
code.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexband.analysis.resampling import OverOutput
from flexband.analysis.selection import surrogates_of
from flexband.analysis.verification.expanded_runs import as_expanded
from flexband.basics.warning import warn, without_warnings
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.response import SensorResponse
from flexband.report.drawing.pictures import fields_picture, mechanism_picture
from flexband.report.page.arrays import JsonRecord
from flexband.report.page.inputs import inputs_table
from flexband.report.page.motion.motion import SAMPLES, motion_data
from flexband.study.study import Study
from flexband.uncertainty.inputs.choices import Choice
from flexband.uncertainty.inputs.distributions.random_option import RandomOption
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import first_case

if TYPE_CHECKING:
    from flexband.analysis.selection import AnySurrogate
    from flexband.basics.response import ResponseFunction


def given_by(
    study: Study,
    inputs: Mapping[str, Any],
    surrogate: AnySurrogate | None,
    file: Path | None,
    *,
    seconds: float = 0.0,
) -> JsonRecord:
    """Return what a report shows of a study's code, whose docstring is its question.

    These are `question`; `inputs`, a table; `units` of inputs, and `display_units`; `fields`, a
    picture; `drawing` and `description` of a mechanism at the nominal values; `motion`, what
    motion.js shows, the nominal one alone if runs take many `seconds`; `hidden`, sentences on what
    cannot be shown.
    """
    # Mean times [s] of a run from which on the motion is shown without samples of the
    # inputs, and not at all: the mechanism is simulated again for it. In a study in which
    # the engine is compiled, a run takes less than the mean
    sampling_limit = 3.0
    motion_limit = 60.0
    fields = {k: i for k, i in inputs.items() if isinstance(i, Field) and i.domain is not None}
    data: JsonRecord = {
        "question": _docstring(file),
        "inputs": inputs_table(inputs, study.display),
        "units": dict(study.units),
        "display_units": dict(study.display_units),
        "hidden": [],
    }
    response = study.source
    if fields:
        along = field_axes(response, inputs)
        _add(data, "fields", "The fields", lambda: fields_picture(fields, along))
    if not isinstance(response, SensorResponse):
        return data

    @cache
    def mechanism() -> Mechanism:
        space = Space(first_case(inputs))
        return response.builder(**space.arguments_at(*space.nominal()))

    with without_warnings():
        _add(data, "drawing", "The mechanism", lambda: mechanism_picture(mechanism()))
        _add(data, "description", "The mechanism", lambda: _in_words(mechanism()))
        takes = f"since a run takes {seconds:.2g} s on average."
        if seconds < motion_limit:
            samples = SAMPLES if seconds < sampling_limit else 0
            data["motion"], remarks = study_motion(study, surrogate, samples=samples)
            nominal = f"The motion is the nominal one, without samples of the inputs, {takes}"
            data["hidden"] += [*remarks, *[nominal] * (data["motion"] is not None and not samples)]
        else:
            data["hidden"].append(f"The motion is not shown, {takes}")
    return data


def study_motion(
    study: Study,
    surrogate: AnySurrogate | None = None,
    *,
    samples: int = SAMPLES,
) -> tuple[JsonRecord | None, list[str]]:
    """Return `motion_data` of a study, at first options and on its surrogate's discretization."""
    response = study.source
    inputs = study.inputs
    remarks = []
    if not isinstance(response, SensorResponse):
        return motion_data(response, Space({}))
    first_options = {
        name: _shown_option(choice) for name, choice in inputs.items() if isinstance(choice, Choice)
    }
    if first_options:
        options = ", ".join(f"{name} = {option}" for name, option in first_options.items())
        remarks = [f"The animation is that of {options}."]
    if surrogate is None:
        space = Space(first_case(study.with_domains().inputs))
    else:
        first_surrogate = next(iter(surrogates_of(surrogate).values()))
        space, (response, _) = first_surrogate.space, as_expanded(first_surrogate, response)
    course = ()
    if isinstance(study.response, OverOutput):
        with without_warnings():
            course = study.response.course(**space.arguments_at(*space.nominal()))
    motion, motion_remarks = motion_data(response, space, samples=samples, course=course)
    return motion, [*remarks, *motion_remarks]


def _shown_option(choice: Choice) -> str | float:
    """Return the first option, or of options with probabilities the nominal one."""
    if choice.probabilities is None:
        return choice.options[0]
    return RandomOption(choice.options, choice.probabilities).mean_or_midpoint()


def _add(data: JsonRecord, name: str, what: str, make: Callable[[], str]) -> None:
    """Add a part of the report, or a remark that it cannot be shown."""
    try:
        data[name] = make()
    except Exception as error:  # whatever a builder raises
        data["hidden"].append(f"{what} cannot be shown: {error}")
        warn(data["hidden"][-1])


def field_axes(response: ResponseFunction, inputs: Mapping[str, Any]) -> dict[str, str]:
    """Return what each field depends on, "position" or "time", as far as that is known."""
    if not isinstance(response, SensorResponse):
        return {}
    space = Space(first_case(inputs))
    axes = {}
    arguments = space.arguments_at(*space.nominal())
    try:
        with without_warnings():
            mechanism = response.builder(**arguments)
    except Exception:  # whatever a builder raises; the drawing's remark tells it
        return {}
    for kind, parts in (("position", mechanism.bodies), ("time", mechanism.joints)):
        for attribute in (v for part in parts.values() for v in vars(part).values()):
            names = [k for k, value in arguments.items() if callable(value) and value is attribute]
            axes.update({k: kind if axes.get(k, kind) == kind else "" for k in names})
    return axes


def _in_words(mechanism: Mechanism) -> str:
    parts = {"bodies": mechanism.bodies, "joints": mechanism.joints, "loads": mechanism.loads}
    return "; ".join(f"{kind} {', '.join(names)}" for kind, names in parts.items() if names)


def _docstring(file: Path | None) -> str:
    """Return the docstring of a Python file; nothing if it has none, or cannot be read."""
    try:
        text = file.read_text(encoding="utf-8") if file else ""
        return " ".join((ast.get_docstring(ast.parse(text)) or "").split())
    except (OSError, ValueError, SyntaxError):
        return ""
