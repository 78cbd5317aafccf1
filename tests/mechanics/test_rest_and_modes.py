"""What statics and modes take for stuck, what they leave out, and motions that begin at a rest."""

import numpy as np
import pytest

import flexband as fb
from flexband import contact

LAW = contact.KeepsRestitution(stiffness=1e6, restitution=0.5, exponent=1.0)
PIN = {"r": fb.Revolute("a", (0.0, 0.0))}
TORSION = {"t": fb.TorsionSpring("a", stiffness=50.0)}
PULL = {"s": fb.Spring("a", (-1.0, 0.0), 100.0)}


def disc(joints, loads):
    return fb.Mechanism(
        bodies={"a": fb.RigidBody(mass=1.0, inertia=1.0)},
        joints=joints,
        loads=loads,
        sensors={"p": fb.Position("a")},
    )


def brake(force):
    return {"b": contact.Brake("a", (0.0, 0.0), force=force, friction=0.3, radius=0.1)}


def gears(moment):
    return fb.Mechanism(
        bodies={
            "a": fb.RigidBody(mass=1.0, inertia=1.0),
            "b": fb.RigidBody(mass=1.0, inertia=2.0, position=(0.3, 0.0)),
        },
        joints={
            "p": fb.Revolute("a", (0.0, 0.0)),
            "q": fb.Revolute("b", (0.3, 0.0)),
            "g": fb.Gear("a", "b", 0.1, 0.2, efficiency=0.9),
        },
        loads={**TORSION, "M": fb.Moment("b", moment)},
        sensors={"a": fb.Angle("a")},
    )


def shafts(force):
    """Three discs, two of which a spring couples; a clutch is between the first two."""
    inertias = {"a": 1.0, "b": 2.0, "c": 0.5}
    return fb.Mechanism(
        bodies={name: fb.RigidBody(mass=1.0, inertia=J) for name, J in inertias.items()},
        joints={name: fb.Revolute(name, (0.0, 0.0)) for name in inertias},
        loads={
            "shaft": fb.TorsionSpring("b", "c", 1000.0),
            "clutch": contact.Clutch("a", "b", force=force, friction=0.3, radius=0.1),
        },
        sensors={"b": fb.Angle("b")},
    )


GRAVITY = {"g": fb.Gravity()}
RAIL = {"r": fb.Slot("a", (0.0, 0.0), friction=0.3)}
SMOOTH = {"r": fb.Slot("a", (0.0, 0.0), friction=0.0)}
ROUGH_PIN = {"r": fb.Revolute("a", (0.0, 0.0), radius=0.01, friction=0.2)}


@pytest.mark.parametrize(
    ("model", "rates", "sticking_parts"),
    [
        (shafts(0.0), [0.0, 0.0, 50.0], []),
        (shafts(9.0), [0.0, np.sqrt(1000 * (1 / 3 + 1 / 0.5))], ["clutch"]),
        (disc(PIN, {**TORSION, **brake(0.0)}), [np.sqrt(50)], []),
        (disc(SMOOTH, {**PULL, **TORSION, **GRAVITY}), [np.sqrt(50), 10.0], []),
        (disc(RAIL, {**PULL, **TORSION}), [np.sqrt(50), 10.0], []),
        (disc(RAIL, {**PULL, **TORSION, **GRAVITY}), [np.sqrt(50)], ["r"]),
        (disc(ROUGH_PIN, TORSION), [np.sqrt(50)], []),
        (gears(0.0), [np.sqrt(50 / 1.5)], []),
    ],
)
def test_friction_that_can_hold_nothing_is_free_in_modes(model, rates, sticking_parts):
    modes = fb.modes(model, 4)
    np.testing.assert_allclose(2 * np.pi * modes["frequency"], rates, rtol=1e-9, atol=1e-12)
    assert modes.attrs["stuck"] == sticking_parts


def test_friction_that_holds_all_is_named():
    with pytest.raises(fb.errors.InputError, match="friction holds all that can move"):
        fb.modes(disc(ROUGH_PIN, TORSION | GRAVITY), 1)


@pytest.mark.parametrize("height", [0.1 - 9.81e-6, 0.1 - 9.8e-6, 0.1 - 5e-6])
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_wheel_on_a_floor_rests_and_rolls(height, friction):
    floor = contact.Contact(
        "a", (0.0, 0.0), contact.CircleOnLine(radius=0.1), LAW, friction=friction,
        closed_at_start=True,
    )  # fmt: skip
    wheel = fb.Mechanism(
        bodies={"a": fb.RigidBody(mass=1.0, inertia=0.004, position=(0.0, height))},
        loads={"floor": floor, **GRAVITY},
        sensors={"p": fb.Position("a")},
    )
    with pytest.warns(fb.errors.FlexbandWarning, match="is left out of the equil"):
        x, y = fb.equilibrium(wheel).values
    assert (x, y) == pytest.approx((0.0, 0.1 - 9.81e-6), abs=1e-9)
    modes = fb.modes(wheel, 4)
    zero = 1 if friction else 2
    np.testing.assert_array_equal(modes["frequency"][:zero], 0.0)
    assert 2 * np.pi * modes["frequency"].values[zero:] == pytest.approx([1000.0], rel=1e-3)


