"""Failures of runs: the codes that the engine sets, and the messages for them."""

from __future__ import annotations

import numpy as np

from flexband.errors import AssemblyError, SimulationError
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.generalized_alpha import CONTRADICTED, DIVERGED
from flexband.mechanics.engine.settle import NOT_SETTLED
from flexband.mechanics.engine.start import NOT_ASSEMBLED, SINGULAR_START

WRONG_BRANCH = 5.0


def raise_failures(failures: np.ndarray, system: System, times: np.ndarray) -> None:
    """Raise an error that lists which samples failed, when and why."""
    code, number, row, _ = failures.T
    failed = np.flatnonzero(code)
    if not len(failed):
        return
    found = {}
    for sample in failed:
        names = system.conditions if code[sample] == WRONG_BRANCH else system.constraints
        where = names[int(row[sample])] if row[sample] >= 0 else ""
        reason = {
            NOT_ASSEMBLED: f"the constraints cannot be met; the worst is {where}",
            SINGULAR_START: "constraints contradict each other, or their Jacobian loses rank "
            f"at the guess; the worst is {where}",
            WRONG_BRANCH: f"joint {where!r} holds its body the wrong way round; the body must "
            "start within 90° of the prescribed angle",
            DIVERGED: "Newton's method diverged, also with half the step",
            NOT_SETTLED: "no equilibrium was found; apply the loads in more steps",
            CONTRADICTED: f"constraints contradict each other; the worst is {where}",
        }[code[sample]]
        found[int(sample)] = (float(times[int(number[sample])]), reason)
    lines = [f"sample {s}, t = {t:g} s: {reason}" for s, (t, reason) in list(found.items())[:5]]
    more = f"\n... and {len(found) - 5} more" if len(found) > 5 else ""
    text = f"{len(found)} of {len(failures)} runs failed\n" + "\n".join(lines) + more
    if not np.any(number[failed]):
        raise AssemblyError(text, found)
    raise SimulationError(text, found)
