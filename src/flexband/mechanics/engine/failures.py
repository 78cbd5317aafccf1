"""Failures of runs: the codes that the engine sets, and the messages for them."""

from __future__ import annotations

import numpy as np

from flexband.errors import AssemblyError, SimulationError
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.generalized_alpha import CONTRADICTED, DIVERGED
from flexband.mechanics.engine.settle import NOT_SETTLED
from flexband.mechanics.engine.start import NOT_ASSEMBLED, SINGULAR_START
from flexband.mechanics.loads.compiled_laws import take_failures

SHORTER = (
    "Take shorter steps: a smaller `step`, or more `substeps`. If these diverge as well, a force "
    "is too large or starts too suddenly for what it moves, as that of a spring far from its "
    "rest_length: see 'Start from equilibrium' in docs/mechanisms.md"
)

WRONG_BRANCH, LAW_FAILED, OUT_OF_REACH = 5.0, 7.0, 8.0


def blame_laws(system: System, failure: np.ndarray, step: float) -> None:
    """Write the laws that failed in this thread to `failure`, see `entries`.

    A law that failed after its lane had failed for another reason is not to blame. `step` is that
    of the run [s], or 0 where there is only one time.
    """
    for found in take_failures():
        time = round(found.time / step) if step else 0
        if failure[0, found.lane] == 0 or time <= failure[1, found.lane]:
            number = next(system.numbers)
            loads = [repr(name) for name, law in system.laws if law is found.law]
            text = f"the law of load {' or '.join(dict.fromkeys(loads))} {found.reason}"
            system.law_failures[number] = text
            failure[:3, found.lane] = LAW_FAILED, time, number


def raise_failures(
    failures: np.ndarray, system: System, times: np.ndarray, *, halved: bool = False
) -> None:
    """Raise an error that lists which samples failed, when and why, and what to change.

    `halved` tells whether those that diverged were run again with half the step.
    """
    code, number, row, _ = failures.T
    failed = np.flatnonzero(code)
    if not len(failed):
        return
    terms, found = system.structure.terms, {}
    driven = terms.k[terms.f > 0] - system.structure.state.multiplier
    step = float(times[1] - times[0]) if len(times) > 1 else 0.0
    tried = f"steps of {step:g} s" + (f" and of {step / 2:g} s" if halved else "")
    drives = " and ".join(dict.fromkeys(system.constraints[k] for k in driven))
    for sample in failed:
        names = {WRONG_BRANCH: system.conditions, LAW_FAILED: system.law_failures}.get(
            code[sample], system.constraints
        )
        where = names[int(row[sample])] if row[sample] >= 0 else ""
        reason = {
            NOT_ASSEMBLED: f"the constraints cannot be met; the worst is {where}",
            SINGULAR_START: "constraints contradict each other, or their Jacobian loses rank "
            f"at the guess; the worst is {where}",
            WRONG_BRANCH: f"joint {where!r} holds its body the wrong way round; the body must "
            "start within 90° of the prescribed angle",
            DIVERGED: f"Newton's method diverged with {tried}",
            NOT_SETTLED: "no equilibrium was found; "
            + (
                f"{where} is in a position where constraints depend on each other and cannot "
                "carry every load"
                if where
                else "there may be none, or the loads have to be applied in more steps"
            ),
            LAW_FAILED: where,
            CONTRADICTED: f"constraints contradict each other; the worst is {where}",
            OUT_OF_REACH: f"{drives} asks for a position that the mechanism cannot reach",
        }[code[sample]]
        found[int(sample)] = (float(times[int(number[sample])]), reason)
    lines = [f"sample {s}, t = {t:g} s: {reason}" for s, (t, reason) in list(found.items())[:5]]
    more = f"\n... and {len(found) - 5} more" if len(found) > 5 else ""
    text = f"{len(found)} of {len(failures)} runs failed\n" + "\n".join(lines) + more
    if DIVERGED in code[failed]:
        text += f"\n{SHORTER}"
    if not np.any(number[failed]):
        raise AssemblyError(text, found)
    raise SimulationError(text, found)
