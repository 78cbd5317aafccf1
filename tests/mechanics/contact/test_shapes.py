"""Angular stops, ends of lines and holes in motion, against exact impacts and SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flexband as fb
from flexband import contact

K = 1e6
RADIUS = 0.05


def integrator_of(tolerance):
    return fb.GeneralizedAlpha(step_tolerance=tolerance)


def linear(restitution=1.0, stiffness=K):
    return contact.KeepsRestitution(stiffness=stiffness, restitution=restitution, exponent=1.0)


def discs(law, **limits):
    """Two discs on one shaft that turn against each other."""
    bodies = {
        "a": fb.RigidBody(mass=1.0, inertia=0.1, rate=5.0),
        "b": fb.RigidBody(mass=1.0, inertia=0.3, rate=-1.0),
    }
    return fb.Mechanism(
        bodies=bodies,
        joints={name: fb.Revolute(name, (0.0, 0.0)) for name in bodies},
        loads={"stop": contact.AngularStop("a", "b", law, **limits)},
        sensors={"a": fb.AngularVelocity("a"), "b": fb.AngularVelocity("b"),
                 "c": contact.Contacts("stop", first=2, angular=True),
                 "gap": contact.Gap("stop", angular=True)},
    )  # fmt: skip


def test_an_angular_stop_reverses_the_relative_rate_after_more_than_a_turn():
    """6 rad/s against each other, e = 0.8: the momentum remains, the difference becomes −4.8."""
    motion = fb.simulate(discs(linear(0.8), upper=9.0), duration=2.0, step=0.1,
                         integrator=integrator_of(1e-10))  # fmt: skip
    end = motion.isel(time=-1)
    difference = -0.8 * 6.0
    momentum = 0.1 * 5.0 - 0.3 * 1.0
    b = (momentum - 0.1 * difference) / 0.4
    assert float(end.sel(output="c_t1")) == pytest.approx(1.5, abs=1e-6)
    assert float(end.sel(output="b")) == pytest.approx(b, abs=5e-6)
    assert float(end.sel(output="a")) == pytest.approx(b + difference, abs=5e-6)
    assert float(end.sel(output="c_energy")) == pytest.approx(0.5 * 0.075 * 36.0 * 0.36, rel=1e-5)
    np.testing.assert_allclose(motion.sel(output="gap")[:15], 9.0 - 0.6 * np.arange(15), atol=1e-6)


def test_both_limits_of_an_angular_stop_hold_and_the_second_impact_is_in_time():
    """A half period of the relative vibration is π√(I/K), I = I₁I₂/(I₁ + I₂)."""
    motion = fb.simulate(discs(linear(), lower=-0.3, upper=0.6), duration=0.4, step=0.1,
                         integrator=integrator_of(1e-10)).isel(time=-1)  # fmt: skip
    contact_time = np.pi * np.sqrt(0.075 / K)
    exact = [0.1, 0.1 + contact_time + 0.9 / 6.0]
    np.testing.assert_allclose(motion.sel(output=["c_t1", "c_t2"]), exact, rtol=0, atol=1e-7)


def nearest(x, y):
    """Return the place of the table, from −0.2 to 0.1 m at Y = 0, that is nearest."""
    return min(max(x, -0.2), 0.1), 0.0


def rates_of(law, place, gravity, approach_speed):
    """Return ÿ of a ball of 1 kg in contact with what is `nearest`, for its `approach_speed`."""
    stiffness = law.stiffness
    damping = float(law.damping(np.asarray(law.restitution)))

    def rates(_, y):
        qx, qy = nearest(*y[:2]) if place is None else place
        dx = y[0] - qx
        dy = y[1] - qy
        d = np.hypot(dx, dy)
        depth = RADIUS - d
        rate = -(dx * y[2] + dy * y[3]) / d
        force = max(stiffness * max(depth, 0.0) * (1 + damping * rate / approach_speed), 0.0)
        return [y[2], y[3], force * dx / d, force * dy / d - gravity]

    return rates


def ball(law, *, position, velocity, gravity, closed_at_start=False):
    table = contact.CircleOnLine(radius=RADIUS, normal=(0.0, 1.0), ends=(-0.2, 0.1))
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=position, velocity=velocity)},
        loads={"table": contact.Contact(
                   "m", (0.0, 0.0), table, law, closed_at_start=closed_at_start),
               "g": fb.Gravity(y=-gravity)},
        sensors={"x": fb.Position("m"), "c": contact.Contacts("table", first=1)},
    )  # fmt: skip


def test_a_ball_rolls_off_the_end_of_a_line():
    """It rests on the table, slides over its end and around it, and falls."""
    law = linear()
    g = 9.81
    start = (0.0, RADIUS - g / K), (0.6, 0.0)
    motion = fb.simulate(ball(law, position=start[0], velocity=start[1], gravity=g,
                              closed_at_start=True),
                         duration=0.4, step=0.02, integrator=integrator_of(1e-10))  # fmt: skip
    y0 = [*start[0], *start[1]]
    t = motion["time"].values
    exact = solve_ivp(rates_of(law, None, g, 1.0), (0, 0.4), y0, "DOP853", t, rtol=1e-11,
                      atol=1e-13, max_step=1e-3)  # fmt: skip
    np.testing.assert_allclose(motion.sel(output=["x_X", "x_Y"]), exact.y[:2], rtol=0, atol=1e-6)
    assert float(motion.sel(output="x_Y")[-1]) < -0.1


@pytest.mark.parametrize("x", [0.13, 0.1 + RADIUS + 1e-6, -0.2 - RADIUS + 1e-3])
def test_a_ball_that_falls_on_the_end_of_a_line_leaves_it_sideways(x):
    law = linear(0.6)
    motion = fb.simulate(ball(law, position=(x, 0.1), velocity=(0.0, -1.0), gravity=0.0),
                         duration=0.15, step=0.01, integrator=integrator_of(1e-11))  # fmt: skip
    end = (0.1, 0.0) if x > 0 else (-0.2, 0.0)
    square_height = RADIUS**2 - (x - end[0]) ** 2
    exact = np.array([x, -0.05])
    if square_height > 0:
        first = 0.1 - np.sqrt(square_height)
        approach_speed = np.sqrt(square_height) / RADIUS
        assert float(motion.sel(output="c_t1")[-1]) == pytest.approx(first, abs=1e-9)
        y0 = [x, 0.1 - first, 0.0, -1.0]
        solution = solve_ivp(rates_of(law, end, 0.0, approach_speed), (first, 0.15), y0, "DOP853",
                             rtol=1e-11, atol=1e-13, max_step=1e-3)  # fmt: skip
        exact = solution.y[:2, -1]
    np.testing.assert_allclose(motion.sel(output=["x_X", "x_Y"])[:, -1], exact, rtol=0, atol=1e-6)


def test_a_ring_and_the_ball_in_it_have_the_motion_of_their_reduced_mass():
    """The centre moves on; the ball's place in the hole is that of a mass m₁m₂/(m₁ + m₂)."""
    inner = 0.02
    hole = 0.05
    m = np.array([1.0, 3.0])
    law = linear(stiffness=1e5)
    start = (0.01, 0.0)
    velocities = ((0.3, 1.1), (-0.2, 0.0))
    motion = fb.simulate(
        fb.Mechanism(
            bodies={
                "ball": fb.PointMass(mass=m[0], position=start, velocity=velocities[0]),
                "ring": fb.PointMass(mass=m[1], velocity=velocities[1]),
            },
            loads={"c": contact.Contact(
                "ball", "ring", contact.CircleInCircle(radii=(inner, hole)), law)},
            sensors={"a": fb.Position("ball"), "b": fb.Position("ring"),
                     "c": contact.Contacts("c", first=3)},
        ),
        duration=0.1, step=0.01, integrator=integrator_of(1e-11),
    )  # fmt: skip
    reduced_mass = m[0] * m[1] / m.sum()
    t = motion["time"].values

    def rates(_, y):
        d = np.hypot(*y[:2])
        force = 1e5 * max(d - (hole - inner), 0.0)
        return [*y[2:], *(-force / reduced_mass * y[:2] / d)]

    y0 = np.concatenate([start, np.subtract(*velocities)])
    exact = solve_ivp(rates, (0, 0.1), y0, "DOP853", t, rtol=1e-12, atol=1e-14, max_step=1e-3)
    a, b = (motion.sel(output=[f"{name}_X", f"{name}_Y"]).values for name in "ab")
    np.testing.assert_allclose(a - b, exact.y[:2], rtol=0, atol=1e-6)
    centre = (m[0] * a + m[1] * b) / m.sum()
    centre_velocity = (m[0] * np.array(velocities[0]) + m[1] * np.array(velocities[1])) / m.sum()
    first = m[0] * np.array(start) / m.sum()
    np.testing.assert_allclose(
        centre, first[:, None] + centre_velocity[:, None] * t, rtol=0, atol=1e-12
    )
    assert int(motion.sel(output="c_number")[-1]) >= 2


def test_an_overlap_is_relaxed_by_a_start_at_rest():
    """The ball starts 1 mm deep, is refused as it is given, and lies still at mg/K."""
    model = ball(linear(), position=(0.0, RADIUS - 1e-3), velocity=(0.0, 0.0), gravity=9.81)
    mechanism = fb.Mechanism(
        bodies=model.bodies, loads=model.loads, sensors=model.sensors,
        joints={"guide": fb.Slot("m", (0.0, 0.0), axis=(0.0, 1.0))},
    )  # fmt: skip
    with pytest.raises(fb.errors.AssemblyError, match=r"'table' is closed at the start, by 0\.001"):
        fb.simulate(mechanism, duration=0.1, step=0.01)
    motion = fb.simulate(mechanism, duration=0.1, step=0.01, start="static")
    height = motion.sel(output="x_Y").values
    np.testing.assert_allclose(height, RADIUS - 9.81 / K, rtol=0, atol=1e-10)
    assert int(motion.sel(output="c_number")[-1]) == 0
