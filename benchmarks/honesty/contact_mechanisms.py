"""Small planar mechanisms with stops, clearances and friction, whose parameters may be uncertain.

Gentle ones are those that an expansion may follow: contacts that stay closed or are met once or
twice by all parts, and friction. Chaotic ones have many impacts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

import flexband as fb
from benchmarks.honesty import mechanisms
from benchmarks.numerics.parts import engine

ORIGIN = (0.0, 0.0)


def law(stiffness, restitution, exponent=1.5) -> fb.contact.NormalLaw:
    return fb.contact.HuntCrossley(stiffness=stiffness, restitution=restitution, exponent=exponent)


def cam(mass, stiffness, preload, eccentricity, speed, restitution):
    """Return a follower on an eccentric disc."""
    radius = 0.03
    face = law(1e6, restitution, 1.0)
    depth = (preload + mass * eccentricity * speed**2) / face.stiffness
    height = radius - eccentricity - depth
    disc = fb.RigidBody(
        mass=1.0, inertia=1e-3, angle=-np.pi / 2, rate=speed, points={"disc": (eccentricity, 0.0)}
    )
    shape = fb.contact.CircleOnLine(radius=radius, normal=(0.0, -1.0))
    return fb.Mechanism(
        bodies={"cam": disc, "follower": fb.PointMass(mass=mass, position=(0.0, height))},
        joints={
            "shaft": fb.Revolute("cam", ORIGIN),
            "motor": fb.PrescribedRotation("cam", lambda t: speed * np.asarray(t) - np.pi / 2),
            "guide": fb.Slot("follower", ORIGIN, axis=(0.0, 1.0)),
        },
        loads={
            "spring": fb.Spring(
                "follower", (0.0, 0.15), stiffness, rest_length=0.15 - height + preload / stiffness
            ),
            "face": fb.contact.Contact("cam.disc", "follower", shape, face, closed_at_start=True),
        },
        sensors={"place": fb.Position("follower"), "force": fb.contact.ContactForce("face")},
    )


def moved_mass(mass, stiffness, friction, restitution, gap, speed, drive=0.0, rate=1.0, lower=None):
    """Return a mass on a spring in a rough guide, which may hit a stop or two."""
    limits = {"upper": gap} if lower is None else {"upper": gap, "lower": -lower}
    return fb.Mechanism(
        bodies={"mass": fb.PointMass(mass=mass, position=ORIGIN, velocity=(speed, 0.0))},
        joints={"guide": fb.Slot("mass", ORIGIN, friction=friction)},
        loads={
            "gravity": fb.Gravity(),
            "spring": fb.Spring("mass", (-0.5, 0.0), stiffness, rest_length=0.5),
            "drive": fb.Force("mass", lambda t: drive * np.sin(rate * np.asarray(t)), 0.0),
            "stop": fb.contact.Stop("mass", ORIGIN, law(1e8, restitution), **limits),
        },
        sensors={
            "place": fb.Position("mass"),
            "velocity": fb.Velocity("mass"),
            "stop": fb.contact.Contacts("stop", first=1),
        },
    )


def landing(mass, height, stiffness, damping, restitution):
    """Return a mass that falls on a soft ground and stays there."""
    return fb.Mechanism(
        bodies={"mass": fb.PointMass(mass=mass, position=(0.0, height))},
        joints={"guide": fb.Slot("mass", ORIGIN, axis=(0.0, 1.0))},
        loads={
            "gravity": fb.Gravity(),
            "damper": fb.ViscousFriction("mass", ORIGIN, damping),
            "ground": fb.contact.Stop(
                "mass", ORIGIN, law(stiffness, restitution, 1.0), lower=0.0, axis=(0.0, 1.0)
            ),
        },
        sensors={
            "place": fb.Position("mass"),
            "ground": fb.contact.Contacts("ground", first=1),
        },
    )


def brake(inertia, rate, friction, force, stiffness):
    """Return a wheel on a torsion spring that a brake stops and holds."""
    return fb.Mechanism(
        bodies={"wheel": fb.RigidBody(mass=1.0, inertia=inertia, rate=rate)},
        joints={"axle": fb.Revolute("wheel", ORIGIN)},
        loads={
            "spring": fb.TorsionSpring("wheel", ORIGIN, stiffness),
            "brake": fb.contact.Brake("wheel", ORIGIN, friction=friction, radius=0.1, force=force),
        },
        sensors={"turn": fb.Angle("wheel"), "rate": fb.AngularVelocity("wheel")},
    )


def slide(mass, stiffness, kinetic, excess, speed):
    """Return a block that sticks to a belt and slips on it."""
    friction = fb.contact.Coulomb(kinetic=kinetic, static=kinetic * (1 + excess))
    belt = fb.PointMass(mass=1.0, velocity=(speed, 0.0))
    return fb.Mechanism(
        bodies={"block": fb.PointMass(mass=mass), "belt": belt},
        joints={
            "motor": fb.PrescribedPath("belt", lambda t: speed * np.asarray(t), lambda t: 0.0),
            "felt": fb.Slot("block", "belt", friction=friction),
        },
        loads={
            "gravity": fb.Gravity(),
            "spring": fb.Spring("block", (-1.0, 0.0), stiffness, rest_length=1.0),
        },
        sensors={"x": fb.Position("block"), "felt": fb.contact.FrictionForce("felt")},
    )


def rough_crank(crank, rod, stiffness, load, speed, guide, pin):
    """Return a slider–crank with friction in its guide and in one pin."""
    smooth = mechanisms.slider_crank(crank, rod, stiffness, 0.0, load, speed)
    joints = {
        **smooth.joints,
        "C": fb.Revolute("slider", "rod.end", friction=pin, radius=0.02),
        "guide": fb.Prismatic("slider", ORIGIN, friction=guide, length=0.2),
    }
    return replace(smooth, joints=joints)


def crank_with_play(crank, rod, stiffness, load, speed, play, restitution):
    """Return a slider–crank whose guide has play, and whose pin is above the slider's middle."""
    smooth = mechanisms.slider_crank(crank, rod, stiffness, 0.0, load, speed)
    high = 0.01
    slider = fb.RigidBody(
        mass=load, inertia=0.01, position=(crank + rod, -high), points={"pin": (0.0, high)}
    )
    guide = fb.Prismatic(
        "slider", (0.0, -high), clearance=play, length=0.15, height=0.05, law=law(1e9, restitution)
    )
    sensors = {
        "slider": fb.Position("slider"),
        "turn": fb.Angle("slider"),
        "guide": fb.contact.Contacts("guide", first=0),
    }
    joints = {**smooth.joints, "C": fb.Revolute("slider.pin", "rod.end"), "guide": guide}
    return replace(
        smooth, bodies={**smooth.bodies, "slider": slider}, joints=joints, sensors=sensors
    )


