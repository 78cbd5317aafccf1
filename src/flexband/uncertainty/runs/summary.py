"""What a result says of its runs: how many there were, and which inputs change no output."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from flexband.basics.progress import Budget
from flexband.basics.warning import warn, without_warnings
from flexband.basics.words import number_of
from flexband.errors import ResolutionWarning
from flexband.execution.store import versions
from flexband.remarks.collection import as_attribute
from flexband.uncertainty.inputs.effects import never_read, probes, without_effect
from flexband.uncertainty.inputs.unfolding import in_words
from flexband.uncertainty.runs.counted_runs import Call, CountedRuns, Purpose
from flexband.uncertainty.surrogates.extrapolation import reached_range


def attributes(runs: CountedRuns, of_method: Mapping[str, Any]) -> dict[str, Any]:
    """Return the number of runs and the method, and report that all runs are done.

    The attributes of the result tell why the method does not trust it, and what it has made
    finer.
    """
    if runs.budget > runs.done or isinstance(runs.budget, Budget):
        runs.progress(runs.done, runs.done)
    xi = np.concatenate([call[0] for level in runs.levels for call in level.calls])
    counts = {"runs": runs.done + runs.exploration_runs, "runs_repeated": runs.repeated}
    inputs = in_words(runs.space.user_inputs)
    texts = {"method": repr(runs.method), "inputs": inputs, "versions": versions()}
    failed = runs.evaluations.failures
    if runs.reused:
        counts["runs_reused"] = runs.reused
    if failed:
        counts["runs_failed"] = failed
    if failed > 0.05 * runs.done:  # results are not trusted
        why = f"{failed} of {number_of(runs.done, 'run')} failed, and what fails is rarely random"
        doubts = of_method.get("not_trusted", "")
        texts["not_trusted"] = "; ".join(filter(None, (doubts, f"any output ({why})")))
    halved = [*runs.start.refined_parts, *of_method.get("halved", [])]
    halvings = {"halved": halved} if halved else {}
    impacts = {"impacts": 1} if runs.start.description.impacts else {}
    return {
        **counts,
        **texts,
        **halvings,
        **impacts,
        **reached_range(xi),
        **_constant_offsets(runs),
        **as_attribute(runs.remarks.get(tuple(sorted(halved)), ())),
    }


def _constant_offsets(runs: CountedRuns) -> dict[str, Any]:
    """Return the outputs whose bounds hold for pins that stay in place in each run only.

    Also whether all plays are stated to be one-sided, so that they do.
    """
    plays = runs.space.plays
    names = runs.start.of_nominal(runs.response.instantaneous) if plays else None
    if names is None or runs.labels is None or "output" not in runs.labels.coords:
        return {}
    output_names = runs.labels["output"].values.astype(str).tolist()
    varying_names = [name for name in output_names if name not in names]
    one_sided = int(all(pair.one_sided for pair in plays.values()))
    if not varying_names:
        return {}
    return {"constant_offsets": varying_names, "offsets_stated": one_sided}


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
