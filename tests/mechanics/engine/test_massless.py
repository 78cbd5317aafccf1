"""Bodies without mass or inertia, whose motion joints and the masses of other bodies determine."""

import numpy as np
import pytest
from numpy.typing import ArrayLike

import flexband as fb
from benchmarks.numerics.massless import draw_mechanism, judge_mechanism
from tests.mechanics.models import FINE


def rod(length, start, angle, mass: ArrayLike = 0.0, inertia: ArrayLike = 0.0):
    """A straight body between two points."""
    x, y = start
    half = length / 2
    return fb.RigidBody(
        mass=mass, inertia=inertia, points={"start": (-half, 0.0), "end": (half, 0.0)},
        position=(x + half * np.cos(angle), y + half * np.sin(angle)), angle=angle,
    )  # fmt: skip


def pendulum(mass: ArrayLike = 0.0, inertia: ArrayLike = 0.0, rate=0.0):
    """The pendulum of docs/evidence/validation.md: 1 kg on a rod of 1 m, released from (−1, 0)."""
    return fb.Mechanism(
        bodies={
            "rod": rod(1.0, (0.0, 0.0), np.pi, mass, inertia),
            "m": fb.PointMass(mass=1.0, position=(-1.0, 0.0), velocity=(0.0, -rate)),
        },
        joints={
            "A": fb.Revolute("rod.start", (0.0, 0.0)),
            "B": fb.Revolute("m", "rod.end"),
        },
        loads={"gravity": fb.Gravity()},
        sensors={
            "m": fb.Position("m"),
            "v": fb.Velocity("m"),
            "A": fb.Reaction("A"),
            "energy": fb.KineticEnergy(),
        },
    )


def test_massless_rod_with_a_mass_is_the_pendulum():
    motion = fb.simulate(pendulum(), duration=10.0, step=2.5e-4)
    exact = {
        1.0: (0.9862917511, -0.1650108531),
        5.0: (-0.9423054350, -0.3347543384),
        10.0: (-0.2750874626, -0.9614192050),
    }
    for time, place in exact.items():
        position = motion.sel(output=["m_X", "m_Y"]).sel(time=time, method="nearest")
        np.testing.assert_allclose(position, place, atol=1e-5)
    x, y, fx, fy = motion.sel(output=["m_X", "m_Y", "A_X", "A_Y"]).values
    assert np.abs(x * fy - y * fx).max() < 1e-8 * np.hypot(fx, fy).max()  # a purely axial force
    energy = motion.sel(output="energy").values + 9.81 * y
    assert np.abs(energy - energy[0]).max() < 5e-5


def test_force_at_the_start_is_that_of_the_circle():
    rate = 3.0
    start = fb.simulate(pendulum(rate=rate), duration=1e-3, step=1e-3).isel(time=0)
    np.testing.assert_allclose(start.sel(output=["v_X", "v_Y"]), (0.0, -rate), atol=1e-12)
    np.testing.assert_allclose(start.sel(output=["A_X", "A_Y"]), (rate**2, 0.0), atol=1e-9)


def four_bar(massless):
    """A crank and a mass on two rods: without mass, or that only keep the distance."""
    coupler = np.hypot(0.7, 0.2)
    rocker = np.hypot(0.1, 0.5)
    bodies = {
        "crank": rod(0.3, (0.0, 0.0), np.pi / 2, 1.0, 0.02),
        "load": fb.PointMass(mass=2.0, position=(0.7, 0.5)),
    }
    joints = {"A": fb.Revolute("crank.start", (0.0, 0.0))}
    if massless:
        bodies["coupler"] = rod(coupler, (0.0, 0.3), np.arctan2(0.2, 0.7))
        bodies["rocker"] = rod(rocker, (0.8, 0.0), np.arctan2(0.5, -0.1))
        joints |= {
            "B": fb.Revolute("coupler.start", "crank.end"),
            "C": fb.Revolute("coupler.end", "load"),
            "D": fb.Revolute("rocker.start", (0.8, 0.0)),
            "E": fb.Revolute("rocker.end", "load"),
        }
    else:
        joints |= {
            "coupler": fb.Distance("load", "crank.end", coupler),
            "rocker": fb.Distance("load", (0.8, 0.0), rocker),
        }
    return fb.Mechanism(
        bodies=bodies, joints=joints, loads={"gravity": fb.Gravity()},
        sensors={"load": fb.Position("load"), "A": fb.Reaction("A")},
    )  # fmt: skip


