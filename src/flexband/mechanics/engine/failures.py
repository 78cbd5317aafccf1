"""Failures of runs: the codes that the engine sets, and the messages for them."""

from __future__ import annotations

import numpy as np

from flexband.basics.words import number_of
from flexband.errors import AssemblyError, SimulationError
from flexband.mechanics.assembly.structure import Values
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.loop_closure import gaps
from flexband.mechanics.engine.straining import LargestStrains, fold_advice
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.kernels.laws.forces import GAP
from flexband.mechanics.kernels.laws.states import MARK
from flexband.mechanics.kernels.state import rows_of_gaps
from flexband.mechanics.loads.law_shape import take_failures

SHORTER = (
    "Take shorter steps: a smaller `step`, or more `substeps`. If these diverge as well, a force "
    "is too large or starts too suddenly for what it moves, as that of a spring far from its "
    "rest_length: see 'Start from equilibrium' in docs/how-to/mechanisms.md"
)

MAX_SHOWN = 5
"""Causes in a message, and samples of a cause."""


def blame_laws(system: System, failure: np.ndarray, step: float) -> None:
    """Write the laws that failed in this thread to `failure`, see `entries`.

    A law that failed after its lane had failed for another reason is not to blame. `step` is that
    of the run [s], or 0 where there is only one time.
    """
    for law_failure in take_failures():
        time = round(law_failure.time / step) if step else 0
        if failure[0, law_failure.lane] == 0 or time <= failure[1, law_failure.lane]:
            number = next(system.numbers)
            loads = [repr(name) for name, law in system.laws if law is law_failure.law]
            text = f"the law of load {' or '.join(dict.fromkeys(loads))} {law_failure.reason}"
            system.law_failures[number] = text
            failure[:3, law_failure.lane] = FAILURE.law_failed, time, number


def raise_failures(
    failures: np.ndarray,
    system: System,
    times: np.ndarray,
    *,
    halved: bool = False,
    folds: LargestStrains | None = None,
) -> None:
    """Raise an error that lists which samples failed, when, why, and what to change.

    `folds` has the largest turns of elements.
    """
    code, number, row, part = failures.T
    failed = np.flatnonzero(code)
    if not len(failed):
        return
    terms = system.structure.terms
    causes = {}
    driven = terms.k[terms.f > 0] - system.structure.state.multiplier
    step = float(times[1] - times[0]) if len(times) > 1 else 0.0
    tried = f"steps of {step:g} s" + (f" and of {step / 2:g} s" if halved else "")
    drives = " and ".join(dict.fromkeys(system.constraints[k] for k in driven))
    # Find the reason of each failure.
    for sample in failed:
        numbers = code[sample], int(row[sample]), float(part[sample])
        reason = _reason(system, *numbers, tried, drives)
        causes[int(sample)] = (float(times[int(number[sample])]), reason)
    lines = [f"{len(causes)} of {number_of(len(failures), 'run')} failed", *_causes(causes)]
    # Say what may help.
    short = np.isin(code[failed], (FAILURE.diverged, FAILURE.too_small)).any()
    fold = fold_advice(system, folds, failed) if folds and short else ""
    if fold or FAILURE.diverged in code[failed]:
        lines.append(fold or SHORTER)
    assembly_failures = np.flatnonzero(
        np.isin(code, (FAILURE.not_assembled, FAILURE.singular_start))
    )
    if len(assembly_failures) and not np.any(number[assembly_failures]):
        lines.append(_advice(system, int(assembly_failures[0])))
    text = "\n".join(lines)
    if np.any(number[failed] == 0):
        raise AssemblyError(text, causes)
    raise SimulationError(text, causes)


