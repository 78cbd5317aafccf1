"""A linkage of pylinkage.

The cranks, dyads and ground points of a `pylinkage.simulation.Linkage` become bodies and joints
with the same lengths, which may be uncertain. The crank–slider is one of pylinkage's own examples;
its rod's length and its crank's radius are intervals. pylinkage is needed:
``pip install pylinkage``.
"""

import numpy as np
from pylinkage.actuators import Crank
from pylinkage.components import Ground
from pylinkage.dyads import FixedDyad, RRPDyad, RRRDyad
from pylinkage.simulation import Linkage

import flexband as fb

WEIGHT = {"mass": 1.0, "inertia": 1.0}  # of every body; the motion is prescribed


def mechanism(linkage, **lengths):
    """Return a linkage whose cranks turn by one of its steps per second.

    Points are bodies of their names. `lengths` replaces distances and radii: the name of a
    component -> one value per length, in the order of its `get_constraints()`.
    """
    bodies, joints, points = {}, {}, {}
    for part in linkage.components:
        name = part.name
        if isinstance(part, Ground):
            points[name] = part.position
            continue
        anchors = [points[anchor.name] for anchor in part.anchors]
        numbers = lengths.get(name, part.get_constraints())
        points[name] = name
        if isinstance(part, Crank):
            reach = np.subtract(part.position, part.anchor.position)
            start, rate = np.arctan2(reach[1], reach[0]), part.angular_velocity
            bodies[name] = fb.RigidBody(**WEIGHT, points={"tip": (numbers[0], 0.0)}, angle=start)
            joints[name] = fb.Revolute(name, anchors[0])
            joints[f"{name} turns"] = fb.PrescribedRotation(
                name, lambda t, start=start, rate=rate: start + rate * t
            )
            points[name] = f"{name}.tip"
        elif isinstance(part, FixedDyad):  # a point of a body along the line through both anchors
            distance, angle = numbers
            place = (distance * np.cos(angle), distance * np.sin(angle))
            (x, y), (x2, y2) = (anchor.position for anchor in part.anchors)
            line = np.arctan2(y2 - y, x2 - x)
            if all(isinstance(anchor, tuple) for anchor in anchors):
                offset = np.exp(1j * line) * complex(*place)
                points[name] = (x + offset.real, y + offset.imag)
                continue
            bodies[name] = fb.RigidBody(
                **WEIGHT, points={"tip": place}, position=(x, y), angle=line
            )
            joints[name] = fb.Revolute(name, anchors[0])
            joints[f"{name} line"] = fb.Slot(anchors[1], name)
            points[name] = f"{name}.tip"
        elif isinstance(part, RRRDyad | RRPDyad):
            bodies[name] = fb.PointMass(mass=1.0, position=part.position)
            for k, distance in enumerate(numbers):
                joints[f"{name} {k}"] = fb.Distance(name, anchors[k], distance)
            if isinstance(part, RRPDyad):
                axis = tuple(np.subtract(anchors[2], anchors[1]))
                joints[f"{name} line"] = fb.Slot(name, anchors[1], axis=axis)
        else:
            raise NotImplementedError(f"{name} is a {type(part).__name__}")
    sensors = {name: fb.Position(points[name]) for name in bodies}
    return fb.Mechanism(bodies=bodies, joints=joints, sensors=sensors)


def stroke_engine():
    """Return pylinkage's example of a crank with a slider."""
    center, start, end = Ground(0, 0, name="O"), Ground(0, 0, name="a"), Ground(1, 0, name="b")
    crank = Crank(center, radius=1.0, angular_velocity=0.1, name="crank")
    slider = RRPDyad(crank.output, start, end, distance=1.5, name="slider")
    return Linkage([center, start, end, crank, slider])


def engine(radius, rod):
    return mechanism(stroke_engine(), crank=(radius,), slider=(rod,))


response = fb.dynamic_response(engine, duration=62.0, step=0.1)
inputs = {"radius": fb.Interval(0.99, 1.01), "rod": fb.Interval(1.49, 1.51)}
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.02))