def door(inertia, rate, opening, damping, restitution):
    """Return a leaf that swings against an angular stop."""
    return fb.Mechanism(
        bodies={"door": fb.RigidBody(mass=1.0, inertia=inertia, rate=rate)},
        joints={"hinge": fb.Revolute("door", ORIGIN)},
        loads={
            "closer": fb.TorsionSpring("door", ORIGIN, 0.0, damping=damping),
            "stop": fb.contact.AngularStop("door", ORIGIN, law(1e4, restitution), upper=opening),
        },
        sensors={
            "angle": fb.Angle("door"),
            "stop": fb.contact.Contacts("stop", first=1, angular=True),
        },
    )


def stopped_pendulum(upper, lower, weight, friction, angle, left, right, restitution):
    """Return a double pendulum whose end moves between two stops."""
    base_model = mechanisms.pendulum(upper, lower, weight, friction, angle)
    x = (upper + lower) * np.sin(angle)
    stop = fb.contact.Stop(
        "weight", ORIGIN, law(1e8, restitution), lower=x - left - right, upper=x + 0.05
    )
    sensors = {
        "weight": fb.Position("weight"),
        "upper": fb.Angle("upper"),
        "stop": fb.contact.Contacts("stop", first=0),
    }
    return replace(base_model, loads={**base_model.loads, "stop": stop}, sensors=sensors)


def ball(mass, radius, hole, x, speed, friction, restitution):
    """Return a disc that bounces in a rough hole."""
    disc = fb.RigidBody(
        mass=mass, inertia=0.5 * mass * radius**2, position=(x, 0.0), velocity=(speed, 0.0)
    )
    hit = fb.contact.Contact(
        "ball", ORIGIN, fb.contact.CircleInCircle(radii=(radius, hole)), law(1e8, restitution),
        friction=friction,
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"ball": disc},
        joints={},
        loads={"gravity": fb.Gravity(), "hole": hit},
        sensors={"ball": fb.Position("ball"), "hole": fb.contact.Contacts("hole", first=0)},
    )


def worn_pin(clearance, mass):
    """Return the slider–crank of examples/worn_pin.py."""
    model = engine(clearance, mass)
    sensors = {
        "slider": fb.Position("slider"),
        "velocity": fb.Velocity("slider"),
        "pin": fb.contact.Contacts("pin", first=0),
    }
    return replace(model, sensors=sensors)


@dataclass(frozen=True)
class Family:
    """Mechanisms of one kind.

    Attributes
    ----------
    builder : function of all parameters by name that returns the mechanism.
    ranges : least and largest nominal value of each parameter, and largest relative spread.
    duration : shortest and longest simulated time [s].
    chaotic : whether there are many impacts.
    runs : most runs of the reference.
    """

    builder: Callable[..., fb.Mechanism]
    ranges: Mapping[str, tuple[float, float, float]]
    duration: tuple[float, float]
    chaotic: bool = False
    runs: int = 1200


MASS = (0.5, 2.0, 0.1)
RESTITUTION = (0.3, 0.9, 0.05)
FRICTION = (0.05, 0.4, 0.15)
CRANK = {
    "crank": (0.1, 0.2, 0.02), "rod": (0.4, 0.5, 0.02), "stiffness": (200.0, 1000.0, 0.1),
    "load": (2.0, 6.0, 0.1),
}  # fmt: skip
CAM = {
    "mass": (0.4, 0.6, 0.05), "stiffness": (1800.0, 2500.0, 0.1), "preload": (60.0, 90.0, 0.1),
    "eccentricity": (0.008, 0.011, 0.05), "restitution": (0.3, 0.8, 0.05),
}  # fmt: skip

