"""Joints that switch, against impulse and momentum."""

from dataclasses import replace

import numpy as np
import pytest

import flexband as fb

Switched = fb.contact.Switched


def rotors(joint, **options):
    """Return the motion of two rotors on one axle, 0.4 and 0.1 kg m² at 3 and −7 rad/s."""
    mechanism = fb.Mechanism(
        bodies={
            "a": fb.RigidBody(mass=1.0, inertia=0.4, rate=3.0),
            "b": fb.RigidBody(mass=1.0, inertia=0.1, rate=-7.0),
        },
        joints={
            "axle": fb.Revolute("a", (0.0, 0.0)),
            "bearing": fb.Revolute("b", (0.0, 0.0)),
            "latch": joint,
        },
        sensors={
            "a": fb.Angle("a"),
            "b": fb.Angle("b"),
            "wa": fb.AngularVelocity("a"),
            "wb": fb.AngularVelocity("b"),
            "M": fb.ReactionMoment("latch"),
            "lost": fb.sensors.SwitchingLoss("latch"),
        },
    )
    return fb.simulate(mechanism, **{"duration": 0.6, "step": 0.01} | options)


def test_rotors_are_locked_where_they_are_and_released():
    """At an instant of each sample: J₁ω₁ + J₂ω₂ and the angle remain, ½ J₁J₂/J (Δω)² is lost."""
    begin = np.array([0.123, 0.203])
    end = 0.45
    motion = rotors(Switched(fb.Weld("b", "a"), lambda t: (t > begin) & (t < end)))
    t = motion.time.values
    common = (0.4 * 3.0 - 0.1 * 7.0) / 0.5
    for sample, start in enumerate(begin):
        sample_motion = motion.isel(sample=sample)
        unlocked_time = np.minimum(t, start)
        common_turn = np.maximum(t - start, 0.0) * common
        np.testing.assert_allclose(
            sample_motion.sel(output="a"), 3.0 * unlocked_time + common_turn, atol=2e-5
        )
        np.testing.assert_allclose(
            sample_motion.sel(output="b"), -7.0 * unlocked_time + common_turn, atol=2e-5
        )
        energy_loss = np.where(t > start, 0.5 * 0.4 * 0.1 / 0.5 * 10.0**2, 0.0)
        np.testing.assert_allclose(sample_motion.sel(output="lost"), energy_loss, atol=2e-6)
        np.testing.assert_allclose(
            sample_motion.sel(output="wb"), np.where(t > start, common, -7.0), atol=1e-6
        )
    np.testing.assert_allclose(motion.sel(output="M"), 0.0, atol=1e-7)


def grip_motion(joint, **parts):
    """Return the motion of two bodies in flight that a joint seizes from 0.15 s to 0.4 s."""
    points = {"eye": (0.2, 0.1)}
    sensors = {"lost": fb.sensors.SwitchingLoss("grip"), "F": fb.Reaction("grip"),
               "T": fb.KineticEnergy()}  # fmt: skip
    for name in "ab":
        sensors |= {f"r{name}": fb.Position(name), f"v{name}": fb.Velocity(name),
                    f"w{name}": fb.AngularVelocity(name), f"q{name}": fb.Angle(name),
                    f"e{name}": fb.Position(f"{name}.eye")}  # fmt: skip
    mechanism = fb.Mechanism(
        bodies={
            "a": fb.RigidBody(mass=2.0, inertia=0.1, points=points, velocity=(3.0, -1.0), rate=4.0),
            "b": fb.RigidBody(mass=3.0, inertia=0.2, points=points, position=(0.5, 0.2),
                              angle=1.0, rate=-3.0),
        },
        joints={"grip": joint},
        sensors=sensors,
    )  # fmt: skip
    motion = fb.simulate(mechanism, duration=0.5, step=0.01, **parts)
    return motion.time.values, {name: motion.sel(output=name).values for name in
                                motion.output.values}  # fmt: skip


