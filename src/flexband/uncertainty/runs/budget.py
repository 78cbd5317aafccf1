"""What a method may take: the number of runs, before the first one."""

from __future__ import annotations

import math

from flexband.errors import InputError
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods.pcci import Method
from flexband.words import number_of

MAX_RUNS = 1_000_000


def _count(runs: int) -> str:
    """Return a number of runs as text; a power of ten if it is astronomical."""
    return str(runs) if runs < 10**12 else f"about 10^{math.log10(runs):.0f}"


def check_method(method: object) -> None:
    """Raise `InputError` if an object is no method."""
    if isinstance(method, type) or not callable(getattr(method, "solve", None)):
        name = method.__name__ if isinstance(method, type) else ""
        text = f"the class {name}: write {name}(…)" if name else repr(method)
        raise InputError(f"method must be one like AdaptivePCCI(0.01); got {text}")


def check_runs(method: Method, space: Space, most_runs: int = MAX_RUNS, count: int = 1) -> None:
    """Raise `InputError` if a method takes more runs; it names what a scan could take instead.

    `count` is the number of combinations of options, each with runs of its own.
    """
    runs = count * method.runs(space)
    if runs > most_runs:
        advice = getattr(method, "fitting", None)
        sampled = f". {advice(space, most_runs // count)}" if callable(advice) else ""
        suggestion = sampled or space.advice_on_fields
        raise InputError(
            f"{method!r} would take {_count(runs)} runs, with {space.random_dimension} random and "
            f"{number_of(space.interval_dimension, 'interval variable')}; most_runs is "
            f"{most_runs}{suggestion}"
        )
