"""Joints and drives of an animated mechanism, and the ground that they stand on."""

from __future__ import annotations

import numpy as np

from flexband.mechanics.joints.drives import PrescribedPath, PrescribedRotation, PrescribedTravel
from flexband.mechanics.joints.gears import Gear, Rack
from flexband.mechanics.joints.joint import PointName, along
from flexband.mechanics.joints.joints import Distance, Prismatic, Revolute, Slot, Weld
from flexband.mechanics.kernels.forms import Vector, add, scale, subtract
from flexband.mechanics.sensors.motion import SensorModel
from flexband.report.drawing.joints import first_sense, held_body, pivot, upward
from flexband.report.drawing.scene import Scene, body_of
from flexband.report.page.motion.bodies import Item
from flexband.report.page.motion.tracks import Tracks

SIMPLE = {Revolute: "pin", Weld: "weld", Distance: "rod", PrescribedPath: "path"}


def joint_item(scene: Scene, tracks: Tracks, name: str) -> Item:
    """Return what is drawn of a joint: its `kind`, its `name`, and its points `at`.

    A "slide" and a "slot" have a direction `axis` and tell whether they have a `block` and stand on
    the `ground`; "gears" and the pinion of a "rack" have `circles`; drives have the `sense` in
    which they start, +1 or −1.
    """
    joint = scene.mechanism.joints[name]
    symbol: Item = {"name": name, "kind": "unknown", "at": [tracks.point(p) for p in joint.points]}
    for kind, word in SIMPLE.items():
        if isinstance(joint, kind):
            symbol["kind"] = word
    match joint:
        case Prismatic() | Slot():
            block, ground = isinstance(joint, Prismatic), not body_of(joint.second)
            symbol |= {"kind": "slide" if block else "slot", "ground": ground}
            symbol["axis"] = _axis(tracks, joint)
        case Gear():
            symbol |= {"kind": "gears", "circles": _circles(scene, tracks, joint)}
        case Rack():
            symbol |= {"kind": "rack", "circles": _circles(scene, tracks, joint)}
            symbol["line"] = [_on_rack(scene, tracks, joint, end) for end in scene.rack_line(joint)]
        case PrescribedRotation():
            at = tracks.point(pivot(scene, joint.first))
            symbol |= {"kind": "rotation", "at": [at], "turn": tracks.turn(joint.first)}
            symbol["sense"] = first_sense(scene, joint.angle)
        case PrescribedTravel():
            symbol |= {"kind": "travel", "axis": _axis(tracks, joint)}
            symbol["sense"] = first_sense(scene, joint.travel)
    return symbol


def supports(scene: Scene, tracks: Tracks, name: str) -> list[Item]:
    """Return the bearings ("bearing") and walls ("wall") under a joint.

    Each has a point `at`, the direction `up` from the ground, and `half` the height [m] of what it
    holds.
    """
    joint = scene.mechanism.joints[name]
    if not isinstance(joint, Revolute | Weld | Distance):
        return []
    kind = "wall" if isinstance(joint, Weld) else "bearing"
    half = float(scene.half_height(held_body(joint)).max())
    return [
        {"kind": kind, "at": tracks.point(point), "half": half,
         "up": upward(scene, joint, scene.at(point)).tolist()}
        for point in joint.points if not body_of(point)
    ]  # fmt: skip


def reaction_item(scene: Scene, tracks: Tracks, name: str) -> Item | None:
    """Return the arrow of the force that a joint exerts on its first body, if there is one."""
    joint, force = scene.mechanism.joints[name], tracks.reaction(name)
    if force is None or not joint.points:
        return None
    at = tracks.point(joint.first)
    if isinstance(joint, Gear):
        at = tracks.position(lambda model: _contact(model, joint), f"contact of {name}")
    return {"kind": "reaction", "name": name, "at": at, "force": force}


def _axis(tracks: Tracks, joint: Prismatic | Slot | PrescribedTravel) -> int:
    return tracks.direction(lambda model: along(model.frame(joint.second), joint.axis))


def _contact(model: SensorModel, gear: Gear) -> Vector:
    """Return where two gears touch."""
    (first, second), place = gear.radii, model.frame(gear.first).position
    centres = subtract(model.frame(gear.second).position, place)
    return add(place, scale(first / (first + second), centres))


def _circles(scene: Scene, tracks: Tracks, joint: Gear | Rack) -> list[Item]:
    """Return the pitch circles of gears; those of rings have negative radii."""
    points: list[PointName] = [joint.first] + [joint.second] * isinstance(joint, Gear)
    return [
        {"center": tracks.point(point), "radius": radius, "turn": tracks.turn(point)}
        for point, (_, radius) in zip(points, scene.pitch_circles(joint), strict=True)
    ]


def _on_rack(scene: Scene, tracks: Tracks, rack: Rack, end: np.ndarray) -> int:
    """Return the number of the point of a rack's body that is at `end` [m] at the start."""
    frame = scene.mechanism.frame(rack.second)
    apart = end - scene.at(rack.second)
    x, y = (float(apart @ scene.start.vector(axis)) for axis in (frame.normal, frame.y))
    return tracks.position(lambda model: model.frame(rack.second).moved(x, y).position)
