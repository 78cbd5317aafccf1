"""Forces, springs, friction and force laws against exact motions."""

import numpy as np
import pytest

import flexband as fb
from tests.mechanics.models import beam, block, motion_of, slider_crank, spring_and_moment, wheel


def test_moment_turns_a_disc_any_number_of_times():
    disc = fb.RigidBody.disc(radius=0.2, width=0.05, density=1000.0)
    assert disc.inertia == pytest.approx(0.5 * disc.mass * 0.2**2)
    assert disc.mass == pytest.approx(1000 * np.pi * 0.04 * 0.05)
    motion = motion_of(
        bodies={"disc": disc},
        joints={"axle": fb.Revolute("disc", (0.1, 0.2))},
        loads={"motor": fb.Moment("disc", lambda t: 20.0 * np.cos(3 * t))},
        sensors={"angle": fb.Angle("disc"), "rate": fb.AngularVelocity("disc")},
        step=1e-4,
    )
    t = motion.time.values
    per = 20.0 / disc.inertia
    exact = per / 9 * (1 - np.cos(3 * t))
    assert exact[-1] > 2 * 2 * np.pi
    np.testing.assert_allclose(motion.sel(output="angle"), exact, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(motion.sel(output="rate"), per / 3 * np.sin(3 * t), rtol=1e-4)


def test_damped_driven_oscillator():
    """m x″ + d x′ + k x = −f: from rest under a step of the pull, in closed form."""
    mass = 2.0
    k = 800.0
    d = 6.0
    pull = 5.0
    motion = motion_of(
        bodies={"m": fb.PointMass(mass=mass, position=(1.0, 0.0))},
        joints={"line": fb.Slot("m", (0.0, 0.0))},
        loads={"s": fb.Spring("m", (0.0, 0.0), k, 1.0, damping=d, pull=lambda t: pull)},
        sensors={
            "r": fb.Position("m"),
            "v": fb.Velocity("m"),
            "a": fb.Acceleration("m"),
            "s": fb.SpringForce("s"),
        },
    )
    t = motion.time.values
    zeta = d / (2 * mass)
    w = np.sqrt(k / mass - zeta**2)
    ringing = np.exp(-zeta * t) * (np.cos(w * t) + zeta / w * np.sin(w * t))
    np.testing.assert_allclose(motion.sel(output="r_X"), 1 - pull / k * (1 - ringing), atol=2e-6)
    rate = -pull / k * np.exp(-zeta * t) * (zeta**2 + w**2) / w * np.sin(w * t)
    np.testing.assert_allclose(motion.sel(output="v_X"), rate, atol=3e-5)
    balance = mass * motion.sel(output="a_X") + d * motion.sel(output="v_X")
    balance = balance + k * (motion.sel(output="r_X") - 1) + pull
    np.testing.assert_allclose(balance, 0.0, atol=1e-8)
    force = -mass * motion.sel(output="a_X")
    np.testing.assert_allclose(motion.sel(output="s_F"), force, atol=1e-8)
    np.testing.assert_allclose(motion.sel(output="s_l"), motion.sel(output="r_X"), atol=1e-12)


def test_cubic_spring_keeps_energy():
    motion = motion_of(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.2, 0.0))},
        joints={"line": fb.Slot("m", (0.0, 0.0))},
        loads={"s": fb.Spring("m", (0.0, 0.0), 10.0, 1.0, cubic=2000.0)},
        sensors={"r": fb.Position("m"), "T": fb.KineticEnergy()},
    )
    x = motion.sel(output="r_X") - 1.0
    energy = motion.sel(output="T") + 5.0 * x**2 + 500.0 * x**4
    np.testing.assert_allclose(energy, energy[0], rtol=1e-4)


def test_force_of_a_spring_that_is_relaxed_at_the_start():
    k = np.array([50.0, 80.0])
    motion = motion_of(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.1, 0.0))},
        joints={"drive": fb.PrescribedPath("m", lambda t: 1.1 + t, lambda t: 0.0)},
        loads={"s": fb.Spring("m", (0.0, 0.0), k, cubic=30.0)},
        sensors={"s": fb.SpringForce("s"), "F": fb.Reaction("drive")},
    )
    t = motion.time.values
    exact = k[:, None] * t + 30.0 * t**3
    np.testing.assert_allclose(motion.sel(output="s_F"), exact, atol=1e-6)
    np.testing.assert_allclose(motion.sel(output="F_X")[:, 50:], exact[:, 50:], atol=1e-3)


