"""Shapes of stops, contacts and clearance, read back from sketches at the start of mechanisms."""

import numpy as np
import pytest

import flexband as fb
from flexband import contact
from flexband.mechanics.configuration import assembled_configuration
from flexband.report.page.motion.record import record_shapes
from flexband.report.shapes.mechanism import sketch_mechanism
from flexband.report.shapes.scene import Scene
from flexband.report.shapes.tracks import Tracks

LAW = contact.KeepsRestitution(stiffness=1e7)
UNIT = 1e-3
"""Metres per point."""


def sketch_of(**parts):
    mechanism = fb.Mechanism(**parts)
    scene = Scene(mechanism, assembled_configuration(mechanism))
    tracks = Tracks(mechanism)
    sketch = sketch_mechanism(scene, tracks, UNIT)
    start = tracks.at_start(scene.start)

    def places(shape):
        return np.concatenate([stroke.places(*start, UNIT) for stroke in shape.strokes])

    return sketch, places


def hatching(sketch, places):
    """Return the first and the last point of each surface [m]."""
    return [places(line)[:2] for line in sketch.lines if line.layer == 2.0]


def test_the_walls_of_a_stop_are_at_its_limits_across_its_axis():
    point = fb.PointMass(mass=1.0, position=(0.03, 0.04))
    stop = contact.Stop("m", (0.0, 0.0), LAW, lower=-0.1, upper=0.2, axis=(3.0, 4.0))
    sketch, places = sketch_of(bodies={"m": point}, loads={"stop": stop})
    axis = np.array([0.6, 0.8])
    across = 9e-3 * np.array([-0.8, 0.6])
    walls = hatching(sketch, places)
    assert len(walls) == 2
    for wall, limit in zip(walls, (-0.1, 0.2), strict=True):
        np.testing.assert_allclose(wall, [limit * axis - across, limit * axis + across], atol=1e-12)


def bar(name, angle, start=(0.0, 0.0)):
    return fb.RigidBody.bar(
        length=0.5, height=0.01, width=0.01, density=7800.0, angle=angle, start=start
    )


def test_the_pointer_of_an_angular_stop_meets_a_spoke_at_the_limit():
    end = 0.5 * np.cos(0.4), 0.5 * np.sin(0.4)
    sketch, places = sketch_of(
        bodies={"a": bar("a", 0.4), "b": bar("b", 0.4 + 0.7, end)},
        joints={"O": fb.Revolute("a.start", (0.0, 0.0)), "P": fb.Revolute("b.start", "a.end")},
        loads={"stop": contact.AngularStop("b", "a", LAW, lower=-0.2, upper=0.7)},
    )
    (pointer,) = [places(line) for line in sketch.lines if line.part == "load 'stop'"]
    spokes = [ends for ends in hatching(sketch, places) if np.linalg.norm(ends[0] - end) < 0.02]
    low, high = (ends[1] for ends in spokes)
    direction = (pointer[1] - end) / 28e-3
    np.testing.assert_allclose(direction, [np.cos(1.1), np.sin(1.1)], atol=1e-9)
    np.testing.assert_allclose(high - end, 32e-3 * direction, atol=1e-9)
    np.testing.assert_allclose(low - end, 32e-3 * np.array([np.cos(0.2), np.sin(0.2)]), atol=1e-9)


@pytest.mark.parametrize(("clearance", "factor"), [(1e-4, 30.0), (6e-3, 1.0)])
def test_a_pin_is_seen_in_its_hole(clearance, factor):
    """A clearance below 3 pt is drawn as 3 pt, its name says so, and the way of the pin fits it."""
    place = 0.1 + 0.5 * clearance, 0.2
    sketch, places = sketch_of(
        bodies={"m": fb.PointMass(mass=1.0, position=place)},
        joints={"pin": fb.Revolute("m", (0.1, 0.2), clearance=clearance, law=LAW, radius=0.01)},
    )
    hole, pin = (mark for mark in sketch.marks if mark.part == "joint 'pin'")
    assert pin.size == pytest.approx(20.0)
    assert hole.size == pytest.approx(20.0 + 2 * factor * clearance / UNIT)
    np.testing.assert_allclose(places(hole), [(0.1, 0.2)], atol=1e-12)
    pin_x = 0.1 + factor * 0.5 * clearance
    np.testing.assert_allclose(places(pin), [(pin_x, 0.2)], atol=1e-12)
    names = [name.text for name in sketch.names]
    assert ("pin (clearance × 30)" if factor > 1 else "pin") in names
    shapes = [s for s in record_shapes(sketch)["shapes"] if s.get("part") == "joint 'pin'"]
    assert shapes[1]["strokes"][0]["frames"][0]["shares"]  # it moves in the page


def test_a_slider_has_its_size_and_its_walls_their_clearance():
    slider = fb.RigidBody(mass=1.0, inertia=1e-3, position=(0.02, 0.001), angle=0.03)
    guide = fb.Prismatic("s", (0.0, 0.0), clearance=0.005, length=0.1, height=0.04, law=LAW)
    sketch, places = sketch_of(bodies={"s": slider}, joints={"guide": guide})
    below, above = hatching(sketch, places)
    np.testing.assert_allclose(below[:, 1], -0.025, atol=1e-12)
    np.testing.assert_allclose(above[:, 1], 0.025, atol=1e-12)
    (block,) = [places(line) for line in sketch.lines if line.part == "joint 'guide'"]
    c = np.cos(0.03)
    s = np.sin(0.03)
    corner = np.array([0.05 * c - 0.02 * s, 0.05 * s + 0.02 * c])
    np.testing.assert_allclose(block[2] - [0.02, 0.001], corner, atol=1e-12)


def test_bodies_that_meet_have_their_shapes():
    circles = contact.CircleInCircle(radii=(0.01, 0.02))
    table = contact.CircleOnLine(radius=0.05, normal=(0.0, 1.0), ends=(-0.2, 0.3))
    sketch, places = sketch_of(
        bodies={"a": fb.PointMass(mass=1.0, position=(0.1, 0.2)),
                "b": fb.PointMass(mass=1.0, position=(0.3, 0.2))},
        loads={
            "table": contact.Contact("a", (0.0, 0.0), table, LAW),
            "both": contact.Contact("a", "b", contact.CircleOnCircle(radii=(0.05, 0.02)), LAW),
            "hole": contact.Contact("b", (0.3, 0.201), circles, LAW),
        },
    )  # fmt: skip
    (surface,) = hatching(sketch, places)
    np.testing.assert_allclose(surface, [(-0.2, 0.0), (0.3, 0.0)], atol=1e-12)
    rings = [places(line) for line in sketch.lines if line.part == "load 'both'"]
    for line, centre, radius in zip(rings, [(0.1, 0.2), (0.3, 0.2)], (0.05, 0.02), strict=True):
        np.testing.assert_allclose(np.linalg.norm(line - centre, axis=1), radius)
    hole, pin = (mark for mark in sketch.marks if mark.part == "load 'hole'")
    assert (hole.size, pin.size) == pytest.approx((40.0, 20.0))
