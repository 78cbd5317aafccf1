"""What users give: nothing that they change later, or return in their own classes, does harm."""

import copy
import pickle
from dataclasses import dataclass

import numpy as np
import pytest

import flexband as fb
from flexband.mechanics.bodies.body import Body
from flexband.mechanics.joints.joint import Joint
from flexband.mechanics.kernels.forms import Form, PlanarFrame
from flexband.mechanics.loads.load import Entries, SpringEntry
from flexband.mechanics.sensors.motion import Sensor

MASS = fb.PointMass(mass=1.0)


def fall(mechanism):
    return fb.simulate(mechanism, duration=0.1, step=0.05).values


def test_a_mechanism_keeps_copies():
    bodies = {"m": MASS}
    masses = np.array([1.0, 2.0])
    loads = {"push": fb.Force("m", x=masses)}
    mechanism = fb.Mechanism(bodies=bodies, loads=loads, sensors={"x": fb.Position("m")})
    before = fall(mechanism)
    bodies["bar"] = fb.RigidBody(mass=1.0, inertia=1.0)
    loads.clear()
    masses[:] = np.nan
    np.testing.assert_array_equal(fall(mechanism), before)
    with pytest.raises(TypeError):
        mechanism.bodies["bar"] = MASS
    with pytest.raises(ValueError, match="read-only"):
        mechanism.loads["push"].x[:] = 0.0
    for duplicate in (copy.deepcopy(mechanism), pickle.loads(pickle.dumps(mechanism))):
        np.testing.assert_array_equal(fall(duplicate), before)


def test_an_array_that_was_changed_before_is_checked_again():
    mass = np.array([1.0, 2.0])
    body = fb.PointMass(mass=mass)
    mass[1] = -1.0
    with pytest.raises(fb.errors.InputError, match=r"body 'm': PointMass mass .* zero or positive"):
        fb.Mechanism(bodies={"m": body})


@dataclass(frozen=True)
class AnyLoad:
    entries: object
    points = ("m",)

    def enters(self, model):
        return self.entries


@dataclass(frozen=True)
class AnySensor(Sensor):
    forms: object
    units = (("", "m"), ("_2", "m"))

    def rows(self, model):
        return self.forms


@dataclass(frozen=True)
class AnyJoint(Joint):
    forms: object
    first = "m"

    def constraints(self, frame):
        return self.forms


@dataclass(frozen=True)
class AnyBody(Body):
    mass: object
    count: int = 2
    per_node = 2

    def coordinates(self):
        return [np.zeros(())] * self.count

    velocities = coordinates

    def mass_entries(self):
        return self.mass

    def frame(self, name, first):
        return PlanarFrame.of_rigid_node(first + 5)


MISSING_ROW = Form.variable(1000)
FIRST_ROW = Form.variable(1)
NEGATIVE_ROW = Form({(-3, 1, None): np.ones(())})
UNIT = {(0, 0): np.ones(()), (1, 1): np.ones(())}


@pytest.mark.parametrize(
    ("kinds", "part", "text"),
    [
        ("loads", AnyLoad(Entries(forces={1000: FIRST_ROW})), "load 'a': forces must act on"),
        ("loads", AnyLoad(Entries(forces={1: MISSING_ROW})), "load 'a': forces must be of rows"),
        ("loads", AnyLoad(Entries(forces={1: NEGATIVE_ROW})), "load 'a': forces must be of rows"),
        (
            "loads",
            AnyLoad(Entries(potential=MISSING_ROW)),
            "load 'a': the potential must be of rows",
        ),
        ("loads", AnyLoad(None), "load 'a': what it enters must be Entries"),
        (
            "loads",
            AnyLoad(Entries(springs=[SpringEntry(MISSING_ROW, 1.0, 1.0, 0.0, 0.0, Form({}))])),
            "load 'a': the elongation of a spring must be of rows",
        ),
        ("sensors", AnySensor([FIRST_ROW, MISSING_ROW]), "sensor 'a': rows must be of rows"),
        ("sensors", AnySensor([1.0]), "sensor 'a': rows must be a Form"),
        ("sensors", AnySensor(None), "sensor 'a': rows must be a list of forms"),
        ("joints", AnyJoint([MISSING_ROW]), "joint 'a': constraints must be of rows 0 to 2 of z"),
        ("joints", AnyJoint([Form({(0, 1, None): np.array("x")})]), "coefficients of constraints"),
        ("bodies", AnyBody({(0, 5): np.ones(())}), "body 'a': mass_entries must be"),
        ("bodies", AnyBody(UNIT, count=3), "body 'a': coordinates must return 2 values; got 3"),
        ("loads", fb.Force, "must be a load"),
        ("loads", fb.Moment("m", 1.0), "a Moment acts on a body that rotates; 'm' does not"),
        ("loads", fb.TorsionSpring("m", (0.0, 0.0)), "must join a body that rotates"),
        ("sensors", fb.Position(3), "sensor 'a': ground point must be a pair"),
        ("sensors", fb.Reaction(["x"]), "joint .*x.* is not in the mechanism"),
    ],
)
def test_wrong_rows_and_points_are_refused_by_name(kinds, part, text):
    parts = {"bodies": {"m": MASS}}
    parts.setdefault(kinds, {})["a"] = part
    with pytest.raises(fb.errors.InputError, match=text):
        fb.Mechanism(**parts)


def test_outputs_of_the_wrong_shape_are_refused():
    mechanism = fb.Mechanism(bodies={"m": MASS}, sensors={"a": AnySensor([FIRST_ROW])})
    with pytest.raises(
        fb.errors.InputError, match=r"sensor 'a': derive must return shape .*\(2, 3, 8\)"
    ):
        fall(mechanism)


def test_two_outputs_of_one_name_are_refused():
    bar = fb.RigidBody(mass=1.0, inertia=1.0)
    sensors = {"tip": fb.Position("b"), "tip_X": fb.Angle("b")}
    with pytest.raises(fb.errors.InputError, match="'tip' and 'tip_X' both have an output 'tip_X'"):
        fb.Mechanism(bodies={"b": bar}, sensors=sensors)


@pytest.mark.parametrize("name", ["", "a.b", 3, None])
def test_names_are_text(name):
    with pytest.raises(fb.errors.InputError, match="the name of a body must be non-empty text"):
        fb.Mechanism(bodies={name: MASS})


@pytest.mark.parametrize("bodies", [None, [MASS], "m", MASS, {}])
def test_parts_are_mappings(bodies):
    with pytest.raises(
        fb.errors.InputError, match=r"bodies must be a mapping|needs at least one body"
    ):
        fb.Mechanism(bodies=bodies)