def test_following_force_spirals_and_a_fixed_one_does_not():
    """A spinning body pushed along its own x axis: v = a/ω (sin ωt, 1 − cos ωt)."""
    body = fb.RigidBody(mass=2.0, inertia=0.1, rate=6.0, points={"tail": (-0.1, 0.0)})
    motion = motion_of(
        bodies={"b": body, "c": body},
        loads={
            "jet": fb.Force("b.tail", x=4.0, following=True),
            "wind": fb.Force("c", x=np.array([4.0, 8.0]), y=lambda t: t),
        },
        sensors={"b": fb.Velocity("b"), "c": fb.Velocity("c"), "turn": fb.Angle("b.tail")},
    )
    t = motion.time.values
    exact = 2.0 / 6.0 * np.stack([np.sin(6 * t), 1 - np.cos(6 * t)])
    np.testing.assert_allclose(motion.sel(output=["b_X", "b_Y"])[0], exact, atol=1e-5)
    np.testing.assert_allclose(motion.sel(output="turn")[0], 6 * t, atol=1e-4)
    np.testing.assert_allclose(motion.sel(output="c_X")[1], 4 * t, atol=1e-9)
    np.testing.assert_allclose(motion.sel(output="c_Y")[1], t**2 / 4, atol=1e-6)


def test_distributed_load_has_the_resultant_and_moment_of_its_integral():
    length = np.array([1.0, 1.3])
    model = fb.Mechanism(bodies={"b": beam(elements=3, length=length, height=0.1)}).model
    load = {
        j: f.terms[0, 0, None] for j, f in model.line_load("b", 50.0, lambda x: 60 * x**2).items()
    }
    resultant = [sum(load[1 + axis + 6 * k] for k in range(4)) for axis in range(2)]
    np.testing.assert_allclose(resultant, [50 * length, 20 * length**3], rtol=1e-12)
    turn = sum(load[2 + 6 * k] * length * k / 3 + load[4 + 6 * k] for k in range(4))
    np.testing.assert_allclose(turn, 15 * length**4, rtol=1e-12)  # ∫ x f dx about the start


def test_distributed_load_may_grow_with_time():
    motion = motion_of(
        bodies={"b": beam(elements=1, height=0.1, youngs_modulus=1e12)},
        loads={"q": fb.DistributedLoad("b", x=270.0, factor=lambda t: t)},
        sensors={"b": fb.Velocity("b.start")},
    )
    mass = 2700 * 0.1 * 0.1 * 1.3
    exact = 270.0 * 1.3 / mass * motion.time.values**2 / 2
    np.testing.assert_allclose(motion.sel(output="b_X"), exact, atol=1e-5)


def test_spring_is_relaxed_at_the_start_unless_told():
    motion = fb.simulate(slider_crank(angle=lambda t: 0.0), duration=0.05, step=1e-3)
    assert np.abs(motion.sel(output=["F_X", "F_Y"])).max() < 1e-6


def test_a_spring_may_pass_through_length_zero():
    mechanism = fb.Mechanism(
        bodies={"a": block()},
        loads={"spring": fb.Spring("a", (0.0, 0.0), 10.0, rest_length=0.0), "g": fb.Gravity()},
        sensors={"a": fb.Position("a")},
    )
    motion = fb.simulate(mechanism, duration=1.0, step=1e-3)  # k = 10 N/m, m = 1 kg
    exact = 0.981 * (np.cos(np.sqrt(10.0) * motion.time) - 1)
    np.testing.assert_allclose(motion.sel(output="a_Y"), exact, atol=1e-5)


UNDAMPED = fb.GeneralizedAlpha(spectral_radius=1.0)


def test_a_torsion_pendulum():
    """J θ̈ + d θ̇ + k θ = 0 from rest at θ₀, and its frequency."""
    J = 0.5
    k = np.array([8.0, 20.0])
    d = 0.3
    start = 0.7
    model = fb.Mechanism(
        bodies={"w": wheel(inertia=J, angle=start)},
        joints={"pin": fb.Revolute("w", (0.0, 0.0))},
        loads={"t": fb.TorsionSpring("w", (0.0, 0.0), stiffness=k, rest_angle=0.0, damping=d)},
        sensors={"a": fb.Angle("w"), "m": fb.SpringMoment("t"), "E": fb.ElasticEnergy()},
    )
    motion = fb.simulate(model, duration=2.0, step=1e-3, integrator=UNDAMPED)
    t = motion["time"].values
    zeta = d / (2 * J)
    w = np.sqrt(k / J - zeta**2)[:, None]
    exact = start * np.exp(-zeta * t) * (np.cos(w * t) + zeta / w * np.sin(w * t))
    angle = motion.sel(output="a")
    moment = motion.sel(output="m_M")
    np.testing.assert_allclose(angle, exact, atol=5e-5)
    rate = np.gradient(exact, t, axis=1, edge_order=2)
    np.testing.assert_allclose(moment, -k[:, None] * exact - d * rate, atol=2e-3)
    np.testing.assert_allclose(motion.sel(output="E"), 0.5 * k[:, None] * angle**2, atol=1e-9)
    undamped_pendulum = fb.Mechanism(
        bodies=model.bodies, joints=model.joints, sensors=model.sensors,
        loads={"t": fb.TorsionSpring("w", (0.0, 0.0), stiffness=k, rest_angle=0.0)},
    )  # fmt: skip
    frequencies = fb.modes(undamped_pendulum, 1)["frequency"][:, 0]
    np.testing.assert_allclose(frequencies, np.sqrt(k / J) / (2 * np.pi), rtol=1e-7)


