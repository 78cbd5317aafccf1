"""Drives between moving bodies against closed forms and Newton–Euler equations."""

import numpy as np
import pytest

import flexband as fb
from tests.mechanics.models import motion_of

LENGTHS = (0.5, 0.4, 0.3)
MASSES = (3.0, 2.0, 1.0)
INERTIAS = (0.08, 0.04, 0.01)
GRAVITY = 9.81


def turns(k):
    """Return a motor's angle: three turns and a half, from rest, with a wobble."""
    return lambda t: (
        0.3 * k + (-1) ** k * (7 * np.pi * t**3 * (4 - 3 * t) + 0.2 * np.sin(5 * k * t) ** 2)
    )


def arm(drives):
    """Return three links in a chain, each with a motor on the one before."""
    bodies = {}
    joints = {}
    sensors = {"hand": fb.Position("link2.end"), "turn": fb.Angle("link2")}
    for k, (length, mass, inertia) in enumerate(zip(LENGTHS, MASSES, INERTIAS, strict=True)):
        bodies[f"link{k}"] = fb.RigidBody(
            mass=mass,
            inertia=inertia,
            points={"start": (0.0, 0.0), "end": (length, 0.0)},
            center=(length / 2, 0.0),
            angle=sum(float(drive(0.0)) for drive in drives[: k + 1]),
        )
        before = f"link{k - 1}.end" if k else (0.0, 0.0)
        joints[f"pin{k}"] = fb.Revolute(f"link{k}.start", before)
        joints[f"motor{k}"] = fb.PrescribedRotation(f"link{k}", before, drives[k])
        sensors |= {
            f"M{k}": fb.ReactionMoment(f"motor{k}"),
            f"P{k}": fb.sensors.Power(f"motor{k}"),
            f"W{k}": fb.Work(f"motor{k}"),
        }
    return fb.Mechanism(
        bodies=bodies, joints=joints, loads={"gravity": fb.Gravity()}, sensors=sensors
    )


def torques(theta, rate, change):
    """Return the torques of the motors by the recursion of Newton and Euler, shape (3, times)."""
    angle, w, dw = (np.cumsum(rows, axis=0) for rows in (theta, rate, change))
    # From the base to the hand: accelerations of the centres, and the links as vectors.
    place = np.zeros((2, angle.shape[1]))
    force = np.array([[0.0], [GRAVITY]])
    accelerations = []
    ends = []
    for k, length in enumerate(LENGTHS):
        along = np.stack([np.cos(angle[k]), np.sin(angle[k])])
        across = np.stack([-along[1], along[0]])
        pull = length * (dw[k] * across - w[k] ** 2 * along)
        accelerations.append(force + place + pull / 2)
        place = place + pull
        _ = ends.append(along * length)
    # From the hand to the base: forces and moments that each joint carries.
    load = np.zeros_like(place)
    moment = np.zeros(angle.shape[1])
    moments = []
    for k in (2, 1, 0):
        link_force = MASSES[k] * accelerations[k]
        x, y = ends[k]
        moment = moment + INERTIAS[k] * dw[k]
        moment = moment + x * (load[1] + link_force[1] / 2) - y * (load[0] + link_force[0] / 2)
        load = load + link_force
        moments.insert(0, moment)
    return np.stack(moments)


def test_three_motors_move_an_arm():
    """Torque, power and work of each motor; every joint turns three times and a half."""
    drives = [turns(k) for k in range(3)]
    motion = fb.simulate(arm(drives), duration=1.0, step=5e-4)
    t = motion.time.values
    d = 1e-4
    theta, theta_after, theta_before = (
        np.stack([drive(t + shift) for drive in drives]) for shift in (0.0, d, -d)
    )
    rate = (theta_after - theta_before) / (2 * d)
    change = (theta_after - 2 * theta + theta_before) / d**2
    expected = torques(theta, rate, change)
    for k in range(3):
        size = np.abs(expected[k]).max()
        power = expected[k] * rate[k]
        np.testing.assert_allclose(motion.sel(output=f"M{k}"), expected[k], atol=2e-6 * size)
        np.testing.assert_allclose(
            motion.sel(output=f"P{k}"), power, atol=2e-6 * np.abs(power).max()
        )
        work = np.trapezoid(power, t)
        np.testing.assert_allclose(motion.sel(output=f"W{k}")[-1], work, rtol=5e-4)
    np.testing.assert_allclose(motion.sel(output="turn"), theta.sum(axis=0), atol=1e-9)


