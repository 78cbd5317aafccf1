"""What a force law takes, its machine code, and its failures."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

Law = Callable[..., None]
"""``law(t, x, v, p, force)``: time [s], positions and velocities of the points, the parameters.

Rows of `x` are (X, Y, θ), turns counted, rows of `v` their rates, shape (points, 3). It fills the
rows of `force`, (F_X, F_Y, M): force [N] on each point and moment [N m] on its body. Rows of lines
follow those of points, see `lines`. With states it is ``law(t, x, v, s, p, force, rate)`` and fills
their rates too, and with events it is
``law(t, x, v, p, force, mode, gap)`` or ``law(t, x, v, s, p, force, rate, mode, gap)``.
"""


class LawShape(NamedTuple):
    """The sizes of what a law takes, the lines between its points, and whether it is a contact.

    The law of a contact takes the address of its memory and serves all lanes at once. It reads the
    speed of the last event as the size of its mode.
    """

    points: int
    parameters: int
    states: int = 0
    events: int = 0
    lines: tuple[tuple[int, int, int], ...] = ()
    contact: bool = False


class LawFailure(NamedTuple):
    """What a law did in one lane of the block that a thread was running."""

    law: CompiledLaw
    lane: int
    time: float
    reason: str


@dataclass(frozen=True, eq=False)
class CompiledLaw:
    """A law as a C function of the memory that `kernels.laws.forces` describes, for all lanes."""

    address: int  # where the engine calls it
    references: tuple  # what has to live as long as the code


_thread = threading.local()


def failures_here() -> dict[tuple[int, int], LawFailure]:
    """Return the first failure of each law and lane in this thread."""
    return _thread.__dict__.setdefault("failures", {})


def take_failures() -> list[LawFailure]:
    """Return the first failure of each law and lane in this thread, and forget them."""
    return list(_thread.__dict__.pop("failures", {}).values())
