"""Mechanisms with friction as data, and their models in flexband."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

import flexband as fb
from benchmarks.numerics.contact_draws import (
    EVENTS,
    GRAVITY,
    Part,
    Place,
    PointNames,
    Touch,
    contact,
    rigid_bodies,
    size_of,
)


class Coulomb(NamedTuple):
    """Coefficients of friction; the speed of Stribeck is 0 where there is none."""

    kinetic: float
    static: float
    stribeck: float = 0.0
    viscous: float = 0.0

    def fall(self, speed: float) -> float:
        """Return which part of µs − µk is left at a sliding speed."""
        return math.exp(-((speed / self.stribeck) ** 2)) if self.stribeck else 0.0

    def make_law(self) -> fb.contact.Coulomb:
        """Return the law of flexband."""
        return fb.contact.Coulomb(
            kinetic=self.kinetic, static=self.static, stribeck_speed=self.stribeck or None,
            viscous=self.viscous,
        )  # fmt: skip


Drive = Callable[[float], tuple[float, float, float]]
"""A function of time that returns a travel [m] or an angle [rad], its rate and its acceleration."""


class Link(NamedTuple):
    """A joint: "pin", "slot", "guide", "motor" or "travel", with its axis and its friction.

    `length` is the radius of a pin or the length of a guide [m].
    """

    kind: str
    first: Place
    second: Place
    axis: tuple[float, float] = (1.0, 0.0)
    friction: Coulomb | None = None
    length: float = 0.0
    drive: Drive | None = None


class RoughTouch(NamedTuple):
    """A contact with friction, which may be closed at the start."""

    touch: Touch
    friction: Coulomb
    closed: bool = False


class Brake(NamedTuple):
    """A brake between two bodies; `force` is a function of time."""

    first: Place
    second: Place
    friction: Coulomb
    radius: float
    force: Callable[[float], float]


@dataclass(frozen=True)
class Draw:
    """A mechanism as data."""

    kind: str
    parts: list[Part]
    links: list[Link] = field(default_factory=list)
    touches: list[RoughTouch] = field(default_factory=list)
    springs: list[tuple[Place, Place, float, float]] = field(default_factory=list)
    brakes: list[Brake] = field(default_factory=list)

    @property
    def size(self) -> float:
        """The largest distance between two bodies [m]."""
        return size_of(self.parts)


def mechanism(draw: Draw, velocities: np.ndarray) -> fb.Mechanism:
    """Return the model with these velocities of all bodies, rows of (v_X, v_Y, ω)."""
    at = PointNames(len(draw.parts))
    joints = {}
    loads = {"gravity": fb.Gravity(y=-GRAVITY)}
    sensors = {}
    for k, link in enumerate(draw.links):
        joints[f"J{k}"] = joint(link, at)
        if link.friction:
            sensors[f"friction J{k}"] = fb.contact.FrictionForce(
                f"J{k}", angular=link.kind == "pin"
            )
    for k, (first, second, stiffness, rest) in enumerate(draw.springs):
        loads[f"spring {k}"] = fb.Spring(at(first), at(second), stiffness, rest)
    for k, (touch, friction, closed) in enumerate(draw.touches):
        name = f"T{k}"
        options = {"friction": friction.make_law(), "closed_at_start": closed}
        loads[name] = contact(touch, at, options)
        sensors[name] = fb.contact.Contacts(name, first=EVENTS + 1)
        sensors[f"friction {name}"] = fb.contact.FrictionForce(name)
    for k, brake in enumerate(draw.brakes):
        loads[f"B{k}"] = fb.contact.Brake(
            at(brake.first), at(brake.second), friction=brake.friction.make_law(),
            radius=brake.radius, force=np.vectorize(brake.force, otypes=[float]),
        )  # fmt: skip
        sensors[f"friction B{k}"] = fb.contact.FrictionForce(f"B{k}", angular=True)
    bodies = rigid_bodies(draw.parts, velocities, at)
    for name in bodies:
        sensors[f"place {name}"] = fb.Position(name)
        sensors[f"angle {name}"] = fb.Angle(name)
    return fb.Mechanism(bodies=bodies, joints=joints, loads=loads, sensors=sensors)


def joint(link: Link, at: PointNames):
    """Return the joint of flexband."""
    a = at(link.first)
    b = at(link.second)
    friction = link.friction.make_law() if link.friction else None
    if link.kind == "motor":
        angle = np.vectorize(lambda t: link.drive(t)[0], otypes=[float])
        return fb.PrescribedRotation(a, angle)
    if link.kind == "travel":
        travel = np.vectorize(lambda t: link.drive(t)[0], otypes=[float])
        return fb.PrescribedTravel(a, b, travel, axis=link.axis)
    friction_options = {} if friction is None else {"friction": friction}
    if link.kind == "slot":
        return fb.Slot(a, b, axis=link.axis, **friction_options)
    if link.kind == "pin":
        return fb.Revolute(
            a, b, **friction_options, **({"radius": link.length} if friction_options else {})
        )
    return fb.Prismatic(
        a,
        b,
        axis=link.axis,
        **friction_options,
        **({"length": link.length} if friction_options else {}),
    )