@pytest.mark.parametrize(
    "joint",
    [
        fb.Weld("a.eye", "b.eye"),
        fb.Revolute("a.eye", "b.eye"),
        fb.Prismatic("a.eye", "b.eye", axis=(1.0, 2.0)),
        fb.Slot("a.eye", "b.eye"),
        fb.Distance("a.eye", "b.eye", 0.3),
    ],
    ids=lambda joint: type(joint).__name__,
)
def test_momentum_and_energy_of_a_grip_in_flight(joint):
    """Momenta remain, the energy falls by what is reported, and the relative place is held."""
    t, outputs = grip_motion(Switched(joint, lambda t: (t > 0.15) & (t < 0.4)))
    bodies = (("a", 2.0, 0.1), ("b", 3.0, 0.2))
    # Momenta remain, and the energy with what is lost.
    for axis in "XY":
        total = sum(m * outputs[f"v{n}_{axis}"] for n, m, _ in bodies)
        np.testing.assert_allclose(total, total[0], atol=1e-8)
    spin = sum(
        m * (outputs[f"r{n}_X"] * outputs[f"v{n}_Y"] - outputs[f"r{n}_Y"] * outputs[f"v{n}_X"])
        + J * outputs[f"w{n}"]
        for n, m, J in bodies
    )
    np.testing.assert_allclose(spin, spin[0], atol=3e-5)
    np.testing.assert_allclose(outputs["T"] + outputs["lost"], outputs["T"][0], rtol=3e-5)
    assert outputs["lost"][-1] > 2e-3
    # What the joint holds is constant while it is active.
    active = (t > 0.155) & (t < 0.395)
    c = np.cos(outputs["qb"])
    s = np.sin(outputs["qb"])
    X = outputs["ea_X"] - outputs["eb_X"]
    Y = outputs["ea_Y"] - outputs["eb_Y"]
    along = (c * X + s * Y)[active]
    across = (c * Y - s * X)[active]
    turn = (outputs["qa"] - outputs["qb"])[active]
    constants = {
        fb.Weld: (along, across, turn),
        fb.Revolute: (along, across),
        fb.Prismatic: (2 * along - across, turn),
        fb.Slot: (across,),
        fb.Distance: (np.hypot(along, across),),
    }[type(joint)]
    for place in constants:
        np.testing.assert_allclose(place, place[0], atol=1e-7)
    force = np.hypot(outputs["F_X"], outputs["F_Y"])
    assert np.all(force[~active & (np.abs(t - 0.15) > 0.01) & (np.abs(t - 0.4) > 0.01)] == 0.0)


def test_slot_catches_a_falling_mass():
    """The speed across the slot is lost; then the mass slides down with g sin α."""
    slope = np.array([4.0, -3.0]) / 5
    mechanism = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=2.0)},
        joints={"chute": Switched(fb.Slot("m", (5.0, 5.0), axis=(4.0, -3.0)), lambda t: t >= 0.2)},
        loads={"gravity": fb.Gravity()},
        sensors={"m": fb.Position("m"), "F": fb.Reaction("chute"),
                 "lost": fb.sensors.SwitchingLoss("chute")},
    )  # fmt: skip
    motion = fb.simulate(mechanism, duration=0.5, step=0.05)
    t = motion.time.values
    after = np.maximum(t - 0.2, 0.0)
    speed = 9.81 * 0.2 * 0.6
    travel = speed * after + 0.5 * 9.81 * 0.6 * after**2
    fall = -0.5 * 9.81 * np.minimum(t, 0.2) ** 2
    expected = np.outer(slope, travel) + np.outer([0.0, 1.0], fall)
    np.testing.assert_allclose(motion.sel(output=["m_X", "m_Y"]), expected, atol=1e-6)
    assert motion.sel(output="lost")[-1] == pytest.approx(0.5 * 2 * (9.81 * 0.2 * 0.8) ** 2)
    reaction = 2.0 * 9.81 * 0.8 * np.array([0.6, 0.8])
    np.testing.assert_allclose(motion.sel(output=["F_X", "F_Y"])[:, -1], reaction, rtol=1e-6)


