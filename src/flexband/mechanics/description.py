"""A mechanism as text: its parts, degrees of freedom and redundant constraints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.basics.checks import check_instance
from flexband.mechanics.engine.corrections import corrections, report
from flexband.mechanics.joints.joint import Joint, body_and_point
from flexband.mechanics.linearization.mobility import Mobility
from flexband.mechanics.loads.load import Load
from flexband.mechanics.model.mechanism import Mechanism


def describe(mechanism: Mechanism) -> str:
    """Return tables of bodies, joints, loads and sensors, and the degrees of freedom at the start.

    It also says what assembly changes in the given places, angles and velocities.

    If parameters are arrays, the numbers are those of the first sample.

    Raises
    ------
    InputError, AssemblyError
        As `simulate` does.

    Examples
    --------
    >>> disc = fb.RigidBody.disc(radius=0.1, width=0.01, density=7800.0)
    >>> print(fb.describe(fb.Mechanism(bodies={"disc": disc})))
    body  kind       mass [kg]  coordinates
    ----  ---------  ---------  -----------
    disc  RigidBody  2.45       4
    <BLANKLINE>
    4 coordinates, 1 constraints (including those of rigidity), 3 degrees of freedom
    """
    check_instance("mechanism", mechanism, Mechanism)
    mobility = Mobility.from_mechanism(mechanism)
    system, z, redundant, names = mobility
    changes = report(system, corrections(system, z, np.zeros(1, dtype=int)))

    # A table for each kind of parts.
    owners = system.constraints
    bodies = [
        [name, type(body).__name__, f"{_mass(body):.4g}", str(body.size)]
        for name, body in mechanism.bodies.items()
    ]
    joints = [
        [name, type(joint).__name__, _points(joint), str(owners.count(f"joint {name!r}"))]
        for name, joint in mechanism.joints.items()
    ]
    loads = [[name, type(load).__name__, _points(load)] for name, load in mechanism.loads.items()]
    sensors = [
        [name, type(mechanism.sensors[name]).__name__, ", ".join(f"{s} [{u}]" for s, u in outputs)]
        for name, outputs in mechanism.model.outputs.items()
    ]
    count = system.structure.state.coordinates
    lines = [
        *_table(["body", "kind", "mass [kg]", "coordinates"], bodies),
        *_table(["joint", "kind", "points", "constraints"], joints),
        *_table(["load", "kind", "points"], loads),
        *_table(["sensor", "kind", "outputs"], sensors),
        f"{count} coordinates, {len(owners)} constraints (including those of rigidity), "
        f"{mobility.degrees_of_freedom} degrees of freedom",
    ]
    if redundant:
        lines.append(
            f"redundant constraints: {redundant}; forces are not unique at {', '.join(names)}"
        )
    if "assembly" in changes:
        lines.append(str(changes["assembly"]))
    return "\n".join(lines)


def _mass(body) -> float:
    """Return the mass: twice the kinetic energy of a unit velocity along X."""
    node_rows = set(body.nodes)
    entries = body.mass_entries().items()
    parts = [np.ravel(m)[0] * (1 + (i != j)) for (i, j), m in entries if {i, j} <= node_rows]
    return float(sum(parts))


def _points(part: Joint | Load) -> str:
    return " – ".join(
        str(p) if body_and_point(p)[0] else f"({p[0]:g}, {p[1]:g})" for p in part.points
    )


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return aligned lines, or none if there are no rows."""
    if not rows:
        return []
    widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        return "  ".join(c.ljust(w) for c, w in zip(cells, widths, strict=True)).rstrip()

    return [line(header), line(["-" * w for w in widths]), *map(line, rows), ""]