def test_massless_rods_of_a_four_bar_keep_distances_and_do_nothing_else():
    rods, distances = (
        fb.simulate(four_bar(massless), duration=2.0, step=1e-3, integrator=FINE).values
        for massless in (True, False)
    )
    np.testing.assert_allclose(rods[:2], distances[:2], atol=1e-11)
    np.testing.assert_allclose(rods[2:], distances[2:], atol=1e-6)


def plate(cranks, mass: ArrayLike = 0.0):
    """A plate of 3 kg on parallel cranks, massless or with one mass for each."""
    masses = np.broadcast_to(mass, cranks)
    angle = 0.5
    places = np.linspace(-0.5, 0.5, cranks).tolist()
    centre = (0.4 * np.cos(angle), 0.4 * np.sin(angle))
    points = {f"p{k}": (x, 0.0) for k, x in enumerate(places)}
    bodies = {"plate": fb.RigidBody(mass=3.0, inertia=0.5, points=points, position=centre)}
    joints = {}
    for k, x in enumerate(places):
        bodies[f"c{k}"] = rod(0.4, (x, 0.0), angle, masses[k], masses[k] * 0.4**2 / 12)
        joints[f"a{k}"] = fb.Revolute(f"c{k}.start", (x, 0.0))
        joints[f"b{k}"] = fb.Revolute(f"plate.p{k}", f"c{k}.end")
    return fb.Mechanism(
        bodies=bodies, joints=joints, loads={"gravity": fb.Gravity()},
        sensors={"plate": fb.Position("plate")} | {k: fb.Reaction(k) for k in joints if "a" in k}
        | {"acceleration": fb.Acceleration("plate")}
        | {k: fb.Reaction(k) for k in joints if "b" in k},
    )  # fmt: skip


def test_redundant_massless_cranks_share_the_force_of_two():
    two = fb.simulate(plate(2), duration=1.0, step=1e-3)
    with pytest.warns(fb.errors.FlexbandWarning, match="one choice of many"):
        three = fb.simulate(plate(3), duration=1.0, step=1e-3)
    np.testing.assert_allclose(three.values[:2], two.values[:2], atol=1e-11)
    sums = [
        motion.sel(
            output=[f"a{k}_Y" for k in range(3) if f"a{k}_Y" in motion["output"].values]
        ).sum("output")
        for motion in (two, three)
    ]
    np.testing.assert_allclose(sums[1], sums[0], atol=1e-6)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.filterwarnings("ignore:.*one choice of many")
def test_redundant_cranks_of_any_mass_carry_the_plate(seed):
    """One mass for all from 1 to 1e-12 kg and zero, and a mass of its own for each."""
    rng = np.random.default_rng(seed)
    scale = [1.0, 1e-3, 1e-6, 1e-9, 1e-12, 0.0][seed]
    for masses in ([scale] * 3, 10.0 ** rng.uniform(-12, 0, 3) * rng.choice([0.0, 1.0], 3)):
        motion = fb.simulate(plate(3, masses), duration=0.15, step=1e-3)
        x, y = ([motion.sel(output=f"b{k}_{axis}").values for k in range(3)] for axis in "XY")
        ax, ay = motion.sel(output=["acceleration_X", "acceleration_Y"]).values
        np.testing.assert_allclose(sum(x), 3 * ax, atol=3e-6)
        np.testing.assert_allclose(sum(y), 3 * (ay + 9.81), atol=3e-6)
    equal_masses = fb.simulate(plate(3, scale), duration=0.15, step=1e-3)
    y = np.stack([equal_masses.sel(output=f"b{k}_Y") for k in range(3)])
    np.testing.assert_allclose(y, np.broadcast_to(y.mean(axis=0), y.shape), atol=0.05)


