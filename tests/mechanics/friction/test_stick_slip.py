"""Sticking and sliding against exact solutions: a belt, inclines, brakes, and a wedge."""

import numpy as np
import pytest
from scipy.integrate import quad

import flexband as fb
from flexband.contact import Brake, Coulomb, FrictionForce

G = 9.81


def simulate(model, duration, count=20, tolerance=1e-10):
    integrator = fb.GeneralizedAlpha(step_tolerance=tolerance, spectral_radius=1.0)
    return fb.simulate(model, duration=duration, step=duration / count, integrator=integrator)


def values(motion, output):
    return motion.sel(output=output).values


def block(friction, *, angle=0.0, loads=None, **body):
    """A block of 1 kg in a guide that is tilted."""
    axis = float(np.cos(angle)), float(np.sin(angle))
    return fb.Mechanism(
        bodies={"m": fb.RigidBody(mass=1.0, inertia=0.01, **body)},
        joints={"guide": fb.Prismatic("m", (0.0, 0.0), axis, friction=friction, length=0.1)},
        loads={"g": fb.Gravity(), **(loads or {})},
        sensors={"x": fb.Position("m"), "v": fb.Velocity("m"), "F": FrictionForce("guide")},
    )


def test_a_block_on_a_belt_has_the_cycle_of_its_coefficients():
    """T_stick = 2 (x_s − x_k)/v₀ and ω T_slip = 2π − 2 arctan((x_s − x_k) ω/v₀)."""
    m = 1.0
    k = 100.0
    v0 = 0.2
    static = 0.4
    kinetic = 0.2
    law = Coulomb(kinetic=kinetic, static=static)
    belt = fb.Mechanism(
        bodies={
            "belt": fb.RigidBody(mass=1.0, inertia=1.0, velocity=(v0, 0.0)),
            "block": fb.RigidBody(mass=m, inertia=0.01, velocity=(v0, 0.0)),
        },
        joints={
            "bed": fb.Prismatic("belt", (0.0, 0.0)),
            "drive": fb.PrescribedTravel("belt", (0.0, 0.0), lambda t: v0 * np.asarray(t)),
            "face": fb.Prismatic("block", "belt", friction=law, length=0.1),
        },
        loads={"g": fb.Gravity(), "spring": fb.Spring("block", (-1.0, 0.0), k, 1.0)},
        sensors={"x": fb.Position("block"), "u": FrictionForce("face")},
    )
    # The cycle in closed form: the block sticks, then vibrates about the kinetic stretch.
    rate = np.sqrt(k / m)
    half_width = (static - kinetic) * m * G / k
    static_stretch = static * m * G / k
    stick = 2 * half_width / v0
    slip = (2 * np.pi - 2 * np.arctan(half_width * rate / v0)) / rate
    begin = static_stretch / v0
    lower_end = static_stretch - 2 * half_width
    cycle = stick + slip
    motion = simulate(belt, begin + 3 * cycle, 240, tolerance=1e-11)
    t = motion["time"].values
    x = values(motion, "x_X")
    u = values(motion, "u_speed")
    # Durations of sticking and of slipping, by the middles of three stages of sticking.
    middles = [begin + n * cycle - stick / 2 for n in (1, 2, 3)]
    middle_indices = [int(np.abs(t - middle).argmin()) for middle in middles]
    assert np.abs(u[middle_indices]).max() < 1e-11
    starts = t[middle_indices] - (x[middle_indices] - lower_end) / v0
    assert starts[0] - begin == pytest.approx(slip, rel=1e-4)
    assert starts[2] - starts[1] - slip == pytest.approx(stick, rel=1e-4)
    # The whole motion.
    phase = np.maximum(t - begin, 0.0) % cycle
    slip_mask = (t > begin) & (phase < slip)
    exact = np.where(t > begin, lower_end + v0 * (phase - slip), v0 * t)
    slip_path = (
        static_stretch
        - half_width
        + half_width * np.cos(rate * phase)
        + v0 / rate * np.sin(rate * phase)
    )
    np.testing.assert_allclose(
        x, np.where(slip_mask, slip_path, exact), rtol=0, atol=1e-5 * static_stretch
    )