def _reason(system: System, code: float, row: int, part: float, tried: str, drives: str) -> str:
    """Return why a sample failed, from its code and the numbers beside it, see `entries`."""
    row_names = {FAILURE.wrong_branch: system.conditions, FAILURE.law_failed: system.law_failures}
    where = (
        row_names.get(code, system.constraints)[row]
        if row >= 0 and code != FAILURE.overlapping
        else ""
    )
    return {
        FAILURE.not_assembled: lambda: "the constraints cannot be met",
        FAILURE.singular_start: lambda: (
            "constraints contradict each other, or their Jacobian loses "
            f"rank at the guess; the worst is {where}"
        ),
        FAILURE.wrong_branch: lambda: (
            f"joint {where!r} holds its body the wrong way round; the body "
            "must start within 90° of the prescribed angle"
        ),
        FAILURE.diverged: lambda: f"Newton's method diverged with {tried}",
        FAILURE.not_settled: lambda: (
            "no equilibrium was found; "
            + _loose(system, int(part))
            + (
                f"{where} is in a position where constraints depend on each other and cannot "
                "carry every load"
                if where
                else "there may be none, or the loads have to be applied in more steps"
            )
        ),
        FAILURE.law_failed: lambda: where,
        FAILURE.contradicted: lambda: f"constraints contradict each other; the worst is {where}",
        FAILURE.snapped_through: lambda: (
            f"the mechanism snaps through at {part:.3g} of the "
            "loads; PrescribedTravel in place of the force follows it"
        ),
        FAILURE.undetermined: lambda: (
            f"{_massless(system)} can move while all that has mass is at "
            "rest, as at a dead centre; give it mass and inertia"
        ),
        FAILURE.too_small: lambda: (
            "no step is short enough, down to the smallest_step: events follow "
            "each other without end, or forces that jump are not events"
        ),
        FAILURE.overlapping: lambda: _overlap(system, row, part),
        FAILURE.unstable: lambda: "the equilibrium to start from is not stable",
        FAILURE.not_periodic: lambda: (
            "no periodic motion to start from was found; the spectral radius "
            f"of the motion over a period is {part:.4g}, and a vibration must decay to "
            "0.98 or less: give more damping, a longer period, or start='static'"
        ),
        FAILURE.not_met: lambda: (
            f"{where} is not met where the motion goes on: it is off by "
            f"{part:.3g} (m, or rad of an angle)"
        ),
        FAILURE.jammed: lambda: (
            f"friction of {friction_names(system)} jams (Painlevé): κ = {part:.3g}, "
            "and from κ = 1 on no motion is consistent, or several are. A smaller friction "
            "coefficient, a longer guide, or a load nearer to it makes κ less; or let what is "
            "pressed together be elastic"
        ),
        FAILURE.unsettled: lambda: _unsettled_reason(system),
        FAILURE.out_of_reach: lambda: (
            f"{drives} asks for a position that the mechanism cannot reach"
        ),
    }[code]()


def _massless(system: System) -> str:
    mass = system.structure.mass
    first = system.model.first_coordinates
    rows = mass.i[mass.massless]
    bodies = system.model.bodies.items()
    names = [
        name
        for name, body in bodies
        if np.any((rows - first[name] >= 0) & (rows - first[name] < body.size))
    ]
    return f"a body without mass or inertia ({', '.join(map(repr, names))})"


def friction_names(system: System, *, switched: bool = False) -> str:
    """Return the names of the parts with friction, or of the joints that switch, as text."""
    names = (name for name, f in system.model.frictions if bool(f.active) == switched)
    return " or ".join(dict.fromkeys(map(repr, names)))


def _unsettled_reason(system: System) -> str:
    """Return why nothing that sticks or slides, or becomes active, agrees with the rest."""
    reasons = []
    if joints := friction_names(system, switched=True):
        reasons.append(
            f"joint {joints} becomes active farther from its place than its tolerance, or "
            "contradicts other joints"
        )
    if parts := friction_names(system):
        reasons.append(
            f"no choice of what sticks and what slides of {parts} agrees with the other forces; "
            "joints that contradict each other may be why"
        )
    return "; or ".join(reasons)


def _causes(causes: dict[int, tuple[float, str]]) -> list[str]:
    """Return each of the first five causes as a line, with the samples that it made fail."""
    samples: dict[str, list[int]] = {}
    for sample, (time, reason) in causes.items():
        samples.setdefault(f"t = {time:g} s: {reason}", []).append(sample)
    lines = []
    for cause, group in list(samples.items())[:MAX_SHOWN]:
        remainder = f" and {len(group) - MAX_SHOWN} more" if len(group) > MAX_SHOWN else ""
        numbers = ", ".join(map(str, group[:MAX_SHOWN]))
        lines.append(f"{'sample' if len(group) == 1 else 'samples'} {numbers}{remainder}, {cause}")
    if len(samples) > MAX_SHOWN:
        lines.append(f"... and {len(samples) - MAX_SHOWN} more")
    return lines


