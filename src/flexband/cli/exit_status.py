"""How commands end: the exit statuses, and that of verdicts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexband.requirements.verdict import RequirementVerdict
    from flexband.study.results.reliability import Doubt


class ExitStatus(IntEnum):
    """How a command ends."""

    ERROR = 1
    USAGE = 2
    """The command line is wrong."""
    DOUBTFUL = 3
    """Finished, but a requirement is undecided, or the result misses its tolerance, is not trusted
    or not confirmed."""
    WAITING = 4
    """Points wait to be run elsewhere."""
    FAILED = 5
    """Finished, and a requirement is not met."""
    STOPPED = 128
    """By a signal, whose number is added: 130 after Ctrl-C, 143 after SIGTERM."""


def exit_status(verdicts: Iterable[RequirementVerdict], doubts: Sequence[Doubt]) -> int:
    """Return how a command ends that has printed verdicts."""
    from flexband.requirements.verdict import Verdict, worst_of  # noqa: PLC0415

    worst = worst_of(verdicts)
    if worst is Verdict.FAIL:
        return ExitStatus.FAILED
    return ExitStatus.DOUBTFUL if doubts or worst is Verdict.UNDECIDED else 0