@pytest.mark.parametrize("share", [0.9, 0.999])
def test_an_incline_holds_below_its_angle_of_friction(share):
    angle = share * float(np.arctan(0.3))
    motion = simulate(block(0.3, angle=angle), 0.5)
    assert np.abs(motion.sel(output=["x_X", "x_Y", "v_X", "v_Y"])).max() < 1e-13
    np.testing.assert_allclose(abs(values(motion, "F")), G * np.sin(angle), rtol=1e-9)


@pytest.mark.parametrize("speed", [0.0, -0.5])
def test_an_incline_above_its_angle_of_friction_lets_go(speed):
    """A block that is thrown uphill comes back."""
    angle = 0.5
    mu = 0.3
    uphill = G * (np.sin(angle) + mu * np.cos(angle))
    downhill = G * (np.sin(angle) - mu * np.cos(angle))
    turn = -speed / uphill
    height = 0.5 * speed**2 / uphill
    velocity = speed * np.cos(angle), speed * np.sin(angle)
    # the axis points downhill, so that the travel grows with gravity
    motion = simulate(block(mu, angle=angle + np.pi, velocity=tuple(-np.array(velocity))), 0.5)
    travel = -values(motion, "x_X") / np.cos(angle)
    t = motion["time"].values
    exact = np.where(
        t < turn,
        speed * t + 0.5 * uphill * t**2,
        -height + 0.5 * downhill * np.maximum(t - turn, 0) ** 2,
    )
    np.testing.assert_allclose(travel, exact, rtol=0, atol=1e-7)


def test_the_stribeck_and_viscous_parts_act_on_the_sliding_speed():
    """u̇ = −(µ(u) g + c u/m), against its integral by quadrature."""
    law = Coulomb(kinetic=0.1, static=0.3, stribeck_speed=0.4, viscous=0.7)
    speed = 1.5
    model = block(law, velocity=(speed, 0.0))

    def slowing(u):
        return (0.1 + 0.2 * np.exp(-((u / 0.4) ** 2))) * G + 0.7 * u

    stop = quad(lambda u: 1.0 / slowing(u), 0.0, speed, epsabs=1e-13)[0]
    distance = quad(lambda u: u / slowing(u), 0.0, speed, epsabs=1e-13)[0]
    motion = simulate(model, 1.1 * stop)
    assert values(motion, "x_X")[-1] == pytest.approx(distance, rel=1e-6)
    assert values(motion, "v_X")[-1] == pytest.approx(0.0, abs=1e-13)
    index = int(0.5 * stop / (1.1 * stop / 20))
    u = values(motion, "v_X")[index]
    assert abs(values(motion, "F")[index]) == pytest.approx(slowing(u), rel=1e-6)


def test_what_sticks_does_not_creep():
    """100 cycles of a force of (0.5 ± 0.4) of the static limit, on a block and in a brake."""
    limit = 0.3 * G
    pull = fb.Force("m", x=lambda t: limit * (0.5 + 0.4 * np.sin(2 * np.pi * np.asarray(t))))
    motion = simulate(block(0.3, loads={"pull": pull}), 100.0, 100, tolerance=1e-6)
    assert np.abs(values(motion, "x_X")).max() < 1e-13
    assert np.abs(values(motion, "v_X")).max() < 1e-13


def pendulum(moment, angle, rate=0.0):
    m = 1.0
    length = 0.5
    return fb.Mechanism(
        bodies={"rod": fb.RigidBody(
            mass=m, inertia=0.02, angle=angle, rate=rate, points={"pin": (0.0, length)},
            position=(length * np.sin(angle), -length * np.cos(angle)),
            velocity=(rate * length * np.cos(angle), rate * length * np.sin(angle)),
        )},
        joints={"pin": fb.Revolute("rod.pin", (0.0, 0.0))},
        loads={"g": fb.Gravity(), "brake": Brake(
            "rod.pin", (0.0, 0.0), friction=0.4, radius=0.1, force=moment / 0.04)},
        sensors={"angle": fb.Angle("rod"), "rate": fb.AngularVelocity("rod"),
                 "most": fb.sensors.Largest(fb.Position("rod"), window=(0.8, 9.0)),
                 "least": fb.sensors.Smallest(fb.Position("rod")),
                 "M": FrictionForce("brake", angular=True),
                 "W": fb.Work("brake"), "T": fb.KineticEnergy(), "V": fb.PotentialEnergy()},
    )  # fmt: skip


