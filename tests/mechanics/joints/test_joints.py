"""Joints, drives and gears against closed forms."""

import numpy as np
import pytest

import flexband as fb
from tests.mechanics.models import ROD, gears, motion_of, pendulum_driven, rigid_slider_crank, wheel

INERTIA = (1.0 + 0.05**2) / 12  # about its centre


def test_pin_in_a_turning_slot():
    """Seen from the slot x″ = ω² x."""
    arm = fb.RigidBody(mass=1.0, inertia=1.0)
    motion = motion_of(
        bodies={"arm": arm, "pin": fb.PointMass(mass=0.3, position=(0.2, 0.0))},
        joints={
            "axle": fb.Revolute("arm", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("arm", lambda t: 4.0 * t),
            "slot": fb.Slot("pin", "arm", axis=(2.0, 0.0)),
        },
        sensors={
            "pin": fb.Position("pin"),
            "F": fb.Reaction("slot"),
            "M": fb.ReactionMoment("motor"),
        },
    )
    # The pin starts with no speed along the slot: r = 0.2 cosh ωt.
    t = motion.time.values
    r = np.hypot(motion.sel(output="pin_X"), motion.sel(output="pin_Y"))
    np.testing.assert_allclose(r, 0.2 * np.cosh(4 * t), rtol=2e-5)
    coriolis = 2 * 0.3 * 4.0 * 0.2 * 4.0 * np.sinh(4 * t)  # 2 m ω ṙ, across the slot
    np.testing.assert_allclose(motion.sel(output="M")[200:], (coriolis * r)[200:], rtol=1e-3)
    across = motion.sel(output="F_Y") * np.cos(4 * t) - motion.sel(output="F_X") * np.sin(4 * t)
    np.testing.assert_allclose(across[200:], coriolis[200:], rtol=1e-3)


def test_welded_bars_fall_as_one():
    """An L of two bars on a pin: small oscillations have the compound pendulum's period."""
    motion = motion_of(
        duration=2.0,
        step=1e-3,
        bodies={
            "a": fb.RigidBody.bar(**ROD, angle=-np.pi / 2 + 0.01),
            "b": fb.RigidBody.bar(
                **ROD, start=(np.sin(0.01), -np.cos(0.01)), angle=-np.pi / 2 + 0.01
            ),
        },
        joints={
            "pin": fb.Revolute("a.start", (0.0, 0.0)),
            "weld": fb.Weld("b.start", "a.end"),
        },
        loads={"gravity": fb.Gravity()},
        sensors={"angle": fb.Angle("b"), "M": fb.ReactionMoment("weld")},
    )
    inertia = 2 * INERTIA + 0.5**2 + 1.5**2
    w = np.sqrt(2 * 9.81 * 1.0 / inertia)
    swing = motion.sel(output="angle").values + np.pi / 2
    np.testing.assert_allclose(swing, 0.01 * np.cos(w * motion.time), atol=1e-6)
    # Moment on b at its start: J α of b about it, less gravity's and the start's acceleration.
    alpha = -(w**2) * 0.01
    exact = (INERTIA + 0.25 + 0.5) * alpha + 9.81 * 0.5 * 0.01
    assert float(motion.sel(output="M")[0]) == pytest.approx(exact, rel=1e-3)


def test_prescribed_path_needs_the_force_of_its_acceleration():
    motion = motion_of(
        bodies={"m": fb.PointMass(mass=0.5, position=(0.3, 0.0))},
        joints={"path": fb.PrescribedPath("m", lambda t: 0.3 * np.cos(5 * t), lambda t: t**3)},
        sensors={"F": fb.Reaction("path")},
    )
    t = motion.time.values
    np.testing.assert_allclose(
        motion.sel(output="F_X")[100:], (-3.75 * np.cos(5 * t))[100:], atol=1e-4
    )
    np.testing.assert_allclose(motion.sel(output="F_Y")[100:], (3 * t)[100:], atol=1e-4)


def test_prescribed_travel_along_a_slanted_line():
    motion = motion_of(
        bodies={"m": fb.PointMass(mass=1.0)},
        joints={
            "line": fb.Slot("m", (0.0, 0.0), axis=(3.0, 4.0)),
            "drive": fb.PrescribedTravel("m", (0.0, 0.0), lambda t: t**2, axis=(3.0, 4.0)),
        },
        sensors={"m": fb.Position("m"), "F": fb.Reaction("drive")},
    )
    end = motion.isel(time=-1)
    np.testing.assert_allclose(end.sel(output=["m_X", "m_Y"]), [0.6 * 0.25, 0.8 * 0.25], atol=1e-9)
    np.testing.assert_allclose(end.sel(output=["F_X", "F_Y"]), [1.2, 1.6], rtol=1e-6)


@pytest.mark.parametrize("second", [0.3, -0.5])
def test_a_gear_pair_driven_by_a_moment(second):
    """(J₁ + J₂ (r₁/r₂)²) α = T, the tooth force is J₂ α r₁/r₂²; a ring gear turns the same way."""
    r1 = 0.1
    r2 = second
    J1 = 0.4
    J2 = 2.0
    T = np.array([1.0, 5.0])
    bodies, joints = gears((r1, r2), (J1, J2))
    model = fb.Mechanism(
        bodies=bodies, joints=joints, loads={"T": fb.Moment("1", T)},
        sensors={"a": fb.Angle("1"), "b": fb.Angle("2"), "F": fb.Reaction("mesh"),
                 "A": fb.Reaction("A"), "W": fb.Work("T"), "E": fb.KineticEnergy()},
    )  # fmt: skip
    motion = fb.simulate(model, duration=2.0, step=1e-3)
    t = motion["time"].values
    alpha = T / (J1 + J2 * (r1 / r2) ** 2)
    turn = 0.5 * alpha[:, None] * t**2
    assert turn.max() > 2 * np.pi
    np.testing.assert_allclose(motion.sel(output="a") - 0.3, turn, atol=1e-4 * turn.max())
    np.testing.assert_allclose(
        motion.sel(output="b") + 0.5, -turn * r1 / r2, atol=1e-4 * turn.max()
    )
    tooth = -J2 * alpha * r1 / r2**2  # on the first gear, against its turning
    steady_motion = motion.sel(time=slice(0.1, None))
    exact = np.broadcast_to(tooth[:, None], steady_motion.sel(output="F_Y").shape)
    np.testing.assert_allclose(steady_motion.sel(output="F_Y"), exact, rtol=1e-3)
    np.testing.assert_allclose(steady_motion.sel(output="A_Y"), -exact, rtol=1e-3)
    np.testing.assert_allclose(steady_motion.sel(output="F_X"), 0.0, atol=1e-6)
    np.testing.assert_allclose(motion.sel(output="W"), motion.sel(output="E"), rtol=1e-3, atol=1e-4)


def test_a_planetary_gear():
    """Sun driven, ring fixed: the arm turns at ω_sun r_s/(r_s + r_r), the planet by Willis."""
    sun = 0.1
    planet = 0.05
    ring = sun + 2 * planet
    arm = fb.RigidBody.bar(length=sun + planet, height=0.01, width=0.01, density=1000.0)
    model = fb.Mechanism(
        bodies={
            "sun": wheel(), "arm": arm,
            "planet": wheel(position=(sun + planet, 0.0)), "ring": wheel(),
        },
        joints={
            "S": fb.Revolute("sun", (0.0, 0.0)),
            "A": fb.Revolute("arm.start", (0.0, 0.0)),
            "P": fb.Revolute("planet", "arm.end"),
            "R": fb.Weld("ring", (0.0, 0.0)),
            "inner": fb.Gear("sun", "planet", sun, planet),
            "outer": fb.Gear("planet", "ring", planet, -ring),
            "motor": fb.PrescribedRotation("sun", lambda t: 30.0 * t),
        },
        sensors={"arm": fb.Angle("arm"), "planet": fb.Angle("planet")},
    )  # fmt: skip
    assert "0 degrees of freedom" in fb.describe(model)
    motion = fb.simulate(model, duration=2.0, step=1e-3)
    t = motion["time"].values
    arm_turn = 30.0 * t * sun / (sun + ring)
    np.testing.assert_allclose(motion.sel(output="arm"), arm_turn, atol=1e-8)
    exact = arm_turn - (30.0 * t - arm_turn) * sun / planet
    np.testing.assert_allclose(motion.sel(output="planet"), exact, atol=1e-7)


@pytest.mark.parametrize("radius", [0.2, -0.2])
def test_a_rack_and_pinion(radius):
    """A pinion on a fixed centre pulls its rack along: (J + m r²) α = T."""
    J = 0.5
    m = 3.0
    T = 2.0
    tilt = 0.6
    c = np.cos(tilt)
    s = np.sin(tilt)
    rack = fb.RigidBody(mass=m, inertia=0.1, position=(radius * s, -radius * c), angle=tilt)
    model = fb.Mechanism(
        bodies={"p": wheel(inertia=J, angle=1.0), "r": rack},
        joints={
            "pin": fb.Revolute("p", (0.0, 0.0)),
            "guide": fb.Prismatic("r", (radius * s, -radius * c), axis=(c, s), angle=tilt),
            "mesh": fb.Rack("p", "r", radius),
        },
        loads={"T": fb.Moment("p", T)},
        sensors={"a": fb.Angle("p"), "r": fb.Position("r"), "F": fb.Reaction("mesh"),
                 "M": fb.ReactionMoment("mesh")},
    )  # fmt: skip
    motion = fb.simulate(model, duration=2.0, step=1e-3)
    t = motion["time"].values
    alpha = T / (J + m * radius**2)
    turn = 0.5 * alpha * t**2
    np.testing.assert_allclose(motion.sel(output="a") - 1.0, turn, atol=1e-4 * turn.max())
    way = radius * turn
    np.testing.assert_allclose(motion.sel(output="r_X") - radius * s, way * c, atol=1e-4)
    np.testing.assert_allclose(motion.sel(output="r_Y") + radius * c, way * s, atol=1e-4)
    steady_motion = motion.sel(time=slice(0.1, None))
    force = -m * radius * alpha
    np.testing.assert_allclose(steady_motion.sel(output="F_X"), force * c, rtol=1e-3)
    np.testing.assert_allclose(steady_motion.sel(output="M"), force * radius, rtol=1e-3)


def test_a_rolling_wheel():
    """A wheel on a slope rolls with g sin β/(1 + J/mr²): the rack is the ground."""
    m = 2.0
    J = 0.03
    r = 0.2
    slope = 0.3
    c = np.cos(-slope)
    s = np.sin(-slope)
    disc = fb.RigidBody(mass=m, inertia=J, position=(-r * s, r * c))
    model = fb.Mechanism(
        bodies={"w": disc},
        joints={
            "height": fb.Slot("w", (-r * s, r * c), axis=(c, s)),
            "roll": fb.Rack("w", (0.0, 0.0), r, axis=(c, s)),
        },
        loads={"g": fb.Gravity()},
        sensors={"w": fb.Position("w"), "a": fb.Angle("w"), "W": fb.Work("roll"),
                 "E": fb.KineticEnergy()},
    )  # fmt: skip
    motion = fb.simulate(model, duration=1.5, step=1e-3)
    t = motion["time"].values
    way = 0.5 * 9.81 * np.sin(slope) / (1 + J / (m * r**2)) * t**2
    np.testing.assert_allclose(motion.sel(output="w_X"), -r * s + way * c, atol=1e-4)
    np.testing.assert_allclose(motion.sel(output="a"), -way / r, rtol=2e-5, atol=1e-6)
    # friction does no work: what it takes from the travel it gives to the rotation
    energy = float(motion.sel(output="E").max())
    np.testing.assert_allclose(motion.sel(output="W"), 0.0, atol=1e-9 * energy)


def test_a_drive_may_turn_round_many_times():
    model = pendulum_driven(lambda t: 200 * t, sensors={"a": fb.Position("a")})
    fb.simulate(model, duration=0.5, step=1e-3)


def test_drives_may_differ_between_samples():
    speeds = np.array([3.0, 4.0, 5.0])
    batch = fb.simulate(rigid_slider_crank(angle=lambda t: speeds * t), duration=0.1, step=1e-3)
    for k, speed in enumerate(speeds):
        single_run = fb.simulate(rigid_slider_crank(angle=lambda t, w=speed: w * t),
                          duration=0.1, step=1e-3)  # fmt: skip
        np.testing.assert_allclose(
            batch[k], single_run, rtol=0, atol=1e-9 * np.abs(single_run).max()
        )


@pytest.mark.parametrize(
    ("build", "text"),
    [
        (lambda: fb.Weld("a", "b", angle=np.nan), "Weld angle"),
        (lambda: fb.Slot("a", "b", axis=(0.0, 0.0)), "Slot axis must have a length"),
        (lambda: fb.Distance("a", "b", 0.0), "Distance length .* must be positive; got 0"),
        (lambda: fb.PrescribedPath("a", 1.0, np.sin), "path x must be a function|Path x must"),
        (lambda: fb.PrescribedTravel("a", "b", 2.0), "travel must be a function of time; got 2.0"),
        (lambda: fb.Gear("a", "b", 0.1, -0.1), "Gear radii"),
        (lambda: fb.Gear("a", "b", 0.0, 0.1), "Gear radii"),
        (lambda: fb.Rack("a", "b", 0.0), "Rack radius"),
        (lambda: fb.Rack("a", "b", 0.1, axis=(0.0, 0.0)), "Rack axis must have a length"),
        (lambda: fb.Prismatic("a", "b", axis=(0.0, 0.0)), "axis must have a length"),
        (lambda: fb.PrescribedRotation("a", 3.0), "function of time; got 3.0"),  # type: ignore
    ],
)
def test_bad_joints_are_refused(build, text):
    with pytest.raises(fb.errors.InputError, match=text):
        build()
