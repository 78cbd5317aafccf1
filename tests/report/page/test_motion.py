"""The data of animated mechanisms, against simulations of the same."""

import zlib
from base64 import b64decode
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import flexband as fb
from flexband.report.page.given import given_by, study_motion
from flexband.report.page.motion.motion import motion_data
from flexband.uncertainty.inputs.space import Space

BAR = {"height": 0.02, "width": 0.02, "density": 1000.0}
STEP = 5e-4
OUTPUTS = 300


def four_bar(length, youngs_modulus):
    """A parallelogram with a flexible coupler, a spring and a force that turns with the rocker."""
    coupler = fb.Beam(length=length, start=(0.6, 0.8), poissons_ratio=0.3, elements=3,
                      youngs_modulus=youngs_modulus, **BAR)  # fmt: skip
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=1.0, angle=0.93, **BAR),
            "coupler": coupler,
            "rocker": fb.RigidBody.bar(length=1.0, start=(2.0, 0.0), angle=0.93, **BAR),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("coupler.start", "crank.end"),
            "C": fb.Revolute("coupler.end", "rocker.end"),
            "D": fb.Revolute("rocker.start", (2.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: 0.93 - 3.0 * t),
        },
        loads={
            "push": fb.Force("rocker.end", lambda t: 5.0 * t, 2.0, following=True),
            "spring": fb.Spring("coupler.middle", (1.0, 2.0), 40.0),
        },
        sensors={
            "middle": fb.Position("coupler.middle"),
            "C": fb.Reaction("C"),
            "turn": fb.Angle("rocker"),
        },  # of an angle there is no path
    )


INPUTS = {"length": fb.Interval(1.99, 2.01), "youngs_modulus": fb.Normal(2e8, 1e7)}
RESPONSE = fb.dynamic_response(four_bar, duration=OUTPUTS * STEP, step=STEP / 2, output_step=STEP)


def unpack(record):
    planes = np.frombuffer(zlib.decompress(b64decode(record["data"])), np.uint8)
    values = planes.reshape(record["bytes"], -1).T.copy().view(f"<i{record['bytes']}")
    if "quantum" not in record:
        values = values.view(float)
    return values.reshape(record["shape"]) * record.get("quantum", 1.0)


@cache
def tree():
    motion, reasons = motion_data(RESPONSE, Space(INPUTS))
    assert reasons == []
    assert motion is not None
    return motion


def read(sensor, times, **inputs):
    """Return the outputs of a sensor of the four-bar at some times, shape (2, times)."""
    mechanism = four_bar(**({"length": 2.0, "youngs_modulus": 2e8} | inputs))
    mechanism = replace(mechanism, sensors={"s": sensor})
    motion = fb.simulate(mechanism, duration=OUTPUTS * STEP, step=STEP, substeps=2)
    return motion.sel(time=times).values


def shape_of(motion, part):
    """Return the shape that stands for a part."""
    (shape,) = [shape for shape in motion["shapes"] if shape.get("part") == part]
    return shape


def frames(motion, part):
    """Return the frames of the shape that stands for a part."""
    return [frame for stroke in shape_of(motion, part)["strokes"] for frame in stroke["frames"]]


def points(motion, part):
    """Return the numbers of the positions that the shape of a part goes through."""
    return [frame["origin"] for frame in frames(motion, part)]