def test_a_pendulum_with_a_brake_loses_the_work_of_its_friction_in_each_half_swing():
    """m g L (cos θ₂ − cos θ₁) = M (θ₁ + θ₂), and it stays where m g L |sin θ| ≤ M."""
    M = 0.3
    weight = 1.0 * G * 0.5
    first = 1.0
    motion = simulate(pendulum(M, first), 9.0, 90)
    second = np.arcsin(-values(motion, "least_X")[-1] / 0.5)
    assert weight * (np.cos(second) - np.cos(first)) == pytest.approx(
        M * (first + second), rel=1e-5
    )
    third = np.arcsin(values(motion, "most_X")[-1] / 0.5)
    assert weight * (np.cos(third) - np.cos(second)) == pytest.approx(
        M * (second + third), rel=1e-5
    )
    angle = values(motion, "angle")
    energy = values(motion, "T") + values(motion, "V")
    np.testing.assert_allclose(values(motion, "W"), energy - energy[0], rtol=0, atol=2e-7)
    assert np.ptp(angle[-10:]) < 1e-13
    assert weight * abs(np.sin(angle[-1])) <= M
    assert abs(values(motion, "M")[-1]) == pytest.approx(weight * abs(np.sin(angle[-1])), rel=1e-8)


def test_a_brake_holds_a_pendulum_that_it_can_hold():
    angle = 0.99 * np.arcsin(0.3 / (G * 0.5))
    motion = simulate(pendulum(0.3, angle), 2.0)
    np.testing.assert_allclose(values(motion, "angle"), angle, rtol=0, atol=1e-13)


def test_a_brake_follows_the_force_in_time():
    """It holds until F(t) has fallen to what the moment of a weight needs."""
    inertia = 0.2
    moment = 1.0
    mu = 0.5
    r = 0.1
    wheel = fb.Mechanism(
        bodies={"wheel": fb.RigidBody(mass=1.0, inertia=inertia)},
        joints={"axle": fb.Revolute("wheel", (0.0, 0.0))},
        loads={"M": fb.Moment("wheel", moment), "brake": Brake(
            "wheel", (0.0, 0.0), friction=mu, radius=r,
            force=lambda t: 30.0 - 20.0 * np.asarray(t))},
        sensors={"angle": fb.Angle("wheel")},
    )  # fmt: skip
    begin = 0.5
    fall = mu * r * 20.0  # slides from t = 0.5 on; the moment falls by 1 N m/s
    motion = simulate(wheel, 1.0)
    t = motion["time"].values
    exact = fall * np.maximum(t - begin, 0.0) ** 3 / (6 * inertia)
    np.testing.assert_allclose(values(motion, "angle"), exact, rtol=0, atol=1e-7)


@pytest.mark.parametrize("share", [0.95, 1.05])
def test_a_wedge_with_two_rough_faces_slides_out_above_twice_the_angle_of_friction(share):
    """Two plates press a light wedge of angle α; it stays if α < 2 arctan µ."""
    mu = 0.2
    mass = 1e-3
    press = 100.0
    alpha = share * 2 * float(np.arctan(mu))
    half = alpha / 2
    # faces at ±half to the X axis; two plates guided along Y are pressed together
    bodies = {"wedge": fb.RigidBody(mass=mass, inertia=1e-6)}
    joints = {}
    loads = {}
    for side in (1, -1):
        name = f"plate {side}"
        bodies[name] = fb.RigidBody(mass=1e-3, inertia=1e-6, angle=-side * half)
        joints[name] = fb.Prismatic(name, (0.0, 0.0), (0.0, 1.0), angle=-side * half)
        joints[f"face {side}"] = fb.Slot(name, "wedge", (np.cos(half), -side * np.sin(half)), mu)
        loads[name] = fb.Force(name, y=-side * press)
    joints["wedge"] = fb.Prismatic("wedge", (0.0, 0.0))
    model = fb.Mechanism(
        bodies=bodies, joints=joints, loads=loads, sensors={"x": fb.Position("wedge")}
    )
    x = values(simulate(model, 1e-3, 5), "x_X")
    if share < 1:
        assert np.abs(x).max() < 1e-13
    else:
        assert np.abs(x[-1]) > 1e-5
