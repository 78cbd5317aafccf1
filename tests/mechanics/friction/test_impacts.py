"""Impacts beside friction: its impulse is that of Moreau's law, and zero without a normal one."""

import numpy as np
import pytest

import flexband as fb
from benchmarks.friction.impacts import judge_impact
from flexband import contact

G = 9.81


def wagons(friction):
    """A wagon of 3 kg at 2 m/s that a hook links at 0.2 s to one of 1 kg at rest."""
    return fb.Mechanism(
        bodies={
            "a": fb.PointMass(mass=3.0, velocity=(2.0, 0.0)),
            "b": fb.PointMass(mass=1.0, position=(1.0, 0.0)),
        },
        joints={
            "rail a": fb.Slot("a", (0.0, 0.0)),
            "rail b": fb.Slot("b", (0.0, 0.0), friction=friction),
            "hook": contact.Switched(fb.Distance("a", "b", 1.0), lambda t: t > 0.2),
        },
        loads={"g": fb.Gravity()},
        sensors={
            "v": fb.Velocity("b"),
            "lost": fb.sensors.SwitchingLoss("hook"),
            "T": fb.KineticEnergy(),
        },
    )


@pytest.mark.parametrize("static", [0.01, 0.5])
def test_a_rough_rail_does_not_stop_linked_wagons(static):
    mu = 0.01
    model = wagons(contact.Coulomb(kinetic=mu, static=static))
    motion = fb.simulate(model, duration=0.4, step=0.05)
    after_impact = motion["time"].values >= 0.2
    t = motion["time"].values[after_impact] - 0.2
    v = motion.sel(output="v_X").values[after_impact]
    np.testing.assert_allclose(v, 1.5 - mu * G * 1.0 / 4.0 * t, rtol=1e-7)
    np.testing.assert_allclose(motion.sel(output="lost").values[after_impact], 1.5, rtol=1e-9)
    np.testing.assert_allclose(motion.sel(output="T").values[after_impact], 2.0 * v**2, rtol=1e-9)


def test_a_brake_does_not_stop_a_wheel_that_a_gear_engages():
    """Before it the brake holds its wheel, after it the wheels turn with their common momentum."""
    model = fb.Mechanism(
        bodies={
            "a": fb.RigidBody(mass=1.0, inertia=0.3, rate=10.0),
            "b": fb.RigidBody(mass=1.0, inertia=0.1, position=(0.3, 0.0)),
        },
        joints={
            "A": fb.Revolute("a", (0.0, 0.0)),
            "B": fb.Revolute("b", (0.3, 0.0)),
            "mesh": contact.Switched(fb.Gear("a", "b", 0.2, 0.1), lambda t: t > -1.0),
        },
        loads={"brake": contact.Brake("b", (0.3, 0.0), friction=0.4, radius=0.1, force=10.0)},
        sensors={"a": fb.AngularVelocity("a"), "b": fb.AngularVelocity("b")},
    )
    motion = fb.simulate(model, duration=0.01, step=0.01).isel(time=0)
    after = 0.3 * 10.0 / (0.3 + 4 * 0.1)
    np.testing.assert_allclose(motion, [after, -2 * after], rtol=1e-7)


def test_a_guide_that_an_impact_presses_takes_its_share():
    """A block in a slot is struck under 45°: its impulse p makes p/√2 of friction µ."""
    mu = 0.3
    m = np.array([1.0, 2.0])
    model = fb.Mechanism(
        bodies={
            "block": fb.PointMass(mass=1.0),
            "hammer": fb.PointMass(mass=m, position=(-1.0, 1.0), velocity=(1.0, -1.0)),
        },
        joints={
            "rail": fb.Slot("block", (0.0, 0.0), friction=mu),
            "way": fb.Slot("hammer", (-1.0, 1.0), (1.0, -1.0)),
            "rod": contact.Switched(fb.Distance("block", "hammer", 1.0), lambda t: t > -1.0),
        },
        sensors={
            "v": fb.Velocity("block"),
            "T": fb.KineticEnergy(),
            "lost": fb.sensors.SwitchingLoss("rod"),
            "W": fb.Work("rail"),
        },
    )
    motion = fb.simulate(model, duration=0.01, step=0.01).isel(time=0)
    # v = p (1 − µ)/√2 of the block, √2 − p/m of the hammer, equal along the rod
    p = np.sqrt(2) / (1 / m + (1 - mu) / 2)
    v = p * (1 - mu) / np.sqrt(2)
    np.testing.assert_allclose(motion.sel(output="v_X"), v, rtol=1e-9)
    loss = 0.5 * p * np.sqrt(2)
    work = -0.5 * mu * p / np.sqrt(2) * v
    np.testing.assert_allclose(motion.sel(output="lost"), loss, rtol=1e-9)
    np.testing.assert_allclose(motion.sel(output="W"), work, rtol=1e-9)
    np.testing.assert_allclose(motion.sel(output="T"), m - loss + work, rtol=1e-9)


