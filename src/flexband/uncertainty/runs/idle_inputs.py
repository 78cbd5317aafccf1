"""Inputs that change no output: a warning, after a few runs that prove it."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from flexband.basics.warning import warn, without_warnings
from flexband.errors import ResolutionWarning
from flexband.uncertainty.inputs.effects import never_read, probes, without_effect
from flexband.uncertainty.runs.runs import Call, CountedRuns, Purpose


def warn_of_idle_inputs(runs: CountedRuns) -> None:
    """Warn of inputs that change no output; the budget may pay for runs that prove it."""
    space = runs.space
    unread = never_read(runs.response.original, space.inputs)
    level = max(runs.levels, key=lambda level: sum(len(call[0]) for call in level.calls))
    idle_inputs: dict[str, int] = {}
    suspects: list[str] = []
    if not level.all_have_effects:
        idle_inputs, suspects = _without_effect(runs, level.calls)
    suspects = [name for name in suspects if name not in unread]
    probe_points = probes(space, suspects)
    if suspects and runs.done + len(probe_points[0]) <= runs.total:
        with suppress(Exception), without_warnings(ResolutionWarning):  # failures prove nothing
            values = level(*probe_points, Purpose.PROBE).values
            idle_names = _without_effect(runs, [(*probe_points, values)])[1]
            idle_inputs |= {name: len(probe_points[0]) for name in suspects if name in idle_names}
    for name in space.uncertain:
        if name in unread:
            warn(f"input {name!r} changes no output: the response never reads it")
        elif name in idle_inputs:
            where = " at the two values of it that were run" if idle_inputs[name] == 2 else ""
            warn(f"input {name!r} changes no output{where}")


def _without_effect(runs: CountedRuns, calls: list[Call]) -> tuple[dict[str, int], list[str]]:
    parts = zip(*calls, strict=True)
    xi, eta, values = (p[0] if len(p) == 1 else np.concatenate(p) for p in parts)
    return without_effect(runs.space, (xi, eta), values)