def test_a_torsion_spring_counts_turns_and_a_motor_winds_it_up():
    """A weak spring, relaxed at the start, and a moment that turns the wheel many times."""
    J = 0.5
    k = 0.02
    T = 3.0
    model = fb.Mechanism(
        bodies={"w": wheel(inertia=J, angle=0.4)},
        joints={"pin": fb.Revolute("w", (0.0, 0.0))},
        loads={"t": fb.TorsionSpring("w", (0.0, 0.0), stiffness=k, torque=lambda t: T)},
        sensors={"a": fb.Angle("w"), "W": fb.Work("t"), "E": fb.KineticEnergy()},
    )
    motion = fb.simulate(model, duration=5.0, step=1e-3)
    t = motion["time"].values
    w = np.sqrt(k / J)
    exact = T / k * (1 - np.cos(w * t))
    assert exact[-1] > 4 * 2 * np.pi
    np.testing.assert_allclose(motion.sel(output="a") - 0.4, exact, rtol=2e-4, atol=1e-6)
    work = motion.sel(output="W")
    energy = motion.sel(output="E")
    np.testing.assert_allclose(work, energy, atol=1e-3 * float(energy.max()))


def test_friction_in_a_guide_and_in_a_pin():
    """v = v₀ e^(−dt/m) and ω = ω₀ e^(−dt/J)."""
    m = 2.0
    J = 0.5
    d = np.array([0.8, 3.0])
    block = fb.RigidBody(mass=m, inertia=1.0, velocity=(1.5, 0.0))
    rotor = wheel(inertia=J, position=(0.0, 1.0), rate=4.0)
    model = fb.Mechanism(
        bodies={"b": block, "w": rotor},
        joints={"guide": fb.Prismatic("b", (0.0, 0.0)), "pin": fb.Revolute("w", (0.0, 1.0))},
        loads={
            "f": fb.ViscousFriction("b", (0.0, 0.0), d),
            "p": fb.TorsionSpring("w", (0.0, 1.0), damping=d),
        },
        sensors={"v": fb.Velocity("b"), "w": fb.AngularVelocity("w")},
    )
    motion = fb.simulate(model, duration=1.0, step=1e-3, integrator=UNDAMPED)
    t = motion["time"].values
    decay = np.exp(-d[:, None] * t)
    np.testing.assert_allclose(motion.sel(output="v_X"), 1.5 * decay ** (1 / m), atol=1e-5)
    np.testing.assert_allclose(motion.sel(output="w"), 4.0 * decay ** (1 / J), atol=2e-5)


def drag(t, x, v, p, force):
    """Air drag with the square of the speed, and a pull that grows with time."""
    speed = np.sqrt(v[0, 0] ** 2 + v[0, 1] ** 2)
    force[0, 0] = -p[0] * speed * v[0, 0]
    force[0, 1] = -p[0] * speed * v[0, 1] + p[1]


def test_a_law_of_the_users_own():
    """Fall with drag in proportion to v²: v = v∞ tanh(g t/v∞)."""
    m = 2.0
    g = 9.81
    c = np.linspace(0.1, 0.5, 11)
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=m)},
        loads={"drag": fb.ForceLaw(["m"], drag, (c, lambda t: -m * g))},
        sensors={"v": fb.Velocity("m")},
    )
    motion = fb.simulate(model, duration=2.0, step=1e-3, integrator=UNDAMPED)
    limit = np.sqrt(m * g / c)[:, None]
    exact = -limit * np.tanh(g * motion["time"].values / limit)
    np.testing.assert_allclose(motion.sel(output="v_Y"), exact, atol=1e-5)