def test_forces_at_the_start_beside_light_and_massless_plates():
    """A pendulum with a massless plate, and one of 1e-7 of its inertia, welded to its end."""
    ends = {"start": (-0.2, 0.0), "end": (0.2, 0.0)}
    pendulum = fb.RigidBody(mass=2.0, inertia=0.05, points=ends, position=(0.2, 0.0))
    angles = {"p": 1.1, "r": 0.4}
    pulls = {"p": (7.0, 55.0), "r": (7.0, 20.0)}
    mechanism = fb.Mechanism(
        bodies={
            "body": pendulum,
            "p": rod(0.2, (0.4, 0.0), angles["p"]),
            "r": rod(0.2, (0.4, 0.0), angles["r"], inertia=3e-7),
        },
        joints={"A": fb.Revolute("body.start", (0.0, 0.0))}
        | {f"W{k}": fb.Weld(f"{k}.start", "body.end", angles[k]) for k in angles},
        loads={"g": fb.Gravity()} | {f"F{k}": fb.Force(f"{k}.end", x=x, y=y)
                                     for k, (x, y) in pulls.items()},
        sensors={"A": fb.Reaction("A")} | {f"W{k}": fb.Reaction(f"W{k}") for k in angles},
    )  # fmt: skip
    start = fb.simulate(mechanism, duration=1e-3, step=1e-3).isel(time=0)
    moment = -0.2 * 2 * 9.81
    for k, (fx, fy) in pulls.items():
        moment += (0.4 + 0.2 * np.cos(angles[k])) * fy - 0.2 * np.sin(angles[k]) * fx
    turn = moment / (0.05 + 2 * 0.2**2 + 3e-7)
    exact = [-14.0, 2 * (9.81 + 0.2 * turn) - 75.0]
    np.testing.assert_allclose(start.sel(output=["A_X", "A_Y"]), exact, rtol=1e-6)
    for k, (fx, fy) in pulls.items():
        force = start.sel(output=[f"W{k}_X", f"W{k}_Y"])
        np.testing.assert_allclose(force, (-fx, -fy), atol=1e-4)


def test_massless_rods_may_come_close_to_a_dead_centre():
    """A mass on a spring, and two rods that follow it; they are 1e-4 m from being straight."""
    start = 0.4
    margin = 1e-4
    y = start + margin
    elbow = np.arccos(y)
    mechanism = fb.Mechanism(
        bodies={
            "a": rod(0.5, (0.0, 0.0), np.pi / 2 + elbow),
            "b": rod(0.5, (-0.5 * np.sin(elbow), y / 2), np.pi / 2 - elbow),
            "m": fb.PointMass(mass=1.0, position=(0.0, y)),
        },
        joints={
            "A": fb.Revolute("a.start", (0.0, 0.0)),
            "B": fb.Revolute("b.start", "a.end"),
            "C": fb.Revolute("m", "b.end"),
        },
        loads={"spring": fb.Spring("m", (0.0, 0.0), 100.0, 0.7)},
        sensors={"m": fb.Position("m"), "A": fb.Reaction("A")},
    )
    motion = fb.simulate(mechanism, duration=0.6, step=1e-3)
    x, y, *force = motion.values
    exact = 0.7 - (0.7 - start - margin) * np.cos(10 * motion["time"].values)
    np.testing.assert_allclose([x, y], [0 * exact, exact], atol=2e-5)
    np.testing.assert_allclose(force, 0.0, atol=1e-6)


@pytest.mark.parametrize("seed", range(2195, 2207))
def test_drawn_mechanisms_with_zero_masses_are_right_or_refused_rightly(seed):
    outcome, reason = judge_mechanism(draw_mechanism(seed))
    assert outcome in ("right", "refused rightly", "not judged"), reason


def test_masses_may_reach_zero_and_samples_stay_apart():
    masses = np.array([0.0, 1e-18, 1e-15, 1e-12, 1e-9, 1e-6, 0.0])
    batch = fb.simulate(pendulum(masses, masses / 12), duration=1.0, step=1e-3)
    for sample, mass in enumerate(masses):
        single_run = fb.simulate(pendulum(mass, mass / 12), duration=1.0, step=1e-3)
        np.testing.assert_array_equal(batch.values[sample], single_run.values)
    deviations = np.abs(batch.values - batch.values[:1]).max(axis=(1, 2))
    assert np.all(deviations <= 100 * masses + 1e-9)


def test_bands_of_a_mass_that_may_be_zero():
    def build(mass):
        return pendulum(mass, mass / 12)

    response = fb.dynamic_response(build, duration=0.5, step=2e-3)
    bands = fb.propagate(response, {"mass": fb.Interval(0.0, 0.2)}, fb.ImprovedPCCI(1, 3))
    ends = [fb.simulate(build(mass), duration=0.5, step=2e-3).values for mass in (0.0, 0.2)]
    mean = bands["mean"].sel(output=["m_X", "m_Y"]).isel(time=-1).values
    np.testing.assert_allclose(mean, np.sort([end[:2, -1] for end in ends], axis=0), atol=1e-5)


