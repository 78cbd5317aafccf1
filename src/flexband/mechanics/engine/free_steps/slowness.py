"""What asks for short steps in a run that takes long, in words."""

from __future__ import annotations

import numpy as np

from flexband.mechanics.assembly.structure import WorkSpace
from flexband.mechanics.assembly.system import System
from flexband.mechanics.kernels.laws.forces import GAP
from flexband.mechanics.kernels.state import rows_of_gaps


def slow_steps(system: System, work: WorkSpace) -> str:
    """Return what the shortest of the next steps of a block follows; "" before there is one."""
    lengths = work.steps[0]
    taken = work.counts[0] > 0
    if not taken.any():
        return ""
    lane = int(np.where(taken, lengths, np.inf).argmin())
    return f"steps of {lengths[lane]:.2g} s follow {_step_causes(system, work, lane)}"


def _step_causes(system: System, work: WorkSpace, lane: int, *, events: float = 2.0) -> str:
    """Return what the steps of a lane follow; more `events` without a long step are named."""
    limit = int(work.counts[3, lane])
    closed = _closed_contacts(system, work.z[:, lane])
    touching = " and ".join(map(repr, dict.fromkeys(closed)))
    if work.steps[2, lane] > events:
        return "events that are close together, as of contacts that bounce or of stick and slip"
    if limit == 0:
        return f"the depth of {touching}" if touching else "contacts"
    where = f" while {touching} is closed" if touching else ""
    for name, body in system.model.bodies.items():
        first = system.model.first_coordinates[name]
        if first <= limit < first + body.size:
            helps = "" if body.rigid else ": damping, or fewer elements, makes them longer"
            return f"fast motions of body {name!r}{where}{helps}"
    return "fast motions"


def _closed_contacts(system: System, z: np.ndarray) -> list[str]:
    """Return the parts whose contacts are closed."""
    rows = rows_of_gaps.py_func(system.structure.state)
    modes = z[rows.mode :][: rows.number]
    names = [name for name, _ in system.model.contact_laws]
    kinds = system.structure.laws.gap_kind
    contacts = np.flatnonzero(np.isin(kinds, (GAP.length, GAP.angle)))
    return [name for name, k in zip(names, contacts, strict=True) if modes[k] < 0]