def test_gear_engages_between_two_turning_rotors():
    """The impulse P on the teeth changes J₁ω₁ by r₁ P, J₂ω₂ by r₂ P, until r₁ω₁ + r₂ω₂ = 0."""
    (J1, J2), (w1, w2), (r1, r2) = (0.4, 0.1), (3.0, -7.0), (0.3, 0.1)
    mechanism = fb.Mechanism(
        bodies={
            "a": fb.RigidBody(mass=1.0, inertia=J1, rate=w1),
            "b": fb.RigidBody(mass=1.0, inertia=J2, rate=w2, position=(0.4, 0.0)),
        },
        joints={
            "axle": fb.Revolute("a", (0.0, 0.0)),
            "shaft": fb.Revolute("b", (0.4, 0.0)),
            "mesh": Switched(fb.Gear("a", "b", r1, r2), lambda t: (t > 0.123) & (t < 0.4)),
        },
        loads={"M": fb.Moment("a", 0.9)},
        sensors={"a": fb.AngularVelocity("a"), "b": fb.AngularVelocity("b"),
                 "M": fb.ReactionMoment("mesh"), "F": fb.Reaction("mesh"),
                 "lost": fb.sensors.SwitchingLoss("mesh")},
    )  # fmt: skip
    w1 += 0.9 / J1 * 0.123
    slip = r1 * w1 + r2 * w2
    impulse = -slip / (r1**2 / J1 + r2**2 / J2)
    motion = fb.simulate(mechanism, duration=0.5, step=0.01)
    at = {name: motion.sel(output=name) for name in motion.output.values}
    t = np.clip(motion.time.values - 0.123, 0.0, 0.4 - 0.123)
    active = (motion.time.values > 0.125) & (motion.time.values < 0.395)
    rate = 0.9 / (J1 + J2 * (r1 / r2) ** 2)  # of the first rotor while they are engaged
    first = w1 + r1 * impulse / J1 + rate * t
    np.testing.assert_allclose(at["a"][active], first[active], rtol=1e-5)
    np.testing.assert_allclose(at["b"][active], -r1 / r2 * first[active], rtol=1e-5)
    np.testing.assert_allclose(at["b"][-5:], -r1 / r2 * first[-1], rtol=1e-5)  # released
    np.testing.assert_allclose(at["M"][active], J1 * rate - 0.9, rtol=1e-5)
    np.testing.assert_allclose(at["F_Y"][active], (J1 * rate - 0.9) / r1, rtol=1e-5)
    np.testing.assert_allclose(at["F_Y"][-5:], 0.0, atol=1e-9)
    assert at["lost"][-1] == pytest.approx(-0.5 * impulse * slip, rel=1e-5)


def test_motor_between_two_bodies_engages():
    """From then on the second rotor turns at 2 rad/s more; the angle goes on from where it is."""
    drive = fb.PrescribedRotation("b", "a", lambda t: 2.0 * t)
    motion = rotors(Switched(drive, lambda t: t > 0.123))
    t = motion.time.values
    at = {name: motion.sel(output=name) for name in motion.output.values}
    speed = (0.4 * 3.0 - 0.1 * 7.0 - 0.1 * 2.0) / 0.5
    np.testing.assert_allclose(at["wa"], np.where(t > 0.123, speed, 3.0), atol=1e-6)
    np.testing.assert_allclose(at["wb"], np.where(t > 0.123, speed + 2.0, -7.0), atol=1e-6)
    angle = -10.0 * np.minimum(t, 0.123) + 2.0 * np.maximum(t - 0.123, 0.0)
    np.testing.assert_allclose(at["b"] - at["a"], angle, atol=2e-5)
    assert at["lost"][-1] == pytest.approx(0.5 * 0.4 * 0.1 / 0.5 * 12.0**2, rel=1e-5)


