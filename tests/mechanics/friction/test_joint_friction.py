"""Friction of pins, guides and slots with their own reactions, against exact solutions."""

import numpy as np
import pytest

import flexband as fb
from flexband.contact import FrictionForce

G = 9.81


def simulate(model, duration, count=20, tolerance=1e-10):
    integrator = fb.GeneralizedAlpha(step_tolerance=tolerance, spectral_radius=1.0)
    return fb.simulate(model, duration=duration, step=duration / count, integrator=integrator)


def arm(mu, r):
    """The friction of a pin acts at r sin(arctan µ) from its axis."""
    return r * float(np.sin(np.arctan(mu)))


def test_a_flywheel_on_a_rough_pin_spins_down():
    """The moment of friction is that of its weight at the arm of friction."""
    mass = 10.0
    inertia = 0.5
    rate = 20.0
    mu = 0.3
    r = 0.1
    model = fb.Mechanism(
        bodies={"wheel": fb.RigidBody(mass=mass, inertia=inertia, rate=rate)},
        joints={"axle": fb.Revolute("wheel", (0.0, 0.0), friction=mu, radius=r)},
        loads={"g": fb.Gravity()},
        sensors={"w": fb.AngularVelocity("wheel"), "M": FrictionForce("axle", angular=True),
                 "R": fb.Reaction("axle")},
    )  # fmt: skip
    moment = arm(mu, r) * mass * G
    stops = inertia * rate / moment
    motion = simulate(model, 1.2 * stops)
    t = motion["time"].values
    w = motion.sel(output="w").values
    np.testing.assert_allclose(w, rate * np.maximum(1 - t / stops, 0.0), rtol=0, atol=2e-5)
    assert np.abs(w[t > 1.001 * stops]).max() < 1e-13
    M = np.abs(motion.sel(output="M").values)
    np.testing.assert_allclose(M[t < stops], moment, rtol=1e-9)
    np.testing.assert_allclose(M[t > 1.001 * stops], 0.0, rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion.sel(output="R_Y"), mass * G, rtol=1e-9)


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_sheave_turns_from_the_ratio_of_its_ropes_on(share):
    """T₁/T₂ = (R + r_f)/(R − r_f) for parallel ropes, whose pin bears T₁ + T₂."""
    R = 0.2
    r = 0.04
    mu = 0.4
    second = 100.0
    inertia = 0.1
    ratio = (R + arm(mu, r)) / (R - arm(mu, r))
    first = share * ratio * second
    model = fb.Mechanism(
        bodies={"sheave": fb.RigidBody(mass=1.0, inertia=inertia)},
        joints={"pin": fb.Revolute("sheave", (0.0, 0.0), friction=mu, radius=r)},
        loads={"ropes": fb.Force("sheave", y=-(first + second)),
               "moment": fb.Moment("sheave", R * (first - second))},
        sensors={"angle": fb.Angle("sheave")},
    )  # fmt: skip
    angle = simulate(model, 1.0).sel(output="angle").values
    if share < 1:
        assert np.abs(angle).max() < 1e-13
    else:
        moment = R * (first - second) - arm(mu, r) * (first + second)
        assert angle[-1] == pytest.approx(0.5 * moment / inertia, rel=1e-5)


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_a_bracket_on_a_post_jams_from_its_arm_on(share):
    """A load at an arm a from a thin post: 2 µ F a/ℓ holds F where a ≥ ℓ/(2 µ)."""
    mu = 0.25
    length = 0.2
    force = 50.0
    mass = 1.0
    place = share * length / (2 * mu)
    model = fb.Mechanism(
        bodies={"bracket": fb.RigidBody(
            mass=mass, inertia=0.01, points={"load": (place, 0.0)})},
        joints={"post": fb.Prismatic(
            "bracket", (0.0, 0.0), (0.0, 1.0), friction=mu, length=length)},
        loads={"load": fb.Force("bracket.load", y=-force)},
        sensors={"x": fb.Position("bracket"), "F": FrictionForce("post")},
    )  # fmt: skip
    motion = simulate(model, 0.2)
    y = motion.sel(output="x_Y").values
    if share > 1:
        assert np.abs(y).max() < 1e-13
        np.testing.assert_allclose(np.abs(motion.sel(output="F")), force, rtol=1e-9)
    else:
        assert y[-1] == pytest.approx(-0.5 * force * (1 - share) / mass * 0.2**2, rel=1e-5)


