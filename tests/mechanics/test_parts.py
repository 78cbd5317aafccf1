"""Bodies, joints, drives, loads and sensors, one by one, against closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flexband as fb
from flexband.mechanics.assembly.system import assemble

from .models import beam, slider_crank, states

ROD = {"length": 1.0, "height": 0.05, "width": 0.02, "density": 1000.0}  # 1 kg
INERTIA = (1.0 + 0.05**2) / 12  # about its centre
FINE = fb.GeneralizedAlpha(spectral_radius=0.8, tolerance=1e-12)


def run(duration=0.5, step=5e-4, **parts):
    return fb.simulate(fb.Mechanism(**parts), duration=duration, step=step, integrator=FINE)


def test_moment_turns_a_disc_any_number_of_times():
    disc = fb.RigidBody.disc(radius=0.2, width=0.05, density=1000.0)
    assert disc.inertia == pytest.approx(0.5 * disc.mass * 0.2**2)
    assert disc.mass == pytest.approx(1000 * np.pi * 0.04 * 0.05)
    motion = run(
        bodies={"disc": disc},
        joints={"axle": fb.Revolute("disc", (0.1, 0.2))},
        loads={"motor": fb.Moment("disc", lambda t: 20.0 * np.cos(3 * t))},
        sensors={"angle": fb.Angle("disc"), "rate": fb.AngularVelocity("disc")},
        step=1e-4,
    )
    t, per = motion.time.values, 20.0 / disc.inertia
    exact = per / 9 * (1 - np.cos(3 * t))
    assert exact[-1] > 2 * 2 * np.pi
    np.testing.assert_allclose(motion.sel(output="angle"), exact, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(motion.sel(output="rate"), per / 3 * np.sin(3 * t), rtol=1e-4)


def test_damped_driven_oscillator():
    """m x″ + d x′ + k x = −f: from rest under a step of the pull, in closed form."""
    mass, k, d, pull = 2.0, 800.0, 6.0, 5.0
    motion = run(
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
    t, zeta = motion.time.values, d / (2 * mass)
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
    motion = run(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.2, 0.0))},
        joints={"line": fb.Slot("m", (0.0, 0.0))},
        loads={"s": fb.Spring("m", (0.0, 0.0), 10.0, 1.0, cubic=2000.0)},
        sensors={"r": fb.Position("m"), "T": fb.KineticEnergy()},
    )
    x = motion.sel(output="r_X") - 1.0
    energy = motion.sel(output="T") + 5.0 * x**2 + 500.0 * x**4
    np.testing.assert_allclose(energy, energy[0], rtol=1e-4)


def test_pin_in_a_turning_slot():
    """Seen from the slot x″ = ω² x."""
    arm = fb.RigidBody(mass=1.0, inertia=1.0)
    motion = run(
        bodies={"arm": arm, "pin": fb.PointMass(mass=0.3, position=(0.2, 0.0))},
        joints={
            "axle": fb.Revolute("arm", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("arm", lambda t: 4.0 * t),
            "slot": fb.Slot("pin", "arm", axis=(2.0, 0.0)),
        },
        sensors={
            "pin": fb.Position("pin"),
            "F": fb.Reaction("slot"),
            "M": fb.ReactionMoment("motor"),
        },
    )
    # The pin starts with no speed along the slot: r = 0.2 cosh ωt.
    t = motion.time.values
    r = np.hypot(motion.sel(output="pin_X"), motion.sel(output="pin_Y"))
    np.testing.assert_allclose(r, 0.2 * np.cosh(4 * t), rtol=2e-5)
    coriolis = 2 * 0.3 * 4.0 * 0.2 * 4.0 * np.sinh(4 * t)  # 2 m ω ṙ, across the slot
    np.testing.assert_allclose(motion.sel(output="M")[200:], (coriolis * r)[200:], rtol=1e-3)
    across = motion.sel(output="F_Y") * np.cos(4 * t) - motion.sel(output="F_X") * np.sin(4 * t)
    np.testing.assert_allclose(across[200:], coriolis[200:], rtol=1e-3)


def test_welded_bars_fall_as_one():
    """An L of two bars on a pin: small oscillations have the compound pendulum's period."""
    motion = run(
        duration=2.0,
        step=1e-3,
        bodies={
            "a": fb.RigidBody.bar(**ROD, angle=-np.pi / 2 + 0.01),
            "b": fb.RigidBody.bar(
                **ROD, start=(np.sin(0.01), -np.cos(0.01)), angle=-np.pi / 2 + 0.01
            ),
        },
        joints={
            "pin": fb.Revolute("a.start", (0.0, 0.0)),
            "weld": fb.Weld("b.start", "a.end"),
        },
        loads={"gravity": fb.Gravity()},
        sensors={"angle": fb.Angle("b"), "M": fb.ReactionMoment("weld")},
    )
    inertia = 2 * INERTIA + 0.5**2 + 1.5**2
    w = np.sqrt(2 * 9.81 * 1.0 / inertia)
    swing = motion.sel(output="angle").values + np.pi / 2
    np.testing.assert_allclose(swing, 0.01 * np.cos(w * motion.time), atol=1e-6)
    # Moment on b at its start: J α of b about it, less gravity's and the start's acceleration.
    alpha = -(w**2) * 0.01
    exact = (INERTIA + 0.25 + 0.5) * alpha + 9.81 * 0.5 * 0.01
    assert float(motion.sel(output="M")[0]) == pytest.approx(exact, rel=1e-3)


