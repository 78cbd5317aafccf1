"""Discs that slide until they roll, against exact solutions."""

import numpy as np
import pytest

import flexband as fb
from flexband.contact import CircleOnLine, Contact, FrictionForce, KeepsRestitution

G = 9.81
RADIUS = 0.1
STIFFNESS = 1e6


def disc(mu, share, *, velocity, rate=0.0, angle=0.0):
    """A disc of 1 kg and the inertia share · m r² that lies on a slope, and its motion."""
    normal = np.array([np.sin(angle), np.cos(angle)])
    place = normal * (RADIUS - G * np.cos(angle) / STIFFNESS)
    down = np.array([np.cos(angle), -np.sin(angle)])
    law = KeepsRestitution(stiffness=STIFFNESS, exponent=1.0)
    ground = CircleOnLine(radius=RADIUS, normal=(float(normal[0]), float(normal[1])))
    model = fb.Mechanism(
        bodies={"disc": fb.RigidBody(
            mass=1.0, inertia=share * RADIUS**2, position=place, rate=rate,
            velocity=velocity * down,
        )},
        loads={"g": fb.Gravity(), "ground": Contact(
            "disc", (0.0, 0.0), ground, law, friction=mu, closed_at_start=True)},
        sensors={"v": fb.Velocity("disc"), "w": fb.AngularVelocity("disc"),
                 "F": FrictionForce("ground")},
    )  # fmt: skip

    def simulate(duration, count=20):
        integrator = fb.GeneralizedAlpha(step_tolerance=1e-9, spectral_radius=1.0)
        motion = fb.simulate(model, duration=duration, step=duration / count, integrator=integrator)
        along = down @ motion.sel(output=["v_X", "v_Y"]).values
        return motion, motion["time"].values, along, motion.sel(output="w").values

    return simulate


@pytest.mark.parametrize(("share", "factor"), [(0.4, 2 / 7), (0.5, 1 / 3)])
def test_a_ball_and_a_disc_roll_when_friction_has_stopped_their_sliding(share, factor):
    """From t = 2 v₀/(7 µ g) and v₀/(3 µ g) on, with 5/7 and 2/3 of the speed."""
    mu = 0.2
    speed = 1.0
    rolls = factor * speed / (mu * G)
    motion, t, v, w = disc(mu, share, velocity=speed)(1.5 * rolls, 30)
    exact = np.maximum(speed - mu * G * t, speed * (1 - factor))
    np.testing.assert_allclose(v, exact, rtol=0, atol=2e-6)
    np.testing.assert_allclose(w, np.maximum(-mu * G / share / RADIUS * t, -exact[-1] / RADIUS),
                               rtol=0, atol=1e-4)  # fmt: skip
    rolling = t > 1.01 * rolls
    assert np.abs(motion.sel(output="F_speed").values[rolling]).max() < 1e-11
    assert np.abs(motion.sel(output="F").values[rolling]).max() < 1e-6
    energy = 0.5 * (v**2 + share * (RADIUS * w) ** 2)
    sliding_distance = speed * rolls / 2  # the mean sliding speed is half of the first
    assert energy[0] - energy[-1] == pytest.approx(mu * G * sliding_distance, rel=1e-5)


@pytest.mark.parametrize("share", [0.4, 1.0])
def test_a_slope_that_is_too_steep_lets_what_rolls_slide(share):
    """It rolls, at g sin α/(1 + share), if tan α ≤ µ (1 + 1/share)."""
    mu = 0.2
    limit = np.arctan(mu * (1 + 1 / share))
    for angle, sticks in ((0.98 * limit, True), (1.02 * limit, False)):
        motion, t, v, _ = disc(mu, share, velocity=0.0, angle=angle)(0.3)
        pull = G * np.sin(angle)
        exact = pull / (1 + share) if sticks else pull - mu * G * np.cos(angle)
        np.testing.assert_allclose(v, exact * t, rtol=0, atol=1e-5)
        speed = np.abs(motion.sel(output="F_speed").values[1:])
        assert (speed.max() < 1e-11) if sticks else (speed.min() > 1e-5)


def test_a_disc_with_backspin_comes_back():
    """It rolls at (v₀ − s r ω₀)/(1 + s), where s m r² is its inertia."""
    share = 0.5
    mu = 0.3
    speed = 0.5
    spin = 20.0
    rolls = (speed - share * RADIUS * spin) / (1 + share)
    _, _, v, _ = disc(mu, share, velocity=speed, rate=spin)(0.8)
    assert v[-1] == pytest.approx(rolls, abs=1e-6)
    assert rolls < 0 < v[0]