@pytest.mark.filterwarnings("ignore:left out")
def test_motor_held_in_modes_and_statics():
    """With its motors at rest the arm is rigid; a spring instead of one makes a pendulum."""
    drives = [lambda t: -np.pi / 2 + 0.0 * t, lambda t: 0.0 * t, lambda t: np.pi / 2 + 0.0 * t]
    mechanism = arm(drives)
    at_rest = fb.equilibrium(mechanism)
    np.testing.assert_allclose(at_rest.sel(output=["hand_X", "hand_Y"]), [0.3, -0.9], atol=1e-12)
    moment = GRAVITY * MASSES[2] * 0.15  # of the last link about all three motors
    for k in range(3):
        assert at_rest.sel(output=f"M{k}") == pytest.approx(moment, rel=1e-9)
    remaining_joints = {name: joint for name, joint in mechanism.joints.items() if name != "motor0"}
    pendulum = fb.Mechanism(
        bodies=mechanism.bodies,
        joints=remaining_joints,
        loads={"spring": fb.TorsionSpring("link0", stiffness=50.0, rest_angle=-np.pi / 2)},
        sensors={"turn": fb.Angle("link0")},
    )
    places = (0.25, 0.7, np.hypot(0.9, 0.15))  # of the centres
    inertia = sum(INERTIAS) + sum(m * x**2 for m, x in zip(MASSES, places, strict=True))
    frequency = fb.modes(pendulum, 1)["frequency"]
    assert frequency.item() == pytest.approx(np.sqrt(50.0 / inertia) / (2 * np.pi), rel=1e-9)


def test_motor_between_flexible_sections():
    """A motor turns the section of a beam against that of another; moments on both."""
    beam = {"length": 1.0, "height": 0.02, "width": 0.02, "density": 7800.0, "elements": 2}
    beam |= {"youngs_modulus": 2e11, "poissons_ratio": 0.3}
    mechanism = fb.Mechanism(
        bodies={"a": fb.Beam(**beam), "b": fb.Beam(**beam, start=(1.0, 0.0))},
        joints={
            "root": fb.Weld("a.start", (0.0, 0.0)),
            "pin": fb.Revolute("b.start", "a.end"),
            "motor": fb.PrescribedRotation("b.start", "a.end", lambda t: 0.0 * t),
        },
        loads={"tip": fb.Force("b.end", y=-10.0)},
        sensors={
            "M": fb.ReactionMoment("motor"),
            "tip": fb.Position("b.end"),
            "inside": fb.SectionForces("a", "0.99"),
        },
    )
    rest = fb.equilibrium(mechanism)
    single_beam = fb.equilibrium(
        fb.Mechanism(
            bodies={"a": fb.Beam(**{**beam, "length": 2.0, "elements": 4})},
            joints={"root": fb.Weld("a.start", (0.0, 0.0))},
            loads={"tip": fb.Force("a.end", y=-10.0)},
            sensors={"tip": fb.Position("a.end")},
        )
    )
    np.testing.assert_allclose(
        rest.sel(output=["tip_X", "tip_Y"]), single_beam.sel(output=["tip_X", "tip_Y"]), atol=1e-9
    )
    lever = float(rest.sel(output="tip_X")) - 1.0
    assert rest.sel(output="M") == pytest.approx(10.0 * lever, rel=1e-3)


def boom(stroke, *, mass=2.0):
    """Return a boom of 1 m on a pin, and a cylinder of this length from its end to (1, 0)."""
    return fb.Mechanism(
        bodies={
            "boom": fb.RigidBody(
                mass=mass, inertia=0.3, points={"pin": (0.0, 0.0), "eye": (1.0, 0.0)}, angle=1.0
            )
        },
        joints={
            "pin": fb.Revolute("boom.pin", (0.0, 0.0)),
            "cylinder": fb.Distance("boom.eye", (1.0, 0.0), stroke),
        },
        sensors={
            "angle": fb.Angle("boom"),
            "rate": fb.AngularVelocity("boom"),
            "F": fb.Reaction("cylinder"),
            "end": fb.Acceleration("boom.eye"),
            "P": fb.sensors.Power("cylinder"),
        },
    )