def test_prescribed_path_needs_the_force_of_its_acceleration():
    motion = run(
        bodies={"m": fb.PointMass(mass=0.5, position=(0.3, 0.0))},
        joints={"path": fb.PrescribedPath("m", lambda t: 0.3 * np.cos(5 * t), lambda t: t**3)},
        sensors={"F": fb.Reaction("path")},
    )
    t = motion.time.values
    np.testing.assert_allclose(
        motion.sel(output="F_X")[100:], (-3.75 * np.cos(5 * t))[100:], atol=1e-4
    )
    np.testing.assert_allclose(motion.sel(output="F_Y")[100:], (3 * t)[100:], atol=1e-4)


def test_prescribed_travel_along_a_slanted_line():
    motion = run(
        bodies={"m": fb.PointMass(mass=1.0)},
        joints={
            "line": fb.Slot("m", (0.0, 0.0), axis=(3.0, 4.0)),
            "drive": fb.PrescribedTravel("m", (0.0, 0.0), lambda t: t**2, axis=(3.0, 4.0)),
        },
        sensors={"m": fb.Position("m"), "F": fb.Reaction("drive")},
    )
    end = motion.isel(time=-1)
    np.testing.assert_allclose(end.sel(output=["m_X", "m_Y"]), [0.6 * 0.25, 0.8 * 0.25], atol=1e-9)
    np.testing.assert_allclose(end.sel(output=["F_X", "F_Y"]), [1.2, 1.6], rtol=1e-6)