def test_a_law_on_a_beam_is_the_load_that_it_stands_for():
    def model(loads):
        beam = fb.Beam(
            length=0.5, height=0.004, width=0.01, density=1000.0, youngs_modulus=1e8,
            poissons_ratio=0.3, elements=4,
        )  # fmt: skip
        return fb.Mechanism(
            bodies={"b": beam},
            joints={"pin": fb.Revolute("b.start", (0.0, 0.0))},
            loads={"g": fb.Gravity(), **loads},
            sensors={"tip": fb.Position("b.end"), "angle": fb.Angle("b.0.3")},
        )

    law = fb.ForceLaw([(0.5, 0.3), "b.0.3"], spring_and_moment, (4.0, 0.01))
    springs = {
        "s": fb.Spring((0.5, 0.3), "b.0.3", 4.0, rest_length=0.0),
        "t": fb.TorsionSpring("b.0.3", (0.0, 0.0), 0.01, rest_angle=0.0),
    }
    law_motion = fb.simulate(model({"law": law}), duration=0.3, step=1e-3)
    spring_motion = fb.simulate(model(springs), duration=0.3, step=1e-3)
    assert np.ptp(spring_motion.values, axis=1).min() > 0.01
    np.testing.assert_allclose(law_motion, spring_motion, atol=1e-7)
    np.testing.assert_allclose(
        fb.equilibrium(model({"law": law})), fb.equilibrium(model(springs)), atol=1e-7
    )


def does_not_compile(t, x, v, p, force):
    force[0] = {"no": object()}


def force_law(points, law, parameters=()):
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)}, loads={"l": fb.ForceLaw(points, law, parameters)}
    )


@pytest.mark.parametrize(
    ("build", "text"),
    [
        (lambda: fb.Force("a", x="strong"), "Force x"),
        (lambda: fb.Moment("a", np.inf), "Moment moment"),
        (lambda: fb.DistributedLoad("a", y=np.nan), "DistributedLoad y"),
        (lambda: fb.DistributedLoad("a", factor=2.0), "factor must be a function"),
        (lambda: fb.Spring("a", "b", damping=-1.0), "damping .* must be zero or positive"),
        (lambda: force_law(["m"], does_not_compile), "does not compile"),
        (lambda: force_law("m", drag), "points must be a list"),
        (lambda: force_law([], drag), "points must be a list"),
        (lambda: force_law(["x"], drag, (1.0, 1.0)), "load 'l': body 'x' is not"),
        (lambda: force_law(["m"], drag, (np.nan, 1.0)), "ForceLaw parameter 0"),
        (lambda: force_law(["m"], 3.0), "law must be a function"),
        (lambda: fb.TorsionSpring("a", "b", stiffness=-1.0), "TorsionSpring stiffness"),
        (lambda: fb.ViscousFriction("a", "b", -1.0), "ViscousFriction damping"),
        (lambda: fb.Spring("a", "b", -1.0), "stiffness .* must be zero or positive; got -1"),
        (lambda: fb.Spring("a", "b", 1.0, rest_length=np.nan), "rest_length"),
        (lambda: fb.Gravity(y=np.nan), "Gravity y"),
    ],
)
def test_bad_loads_are_refused(build, text):
    with pytest.raises(fb.errors.InputError, match=text):
        build()


def test_a_load_that_crosses_a_bridge_is_shared_by_its_nodes():
    """Against the modal series of a simply supported beam whose length, mass and EI are 1."""
    P = 0.01
    n = 16
    bridge = fb.Cable(
        length=1.0, mass_per_length=1.0, axial_stiffness=1e4, bending_stiffness=1.0, elements=n
    )
    loads = {
        f"P{k}": fb.Force(f"b.node {k}", y=lambda t, k=k: -P * max(0.0, 1.0 - abs(n * t - k)))
        for k in range(n + 1)
    }
    model = fb.Mechanism(
        bodies={"b": bridge},
        joints={"A": fb.Revolute("b.start", (0.0, 0.0)), "B": fb.Slot("b.end", (0.0, 0.0))},
        loads=loads,
        sensors={"m": fb.Position("b.middle")},
    )
    deflection = fb.simulate(model, duration=1.0, step=2e-3).sel(output="m_Y")
    j = np.pi * np.arange(1, 40)[:, None]
    t = deflection.time.values
    parts = (np.sin(j * t) - np.sin(j**2 * t) / j) / (j**4 - j**2)
    exact = -2 * P * (np.sin(j / 2) * parts).sum(axis=0)
    np.testing.assert_allclose(deflection, exact, atol=6e-3 * np.abs(exact).max())