@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_modes_of_free_bodies(damping):
    pair = fb.Mechanism(
        bodies={
            "a": fb.PointMass(mass=1.0),
            "b": fb.PointMass(mass=2.0, position=(1.0, 0.0)),
        },
        loads={"s": fb.Spring("a", "b", 100.0, 1.0, damping=damping)},
    )
    modes = fb.modes(pair, 6)
    exact = np.sqrt(100 / (2 / 3))
    np.testing.assert_allclose(2 * np.pi * modes["frequency"], [0, 0, 0, exact], rtol=1e-9)
    ratio = damping / (2 * (2 / 3) * exact)
    np.testing.assert_allclose(modes["damping_ratio"].values[3], ratio, rtol=1e-6, atol=1e-12)
    mechanism = fb.Mechanism(
        bodies={"a": fb.RigidBody(mass=2.0, inertia=1.0)},
        loads={"v": fb.ViscousFriction("a", (0.0, 0.0), 3.0)},
    )
    s = fb.modes(mechanism, 6)["eigenvalue"].values
    np.testing.assert_allclose(np.sort(s), [-1.5, -1.5, 0, 0, 0], atol=1e-9)


def mass_on_rope(with_hand, speed=0.0):
    loads = {"g": fb.Gravity(), "rope": fb.Spring("m", (0.0, 10.0), 100.0, 4.0)}
    if with_hand:
        loads["hand"] = fb.Force("m", 0.0, -300.0)
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=10.0, velocity=(0.0, speed))},
        joints={"s": fb.Slot("m", (0.0, 0.0), axis=(0.0, 1.0))},
        loads=loads,
        sensors={"y": fb.Position("m"), "v": fb.Velocity("m")},
    )


@pytest.mark.parametrize("speed", [0.0, 2.0])
def test_what_is_held_is_released_with_a_speed(speed):
    rest = fb.equilibrium(mass_on_rope(with_hand=True), keep_state=True)
    motion = fb.simulate(
        mass_on_rope(with_hand=False, speed=speed), duration=1.0, step=1e-3, start=rest
    )
    level = 6.0 - 98.1 / 100
    w = np.sqrt(10.0)
    t = motion["time"].values
    exact = level - 3.0 * np.cos(w * t) + speed / w * np.sin(w * t)
    np.testing.assert_allclose(motion.sel(output="y_Y"), exact, atol=2e-5)
    assert motion.sel(output="v_Y").values[0] == pytest.approx(speed, abs=1e-12)


@pytest.mark.parametrize("first", [True, False])
def test_a_static_start_has_the_joints_that_are_active(first):
    """A weight on a spring that is caught, or held where it is drawn, at 0.5 s."""
    catch = contact.Switched(fb.Revolute("m", (0.0, 0.0)), lambda t: (t < 0.5) == first)
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=10.0)},
        joints={"s": fb.Slot("m", (0.0, 0.0), axis=(0.0, 1.0)), "catch": catch},
        loads={"g": fb.Gravity(), "rope": fb.Spring("m", (0.0, 10.0), 100.0, 4.0)},
        sensors={"y": fb.Position("m")},
    )
    motion = fb.simulate(model, duration=1.0, step=1e-3, start="static")
    y = motion.sel(output="y_Y").values
    t = motion["time"].values
    level = 6.0 - 98.1 / 100
    if first:
        swing_time = np.maximum(t - 0.5, 0.0)
        np.testing.assert_allclose(y, level * (1 - np.cos(np.sqrt(10) * swing_time)), atol=3e-5)
    else:
        np.testing.assert_allclose(y, level, atol=1e-9)


@pytest.mark.parametrize("solve", [fb.equilibrium, lambda m: fb.modes(m, 2)])
def test_sensors_of_a_motion_are_left_out_of_statics_and_modes(solve):
    model = fb.Mechanism(
        bodies={"a": fb.PointMass(mass=1.0)},
        joints={"s": fb.Slot("a", (0.0, 0.0), axis=(0.0, 1.0))},
        loads={
            "k": fb.Spring("a", (0.0, -1.0), 100.0, 1.0),
            "c": contact.Stop("a", (0.0, 0.0), LAW, lower=-0.5, axis=(0.0, 1.0)),
        },
        sensors={
            "p": fb.Position("a"),
            "c": contact.Contacts("c"),
            "W": fb.Work("k"),
            "P": fb.sensors.Power("k"),
            "L": fb.sensors.Largest(fb.Position("a")),
        },
    )
    with pytest.warns(fb.errors.FlexbandWarning, match="left out: 'c', 'W', 'P', 'L', since"):
        result = solve(model)
    assert result["output"].values.tolist() == ["p_X", "p_Y"]
    assert result.attrs["left_out"] == ["c", "W", "P", "L"]