def test_cylinder_and_linear_drive_engage():
    """Two masses on a rail: the distance grows by 0.5 m/s from then on, the momentum remains."""
    for drive in (
        Switched(
            fb.Distance("b", "a", lambda t: 1.0 + 0.5 * (t - 0.2)), lambda t: t > 0.2, "given"
        ),
        Switched(fb.PrescribedTravel("b", "a", lambda t: 0.5 * t), lambda t: t > 0.2),
    ):
        mechanism = fb.Mechanism(
            bodies={"a": fb.RigidBody(mass=3.0, inertia=1.0), "b": fb.PointMass(mass=1.0,
                    position=(1.0, 0.0))},
            joints={"a": fb.Prismatic("a", (0.0, 0.0)), "b": fb.Slot("b", (0.0, 0.0)),
                    "drive": drive},
            sensors={"a": fb.Velocity("a"), "b": fb.Position("b"), "F": fb.Reaction("drive")},
        )  # fmt: skip
        motion = fb.simulate(mechanism, duration=0.4, step=0.1)
        after = np.maximum(motion.time.values - 0.2, 0.0)
        np.testing.assert_allclose(motion.sel(output="a_X")[-1], -0.125, rtol=1e-6)
        np.testing.assert_allclose(motion.sel(output="b_X"), 1.0 + 0.375 * after, atol=1e-6)
        np.testing.assert_allclose(motion.sel(output="F_X")[-1], 0.0, atol=1e-6)


def test_offset_is_where_a_pin_is_held():
    """A mass on an arm of 0.5 m is held at the pin, not at its centre, and swings about it."""
    pin = fb.Revolute("m", (0.5, 0.0), offset=(0.5, 0.0))
    for place in ("present", "given"):
        mechanism = fb.Mechanism(
            bodies={"m": fb.RigidBody(mass=2.0, inertia=0.3, velocity=(0.0, 1.0))},
            joints={"pin": Switched(pin, lambda t: t > -1.0, place)},
            sensors={"m": fb.Position("m"), "w": fb.AngularVelocity("m"),
                     "lost": fb.sensors.SwitchingLoss("pin")},
        )  # fmt: skip
        motion = fb.simulate(mechanism, duration=0.2, step=0.01)
        rate = -2.0 * 0.5 / (0.3 + 2.0 * 0.5**2)
        np.testing.assert_allclose(motion.sel(output="w")[-1], rate, rtol=1e-6)
        np.testing.assert_allclose(np.hypot(motion.sel(output="m_X") - 0.5,
                                            motion.sel(output="m_Y")), 0.5, rtol=1e-6)  # fmt: skip


def reaches(t, x, v, p, force, mode, gap):
    """Say when a point is below a height."""
    gap[0] = x[0, 1] - p[0]


def test_event_of_a_law_closes_a_latch():
    """A mass that falls by 0.3 m is caught there, with all of its energy."""
    mechanism = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=2.0)},
        joints={"guide": fb.Slot("m", (0.0, 0.0), axis=(0.0, 1.0)),
                "latch": Switched(fb.Distance("m", (1.0, 0.0), 1.0), ("switch", "low"))},
        loads={"gravity": fb.Gravity(),
               "switch": fb.ForceLaw(["m"], reaches, (-0.3,), events=["low"])},
        sensors={"m": fb.Position("m"), "lost": fb.sensors.SwitchingLoss("latch")},
    )  # fmt: skip
    motion = fb.simulate(mechanism, duration=0.5, step=0.02)
    t = motion.time.values
    expected = np.maximum(-0.5 * 9.81 * t**2, -0.3)
    np.testing.assert_allclose(motion.sel(output="m_Y"), expected, atol=1e-5)
    assert motion.sel(output="lost")[-1] == pytest.approx(2 * 9.81 * 0.3, rel=1e-4)


def test_given_place_within_a_tolerance():
    wide_latch = Switched(fb.Weld("b", "a", angle=0.0), lambda t: t > 0.1, "given", 1.1)
    motion = rotors(wide_latch, duration=0.2)
    difference = motion.sel(output="a") - motion.sel(output="b")
    np.testing.assert_allclose(difference[-5:], 1.0, atol=1e-5)  # 10 rad/s × 0.1 s, which remains
    angled_latch = Switched(
        fb.Weld("b", "a", angle=-1.0 - 2 * np.pi), lambda t: t > 0.1, "given", 1e-3
    )
    assert rotors(angled_latch, duration=0.2).sel(output="lost")[-1] > 3.9
    tight_latch = Switched(fb.Weld("b", "a", angle=0.0), lambda t: t > 0.1, "given", 0.9)
    with pytest.raises(fb.errors.SimulationError, match="latch' becomes active farther from its"):
        rotors(tight_latch, duration=0.2)


