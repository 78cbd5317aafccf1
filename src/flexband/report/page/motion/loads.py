"""Loads of an animated mechanism."""

from __future__ import annotations

import numpy as np

from flexband.mechanics.kernels.forms import Vector
from flexband.mechanics.loads.force_laws import ForceLaw, ViscousFriction
from flexband.mechanics.loads.load import in_time
from flexband.mechanics.loads.loads import DistributedLoad, Force, Gravity, Moment
from flexband.mechanics.loads.springs import Spring, TorsionSpring
from flexband.mechanics.sensors.motion import SensorModel
from flexband.report.drawing.loads import GAPS, elements_of, sense_of
from flexband.report.drawing.scene import Scene, body_of
from flexband.report.page.motion.bodies import Item
from flexband.report.page.motion.tracks import Tracks


def load_item(scene: Scene, tracks: Tracks, name: str) -> Item:
    """Return what is drawn of a load: its `kind`, its `name`, and its points `at`.

    A "spring" and a "torsion" spring tell whether they are `elastic` and `damped`; a spring which
    of its ends are `walls`; what turns the `sense` at the start; "gravity" its `field` [m/s²]; a
    "distributed" load the `shares` of the largest at its points. A "force" has the number of a
    force.
    """
    load = scene.mechanism.loads[name]
    symbol: Item = {"name": name, "kind": "unknown", "at": []}
    if isinstance(load, DistributedLoad):
        return symbol | _distributed(scene, tracks, load)
    symbol["at"] = [tracks.point(point) for point in load.points]
    match load:
        case Gravity():
            field = [scene.start.number(load.x), scene.start.number(load.y)]
            symbol |= {"kind": "gravity", "field": field}
        case Spring() | ViscousFriction():
            walls = [not body_of(point) for point in load.points]
            symbol |= {"kind": "spring", "walls": walls, **elements_of(scene, load)}
        case TorsionSpring():
            elements = elements_of(scene, load)
            motor = not any(elements.values())
            turned = motor or callable(load.torque) or scene.start.number(load.torque)
            sense = sense_of(scene, load.torque) if turned else 0.0
            symbol |= {"kind": "torsion", "sense": sense, **elements}
        case Moment():
            symbol |= {"kind": "moment", "sense": sense_of(scene, load.moment)}
        case Force():
            force = tracks.force(lambda model: _force(model, load))
            symbol |= {"kind": "force", "at": symbol["at"][0], "force": force}
        case ForceLaw():
            symbol["kind"] = "law"
    return symbol


def _force(model: SensorModel, load: Force) -> Vector:
    x, y = in_time("x", load.x), in_time("y", load.y)
    return model.frame(load.point).direction(x, y) if load.following else (x, y)


def _distributed(scene: Scene, tracks: Tracks, load: DistributedLoad) -> Item:
    """Return the arrows of a load along a beam, in proportion to the load at the start."""
    points = [tracks.point(f"{load.beam}.{k / GAPS!r}") for k in range(GAPS + 1)]
    length = getattr(scene.mechanism.bodies[load.beam], "length", 0.0)
    x = np.linspace(0.0, scene.start.number(length), GAPS + 1)
    force = np.stack([scene.start.along(part, x) for part in (load.x, load.y)], axis=1)
    shares = force / (np.hypot(*force.T).max() or 1.0)
    return {"kind": "distributed", "at": points, "shares": shares.round(3).tolist()}