def test_a_slot_rubs_by_its_one_reaction():
    """A disc on a slot's pin, thrown along it: u̇ = −µ g, and the disc does not turn."""
    model = fb.Mechanism(
        bodies={"disc": fb.RigidBody(mass=2.0, inertia=0.1, velocity=(1.0, 0.0))},
        joints={"slot": fb.Slot("disc", (0.0, 0.0), friction=0.3)},
        loads={"g": fb.Gravity()},
        sensors={"x": fb.Position("disc"), "F": FrictionForce("slot"), "a": fb.Angle("disc")},
    )
    motion = simulate(model, 0.5)
    t = np.minimum(motion["time"].values, 1.0 / (0.3 * G))
    np.testing.assert_allclose(motion.sel(output="x_X"), t - 0.15 * G * t**2, rtol=0, atol=1e-8)
    assert np.abs(motion.sel(output="a")).max() < 1e-13


def test_friction_of_a_force_that_grows_is_that_of_each_instant():
    """A block pulled along a slot by P and pressed by N + c t: x = P t²/2 − µ (N t²/2 + c t³/6)."""
    pull = 20.0
    normal = 10.0
    growth = 200.0
    mu = 0.3
    model = fb.Mechanism(
        bodies={"m": fb.RigidBody(mass=1.0, inertia=0.01)},
        joints={"slot": fb.Slot("m", (0.0, 0.0), friction=mu)},
        loads={"f": fb.Force("m", x=pull, y=lambda t: -(normal + growth * np.asarray(t)))},
        sensors={"x": fb.Position("m")},
    )
    motion = simulate(model, 0.1, 5)
    t = motion["time"].values
    exact = pull * t**2 / 2 - mu * (normal * t**2 / 2 + growth * t**3 / 6)
    np.testing.assert_allclose(motion.sel(output="x_X"), exact, rtol=0, atol=1e-6)


def test_a_crank_passes_the_dead_centres_of_a_rough_slider():
    """The slider's speed is zero there, but a crank that turns cannot stop it."""
    r = 0.1
    length = 0.3
    rate = 20.0
    inertia = 0.05
    reach = float(np.sqrt(length**2 - r**2))
    model = fb.Mechanism(
        bodies={
            "crank": fb.RigidBody(
                mass=1.0, inertia=inertia, rate=rate, angle=np.pi / 2, points={"end": (r, 0.0)}
            ),
            "slider": fb.RigidBody(
                mass=0.5, inertia=1e-3, position=(reach, 0.0), velocity=(-r * rate, 0.0)
            ),
        },
        joints={
            "O": fb.Revolute("crank", (0.0, 0.0)),
            "rod": fb.Distance("crank.end", "slider", length),
            "guide": fb.Slot("slider", (0.0, 0.0), friction=1e-3),
        },
        loads={"press": fb.Force("slider", y=-20.0)},
        sensors={"a": fb.Angle("crank"), "E": fb.KineticEnergy(), "F": FrictionForce("guide")},
    )
    motion = simulate(model, 0.4, 40)
    energy = motion.sel(output="E").values
    turn = motion.sel(output="a").values[-1] - np.pi / 2
    assert turn > 2 * np.pi
    assert 0 < energy[0] - energy[-1] < 2 * 1e-3 * 60.0 * 0.2 * (turn / np.pi + 1)


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("ratio", [0.5, 0.9, 0.99, 1.01])
def test_a_rod_whose_end_slides_has_the_reaction_of_its_equations_until_it_jams(ratio, sense):
    """N (1 − κ) = N₀ with κ = µ sc/(s² + J/mℓ²); for |κ| > 1 there are two solutions or none."""
    m = 2.0
    length = 0.5
    inertia = 0.02
    angle = 0.4
    s = np.sin(angle)
    c = np.cos(angle)
    per_mu = s * c / (s * s + inertia / (m * length**2))
    rod = fb.RigidBody(
        mass=m, inertia=inertia, angle=angle, position=(-length * s, length * c),
        velocity=(3.0 * sense, 0.0), points={"tip": (0.0, -length)},
    )  # fmt: skip
    model = fb.Mechanism(
        bodies={"rod": rod},
        joints={"tip": fb.Slot("rod.tip", (0.0, 0.0), friction=ratio / per_mu)},
        loads={"g": fb.Gravity()},
        sensors={"N": fb.Reaction("tip")},
    )
    if ratio > 1:
        with pytest.raises(fb.errors.RunError, match="friction of 'tip' jams"):
            fb.simulate(model, duration=1e-3, step=1e-3)
        return
    motion = fb.simulate(model, duration=1e-3, step=1e-3)
    frictionless_force = m * 9.81 / (1.0 + m * length**2 * s * s / inertia)
    assert float(motion.sel(output="N_Y")[0]) == pytest.approx(
        frictionless_force / (1 - sense * ratio), rel=1e-9
    )