def _advice(system: System, sample: int) -> str:
    """Return which joints of a sample stay open, by how much, and what to change."""
    open_by = gaps(system, sample)
    joints = system.model.joints
    if not open_by:
        return f"`fb.draw(mechanism, sample={sample})` shows the guess"
    worst = max(open_by, key=lambda name: open_by[name])
    open_joints = [name for name in open_by if open_by[name] > open_by[worst] / 10]
    points = [
        point for name in open_joints for point in joints[name].points if isinstance(point, str)
    ]
    bodies = ", ".join(dict.fromkeys(repr(point.partition(".")[0]) for point in points))
    others = f", all joints together by {sum(open_by.values()):.3g} m" if len(open_by) > 1 else ""
    return (
        f"Sample {sample}: however the bodies are moved and turned from their guess, joint "
        f"{worst!r} stays open by {open_by[worst]:.3g} m{others}. Change lengths or the places "
        f"of joints of {bodies}, or their `start` and `angle` if they do reach each other. "
        f"`fb.draw(mechanism, sample={sample})` shows the guess"
    )


def _loose(system: System, number: int) -> str:
    """Say which body is not held, if any: this number from 1 on, negative if loads turn it."""
    if not number:
        return ""
    name = [*system.model.bodies][abs(number) - 1]
    verb = "move" if number > 0 else "turn"
    return f"its loads {verb} body {name!r}, and nothing seems to hold it; "


def _overlap(system: System, number: int, depth: float) -> str:
    """Say how far a contact is closed at the start, and what helps."""
    name, law = system.model.contact_laws[number]
    angular = law.is_angular
    text = f"contact {name!r} is closed at the start, by {depth:.3g} {'rad' if angular else 'm'}"
    if name in system.model.joints:
        return f"{text} beyond its clearance; move its bodies to where the joint has play"
    if angular and depth > np.pi:
        turn = "angles count from those that bodies are given, turns included"
        return f"{text}: {turn}; give the bodies or the limits angles on the same turn"
    return f"{text}; move its bodies apart, or give closed_at_start=True"


def blame_overlaps(
    system: System,
    values: Values,
    z: np.ndarray,
    failure: np.ndarray,
    before: np.ndarray | None = None,
    *,
    touch: float = 1e-8,
    moved: float = 1e-5,
) -> None:
    """Write to `failure` which contacts are closed that must be open at the start.

    A depth of `touch` times the size of the mechanism counts as none. Where a contact has closed in
    a motion that goes on, it may be as deep as it was in the state `before`, and deeper by `moved`.
    """
    laws = [law for _, law in system.model.contact_laws]
    if not laws:
        return
    kinds = system.structure.laws.gap_kind
    state = system.structure.state
    rows = rows_of_gaps.py_func(state)
    gaps, modes = (z[first:][: rows.number] for first in (rows.value, rows.mode))
    contact = np.isin(kinds, (GAP.length, GAP.angle))
    depths = -gaps[contact]
    modes = modes[contact]
    sizes = np.array([1.0 if law.is_angular else 0.0 for law in laws])[:, None]
    sizes = np.where(sizes > 0, sizes, 1.0 / values.inverse_scale[1])
    refused = ~np.array([law.closed_at_start for law in laws])[:, None]
    allowed = touch * sizes
    if before is not None:
        depth_limit = moved * sizes + np.maximum(-before[state.gap :][: len(kinds)][contact], 0.0)
        allowed = np.where(np.abs(modes) == MARK.at_rest, allowed, depth_limit)
    depths = np.where(refused & (depths > allowed), depths, 0.0)
    depth = depths.max(axis=0)
    code = np.full(WIDTH, FAILURE.overlapping)
    overlapping = np.stack([code, 0.0 * code, depths.argmax(axis=0), depth])
    failure[:] = np.where((failure[0] == 0) & (depth > 0), overlapping, failure)
