"""Redundant constraints and positions where the Jacobian loses rank."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flexband as fb
from tests.mechanics.models import SQUARE_ROD, between_rods, parallelogram


def test_a_third_crank_changes_inertia_only_and_is_named():
    """Against the exact motion of one degree of freedom: ½ J θ̇² + G cos θ is kept."""
    with pytest.warns(
        fb.errors.ResolutionWarning, match="more of its constraints depend on each other"
    ):
        motion = fb.simulate(parallelogram(3), duration=1.0, step=5e-4)
    joint_names = motion.attrs["not_unique"]
    assert {"joint 'top0'", "joint 'top1'", "joint 'top2'"} <= set(joint_names)
    assert "not_unique" not in fb.simulate(parallelogram(2), duration=0.01, step=1e-3).attrs
    m = 2000.0 * 0.02**2
    inertia = 3 * m * (1 / 3 + 0.02**2 / 12) + 0.8
    weight = 9.81 * (3 * m / 2 + 0.8)

    exact = solve_ivp(
        lambda t, s: [s[1], weight * np.sin(s[0]) / inertia], (0, 1), [0.3, 0.0],
        rtol=1e-11, atol=1e-12, t_eval=motion.time.values,
    ).y[0]  # fmt: skip
    position = motion.sel(output="coupler_X")
    dead_point = 1300  # all bars in line soon after 0.65 s
    np.testing.assert_allclose(position[:dead_point], np.sin(exact)[:dead_point], atol=1e-6)
    # How near a step comes to the dead point, where the Jacobian loses rank, is up to rounding.
    np.testing.assert_allclose(position, np.sin(exact), atol=2e-4)
    np.testing.assert_allclose(motion.sel(output="coupler_Y"), np.cos(exact), atol=2e-4)


def test_reactions_of_redundant_joints_still_add_up():
    three = fb.simulate(parallelogram(3), duration=0.5, step=1e-3)
    mass = 3 * 2000.0 * 0.02**2 + 0.8
    vertical_force = sum(three.sel(output=f"F{k}_Y") for k in range(3))
    start = float(vertical_force.isel(time=0))
    m = 2000.0 * 0.02**2
    inertia = 3 * m * (1 / 3 + 0.02**2 / 12) + 0.8
    arm = 3 * m / 2 + 0.8
    spin = 9.81 * arm * np.sin(0.3) / inertia
    assert start == pytest.approx(9.81 * mass - arm * spin * np.sin(0.3), rel=1e-6)


def test_flat_four_bar_passes_its_singular_position():
    """All rods lie on the ground twice a turn; at the start they turn fast enough to pass."""
    bodies = {
        "a": fb.RigidBody.bar(length=1.0, angle=np.pi / 2, rate=-10.0, **SQUARE_ROD),
        "b": fb.RigidBody.bar(
            length=1.0, start=(2.0, 0.0), angle=np.pi / 2, rate=-10.0, **SQUARE_ROD
        ),
        "c": fb.RigidBody.bar(length=2.0, start=(0.0, 1.0), velocity=(10.0, 0.0), **SQUARE_ROD),
    }
    joints = {
        "A": fb.Revolute("a.start", (0.0, 0.0)),
        "B": fb.Revolute("b.start", (2.0, 0.0)),
        "C": fb.Revolute("c.start", "a.end"),
        "D": fb.Revolute("c.end", "b.end"),
    }
    model = fb.Mechanism(bodies=bodies, joints=joints, sensors={"a": fb.Angle("a")})
    motion = fb.simulate(model, duration=1.0, step=5e-4).sel(output="a")
    exact = np.pi / 2 - 10.0 * motion.time
    np.testing.assert_allclose(motion, exact, atol=1e-4)


def test_contradicting_drives_are_refused_when_they_part():
    bar = fb.RigidBody.bar(length=1.0, **SQUARE_ROD)
    model = fb.Mechanism(
        bodies={"bar": bar},
        joints={
            "A": fb.Revolute("bar.start", (0.0, 0.0)),
            "one": fb.PrescribedRotation("bar", lambda t: t),
            "two": fb.PrescribedRotation("bar", lambda t: t + max(0.0, t - 0.0505)),
        },
        sensors={"angle": fb.Angle("bar")},
    )
    with (
        pytest.warns(fb.errors.ResolutionWarning, match="rate jumps at t = 0.0505 s"),
        pytest.raises(fb.errors.SimulationError, match=r"t = 0.051 s: .*(contradict|diverged)"),
    ):
        fb.simulate(model, duration=0.1, step=1e-3)


@pytest.mark.parametrize("slope", [1e-2, 2e-4, -1e-5, np.array([1e-2, 1e-2, -1e-5])])
def test_a_mass_between_two_rods_almost_in_line_is_held(slope):
    """The force in each rod is m g / (2 sin α)."""
    motion = fb.simulate(between_rods(slope), duration=0.02, step=1e-3)
    force = motion.sel(output="R_X")
    exact = 2.0 * 9.81 / (2 * np.tan(slope))
    np.testing.assert_allclose(force, np.broadcast_to(exact, force.T.shape).T, rtol=1e-6)
    assert np.abs(motion.sel(output=["m_X", "m_Y"])).max() < 1e-9


def test_a_mass_between_two_rods_in_line_does_not_fall():
    """It is locked, but only to second order, so its reactions are without bound."""
    with pytest.raises(
        fb.errors.SimulationError, match=r"contradict each other; the worst is joint"
    ):
        fb.simulate(between_rods(0.0), duration=0.02, step=1e-3)


@pytest.mark.parametrize("mass", [1e-3, 1e-7, 1e-11])
def test_a_light_body_carries_the_force_between_heavy_ones(mass):
    heavy = fb.RigidBody(mass=1.0, inertia=1.0)
    model = fb.Mechanism(
        bodies={"a": heavy, "b": heavy, "light": fb.PointMass(mass=mass)},
        joints={
            "p": fb.Revolute("light", "a"),
            "q": fb.Revolute("light", "b"),
            "guide": fb.Slot("a", (0.0, 0.0)),
        },
        loads={"force": fb.Force("a", x=1.0)},
        sensors={"R": fb.Reaction("q"), "b": fb.Position("b")},
    )
    motion = fb.simulate(model, duration=0.1, step=1e-2)
    np.testing.assert_allclose(motion.sel(output="R_X"), -1 / (2 + mass), rtol=1e-4)
    np.testing.assert_allclose(motion.sel(output="b_X"), motion.time**2 / 2 / (2 + mass), rtol=1e-6)


def test_a_drive_out_of_reach_is_named_with_its_time():
    bar = {"length": 0.5, "height": 0.01, "width": 0.01, "density": 1e3}
    model = fb.Mechanism(
        bodies={
            "a": fb.RigidBody.bar(**bar),
            "b": fb.RigidBody.bar(start=(0.5, 0.0), angle=-0.5, **bar),
        },
        joints={
            "foot": fb.Revolute("a.start", (0.0, 0.0)),
            "knee": fb.Revolute("a.end", "b.start"),
            "guide": fb.Slot("b.end", (0.0, 0.0)),
            "drive": fb.PrescribedTravel("b.end", (0.0, 0.0), lambda t: 0.9 + 0.3 * t),
        },
        sensors={"end": fb.Position("b.end")},
    )
    with pytest.raises(
        fb.errors.SimulationError, match=r"t = 0.33[34] s: joint 'drive' .* cannot reach"
    ):
        fb.simulate(model, duration=1.0, step=1e-3)


@pytest.mark.parametrize("angle", [0.02, -1.43, 1.2])
def test_exactly_redundant_cranks_are_found_in_every_position(angle):
    """Five equal cranks at irregular places; their pivots are rounding errors of any size."""
    generator = np.random.default_rng(7)
    places = np.stack([np.linspace(0, 2, 5), generator.uniform(-0.5, 0.5, 5)], axis=1)
    x = 1.3 * np.cos(angle)
    y = 1.3 * np.sin(angle)
    points = {f"p{k}": tuple(place) for k, place in enumerate(places)}
    bodies = {"plate": fb.RigidBody(mass=9.0, inertia=4.0, position=(x, y), points=points)}
    joints = {}
    sensors = {}
    for k, (px, py) in enumerate(places):
        bodies[f"c{k}"] = fb.RigidBody.bar(
            length=1.3, start=(px, py), angle=angle, height=0.02, width=0.02, density=2000.0
        )
        joints[f"foot{k}"] = fb.Revolute(f"c{k}.start", (px, py))
        joints[f"top{k}"] = fb.Revolute(f"plate.p{k}", f"c{k}.end")
        sensors[f"R{k}"] = fb.Reaction(f"top{k}")
    model = fb.Mechanism(
        bodies=bodies, joints=joints, loads={"gravity": fb.Gravity()}, sensors=sensors
    )
    motion = fb.simulate(model, duration=0.05, step=1e-3)
    assert {"joint 'top0'", "joint 'top4'"} <= set(motion.attrs["not_unique"])
    assert np.abs(motion).max() < 9.81 * (9.0 + 5 * 1.04)


def test_sensors_of_forces_that_joints_share_are_warned_of():
    """A bar on one pin, which a second one doubles: each carries half of the weight."""

    def bar(*pins):
        return fb.Mechanism(
            bodies={"bar": fb.RigidBody.bar(length=1.0, height=0.02, width=0.02, density=1000.0)},
            joints={name: fb.Revolute("bar.start", (0.0, 0.0)) for name in pins},
            sensors={"F": fb.Reaction("A"), "x": fb.Position("bar")},
        )

    single_pin = fb.simulate(bar("A"), duration=0.01, step=1e-3)
    with pytest.warns(
        fb.errors.FlexbandWarning, match="sensor 'F' measures .* joint 'A' and joint 'A2'"
    ):
        two_pins = fb.simulate(bar("A", "A2"), duration=0.01, step=1e-3)
    names = ["F_X", "F_Y"]
    np.testing.assert_allclose(
        2 * two_pins.sel(output=names), single_pin.sel(output=names), rtol=1e-9
    )
