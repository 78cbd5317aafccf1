"""What moves along with an animated mechanism: arrows of forces, and paths of measured points."""

from __future__ import annotations

from functools import partial

from flexband.mechanics.assembly.mechanism import Mechanism
from flexband.mechanics.kernels.forms import Vector
from flexband.mechanics.loads.load import in_time
from flexband.mechanics.loads.loads import Force
from flexband.mechanics.sensors.motion import Acceleration, Position, SensorModel, Velocity
from flexband.report.page.arrays import JsonRecord
from flexband.report.shapes.joints import force_point
from flexband.report.shapes.scene import body_of
from flexband.report.shapes.tracks import Tracks


def force_arrows(mechanism: Mechanism, tracks: Tracks) -> list[JsonRecord]:
    """Return the arrows of reactions and of applied forces, with the numbers of their tracks."""
    arrows = []
    for name, joint in mechanism.joints.items():
        force = tracks.reaction(name)
        if force is not None and joint.points:
            at = force_point(joint, tracks, name)
            arrows.append({"kind": "reaction", "name": name, "at": at, "force": force})
    for name, load in mechanism.loads.items():
        if isinstance(load, Force):
            at = tracks.point(load.point)
            force = tracks.force(partial(_applied, load=load), ("load", name))
            arrows.append({"kind": "force", "name": name, "at": at, "force": force})
    return arrows


def _applied(model: SensorModel, load: Force) -> Vector:
    x, y = in_time("x", load.x), in_time("y", load.y)
    return model.frame(load.point).direction(x, y) if load.following else (x, y)


def traces_of(mechanism: Mechanism, tracks: Tracks) -> list[JsonRecord]:
    """Return the measured points whose paths tell something, unlike that of an Angle."""
    return [
        {"name": name, "at": tracks.point(sensor.point)}
        for name, sensor in mechanism.sensors.items()
        if isinstance(sensor, Position | Velocity | Acceleration) and body_of(sensor.point)
    ]