def beam_of(motion, name):
    """Return the axis of a beam, in numbers of positions, its nodes, and half its heights [m]."""
    sides = points(motion, f"body {name!r}")
    axis = sides[: len(sides) // 2]
    (marks,) = [s for s in motion["shapes"] if s.get("color") == "flexible" and "spacing" in s]
    nodes = [frame["origin"] for stroke in marks["strokes"] for frame in stroke["frames"]]
    (stroke,) = shape_of(motion, f"body {name!r}")["strokes"]
    half = unpack(motion["vertices"])[stroke["first"] : stroke["first"] + len(axis), 1]
    return axis, nodes, half


def entry_of(kind, name):
    (entry,) = [entry for entry in tree()[kind] if entry["name"] == name]
    return entry


def test_points_move_as_in_a_simulation():
    times = unpack(tree()["times"])
    position = unpack(tree()["position"])
    np.testing.assert_allclose(times, np.arange(0, OUTPUTS + 1, 2) * STEP, atol=1e-12)
    size = np.abs(position).max()
    for body, corner, point in (("rocker", 0, "rocker.start"), ("rocker", 1, "rocker.end")):
        number = points(tree(), f"body {body!r}")[corner]
        exact = read(fb.Position(point), times)
        np.testing.assert_allclose(position[number], exact, atol=size / 30_000)
    (trace,) = tree()["traces"]
    exact = read(fb.Position("coupler.middle"), times)
    np.testing.assert_allclose(position[trace["at"]], exact, atol=size / 30_000)


def test_ends_of_a_bent_beam_are_where_its_joints_are():
    axis, nodes, half = beam_of(tree(), "coupler")
    assert len(axis) == 25
    assert nodes == axis[::8]
    crank, rocker = (points(tree(), f"body {name!r}") for name in ("crank", "rocker"))
    joints = {name: points(tree(), f"joint {name!r}") for name in "BC"}
    position = unpack(tree()["position"])
    quantum = tree()["position"]["quantum"]
    for node, corners in ((axis[0], joints["B"] + crank[1:]), (axis[-1], joints["C"] + rocker[1:])):
        for corner in corners:
            np.testing.assert_allclose(position[corner], position[node], atol=1.01 * quantum)
    chord = np.linspace(position[axis[0]], position[axis[-1]], 25)
    assert np.abs(position[axis] - chord).max() > 100 * quantum  # it is drawn bent
    np.testing.assert_allclose(half, 0.01)


def test_arrows_are_reactions_and_applied_forces():
    times = unpack(tree()["times"])
    forces = unpack(tree()["force"])
    position = unpack(tree()["position"])
    quantum = tree()["force"]["quantum"]
    for name in "ABCD":
        arrow = entry_of("forces", name)
        np.testing.assert_allclose(
            forces[arrow["force"]], read(fb.Reaction(name), times), atol=1.01 * quantum
        )
        assert [arrow["at"]] == points(tree(), f"joint {name!r}")
    assert "motor" not in [arrow["name"] for arrow in tree()["forces"]]
    start, end = (position[k] for k in points(tree(), "body 'rocker'"))
    along = end - start
    across = np.stack([-along[1], along[0]])
    exact = 5.0 * times * along + 2.0 * across
    force = forces[entry_of("forces", "push")["force"]]
    np.testing.assert_allclose(force, exact, atol=2e-3)


def test_samples_are_motions_of_other_inputs():
    samples = tree()["samples"]
    times = unpack(tree()["times"])
    deviation = unpack(samples["deviation"])
    assert deviation.shape == (23, len(samples["points"]), 2, len(times))
    (beam,) = [outline for outline in samples["outlines"] if len(outline["points"]) > 2]
    end = [samples["points"][k] for k in beam["points"]].index(beam_of(tree(), "coupler")[0][-1])
    tip = deviation[:, beam["points"][end]]
    short, long = (
        read(fb.Position("coupler.end"), times, length=length)
        - read(fb.Position("coupler.end"), times)
        for length in (1.99, 2.01)
    )
    # Young's modulus matters little: the corners of the interval are the two groups of samples
    errors = [np.abs(tip - exact).max(axis=(1, 2)) for exact in (short, long)]
    corners = np.minimum(*errors)[:12]
    assert corners.max() < 0.05 * np.abs(long).max()
    assert (errors[0][:12] < errors[1][:12]).sum() == 6
    assert 0 < np.abs(tip[12:, :, -1]).mean() < np.abs(tip[:12, :, -1]).mean()


def test_gears_racks_and_guides():
    def gears():
        disc = {"width": 0.02, "density": 7800.0}
        block = {"length": 0.1, "height": 0.02, "points": {"left": (-0.05, 0.0), "right": (0.1, 0)}}
        bodies = {
            "pinion": fb.RigidBody.disc(radius=0.1, rate=2.0, **disc),
            "wheel": fb.RigidBody.disc(radius=0.2, position=(0.3, 0.0), rate=-1.0, **disc),
            "rack": fb.RigidBody.block(position=(0.0, -0.1), velocity=(0.2, 0.0), **block, **disc),
        }
        joints = {
            "P": fb.Revolute("pinion", (0.0, 0.0)),
            "W": fb.Revolute("wheel", (0.3, 0.0)),
            "teeth": fb.Gear("pinion", "wheel", 0.1, 0.2),
            "rack": fb.Rack("pinion", "rack", 0.1),
            "guide": fb.Prismatic("rack.left", (0.0, -0.1)),
        }
        return fb.Mechanism(bodies=bodies, joints=joints)

    response = fb.dynamic_response(gears, duration=0.1, step=0.01)
    motion, reasons = motion_data(response, Space({}), samples=0)
    assert motion is not None, reasons
    position = unpack(motion["position"])
    direction = unpack(motion["direction"])
    turns = [direction[frame["turn"]] for frame in frames(motion, "joint 'teeth'")]
    angles = [np.arctan2(y, x) for x, y in turns]
    np.testing.assert_allclose(angles[0], 2.0 * unpack(motion["times"]), atol=2e-3)
    np.testing.assert_allclose(angles[1], -1.0 * unpack(motion["times"]), atol=2e-3)
    ends = position[list(frames(motion, "joint 'rack'")[0]["ends"])]
    np.testing.assert_allclose(ends[:, 1], -0.1, atol=1e-4)
    np.testing.assert_allclose(ends[:, 0, -1] - ends[:, 0, 0], 0.02, atol=1e-4)
    np.testing.assert_allclose(
        direction[frames(motion, "joint 'guide'")[0]["turn"]].T, [[1.0, 0.0]] * 11, atol=1e-3
    )
    (contact,) = [arrow for arrow in motion["forces"] if arrow["name"] == "teeth"]
    np.testing.assert_allclose(position[contact["at"]].T, [[0.1, 0.0]] * 11, atol=1e-4)


def test_samples_that_fail_are_left_out():
    def closing(length):
        """A rod that is too long for some samples."""
        return fb.Mechanism(
            bodies={"m": fb.PointMass(mass=1.0, position=(0.5, 0.3))},
            joints={
                "left": fb.Distance("m", (0.0, 0.0), 0.6),
                "right": fb.Distance("m", (1.5, 0.0), length),
            },
        )

    response = fb.dynamic_response(closing, duration=0.01, step=0.01)
    motion, reasons = motion_data(response, Space({"length": fb.Interval(0.8, 1.2)}))
    assert motion is not None, reasons
    assert "not drawn, of 23, since their motion fails" in reasons[0]
    assert 0 < motion["samples"]["deviation"]["shape"][0] < 23


def test_without_a_mechanism_or_without_its_motion_the_reason_is_told():
    motion, reasons = motion_data(lambda length: length, Space(INPUTS))
    assert motion is None
    assert "no animation" in reasons[0]

    def fail(length):
        raise ValueError("no such length")

    response = fb.dynamic_response(fail, duration=1.0, step=0.1)
    motion, reasons = motion_data(response, Space({"length": fb.Interval(1.0, 2.0)}))
    assert motion is None
    assert "no such length" in reasons[-1]


def test_a_mechanism_at_rest_has_one_instant():
    def hanging(stiffness):
        return fb.Mechanism(
            bodies={"m": fb.PointMass(mass=1.0, position=(0.0, -1.0))},
            loads={
                "spring": fb.Spring("m", (0.0, 0.0), stiffness, rest_length=1.0),
                "side": fb.Spring("m", (-1.0, -1.1), 10.0, rest_length=1.0),
                "gravity": fb.Gravity(),
            },
        )

    space = Space({"stiffness": fb.Interval(90.0, 110.0)})
    motion, reasons = motion_data(fb.static_response(hanging), space)
    assert reasons == []
    assert motion is not None
    (number,) = points(motion, "body 'm'")
    assert motion["times"]["shape"] == [1]
    assert -1.099 < unpack(motion["position"])[number, 1, 0] < -1.09
    assert np.ptp(unpack(motion["samples"]["deviation"])[:, 0, 1, 0]) == pytest.approx(0.02, 0.1)


def test_a_drive_that_ends_is_drawn():
    """A road of which nothing is known after its end has a direction all the same."""

    def travel(t):
        if t > 1.0:
            raise fb.errors.InputError("the road ends")
        return 0.0

    mass = fb.PointMass(mass=1.0)
    model = fb.Mechanism(
        bodies={"m": mass}, joints={"drive": fb.PrescribedTravel("m", (0.0, 0.0), travel)}
    )
    fb.draw(model)


def test_the_motion_of_a_study_has_its_discretization_and_first_options():
    def pendulum(length, height):
        beam = fb.Beam(length=length, height=height, width=0.01, density=1000.0,
                       youngs_modulus=1e9, poissons_ratio=0.3, retardation_time=1e-2)  # fmt: skip
        return fb.Mechanism(
            bodies={"beam": beam},
            joints={"hinge": fb.Revolute("beam.start", (0.0, 0.0))},
            loads={"gravity": fb.Gravity()},
            sensors={"tip": fb.Position("beam.end")},
        )

    inputs = {"length": fb.Interval(0.49, 0.51), "height": fb.Choice(0.02, 0.01)}
    response = fb.dynamic_response(pendulum, duration=0.1, output_step=0.01)
    study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.05))
    surrogate = study.expand()
    motion, reasons = study_motion(study, surrogate, samples=4)
    assert motion is not None
    assert reasons == ["The animation is that of height = 0.02."]
    axis, nodes, half = beam_of(motion, "beam")
    assert half[0] == pytest.approx(0.01, rel=1e-7)
    first = surrogate.surrogates["0.02"]
    elements = int(first.diagnostics.attrs["discretization"].rpartition(" ")[2])
    assert len(nodes) - 1 == elements
    nominal = unpack(motion["position"])[axis[-1]]
    mean = first.bands()["mean"].sel(output="tip_Y")
    lower, upper = mean.values
    slack = 1e-3 + (upper - lower)
    assert (nominal[1] > lower - slack).all()
    assert (nominal[1] < upper + slack).all()


def test_a_study_whose_runs_take_long_shows_the_nominal_motion_alone():
    study = fb.Study(RESPONSE, INPUTS, fb.PCCI(1, 1))

    def drawing_of(seconds):
        record = given_by(study, INPUTS, None, None, seconds=seconds)
        motion = record.get("motion")
        samples = motion["samples"]["deviation"]["shape"][0] if motion else None
        return samples, motion and motion["times"], record["hidden"]

    samples, times, hidden = drawing_of(0.1)
    assert (samples, hidden) == (23, [])
    assert drawing_of(4.2)[:2] == (0, times)
    assert drawing_of(4.2)[2] == [
        "The motion is the nominal one, without samples of the inputs, since a run takes 4.2 s on "
        "average."
    ]
    assert drawing_of(75.0) == (
        None,
        None,
        ["The motion is not shown, since a run takes 75 s on average."],
    )
