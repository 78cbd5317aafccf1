"""Small mechanisms whose parameters may be uncertain: functions of numbers or arrays of samples."""

from __future__ import annotations

import numpy as np

import flexband as fb

STEEL = {"height": 0.02, "width": 0.02, "density": 7800.0}  # m, m, kg/m³


def slider_crank(crank, rod, stiffness, friction, load, speed):
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=crank, **STEEL),
            "rod": fb.RigidBody.bar(length=rod, start=(crank, 0.0), **STEEL),
            "slider": fb.RigidBody(mass=load, inertia=0.01, position=(crank + rod, 0.0)),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("rod.start", "crank.end"),
            "C": fb.Revolute("slider", "rod.end"),
            "guide": fb.Prismatic("slider", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: speed * t),
        },
        loads={
            "spring": fb.Spring("slider", (2.0, 0.0), stiffness),
            "friction": fb.ViscousFriction("slider", (2.0, 0.0), friction),
        },
        sensors={
            "F": fb.Reaction("A"),
            "rod": fb.Angle("rod"),
            "torque": fb.ReactionMoment("motor"),
        },
    )


def quick_return(crank, pivot, friction, load, speed):
    lever = 0.5
    height = 0.52
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=crank, start=(0.0, pivot), **STEEL),
            "lever": fb.RigidBody.bar(length=lever, angle=np.arctan2(pivot, crank), **STEEL),
            "rod": fb.RigidBody.bar(length=0.22, start=(0.2, 0.47), angle=0.2, **STEEL),
            "ram": fb.RigidBody(mass=load, inertia=0.05, position=(0.4, height)),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, pivot)),
            "O": fb.Revolute("lever.start", (0.0, 0.0)),
            "slot": fb.Slot("crank.end", "lever.start"),
            "B": fb.Revolute("rod.start", "lever.end"),
            "C": fb.Revolute("rod.end", "ram"),
            "guide": fb.Prismatic("ram", (0.0, height)),
            "motor": fb.PrescribedRotation("crank", lambda t: speed * t),
        },
        loads={"friction": fb.ViscousFriction("ram", (0.8, height), friction)},
        sensors={
            "rod": fb.Angle("rod"),
            "lever": fb.Angle("lever"),
            "torque": fb.ReactionMoment("motor"),
        },
    )


def four_bar(crank, coupler, rocker, ground, stiffness, friction, speed):
    start = np.pi / 3
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=crank, angle=start, **STEEL),
            "coupler": fb.RigidBody.bar(length=coupler, start=(0.04, 0.07), angle=0.4, **STEEL),
            "rocker": fb.RigidBody.bar(length=rocker, start=(0.32, 0.0), angle=1.6, **STEEL),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("coupler.start", "crank.end"),
            "C": fb.Revolute("coupler.end", "rocker.end"),
            "D": fb.Revolute("rocker.start", (ground, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: start + speed * t),
        },
        loads={
            "spring": fb.TorsionSpring(
                "rocker", (0.0, 0.0), stiffness, rest_angle=1.6, damping=friction
            )
        },
        sensors={
            "rocker": fb.Angle("rocker"),
            "F": fb.Reaction("D"),
            "torque": fb.ReactionMoment("motor"),
        },
    )


def pendulum(upper, lower, weight, friction, angle):
    """Return a double pendulum that is released at an angle from the vertical."""
    direction = angle - np.pi / 2
    knee = (upper * np.cos(direction), upper * np.sin(direction))
    return fb.Mechanism(
        bodies={
            "upper": fb.RigidBody.bar(length=upper, angle=direction, **STEEL),
            "lower": fb.RigidBody.bar(length=lower, start=knee, angle=direction, **STEEL),
            "weight": fb.PointMass(
                mass=weight,
                position=(knee[0] + lower * np.cos(direction), knee[1] + lower * np.sin(direction)),
            ),
        },
        joints={
            "hinge": fb.Revolute("upper.start", (0.0, 0.0)),
            "knee": fb.Revolute("lower.start", "upper.end"),
            "end": fb.Revolute("weight", "lower.end"),
        },
        loads={
            "gravity": fb.Gravity(),
            "friction": fb.TorsionSpring("upper", (0.0, 0.0), 0.0, damping=friction),
        },
        sensors={
            "weight": fb.Position("weight"),
            "upper": fb.Angle("upper"),
            "F": fb.Reaction("hinge"),
        },
    )


def elastic_crank(crank, link, modulus, stiffness, load, speed, elements=2, retardation_time=0.0):
    """Return the slider–crank with an elastic link."""
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=crank, **STEEL),
            "link": fb.Beam(
                length=link, height=0.008, width=0.01, density=2700.0, start=(crank, 0.0),
                youngs_modulus=modulus, poissons_ratio=0.3, elements=elements,
                retardation_time=retardation_time,
            ),
            "slider": fb.RigidBody(mass=load, inertia=0.01, position=(crank + link, 0.0)),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("link.start", "crank.end"),
            "C": fb.Revolute("slider", "link.end"),
            "guide": fb.Prismatic("slider", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: speed * t),
        },
        loads={"spring": fb.Spring("slider", (2.0, 0.0), stiffness)},
        sensors={"F": fb.Reaction("A"), "bend": fb.Deflection("link")},
    )  # fmt: skip


def elastic_four_bar(crank, coupler, modulus, damping, speed, elements=2):
    """Return the four-bar linkage of a wiper with a coupler of polyamide."""
    start = np.pi / 3
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=crank, angle=start, **STEEL),
            "coupler": fb.Beam(
                length=coupler, height=0.008, width=0.01, density=1140.0,
                youngs_modulus=modulus, poissons_ratio=0.39, retardation_time=damping,
                elements=elements, start=(0.04, 0.07), angle=0.4,
            ),
            "rocker": fb.RigidBody.bar(length=0.2, start=(0.32, 0.0), angle=1.6, **STEEL),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("coupler.start", "crank.end"),
            "C": fb.Revolute("coupler.end", "rocker.end"),
            "D": fb.Revolute("rocker.start", (0.32, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: start + speed * t),
        },
        sensors={
            "rocker": fb.Angle("rocker"),
            "bend": fb.Deflection("coupler"),
            "F": fb.Reaction("A"),
        },
    )  # fmt: skip
