"""Said before the runs: which requirements are undecided, since pins may move in their holes."""

from __future__ import annotations

from collections.abc import Sequence

from flexband.basics.warning import warn
from flexband.basics.words import number_of
from flexband.requirements.corridors import ONE_SIDED
from flexband.requirements.requirement import requirement_tuple
from flexband.study.definition import StudyDefinition
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import first_case


def warn_of_free_pins(study: StudyDefinition) -> None:
    """Warn of requirements that will be undecided, and name the bodies whose motion is free."""
    space = Space(first_case(study.inputs))
    pins = [name for name, pair in space.plays.items() if not pair.one_sided]
    if not pins or not study.requirements:
        return
    values = space.arguments_at(*space.nominal())
    decided = study.source.instantaneous(**values)
    if decided is None:  # it is not known of a function of the user
        return
    only_output = bool(decided) and len(study.source.description(**values).quantities) <= 1
    undecided = [
        str(requirement)
        for requirement in requirement_tuple(study.requirements)
        if (requirement.output or requirement.name) not in decided
        and not (requirement.output is None and only_output)
    ]
    if undecided:
        warn(_text(undecided, pins, study.source.free_bodies(**values)))


def _text(requirements: Sequence[str], pins: Sequence[str], bodies: Sequence[str]) -> str:
    free = f", and nothing prescribes the motion of {' and '.join(bodies)}" if bodies else ""
    return (
        f"{number_of(len(requirements), 'requirement')} will be UNDECIDED "
        f"({', '.join(requirements)}): {' and '.join(pins)} may change during a run, as pins move "
        f"in their holes{free}; bounds hold only for pins that stay in place. {ONE_SIDED}"
    )