def test_cylinder_lifts_a_boom():
    """ℓ = 2 sin(θ/2): the angle, its rates from the first instant on, force and power."""
    motion = fb.simulate(boom(lambda t: 1.0 + 0.3 * np.sin(3 * t)), duration=1.0, step=1e-3)
    t = motion.time.values
    length = 1 + 0.3 * np.sin(3 * t)
    speed = 0.9 * np.cos(3 * t)
    change = -2.7 * np.sin(3 * t)
    half = np.arcsin(length / 2)
    rate = speed / np.cos(half)
    angular = (change + speed * rate / 2 * np.tan(half)) / np.cos(half)
    pull = 0.3 * angular / np.cos(half)  # the cylinder's line is at cos(θ/2) from the pin
    eye = np.stack([np.cos(2 * half), np.sin(2 * half)])
    unit = (eye - [[1.0], [0.0]]) / length
    np.testing.assert_allclose(motion.sel(output="angle"), 2 * half, atol=1e-12)
    np.testing.assert_allclose(motion.sel(output="rate"), rate, atol=1e-10)
    np.testing.assert_allclose(motion.sel(output=["F_X", "F_Y"]), pull * unit, atol=1e-7)
    acceleration = angular * np.stack([-eye[1], eye[0]]) - rate**2 * eye
    np.testing.assert_allclose(motion.sel(output=["end_X", "end_Y"]), acceleration, atol=1e-6)
    np.testing.assert_allclose(motion.sel(output="P"), pull * speed, atol=1e-7)


def test_cylinder_goes_on_from_a_result():
    full_motion = fb.simulate(boom(lambda t: 1.0 + 0.3 * np.sin(3 * t)), duration=0.4, step=1e-3)
    first = fb.simulate(
        boom(lambda t: 1.0 + 0.3 * np.sin(3 * t)), duration=0.2, step=1e-3, keep_state=True
    )
    rest = fb.simulate(
        boom(lambda t: 1.0 + 0.3 * np.sin(3 * t)), duration=0.2, step=1e-3, start=first
    )
    np.testing.assert_allclose(
        rest.sel(output="angle")[-1], full_motion.sel(output="angle")[-1], atol=1e-9
    )


def test_wrong_lengths_are_refused():
    with pytest.raises(fb.errors.InputError, match=r"Distance length .m. must be positive; got -"):
        fb.simulate(boom(lambda t: 1.0 - 3.1 * t), duration=0.5, step=0.01)
    with pytest.raises(fb.errors.InputError, match="jumps"):
        fb.simulate(boom(lambda t: 1.0 + (t > 0.2)), duration=0.5, step=0.01)
    with pytest.raises(fb.errors.InputError, match="PrescribedRotation angle must be a function"):
        fb.PrescribedRotation("boom", "other")
    bodies = {"wheel": fb.RigidBody(mass=1.0, inertia=0.1), "bob": fb.PointMass(mass=1.0)}
    with pytest.raises(fb.errors.InputError, match="that rotate; 'bob' is a point mass"):
        fb.Mechanism(bodies=bodies, joints={"m": fb.PrescribedRotation("wheel", "bob", np.sin)})


@pytest.mark.parametrize("part", ["spring", "torsion", "law", "moment", "force", "gear"])
def test_power_is_the_rate_of_work(part):
    """Of loads on lengths, angles and points, and of a joint of angles."""

    def drag(t, x, v, p, force):
        force[0, 2] = -p[0] * v[0, 2]
        force[0, 0] = 1.0 + x[0, 0]

    def disc(x, rate):
        disc = {"radius": 0.2, "width": 0.01, "density": 500.0, "points": {"rim": (0.1, 0.0)}}
        return fb.RigidBody.disc(**disc, position=(x, 0.0), rate=rate)

    motion = motion_of(
        duration=0.5,
        step=5e-4,
        bodies={"a": disc(0.0, 3.0), "b": disc(0.4, -3.0)},
        joints={
            "axle": fb.Revolute("a", (0.0, 0.0)),
            "shaft": fb.Revolute("b", (0.4, 0.0)),
            "gear": fb.Gear("a", "b", 0.2, 0.2),
        },
        loads={
            "spring": fb.Spring("a.rim", (0.5, 0.5), stiffness=20.0, rest_length=0.3, damping=1.0),
            "torsion": fb.TorsionSpring("b", "a", stiffness=0.2, rest_angle=0.0),
            "law": fb.ForceLaw(["a.rim"], drag, (0.02,)),
            "moment": fb.Moment("b", lambda t: np.sin(9 * t)),
            "force": fb.Force("b.rim", y=0.4, following=True),
        },
        sensors={"P": fb.sensors.Power(part), "W": fb.Work(part)},
    )
    power = motion.sel(output="P").values
    work = motion.sel(output="W").values
    integral = np.cumsum((power[1:] + power[:-1]) / 2) * 5e-4
    size = np.ptp(work)
    if part == "gear":  # which passes on all that it takes
        size = 0.01
        np.testing.assert_allclose(power, 0.0, atol=1e-12)
    assert size > 1e-3
    np.testing.assert_allclose(integral, work[1:], atol=2e-5 * size)