def test_modes_and_equilibrium_of_the_pendulum():
    modes = fb.modes(pendulum(), 3)
    np.testing.assert_allclose(modes["frequency"], [np.sqrt(9.81) / (2 * np.pi)], rtol=1e-9)
    rest = fb.equilibrium(pendulum())
    np.testing.assert_allclose(rest.sel(output=["m_Y", "A_Y"]), (-1.0, 9.81), rtol=1e-9)


def test_drive_moves_bodies_without_any_mass():
    bar = fb.RigidBody.bar(length=1.0, height=0.1, width=0.1, density=0.0)
    mechanism = fb.Mechanism(
        bodies={"bar": bar},
        joints={
            "A": fb.Revolute("bar.start", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("bar", lambda t: t),
        },
        loads={"spring": fb.Spring("bar.end", (2.0, 0.0), 10.0, 0.5)},
        sensors={"end": fb.Position("bar.end"), "M": fb.ReactionMoment("motor")},
    )
    motion = fb.simulate(mechanism, duration=1.0, step=2.5e-3)
    turn = motion["time"].values
    x, y, moment = motion.values
    np.testing.assert_allclose([x, y], [np.cos(turn), np.sin(turn)], atol=1e-12)
    length = np.sqrt(5 - 4 * np.cos(turn))
    pull = 10.0 * (length - 0.5) * 2 * np.sin(turn) / length
    np.testing.assert_allclose(np.abs(moment), pull, atol=3e-8)


SENSORS = {"p": fb.Position("b")}
PIN = {"A": fb.Revolute("b.start", (0.0, 0.0))}


@pytest.mark.parametrize("compute", [lambda m: fb.simulate(m, duration=0.1, step=0.01),
                                     lambda m: fb.modes(m, 1), fb.equilibrium])  # fmt: skip
@pytest.mark.parametrize(
    ("body", "joints", "message"),
    [
        (rod(1.0, (0.0, 0.0), 0.0), PIN, "body 'b' has no mass or inertia and can still turn"),
        (
            rod(1.0, (-0.5, 0.0), 0.0, mass=1.0),
            {"A": fb.Revolute("b", (0.0, 0.0))},
            "body 'b' has no inertia and can still turn .*; give it inertia, or a joint",
        ),
        (
            fb.PointMass(mass=np.array([1.0, 0.0])),
            {"A": fb.Slot("b", (0.0, 0.0))},
            r"body 'b' has no mass and can still move along .* \(sample 1\)",
        ),
    ],
)
def test_motions_that_no_mass_determines_are_refused(body, joints, message, compute):
    loads = {"spring": fb.Spring("b", (3.0, 4.0), 10.0)}
    mechanism = fb.Mechanism(bodies={"b": body}, joints=joints, loads=loads, sensors=SENSORS)
    with pytest.raises(fb.errors.InputError, match=message):
        compute(mechanism)


def test_dead_centre_of_massless_rods_fails_with_its_reason():
    angle = 0.5
    x = 0.3 * np.cos(angle)
    y = 0.3 * np.sin(angle)
    slope = np.arcsin(y)
    mechanism = fb.Mechanism(
        bodies={
            "crank": rod(0.3, (0.0, 0.0), angle),
            "rod": rod(1.0, (x, y), -slope),
            "slider": fb.PointMass(mass=1.0, position=(x + np.cos(slope), 0.0)),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("rod.start", "crank.end"),
            "C": fb.Revolute("slider", "rod.end"),
            "guide": fb.Slot("slider", (0.0, 0.0)),
        },
        loads={"gravity": fb.Gravity(x=9.81, y=0.0)},
        sensors={"slider": fb.Position("slider"), "phi": fb.Angle("crank")},
    )
    with pytest.raises(
        fb.errors.SimulationError, match=r"\('crank', 'rod'\) can move while all that has"
    ):
        fb.simulate(mechanism, duration=1.0, step=1e-3)
    assert fb.equilibrium(mechanism).sel(output="slider_X") == pytest.approx(1.3)
    with pytest.raises(fb.errors.InputError, match="body 'crank' has no mass or inertia"):
        fb.modes(mechanism, 1)


def test_negative_masses_are_refused():
    for build in (
        lambda: fb.RigidBody(mass=-1.0, inertia=1.0),
        lambda: fb.RigidBody(mass=1.0, inertia=-1.0),
        lambda: fb.PointMass(mass=-1e-300),
    ):
        with pytest.raises(fb.errors.InputError, match="must be zero or positive; got -1"):
            build()