def test_a_drive_that_becomes_active_does_the_work_of_its_impulse():
    """3 rad/s for an inertia of 1 kg m² at rest: 9 J, of which the clutch takes one half."""
    model = fb.Mechanism(
        bodies={"disc": fb.RigidBody(mass=1.0, inertia=1.0)},
        joints={
            "axle": fb.Revolute("disc", (0.0, 0.0)),
            "motor": contact.Switched(
                fb.PrescribedRotation("disc", lambda t: 3.0 * t), lambda t: t > -1.0
            ),
        },
        sensors={
            "T": fb.KineticEnergy(),
            "lost": fb.sensors.SwitchingLoss("motor"),
            "W": fb.Work("motor"),
        },
    )
    motion = fb.simulate(model, duration=0.01, step=0.01).isel(time=0)
    np.testing.assert_allclose(motion, [4.5, 4.5, 9.0], rtol=1e-9)


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_a_drive_whose_speed_jumps_beside_friction_works_with_the_mean_speed(mu):
    """A cart in a rail at 0.3 rad that a rod draws along X at 1 m/s from 0.1 s on."""
    c = np.cos(0.3)
    s = np.sin(0.3)
    model = fb.Mechanism(
        bodies={
            "cart": fb.PointMass(mass=2.0),
            "rod": fb.PointMass(mass=1.0, position=(-1.0, 0.0)),
        },
        joints={
            "rail": fb.Slot("cart", (0.0, 0.0), (c, s), friction=mu),
            "way": fb.Slot("rod", (-1.0, 0.0), (1.0, 0.0)),
            "link": fb.Distance("cart", "rod", 1.0),
            "drive": fb.PrescribedTravel("rod", (-1.0, 0.0), lambda t: np.maximum(t - 0.1, 0.0)),
        },
        sensors={"v": fb.Velocity("cart"), "W": fb.Work("drive"), "T": fb.KineticEnergy()},
    )
    with pytest.warns(fb.errors.ResolutionWarning, match="takes an impulse"):
        motion = fb.simulate(model, duration=0.2, step=0.05).sel(time=0.1)
    # along the rail 2/c = P (c − µ s) with P of the rod; the drive gives P + 1
    P = 2.0 / c / (c - mu * s)
    np.testing.assert_allclose(motion.sel(output=["v_X", "v_Y"]), [1.0, s / c], rtol=1e-9)
    np.testing.assert_allclose(motion.sel(output="W"), 0.5 * (P + 1.0), rtol=1e-9)
    np.testing.assert_allclose(motion.sel(output="T"), 0.5 + 1.0 / c**2, rtol=1e-9)


