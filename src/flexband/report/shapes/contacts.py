"""Shapes of contacts: stops, bodies that meet, and pins in larger holes."""

from __future__ import annotations

import math
from functools import singledispatch

import numpy as np
from numpy.typing import ArrayLike

from flexband.mechanics.contact.contact_law import checked_limits
from flexband.mechanics.contact.geometry.circle_on_line import CircleOnLine
from flexband.mechanics.contact.geometry.circles import CircleInCircle, CircleOnCircle
from flexband.mechanics.contact.geometry.geometry import Geometry
from flexband.mechanics.joints.joint import PairJoint
from flexband.mechanics.loads.contacts import AngularStop, Contact, Stop
from flexband.report.shapes.scene import body_of, pin_between
from flexband.report.shapes.shapes import LocalFrame, Stroke, at, in_points
from flexband.report.shapes.sketch import AXIS, Sketch, arc, circle, in_metres

PLAY = 3.0
"""Least clearance [pt] that is drawn; a smaller one is drawn larger, and its name says so."""


def enlarged_clearance(sketch: Sketch, name: str, clearance: ArrayLike) -> tuple[float, str]:
    """Return the size [pt] with which a clearance is drawn, and the name that says so."""
    size = sketch.scene.start.number(clearance) / sketch.unit
    factor = PLAY / size
    return max(size, PLAY), name if factor <= 1 else f"{name} (clearance × {factor:.2g})"


def add_pin(
    sketch: Sketch,
    part: str,
    name: str,
    ends: PairJoint | Contact,
    clearance: ArrayLike,
    radius: ArrayLike,
) -> None:
    """Add a pin in its hole; where the clearance is enlarged, so is the pin's way in it."""
    pin, hole = sketch.points(ends.points)
    play, said = enlarged_clearance(sketch, name, clearance)
    way = play * sketch.unit / sketch.scene.start.number(clearance)
    size = max(sketch.scene.start.number(radius) / sketch.unit, 4.0)
    place = Stroke([LocalFrame(hole, ends=(hole, pin), shares=True)], np.array([[way, 0, 0, 0.0]]))
    sketch.mark(at(hole), size=2 * (size + play), fill="paper", layer=6.9, part=part)
    sketch.mark(place, size=2 * size, fill="hole", layer=7.0, part=part)
    sketch.name(said, at(hole), color="load" if part.startswith("load") else "ink")


@singledispatch
def add_geometry(geometry: Geometry, sketch: Sketch, load: Contact, name: str) -> None:
    """Add the shapes of a contact with its name; those of an unknown geometry are a diamond."""
    sketch.unknown(load.points, f"load {name!r}", "load")
    sketch.name(name, at(sketch.tracks.point(load.first)), color="load")


@add_geometry.register
def _(geometry: CircleOnLine, sketch: Sketch, load: Contact, name: str) -> None:
    """Add a circle, and a line as far as its ends or the motion along it."""
    x, y = geometry.normal
    first, second = sketch.points(load.points)
    turn = sketch.tracks.axis(load.second, (y, -x))
    beyond = 0.0
    _add_circle(sketch, first, geometry.radius, f"load {name!r}")
    if geometry.ends is None:
        sketch.guides[name] = (first, second, turn)
        beyond = 30.0
        low, high = sketch.travel(name, load, (y, -x))
    else:
        low, high = (sketch.scene.start.number(end) for end in geometry.ends)
    line = LocalFrame(second, turn=turn)
    ends = [(low, 0, -beyond, 0.0), (high, 0, beyond, 0.0)]
    if body_of(load.second):
        sketch.line(Stroke([line], np.array(ends)), width=1.8, layer=6.0, part=f"load {name!r}")
    else:
        sketch.hatch(line, ends[0], ends[1], (-4, -4))
    sketch.name(name, at(first), color="load")


@add_geometry.register
def _(geometry: CircleOnCircle, sketch: Sketch, load: Contact, name: str) -> None:
    numbers = sketch.points(load.points)
    for number, radius in zip(numbers, geometry.radii, strict=True):
        _add_circle(sketch, number, radius, f"load {name!r}")
    sketch.name(name, at(*numbers), color="load")


@add_geometry.register
def _(geometry: CircleInCircle, sketch: Sketch, load: Contact, name: str) -> None:
    clearance, radius = geometry.parameters
    add_pin(sketch, f"load {name!r}", name, load, clearance, radius)


def _add_circle(sketch: Sketch, number: int, radius: ArrayLike, part: str) -> None:
    """Add a circle about a position, or a point if it has no radius."""
    size = sketch.scene.start.number(radius)
    if size:
        sketch.line(in_metres(LocalFrame(number), circle(size, 72)), layer=6.0, part=part)
    else:
        sketch.mark(at(number), size=5.0, fill="ink", layer=7.0, part=part)


def add_stop(load: Stop, sketch: Sketch, name: str) -> None:
    """Add walls across the line of a travel."""
    first, second = sketch.points(load.points)
    line = LocalFrame(second, turn=sketch.tracks.axis(load.second, load.axis))
    places = [(0.0, 0.0, 0.0, 0.0)]
    for sign, limit in checked_limits("Stop", load.lower, load.upper):
        place = sign * sketch.scene.start.number(limit)
        sketch.hatch(line, (place, 0, 0, -9), (place, 0, 0, 9), (4 * sign, 4))
        places.append((place, 0.0, 0.0, 0.0))
    sketch.line(Stroke([line], np.array(places[-2:])), **AXIS)
    sketch.mark(at(first), marker="square", size=5.0, fill="ink", layer=7.0, part=f"load {name!r}")
    sketch.name(name, at(first), color="load")


def add_angular_stop(load: AngularStop, sketch: Sketch, name: str) -> None:
    """Add a pointer of the first body, and spokes of the second one that it meets."""
    pivot = sketch.tracks.point(pin_between(sketch.scene, *load.points) or load.first)
    limits = checked_limits("AngularStop", load.lower, load.upper)
    frame = LocalFrame(pivot, turn=sketch.tracks.turn(load.second))
    angles = [sign * sketch.scene.start.number(limit) for sign, limit in limits]
    for (sign, _), angle in zip(limits, angles, strict=True):
        spoke = np.array([0.0, 0.0, math.cos(angle), math.sin(angle)])
        tick = -4.0 * sign * math.sin(angle), 4.0 * sign * math.cos(angle)
        sketch.hatch(frame, 14.0 * spoke, 32.0 * spoke, tick)
    if len(angles) == 2:
        sketch.line(in_points(frame, arc(np.linspace(angles[0], angles[1], 40), 23.0)), **AXIS)
    pointer = in_points(LocalFrame(pivot, turn=sketch.tracks.turn(load.first)), [(0, 0), (28, 0)])
    sketch.line(pointer, width=1.8, color="load", layer=6.0, part=f"load {name!r}")
    sketch.name(name, pointer, color="load")
