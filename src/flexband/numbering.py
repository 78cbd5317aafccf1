"""Numbers of what computes: they rise with every commit that changes results on purpose.

What is on file has the numbers with which it was computed. Runs and answers of lower ones are not
used, whatever the code: a hash of the code changes with every commit, and does not tell whether its
results do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from flexband.errors import InputError


class Numbering(NamedTuple):
    """The numbers of what computes."""

    runs: int
    """Of mechanics. Raise it where a motion, a rest or a mode is another one than before."""
    answers: int
    """Of all that is made of runs. Raise it where a band, a claim or a verdict is another one."""


NUMBERING = Numbering(runs=2, answers=2)

FIRST = Numbering(1, 1)
"""That of what states none."""


class OutdatedError(InputError):
    """What is on file was computed with lower numbers."""


def check_numbering(name: str, numbers: Sequence[int] | None) -> None:
    """Raise `OutdatedError` if what is on file was computed otherwise than it would be now."""
    before = FIRST if numbers is None else Numbering(*map(int, numbers))
    changed = [
        field for field in Numbering._fields if getattr(before, field) < getattr(NUMBERING, field)
    ]
    if changed:
        raise OutdatedError(
            f"{name} has results of an older version of flexband, which computes "
            f"{' and '.join(changed)} otherwise now; `flexband run` computes them again"
        )