@pytest.mark.parametrize("force", [0.0, 10.0, 100.0])
def test_a_drive_that_starts_at_once_takes_a_brake_along(force):
    """Through a one-way clutch: the brake's moment is finite."""
    model = fb.Mechanism(
        bodies={
            "in": fb.RigidBody(mass=1.0, inertia=0.1),
            "out": fb.RigidBody(mass=1.0, inertia=0.5),
        },
        joints={
            "A": fb.Revolute("in", (0.0, 0.0)),
            "B": fb.Revolute("out", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("in", lambda t: 3.0 * np.maximum(t - 0.1, 0.0)),
        },
        loads={
            "free": contact.OneWayClutch("out", "in"),
            "brake": contact.Brake("out", (0.0, 0.0), friction=0.4, radius=0.1, force=force),
        },
        sensors={"w": fb.AngularVelocity("out"), "W": fb.Work("motor"), "B": fb.Work("brake")},
    )
    with pytest.warns(fb.errors.ResolutionWarning, match="takes an impulse"):
        motion = fb.simulate(model, duration=0.3, step=0.05).isel(time=-1)
    brake_work = 0.04 * force * 3.0 * 0.2
    np.testing.assert_allclose(motion, [3.0, 2.7 + brake_work, -brake_work], rtol=1e-5, atol=1e-9)


def test_what_slides_may_reverse_in_an_impact():
    """A block that slides to the left on its rail is struck to the right, and pressed down."""
    model = fb.Mechanism(
        bodies={
            "block": fb.PointMass(mass=1.0, velocity=(-0.5, 0.0)),
            "hammer": fb.PointMass(mass=4.0, position=(-1.0, 1.0), velocity=(2.0, -2.0)),
        },
        joints={
            "rail": fb.Slot("block", (0.0, 0.0), friction=0.2),
            "way": fb.Slot("hammer", (-1.0, 1.0), (1.0, -1.0)),
            "rod": contact.Switched(fb.Distance("block", "hammer", 1.0), lambda t: t > -1.0),
        },
        sensors={"v": fb.Velocity("block")},
    )
    v = float(fb.simulate(model, duration=0.01, step=0.01)[0, 0])
    p = (2 * np.sqrt(2) + 0.5 / np.sqrt(2)) / (1 / 4 + (1 - 0.2) / 2)
    assert v == pytest.approx(-0.5 + p * (1 - 0.2) / np.sqrt(2), rel=1e-9)
    assert v > 0


@pytest.mark.parametrize("seed", range(60, 76))
def test_random_mechanisms_have_the_speeds_of_their_impulse_problems(seed):
    _, outcome, reason = judge_impact(seed)
    assert outcome in ("right", "refused"), reason


@pytest.mark.parametrize("friction", [0.01, 0.3, 0.9])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_motion_that_goes_on_with_a_link_at_a_slope(friction, sense):
    """The link presses the wagon at rest on its rail, whose friction takes part in the impact.

    v = m v₀ (1 − µ tan φ)/(M + m (1 − µ tan φ)), and what remains of the energy.
    """
    m = 3.0
    M = 1.0
    v0 = 2.0 * sense
    slope = 0.7
    heights = 0.0, float(np.tan(slope))

    def wagons(**link):
        return fb.Mechanism(
            bodies={
                "a": fb.PointMass(mass=m, velocity=(v0, 0.0)),
                "b": fb.PointMass(mass=M, position=(1.0, heights[1])),
            },
            joints={
                "ra": fb.Slot("a", (0.0, 0.0)),
                "rb": fb.Slot("b", (0.0, heights[1]), friction=friction),
                **link,
            },
            sensors={"a": fb.Velocity("a"), "b": fb.Velocity("b"), "T": fb.KineticEnergy()},
        )

    step = 1e-6
    first = fb.simulate(wagons(), duration=step, step=step, keep_state=True)
    length = float(np.hypot(1.0 - v0 * step, heights[1]))
    mechanism = wagons(link=fb.Distance("a", "b", length))
    motion = fb.simulate(mechanism, duration=step, step=step, start=first)
    part = 1.0 - friction * np.tan(slope)
    v = m * v0 * part / (M + m * part)
    start_values = motion.isel(time=0).sel(output=["a_X", "b_X", "T"]).values
    np.testing.assert_allclose(start_values[:2], v, rtol=1e-5)
    energy_loss = 0.5 * m * v0**2 - 0.5 * (m + M) * v**2
    assert motion.attrs["lost_energy"][0] == pytest.approx(energy_loss, rel=1e-5)
    assert start_values[2] == pytest.approx(0.5 * (m + M) * v**2, rel=1e-5)