@pytest.mark.parametrize("active", [True, False])
def test_statics_and_modes_have_it_as_at_the_start(active):
    mechanism = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=2.0, position=(0.0, -1.0))},
        joints={"guide": fb.Slot("m", (0.0, 0.0), axis=(0.0, 1.0)),
                "latch": Switched(fb.Revolute("m", (0.0, 0.0)), lambda t: (t < 1.0) == active)},
        loads={"gravity": fb.Gravity(), "spring": fb.Spring("m", (0.0, 0.0), 200.0, 1.0)},
        sensors={"m": fb.Position("m"), "F": fb.Reaction("latch")},
    )  # fmt: skip
    rest = fb.equilibrium(mechanism)
    place, force = (-1.0, 19.62) if active else (-1.0 - 19.62 / 200.0, 0.0)
    np.testing.assert_allclose(rest.sel(output=["m_Y", "F_Y"]), [place, force], atol=1e-9)
    if not active:
        assert fb.modes(mechanism, 1)["frequency"] == pytest.approx(10 / (2 * np.pi))
    with pytest.raises(fb.errors.InputError, match="joints that switch"):
        fb.simulate(mechanism, duration=0.1, step=0.01, start="periodic", period=0.1)
    lossy = replace(mechanism, sensors={"loss": fb.sensors.SwitchingLoss("latch")})
    with pytest.warns(fb.errors.FlexbandWarning, match="left out: 'loss', since"):
        fb.equilibrium(lossy)


def test_motion_goes_on_with_a_closed_latch():
    latch = Switched(fb.Weld("b", "a"), lambda t: t > 0.123)
    full_motion = rotors(latch)
    first = rotors(latch, duration=0.3, keep_state=True)
    rest = rotors(Switched(fb.Weld("b", "a"), lambda t: t > -1.0), duration=0.3, start=first)
    for name in ("a", "b"):
        end = full_motion.sel(output=name)[-1]
        np.testing.assert_allclose(rest.sel(output=name)[-1], end, atol=1e-6)


def test_drawing_has_the_joint_in_a_ring():
    latch = Switched(fb.Weld("b", "a"), lambda t: t > 0.1)
    mechanism = fb.Mechanism(
        bodies={"a": fb.RigidBody(mass=1.0, inertia=0.4), "b": fb.RigidBody(mass=1.0, inertia=0.1)},
        joints={"latch": latch},
    )
    assert "latch" in {text.get_text() for text in fb.draw(mechanism).axes[0].texts}


@pytest.mark.parametrize(
    ("build", "text"),
    [
        (lambda: Switched("pin", lambda t: 1.0), "joint must be a joint"),
        (
            lambda: fb.Mechanism(
                bodies={"a": fb.PointMass(mass=1.0)},
                joints={"m": Switched(fb.PrescribedRotation("a", np.sin), np.cos)},
            ),
            "'a' is a point mass",
        ),
        (lambda: Switched(fb.Gear("a", "b", 1.0, 1.0), lambda t: 1.0, "given"), "states no place"),
        (lambda: rotors(Switched(fb.Gear("a", "b", 1.0, 1.0, 0.9), lambda t: 1.0)), "losses"),
        (lambda: rotors(Switched(fb.Slot("a", "b", friction=0.1), lambda t: 1.0)), "friction"),
        (lambda: rotors(Switched(Switched(fb.Weld("b", "a"), np.cos), np.cos)), "cannot switch"),
        (lambda: Switched(fb.Revolute("a", "b"), 1.0), "active must be a function of time"),
        (lambda: Switched(fb.Revolute("a", "b"), ("law",)), "names of a load and its event"),
        (lambda: Switched(fb.Distance("a", "b", np.cos), lambda t: t > 1), "cylinder needs where"),
        (lambda: Switched(fb.Revolute("a", "b"), lambda t: t > 1, "there"), "where"),
        (lambda: rotors(Switched(fb.Weld("b", "a"), ("load", "event"))), "load with events"),
    ],
)
def test_wrong_switches_are_refused(build, text):
    with pytest.raises(fb.errors.InputError, match=text):
        build()