def test_following_force_spirals_and_a_fixed_one_does_not():
    """A spinning body pushed along its own x axis: v = a/ω (sin ωt, 1 − cos ωt)."""
    body = fb.RigidBody(mass=2.0, inertia=0.1, rate=6.0, points={"tail": (-0.1, 0.0)})
    motion = run(
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
    model = fb.Mechanism(bodies={"b": beam(elements=3, length=length, height=0.1)})
    load = {
        j: f.terms[0, 0, None] for j, f in model.line_load("b", 50.0, lambda x: 60 * x**2).items()
    }
    resultant = [sum(load[1 + axis + 6 * k] for k in range(4)) for axis in range(2)]
    np.testing.assert_allclose(resultant, [50 * length, 20 * length**3], rtol=1e-12)
    turn = sum(load[2 + 6 * k] * length * k / 3 + load[4 + 6 * k] for k in range(4))
    np.testing.assert_allclose(turn, 15 * length**4, rtol=1e-12)  # ∫ x f dx about the start


def test_distributed_load_may_grow_with_time():
    motion = run(
        bodies={"b": beam(elements=1, height=0.1, youngs_modulus=1e12)},
        loads={"q": fb.DistributedLoad("b", x=270.0, factor=lambda t: t)},
        sensors={"b": fb.Velocity("b.start")},
    )
    mass = 2700 * 0.1 * 0.1 * 1.3
    exact = 270.0 * 1.3 / mass * motion.time.values**2 / 2
    np.testing.assert_allclose(motion.sel(output="b_X"), exact, atol=1e-5)


def test_reaction_in_body_axes_is_the_same_force():
    parts = {
        "bodies": {"bar": fb.RigidBody.bar(**ROD, angle=0.4)},
        "joints": {"pin": fb.Revolute("bar.start", (0.0, 0.0))},
        "loads": {"gravity": fb.Gravity()},
        "sensors": {
            "F": fb.Reaction("pin"), "own": fb.Reaction("pin", axes="body"), "a": fb.Angle("bar"),
        },
    }  # fmt: skip
    motion = run(**parts)
    a = motion.sel(output="a")
    X, Y = motion.sel(output="F_X"), motion.sel(output="F_Y")
    np.testing.assert_allclose(motion.sel(output="own_x"), X * np.cos(a) + Y * np.sin(a), atol=1e-9)
    np.testing.assert_allclose(motion.sel(output="own_y"), Y * np.cos(a) - X * np.sin(a), atol=1e-9)


@given(st.floats(0.1, 2.0), st.floats(0.1, 2.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_polygon_is_a_block_wherever_its_axes_are(a, b, x, y):
    corners = [(x, y), (x + a, y), (x + a, y + b), (x, y + b)]
    block = fb.RigidBody.block(length=a, height=b, width=0.3, density=700.0)
    for vertices in (corners, corners[::-1]):
        plate = fb.RigidBody.polygon(vertices=vertices, width=0.3, density=700.0)
        assert plate.mass == pytest.approx(block.mass)
        assert plate.inertia == pytest.approx(block.inertia, rel=1e-6)
        np.testing.assert_allclose(plate.center, (x + a / 2, y + b / 2), atol=1e-9)


def test_points_are_where_the_axes_put_them_however_the_centre_lies():
    def motion(center, shift):
        points = {"p": (0.3 + shift[0], 0.1 + shift[1]), "pin": shift}
        body = fb.RigidBody(
            mass=1.0, inertia=0.2, center=(center[0] + shift[0], center[1] + shift[1]),
            points=points, angle=0.5,
            position=(-shift[0] * np.cos(0.5) + shift[1] * np.sin(0.5),
                      -shift[0] * np.sin(0.5) - shift[1] * np.cos(0.5)),
        )  # fmt: skip
        return run(
            bodies={"b": body},
            joints={"pin": fb.Revolute("b.pin", (0.0, 0.0))},
            loads={"gravity": fb.Gravity()},
            sensors={"p": fb.Position("b.p")},
        )

    here, there = motion((0.2, -0.1), (0.0, 0.0)), motion((0.2, -0.1), (0.7, -0.4))
    np.testing.assert_allclose(here, there, atol=1e-9)


def test_a_free_flexible_body_keeps_momentum():
    """Linear and angular momentum, with velocities given at the start."""
    body = beam(
        elements=4, height=0.05, youngs_modulus=1e7, velocity=(1.0, 2.0), rate=30.0, angle=0.3
    )
    model = fb.Mechanism(
        bodies={"b": body},
        sensors={"T": fb.KineticEnergy()},
    )
    motion = fb.simulate(model, duration=0.3, step=1e-4, integrator=FINE)
    mass, length = 2700 * 0.05 * 0.1 * 1.3, 1.3
    start_energy = (
        0.5
        * mass
        * (
            (1.0 - 30.0 * length / 2 * np.sin(0.3)) ** 2
            + (2.0 + 30.0 * length / 2 * np.cos(0.3)) ** 2
        )
        + 0.5 * mass * (length**2 + 0.05**2) / 12 * 30.0**2
    )
    assert float(motion.sel(output="T")[0]) == pytest.approx(start_energy, rel=1e-8)
    q, v, _ = states(model, 3000, 1e-4, FINE)
    q0, v0, _ = states(model, 0, 1e-4, FINE)
    n = assemble(model).structure.state.coordinates
    M = np.zeros((n, n))
    for (i, j), value in model.mass_entries().items():
        M[i - 1, j - 1] = M[j - 1, i - 1] = np.squeeze(value)
    move = np.zeros((2, n))
    move[0, 0::6] = move[1, 1::6] = 1.0
    np.testing.assert_allclose(move @ M @ v, move @ M @ v0, rtol=1e-9)
    turned = lambda s: np.stack([-s[1::2], s[0::2]], axis=1).ravel()  # noqa: E731
    assert turned(q) @ M @ v == pytest.approx(turned(q0) @ M @ v0, rel=1e-6)


@settings(max_examples=5, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_turning_and_moving_everything_changes_nothing(angle, x, y):
    """A flexible pendulum under a turned field of gravity, seen in turned axes."""

    def tip(turn, at):
        c, s = np.cos(turn), np.sin(turn)
        body = beam(elements=2, height=0.02, youngs_modulus=1e8, start=at, angle=turn)
        model = fb.Mechanism(
            bodies={"b": body},
            joints={"hinge": fb.Weld("b.start", at, angle=turn)},
            loads={"gravity": fb.Gravity(9.81 * s, -9.81 * c)},
            sensors={"tip": fb.Position("b.end")},
        )
        motion = fb.simulate(model, duration=0.2, step=1e-3).values - np.array(at)[:, None]
        return np.array([[c, s], [-s, c]]) @ motion

    np.testing.assert_allclose(tip(angle, (x, y)), tip(0.0, (0.0, 0.0)), atol=1e-8)


def test_a_diverging_sample_is_repeated_with_half_the_step_and_hurts_no_other():
    def model(speed):
        return fb.Mechanism(
            bodies={"m": fb.PointMass(mass=1.0, position=(1.0, 0.0), velocity=(speed, 0.0))},
            joints={"line": fb.Slot("m", (0.0, 0.0))},
            loads={"s": fb.Spring("m", (-1.0, 0.0), 10.0, 2.0, cubic=1e7)},
            sensors={"m": fb.Position("m")},
        )

    speeds = np.array([0.1, 4.0, 0.2, 7.0, 0.3])
    together = fb.simulate(model(speeds), duration=1.0, step=0.02)
    assert together.attrs["halved_step"] == [1, 3]
    for k in (0, 2, 4):
        alone = fb.simulate(model(speeds[k]), duration=1.0, step=0.02)
        np.testing.assert_array_equal(together[k], alone)
    finer = fb.simulate(model(speeds[[1, 3]]), duration=1.0, step=0.01)
    np.testing.assert_array_equal(together[[1, 3]], finer[:, :, ::2])
    with pytest.raises(fb.SimulationError, match="with half the step as well"):
        fb.simulate(model(22.0), duration=1.0, step=0.02)


@pytest.mark.parametrize(
    ("build", "text"),
    [
        (lambda: fb.Weld("a", "b", angle=np.nan), "Weld angle"),
        (lambda: fb.Slot("a", "b", axis=(0.0, 0.0)), "Slot axis must have a length"),
        (lambda: fb.Distance("a", "b", 0.0), "Distance length .* must be positive; got 0"),
        (lambda: fb.PrescribedPath("a", 1.0, np.sin), "path x must be a function|Path x must"),
        (lambda: fb.PrescribedTravel("a", "b", 2.0), "travel must be a function of time; got 2.0"),
        (lambda: fb.Force("a", x="strong"), "Force x"),
        (lambda: fb.Moment("a", np.inf), "Moment moment"),
        (lambda: fb.DistributedLoad("a", y=np.nan), "DistributedLoad y"),
        (lambda: fb.DistributedLoad("a", factor=2.0), "factor must be a function"),
        (lambda: fb.Spring("a", "b", damping=-1.0), "damping .* must be zero or positive"),
        (lambda: fb.PointMass(mass=0.0), "PointMass mass"),
        (lambda: fb.RigidBody.polygon(vertices=[(0, 0), (1, 0)], width=1, density=1), "three"),
        (
            lambda: fb.RigidBody.polygon(vertices=[(0, 0), (1, 0), (2, 0)], width=1, density=1),
            "enclose",
        ),
        (lambda: fb.Reaction("a", axes="sideways"), "axes 'sideways' is unknown"),
        (lambda: slider_crank_with(x=fb.Position("link.1.5")), "point '1.5' is unknown"),
        (lambda: slider_crank_with(M=fb.ReactionMoment("A")), "exerts no moment"),
    ],
)
def test_bad_parts_are_refused(build, text):
    with pytest.raises(fb.InputError, match=text):
        build()


def slider_crank_with(**sensors):
    model = slider_crank()
    return fb.Mechanism(bodies=model.bodies, joints=model.joints, sensors=sensors)


def test_kelvin_voigt_damps_a_mode_by_half_its_retardation_times_frequency():
    """A heavy mass on the axial stiffness of a light bar: logarithmic decrement."""
    length, area, modulus, mass, tau = 1.0, 1e-4, 1e9, 50.0, 2e-4
    rod = fb.Beam(
        length=length, height=0.01, width=0.01, density=10.0, youngs_modulus=modulus,
        poissons_ratio=0.0, elements=2, retardation=np.array([0.0, tau]),
    )  # fmt: skip
    motion = run(
        duration=0.6,
        step=2e-4,
        bodies={"rod": rod, "m": fb.PointMass(mass=mass, position=(length, 0.0))},
        joints={
            "clamp": fb.Weld("rod.start", (0.0, 0.0)),
            "pin": fb.Revolute("rod.end", "m"),
            "line": fb.Slot("m", (0.0, 0.0)),
        },
        loads={"kick": fb.Force("m", x=lambda t: 200.0 if t < 5e-3 else 0.0)},
        sensors={"m": fb.Position("m")},
    )
    x = motion.sel(output="m_X").values - length
    omega = np.sqrt(modulus * area / length / mass)
    zeta = tau * omega / 2
    t = motion.time.values
    late = t > 0.01
    for k, ratio in enumerate((0.0, zeta)):
        decay = np.exp(-ratio * omega * t[late])
        w = omega * np.sqrt(1 - ratio**2)
        basis = np.stack([decay * np.cos(w * t[late]), decay * np.sin(w * t[late])], axis=1)
        weights, *_ = np.linalg.lstsq(basis, x[k, late], rcond=None)
        size = np.hypot(*weights)
        np.testing.assert_allclose(x[k, late], basis @ weights, atol=0.003 * size)
    assert size > 1e-4


def test_damping_leaves_a_turning_beam_alone():
    """A free beam that turns as a rigid body has no strain rates: it keeps its energy."""
    spinning = {"height": 0.05, "rate": 20.0, "velocity": (1.0, -1.0), "elements": 3}
    stiff = beam(retardation=np.array([0.0, 1e-3]), **spinning)
    motion = run(bodies={"b": stiff}, sensors={"T": fb.KineticEnergy()}, duration=0.2)
    energy = motion.sel(output="T").values
    np.testing.assert_allclose(energy[1, 20:], energy[1, -1], rtol=1e-4)
    np.testing.assert_allclose(energy[1, -1], energy[0].mean(), rtol=1e-3)


def test_force_of_a_spring_that_is_relaxed_at_the_start():
    k = np.array([50.0, 80.0])
    motion = run(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.1, 0.0))},
        joints={"drive": fb.PrescribedPath("m", lambda t: 1.1 + t, lambda t: 0.0)},
        loads={"s": fb.Spring("m", (0.0, 0.0), k, cubic=30.0)},
        sensors={"s": fb.SpringForce("s"), "F": fb.Reaction("drive")},
    )
    t = motion.time.values
    exact = k[:, None] * t + 30.0 * t**3
    np.testing.assert_allclose(motion.sel(output="s_F"), exact, atol=1e-6)
    np.testing.assert_allclose(motion.sel(output="F_X")[:, 50:], exact[:, 50:], atol=1e-3)


def test_deflection_is_seen_from_the_chord():
    body = fb.Cable(
        length=2.0, elements=4, mass_per_length=1.0, axial_stiffness=1e6, bending_stiffness=10.0,
        curvature=0.5, angle=0.7,
    )  # fmt: skip
    model = fb.Mechanism(bodies={"c": body}, sensors={"d": fb.Deflection("c")})
    sag = -(1 - np.cos(0.5)) / 0.5  # an arc to the left has its middle to the right of the chord
    start = fb.simulate(model, duration=1e-3, step=1e-3).isel(time=0)
    assert float(start.squeeze()) == pytest.approx(sag, rel=1e-9)
    with pytest.raises(fb.InputError, match="spring 'x' is not in the mechanism"):
        fb.Mechanism(bodies={"c": body}, sensors={"s": fb.SpringForce("x")})