FAMILIES = {
    "cam": Family(cam, {**CAM, "speed": (40.0, 90.0, 0.03)}, (0.04, 0.1), runs=1100),
    "stop that is met": Family(
        moved_mass,
        {
            "mass": MASS, "stiffness": (50.0, 300.0, 0.1), "friction": FRICTION,
            "restitution": (0.2, 0.7, 0.05), "gap": (0.02, 0.04, 0.1), "speed": (1.0, 2.0, 0.1),
        },
        (0.06, 0.2),
        runs=2200,
    ),
    "stop that some meet": Family(
        moved_mass,
        {
            "mass": (1.0, 1.0, 0.1), "stiffness": (100.0, 100.0, 0.1), "friction": (0.02, 0.1, 0.2),
            "restitution": RESTITUTION, "gap": (0.07, 0.1, 0.1), "speed": (0.8, 1.1, 0.1),
        },
        (0.2, 0.5),
        runs=2200,
    ),
    "landing": Family(
        landing,
        {
            "mass": MASS, "height": (0.02, 0.1, 0.1), "stiffness": (5e3, 5e4, 0.1),
            "damping": (1.0, 20.0, 0.1), "restitution": (0.05, 0.3, 0.1),
        },
        (0.3, 0.6),
        runs=2200,
    ),
    "brake": Family(
        brake,
        {
            "inertia": (0.02, 0.05, 0.1), "rate": (5.0, 20.0, 0.1), "friction": FRICTION,
            "force": (10.0, 30.0, 0.1), "stiffness": (0.1, 1.0, 0.1),
        },
        (0.5, 2.0),
        runs=2200,
    ),
    "slide": Family(
        slide,
        {
            "mass": MASS, "stiffness": (50.0, 200.0, 0.1), "kinetic": (0.1, 0.3, 0.15),
            "excess": (0.2, 0.6, 0.1), "speed": (0.05, 0.2, 0.1),
        },
        (0.5, 2.0),
    ),
    "rough crank": Family(
        rough_crank,
        {**CRANK, "speed": (8.0, 20.0, 0.02), "guide": FRICTION, "pin": FRICTION},
        (0.2, 0.6),
    ),
    "door": Family(
        door,
        {
            "inertia": (0.2, 0.6, 0.1), "rate": (1.0, 2.0, 0.1), "opening": (0.4, 0.8, 0.1),
            "damping": (0.02, 0.1, 0.1), "restitution": (0.2, 0.8, 0.05),
        },
        (0.6, 1.2),
        runs=2200,
    ),
    "worn pin": Family(
        worn_pin,
        {"clearance": (0.2e-3, 0.6e-3, 0.1), "mass": (0.1, 0.2, 0.1)},
        (0.006, 0.02),
        chaotic=True,
    ),
    "rattling mass": Family(
        moved_mass,
        {
            "mass": MASS, "stiffness": (50.0, 300.0, 0.1), "friction": (0.01, 0.1, 0.15),
            "restitution": (0.6, 0.9, 0.05), "gap": (0.005, 0.02, 0.1), "speed": (0.2, 0.5, 0.1),
            "drive": (10.0, 40.0, 0.1), "rate": (20.0, 60.0, 0.05), "lower": (0.005, 0.02, 0.1),
        },
        (0.5, 1.2),
        chaotic=True,
    ),
    "stopped pendulum": Family(
        stopped_pendulum,
        {
            "upper": (0.4, 0.6, 0.03), "lower": (0.3, 0.5, 0.03), "weight": (1.0, 3.0, 0.1),
            "friction": (0.05, 0.3, 0.1), "angle": (0.4, 0.9, 0.1), "left": (0.2, 0.4, 0.1),
            "right": (0.1, 0.2, 0.1), "restitution": (0.5, 0.9, 0.05),
        },
        (0.8, 2.5),
        chaotic=True,
    ),
    "ball in a hole": Family(
        ball,
        {
            "mass": MASS, "radius": (0.02, 0.03, 0.03), "hole": (0.06, 0.1, 0.03),
            "x": (0.005, 0.02, 0.1), "speed": (0.1, 0.6, 0.1), "friction": FRICTION,
            "restitution": (0.8, 0.95, 0.05),
        },
        (0.6, 2.0),
        chaotic=True,
    ),
    "guide with play": Family(
        crank_with_play,
        {
            **CRANK, "speed": (10.0, 30.0, 0.03), "play": (1e-4, 1e-3, 0.1),
            "restitution": (0.4, 0.8, 0.05),
        },
        (0.15, 0.4),
        chaotic=True,
    ),
    "jumping cam": Family(
        cam, {**CAM, "speed": (140.0, 220.0, 0.03)}, (0.05, 0.15), chaotic=True, runs=1100
    ),
}  # fmt: skip
"""All families by name; a spread is that of an interval's half, or two standard deviations."""
