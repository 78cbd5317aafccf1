"""Joints of three components: a spatial slider–crank in closed form, guesses, and refusals."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flexband as fb
from flexband.mechanics.joints.joint import PairJoint
from flexband.mechanics.kernels.forms import at_point, constant_vector, dot, subtract
from flexband.mechanics.kernels.relation_forms import (
    across,
    alignment,
    meet,
    moment,
    parallel,
)
from flexband.mechanics.loads.load import Entries
from tests.mechanics.space import INERTIA, NONE, Coordinates, SpatialBody, axes_of

ignore_resolution = pytest.mark.filterwarnings("ignore::flexband.errors.ResolutionWarning")

CRANK = 0.3
ROD = 1.1  # m
AXIS = np.array([0.8, 0.36, -0.48])
PLACE = np.array([0.2, -0.1, 0.25])  # of the guide


class Related(PairJoint):
    """A joint that is a function of two frames."""

    def __init__(self, first, second, rows):
        self.first = first
        self.second = second
        self.rows = rows

    def constraints(self, frame):
        return self.rows(frame(self.first), frame(self.second))


def universal(first, second):
    """Return rows of a cross, the second axis of one body and the third of the other its arms."""
    return [*meet(first, second), dot(first.axes[1], second.axes[2])]


def guide(first, second):
    """Return rows of a slide along AXIS, on which the bodies do not turn against each other."""
    separation = subtract(first.position, second.position)
    rows = [dot(vector, separation) for vector in across(second, AXIS)]
    return [*rows, *parallel(first, second, AXIS), alignment(first, second, 1.0, 0.0, AXIS)[0]]


def travel(angle):
    """Return where the slider is along its axis: |p − p₀ − s u| = ℓ."""
    pin = CRANK * np.array([np.cos(angle), np.sin(angle), 0.0]) - PLACE
    middle = AXIS @ pin
    return middle + np.sqrt(middle**2 - pin @ pin + ROD**2)


def slider_crank(angle, noise=0.0, seed=0):
    """Return the mechanism, whose bodies are `noise` [m], [rad] from where they belong."""
    rng = np.random.default_rng(seed)
    pin = np.array([CRANK, 0.0, 0.0])
    slide = PLACE + travel(0.0) * AXIS
    along_rod = (slide - pin) / ROD
    arm = np.cross([0.0, 0.0, 1.0], along_rod)
    arm /= np.linalg.norm(arm)
    rod = Rotation.from_matrix(np.stack([along_rod, arm, np.cross(along_rod, arm)], axis=1))

    def body(place, way, **points):
        return SpatialBody(
            place + noise * rng.normal(size=3),
            Rotation.from_rotvec(noise * rng.normal(size=3)) * way, **points,
        )  # fmt: skip

    return fb.Mechanism(
        bodies={
            "crank": body(np.zeros(3), NONE, pin=(CRANK, 0.0, 0.0)),
            "rod": body((pin + slide) / 2, rod, start=(-ROD / 2, 0, 0), end=(ROD / 2, 0, 0)),
            "slider": body(slide, NONE),
        },
        joints={
            "main": fb.Revolute("crank", (0.0, 0.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", angle),
            "ball": Related("rod.start", "crank.pin", meet),
            "cross": Related("rod.end", "slider", universal),
            "guide": Related("slider", tuple(PLACE), guide),
        },
        sensors={name: Coordinates(name) for name in ("crank", "rod", "slider")},
    )  # fmt: skip


@ignore_resolution
def test_a_crank_with_spherical_and_universal_joints_moves_a_slider_as_its_closed_form_says():
    motion = fb.simulate(slider_crank(lambda t: 2 * t + t**3), duration=2.0, step=2e-3)
    places = motion.sel(output=[f"slider {k}" for k in range(3)]).values
    exact = [PLACE + travel(2 * t + t**3) * AXIS for t in motion["time"].values]
    np.testing.assert_allclose(places.T, exact, rtol=0, atol=1e-12)
    np.testing.assert_allclose(axes_of(motion, "slider"), [np.eye(3)] * len(exact), atol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_a_guess_of_space_assembles_and_its_turns_are_told(seed):
    """Bodies are 0.3 rad and 0.3 m off; the report states the turn of the body that turned most."""
    mechanism = slider_crank(lambda t: 2 * t, noise=0.3, seed=seed)
    with pytest.warns(fb.errors.FlexbandWarning, match="assembly turned body"):
        motion = fb.simulate(mechanism, duration=1e-3, step=1e-3)
    place = motion.sel(output=[f"slider {k}" for k in range(3)]).values[:, 0]
    np.testing.assert_allclose(place, PLACE + travel(0.0) * AXIS, rtol=0, atol=1e-12)
    turns = [
        Rotation.from_matrix(start_axes.T @ axes_of(motion, name)[0]).magnitude()
        for name, body in mechanism.bodies.items()
        for start_axes in [np.array(body.start[3:]).reshape(3, 3).T]
    ]
    assert motion.attrs["largest_turn"] == pytest.approx(max(turns), rel=1e-9)


@ignore_resolution
def test_a_moment_about_a_tilted_axis_turns_a_free_body():
    """½ M × g on each axis is M δφ: at rest, J α = M in the axes of the body."""
    way = Rotation.from_euler("xyz", [0.4, -0.7, 1.1])
    moment_vector = np.array([0.3, -0.2, 0.5])

    class Turning:
        points = ("a",)

        def enters(self, model):
            return Entries(forces=moment(model.frame("a"), *moment_vector))

    mechanism = fb.Mechanism(
        bodies={"a": SpatialBody(np.zeros(3), way)}, loads={"M": Turning()},
        sensors={"a": Coordinates("a")},
    )  # fmt: skip
    motion = fb.simulate(mechanism, duration=0.01, step=1e-3)
    rotation_vector = Rotation.from_matrix(way.as_matrix().T @ axes_of(motion, "a")[-1]).as_rotvec()
    exact = 0.5 * 0.01**2 * (way.inv().apply(moment_vector) / INERTIA)
    np.testing.assert_allclose(rotation_vector, exact, rtol=1e-3)


def test_bodies_of_the_plane_and_of_space_are_not_mixed():
    bodies = {"a": SpatialBody(np.zeros(3)), "b": fb.PointMass(mass=1.0)}
    with pytest.raises(fb.errors.InputError, match="those of 'a' have 3 and those of 'b' 2"):
        fb.Mechanism(bodies=bodies)


@pytest.mark.parametrize(
    "part",
    [
        {"joints": {"j": fb.Gear("a", (1.0, 0.0), first_radius=0.5, second_radius=0.5)}},
        {"loads": {"l": fb.Moment("a", 1.0)}},
        {"loads": {"l": fb.TorsionSpring("a", (0.0, 0.0), stiffness=1.0)}},
        {"sensors": {"s": fb.Angle("a")}},
        {"sensors": {"s": fb.AngularVelocity("a")}},
    ],
)
def test_what_needs_an_angle_refuses_bodies_of_space(part):
    with pytest.raises(fb.errors.InputError, match=r"'[jls]': a body of space has no angle"):
        fb.Mechanism(bodies={"a": SpatialBody(np.zeros(3))}, **part)


def test_vectors_have_as_many_outputs_as_components():
    sensors = {
        "p": fb.Position("a"), "v": fb.Velocity("a"), "a": fb.Acceleration("a"),
        "R": fb.Reaction("pin"),
    }  # fmt: skip
    mechanism = fb.Mechanism(
        bodies={"a": SpatialBody(np.zeros(3), end=(0.0, 0.0, 2.0))},
        joints={"pin": fb.Weld("a.end", (0.0, 0.0, 2.0))}, loads={"up": Up()}, sensors=sensors,
    )  # fmt: skip
    rest = fb.equilibrium(mechanism)
    names = [f"{name}_{axis}" for name in "pvaR" for axis in "XYZ"]
    assert list(rest["output"].values) == names
    reaction = rest.sel(output=["R_X", "R_Y", "R_Z"])
    np.testing.assert_allclose(reaction, [0.0, 0.0, -7.0], atol=1e-9)


class Up:
    """A force of 7 N along Z."""

    points = ("a",)

    def enters(self, model):
        force = at_point(constant_vector((0.0, 0.0, 7.0)), model.frame("a").position)
        return Entries(forces=force)
