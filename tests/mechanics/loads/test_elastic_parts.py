"""Tables, bushings and free strains of members against closed forms and SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flexband as fb
from tests.mechanics.models import motion_of

ALONG = {"guide": fb.Slot("m", (0.0, 0.0))}


def sled(load, *, velocity=0.0, mass=2.0, place=1.0, **options):
    """Return the motion of a mass on the X axis, whose load acts between it and the origin."""
    body = fb.PointMass(mass=mass, position=(place, 0.0), velocity=(velocity, 0.0))
    return motion_of(
        bodies={"m": body},
        joints=ALONG,
        loads={"load": load},
        sensors={"x": fb.Position("m"), "F": fb.SpringForce("load"), "P": fb.sensors.Power("load")},
        **options,
    )


def test_a_straight_table_is_a_spring_and_a_damper():
    place = np.array([-0.5, 0.1, 0.4])
    speed = np.array([-1.0, 2.0])
    table = fb.loads.Characteristic(300 * place[:, None] + 5 * speed, place, speed)
    options = {"velocity": 1.0, "duration": 1.0, "step": 1e-3}
    a = sled(fb.Spring("m", (0.0, 0.0), rest_length=0.8, pull=table), **options)
    b = sled(fb.Spring("m", (0.0, 0.0), 300.0, rest_length=0.8, damping=5.0), **options)
    np.testing.assert_allclose(a, b, atol=1e-8)


def test_motor_with_a_torque_over_speed():
    """Constant torque, then a line to the speed without load, in samples of different factors."""
    factor = np.array([1.0, 0.5])
    motor = fb.loads.Characteristic([3.0, 3.0, 0.0], speed=[0.0, 10.0, 15.0], factor=factor)
    motion = motion_of(
        bodies={
            "case": fb.RigidBody(mass=1.0, inertia=1.5),
            "rotor": fb.RigidBody(mass=1.0, inertia=3.0),
        },
        joints={
            "axle": fb.Revolute("case", (0.0, 0.0)),
            "bearing": fb.Revolute("rotor", "case"),
        },
        loads={"motor": fb.TorsionSpring("rotor", "case", torque=motor)},
        sensors={"a": fb.AngularVelocity("rotor"), "b": fb.AngularVelocity("case"),
                 "motor": fb.SpringMoment("motor")},
        duration=5.0,
        step=2e-3,
    )  # fmt: skip
    t = motion.time.values
    speed = (motion.sel(output="a") - motion.sel(output="b")).values
    inertia = 1.0  # 1.5 and 3 against each other
    for row, part in zip(speed, factor, strict=True):
        corner = 10.0 * inertia / (3.0 * part)
        decay = 5.0 * inertia / (3.0 * part)
        second_phase = 15.0 - 5.0 * np.exp(-np.maximum(t - corner, 0.0) / decay)
        np.testing.assert_allclose(
            row, np.where(t < corner, 3.0 * part * t, second_phase), atol=4e-4
        )
    torque = motion.sel(output="motor_M").values
    expected = factor[:, None] * np.interp(speed, [0.0, 10.0, 15.0], [3.0, 3.0, 0.0])
    np.testing.assert_allclose(torque, expected, atol=1e-9)


def test_table_over_stroke_and_speed():
    """x v is bilinear, so its table is exact: m ẍ = −40 x ẋ − 30 x."""
    place = np.linspace(-1.0, 1.0, 5)
    speed = np.linspace(-3.0, 3.0, 4)
    table = fb.loads.Characteristic(
        40.0 * place[:, None] * speed + 30.0 * place[:, None], place, speed
    )
    motion = sled(
        fb.Spring("m", (0.0, 0.0), rest_length=1.0, pull=table),
        velocity=2.0, duration=2.0, step=1e-3,
    )  # fmt: skip
    exact = solve_ivp(
        lambda t, y: [y[1], -(40 * y[0] * y[1] + 30 * y[0]) / 2.0],
        (0.0, 2.0), [0.0, 2.0], t_eval=motion.time.values, rtol=1e-10, atol=1e-12,
    )  # fmt: skip
    np.testing.assert_allclose(motion.sel(output="x_X") - 1.0, exact.y[0], atol=1e-5)


def test_buffer_with_a_gap():
    """A mass flies 0.1 m, half a swing of the buffer sends it back."""
    k = 200.0
    v = 1.5
    buffer = fb.loads.Characteristic([-k * 0.5, 0.0, 0.0], place=[-0.5, 0.0, 1.0])
    motion = sled(
        fb.Spring("m", (0.0, 0.0), rest_length=0.9, pull=buffer),
        velocity=-v, duration=0.6, step=5e-5,
    )  # fmt: skip
    w = np.sqrt(k / 2.0)
    t = motion.time.values
    hit = 0.1 / v
    leaves = hit + np.pi / w
    inside = 0.9 - v / w * np.sin(w * (t - hit))
    expected = np.where(t < hit, 1.0 - v * t, np.where(t < leaves, inside, 0.9 + v * (t - leaves)))
    np.testing.assert_allclose(motion.sel(output="x_X"), expected, atol=1e-6)
    stiff = sled(fb.Spring("m", (0.0, 0.0), rest_length=1.2, pull=buffer), duration=1e-3, step=1e-4)
    assert stiff.sel(output="F_F")[0] == pytest.approx(-k * 0.2)


def test_tables_in_statics_and_modes():
    table = fb.loads.Characteristic([-20.0, 0.0, 50.0], place=[-0.1, 0.0, 0.1])
    mechanism = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=2.0, position=(1.0, 0.0))},
        joints=ALONG,
        loads={"table": fb.Spring("m", (0.0, 0.0), rest_length=1.0, pull=table),
               "force": fb.Force("m", 25.0)},
        sensors={"x": fb.Position("m")},
    )  # fmt: skip
    assert fb.equilibrium(mechanism).sel(output="x_X") == pytest.approx(1.05, abs=1e-10)
    frequency = fb.modes(mechanism, 1)["frequency"].item()
    assert frequency == pytest.approx(np.sqrt(500.0 / 2.0) / (2 * np.pi), rel=1e-7)


def test_spring_of_no_rest_length_passes_through_its_end():
    """k d is linear: the mass swings on an ellipse, and on a line through the end."""
    for start, velocity in (((1.0, 0.0), (0.0, 3.0)), ((0.6, 0.8), (0.0, 0.0))):
        motion = motion_of(
            bodies={"m": fb.PointMass(mass=2.0, position=start, velocity=velocity)},
            loads={"spring": fb.Spring("m", (0.0, 0.0), stiffness=50.0, rest_length=0.0)},
            sensors={"r": fb.Position("m")},
            duration=2.0,
            step=1e-3,
        )
        t = motion.time.values
        exact = np.outer(start, np.cos(5 * t)) + np.outer(velocity, np.sin(5 * t)) / 5
        np.testing.assert_allclose(motion, exact, atol=3e-5)


K = np.array([[4e3, 500.0, 60.0], [500.0, 9e3, -80.0], [60.0, -80.0, 12.0]])


def two_bodies(bushing, **parts):
    """Return two bodies that a bushing joins off their centres."""
    points = {"eye": (0.1, 0.05)}
    bodies = {
        "a": fb.RigidBody(mass=2.0, inertia=0.03, points=points, angle=0.4,
                          position=(0.2, 0.0), velocity=(0.5, 0.3), rate=2.0),
        "b": fb.RigidBody(mass=3.0, inertia=0.05, points=points, angle=-2.6,
                          position=(0.35, 0.2), rate=-3.0),
    }  # fmt: skip
    sensors = {"F": fb.sensors.LawForce("bushing"), "T": fb.KineticEnergy()}
    for name in "ab":
        sensors |= {f"r{name}": fb.Position(name), f"v{name}": fb.Velocity(name),
                    f"w{name}": fb.AngularVelocity(name), f"q{name}": fb.Angle(name),
                    f"e{name}": fb.Position(f"{name}.eye")}  # fmt: skip
    return fb.Mechanism(bodies=bodies, loads={"bushing": bushing}, sensors=sensors, **parts)


@pytest.mark.parametrize("retardation", [0.0, 1e-3])
def test_bushing_conserves_energy_and_momentum(retardation):
    """Of two free bodies that turn by several rad, with a coupling of all three directions."""
    bushing = fb.loads.Bushing(
        "a.eye", "b.eye", stiffness=K, damping=retardation * K, rest=(0.01, -0.02, 3.0)
    )
    motion = fb.simulate(
        two_bodies(bushing),
        duration=0.6,
        step=2.5e-4,
        integrator=fb.GeneralizedAlpha(spectral_radius=1.0),
    )  # fmt: skip
    outputs = {name: motion.sel(output=name).values for name in motion.output.values}
    # The deflection in the axes of the second body, and the energy with what damping took.
    X = outputs["ea_X"] - outputs["eb_X"]
    Y = outputs["ea_Y"] - outputs["eb_Y"]
    turn = outputs["qb"]
    c = np.cos(turn)
    s = np.sin(turn)
    d = np.stack([c * X + s * Y - 0.01, c * Y - s * X + 0.02, outputs["qa"] - turn - 3.0])
    energy = outputs["T"] + 0.5 * np.einsum("it,ij,jt->t", d, K, d)
    t = motion.time.values
    rate = np.gradient(d, t, axis=1, edge_order=2)
    dissipation = np.einsum("it,ij,jt->t", rate, retardation * K, rate)
    energy[1:] += np.cumsum((dissipation[1:] + dissipation[:-1]) / 2 * np.diff(t))
    np.testing.assert_allclose(energy, energy[0], rtol=2e-3 if retardation else 2e-4)
    # The sensor of the law has its force in global axes.
    force = -K @ (d + retardation * rate)
    global_force = np.stack([c * force[0] - s * force[1], s * force[0] + c * force[1], force[2]])
    law_force = np.stack([outputs["F_X"], outputs["F_Y"], outputs["F_M"]])
    np.testing.assert_allclose(
        law_force, global_force, atol=(1e-2 if retardation else 1e-8) * np.abs(global_force).max()
    )
    # Angular momentum of both bodies.
    a, b = (
        m * (outputs[f"r{n}_X"] * outputs[f"v{n}_Y"] - outputs[f"r{n}_Y"] * outputs[f"v{n}_X"])
        + J * outputs[f"w{n}"]
        for n, m, J in (("a", 2.0, 0.03), ("b", 3.0, 0.05))
    )
    np.testing.assert_allclose(a + b, a[0] + b[0], atol=2e-5)
    assert np.abs(outputs["qb"]).max() > 1.5


def test_bushing_in_statics_and_modes():
    """d = K⁻¹F in the axes of the second body, and the eigenvalues of M⁻¹K, also from tables."""
    x = np.array([-0.1, 0.1])
    straight = [fb.loads.Characteristic(k * x, x) for k in np.diag(K)]
    for stiffness, tables in ((K, None), (K - np.diag(np.diag(K)), straight)):
        mechanism = fb.Mechanism(
            bodies={
                "base": fb.RigidBody(mass=1.0, inertia=1.0, angle=0.5, points={"p": (0.3, 0.1)}),
                "m": fb.RigidBody(mass=2.0, inertia=0.01, angle=0.5),
            },
            joints={"clamp": fb.Revolute("base", (0.0, 0.0)),
                    "hold": fb.PrescribedRotation("base", lambda t: 0.5 + 0.0 * t)},
            loads={"bushing": fb.loads.Bushing("m", "base.p", stiffness, tables=tables),
                   "force": fb.Force("m", 3.0, 4.0), "moment": fb.Moment("m", 0.05)},
            sensors={"m": fb.Position("m"), "turn": fb.Angle("m")},
        )  # fmt: skip
        rest = fb.equilibrium(mechanism)
        c = np.cos(0.5)
        s = np.sin(0.5)
        axes = np.array([[c, -s], [s, c]])
        force = np.append(axes.T @ [3.0, 4.0], 0.05)
        d = np.linalg.solve(K, force)
        place = axes @ np.array([0.3 + d[0], 0.1 + d[1]])
        np.testing.assert_allclose(rest, [*place, 0.5 + d[2]], atol=1e-9)
        bushing_load = {n: load for n, load in mechanism.loads.items() if n == "bushing"}
        bushing_only = fb.Mechanism(
            bodies=mechanism.bodies, joints=mechanism.joints, loads=bushing_load,
            sensors=mechanism.sensors,
        )  # fmt: skip
        w2 = np.sort(np.linalg.eigvals(np.diag([0.5, 0.5, 100.0]) @ K).real)
        frequency_squares = (2 * np.pi * fb.modes(bushing_only, 3)["frequency"].values.ravel()) ** 2
        np.testing.assert_allclose(frequency_squares, w2, rtol=1e-6)


def test_numbers_of_a_bushing_may_differ_between_three_samples():
    across = np.array([5e3, 6e3, 7e3])
    turn_stiffness = np.array([4e3, 5e3, 6e3])
    rest = fb.equilibrium(
        fb.Mechanism(
            bodies={"m": fb.RigidBody(mass=2.0, inertia=0.5)},
            loads={
                "rubber": fb.loads.Bushing(
                    "m", (0.0, 0.0), (np.full(3, 8e2), across, turn_stiffness)
                ),
                "rest": fb.loads.Bushing(
                    "m", (0.0, 0.0), ((0.0, 0, 0), (0, across, 0), (0, 0, 1)), (0.0, across, 0.0)
                ),
                "force": fb.Force("m", 8.0, 50.0),
                "moment": fb.Moment("m", 40.0),
            },
            sensors={"m": fb.Position("m"), "turn": fb.Angle("m")},
        )
    )
    expected = np.transpose([np.full(3, 0.01), 25 / across, 40 / (turn_stiffness + 1)])
    np.testing.assert_allclose(rest, expected, rtol=1e-9)


def test_damping_of_a_bushing():
    mechanism = fb.Mechanism(
        bodies={"m": fb.RigidBody(mass=2.0, inertia=0.5)},
        loads={"rubber": fb.loads.Bushing("m", (0.0, 0.0), (800.0, 5e3, 4e3), (4.0, 20.0, 8.0))},
        sensors={"m": fb.Position("m")},
    )
    ratios = fb.modes(mechanism, 3)["damping_ratio"].values.ravel()
    k, d, m = np.array([[800.0, 5e3, 4e3], [4.0, 20.0, 8.0], [2.0, 2.0, 0.5]])
    np.testing.assert_allclose(ratios, d / (2 * np.sqrt(k * m)), rtol=1e-6)


def member(kind, elements=4, **options):
    """Return a cable or beam of EA = 2e5 N and EI = 5/3 N m², 1 m long, of 0.2 kg."""
    if kind == "cable":
        return fb.Cable(length=1.0, mass_per_length=0.2, axial_stiffness=2e5,
                        bending_stiffness=5 / 3, elements=elements, **options)  # fmt: skip
    return fb.Beam(length=1.0, height=0.01, width=0.01, density=2000.0, youngs_modulus=2e9,
                   poissons_ratio=0.3, elements=elements, **options)  # fmt: skip


CLAMPS = {"a": fb.Weld("rod.start", (0.0, 0.0)), "b": fb.Weld("rod.end", (1.0, 0.0))}


@pytest.mark.parametrize("kind", ["cable", "beam"])
def test_free_strain_of_a_clamped_and_of_a_free_rod(kind):
    """N = −EA ε between walls; the length of a free rod is L (1 + ε), however ε is given."""
    ways = {
        "number": {"strain": np.array([2e-4, -1e-4])},
        "field": {"strain": lambda x: 4e-4 * x},
        "factor": {"strain": 4e-4, "factor": lambda t: 0.5 + t},
        "history": {"history": lambda x, t: (4e-4 + t) * x},
    }
    for way, arguments in ways.items():
        loads = {"heat": fb.loads.FreeStrain("rod", **arguments)}
        sensors = {"N": fb.SectionForces("rod", "0.3"), "end": fb.Position("rod.end"),
                   "e": fb.Strain("rod", "0.5"), "U": fb.ElasticEnergy()}  # fmt: skip
        expected = np.array([2e-4, -1e-4]) if way == "number" else np.array([2e-4])
        rod = {"rod": member(kind)}
        parts = {"bodies": rod, "loads": loads, "sensors": sensors}
        if way in ("number", "factor"):  # the section force is that of each place
            walls = fb.equilibrium(fb.Mechanism(joints=CLAMPS, **parts))
            force = np.ravel(walls.sel(output="N_N"))
            np.testing.assert_allclose(force, -2e5 * expected, rtol=1e-9)
            energy = np.ravel(walls.sel(output="U"))
            np.testing.assert_allclose(energy, 1e5 * expected**2, rtol=1e-6)
        cantilever = fb.equilibrium(fb.Mechanism(joints={"a": CLAMPS["a"]}, **parts))
        np.testing.assert_allclose(
            np.ravel(cantilever.sel(output="end_X")), 1 + expected, atol=1e-11
        )
        np.testing.assert_allclose(cantilever.sel(output=["N_N", "e_xx", "U"]), 0.0, atol=1e-6)


@pytest.mark.parametrize("kind", ["cable", "beam"])
def test_free_curvature_of_a_cantilever_and_between_walls(kind):
    """A circular arc without stress, or the moment −EI κ without deflection, however κ is given."""
    ways = {
        "number": {"curvature": np.array([0.4, -0.2])},
        "position": {"curvature": lambda x: 0.4 + 0.0 * x},
        "factor": {"curvature": 0.8, "factor": lambda t: 0.5 + t},
        "history": {"history": lambda x, t: 0.4 + t + 0.0 * x},
    }
    for way, arguments in ways.items():
        kappa = np.array([0.4, -0.2]) if way == "number" else np.array([0.4])
        parts = {
            "bodies": {"rod": member(kind)},
            "loads": {"sun": fb.loads.FreeCurvature("rod", **arguments)},
            "sensors": {"end": fb.Position("rod.end"), "turn": fb.Angle("rod.end"),
                        "S": fb.SectionForces("rod", "0.3"), "e": fb.Strain("rod", "0.5", y=0.004),
                        "U": fb.ElasticEnergy(), "y": fb.Position("rod.middle")},
        }  # fmt: skip
        cantilever = fb.equilibrium(fb.Mechanism(joints={"a": CLAMPS["a"]}, **parts))
        np.testing.assert_allclose(np.ravel(cantilever.sel(output="turn")), kappa, rtol=1e-9)
        arc = np.stack([np.sin(kappa), 1 - np.cos(kappa)]) / kappa
        place = np.atleast_2d(cantilever.sel(output=["end_X", "end_Y"]).values).T
        np.testing.assert_allclose(place, arc, atol=(kappa.max() / 4) ** 4 / 2880 * 1.1)
        np.testing.assert_allclose(
            cantilever.sel(output=["S_N", "S_M", "e_xx", "U"]), 0.0, atol=1e-7
        )
        walls = fb.equilibrium(fb.Mechanism(joints=CLAMPS, **parts))
        np.testing.assert_allclose(np.ravel(walls.sel(output="S_M")), -5 / 3 * kappa, rtol=1e-9)
        np.testing.assert_allclose(walls.sel(output=["y_Y", "S_N"]), 0.0, atol=1e-9)
        energy = np.ravel(walls.sel(output="U"))
        np.testing.assert_allclose(energy, 0.5 * 5 / 3 * kappa**2, rtol=1e-9)


def test_free_curvature_of_a_propped_strip_and_in_time():
    """The end would rise by ∫κ(L − x) dx; between walls the moment is −EI κ(t)."""
    parts = {"bodies": {"rod": member("cable")}, "sensors": {"S": fb.SectionForces("rod", "0.5")}}
    mechanism = fb.Mechanism(
        joints={"a": CLAMPS["a"], "prop": fb.Slot("rod.end", (1.0, 0.0))},
        loads={"sun": fb.loads.FreeCurvature("rod", lambda x: 0.006 * x)},
        **parts,
    )
    force = -3 * 5 / 3 * 1e-3
    assert fb.equilibrium(mechanism).sel(output="S_M") == pytest.approx(0.5 * force, rel=1e-5)
    sun = fb.loads.FreeCurvature("rod", history=lambda x, t: 0.02 * t**2 + 0.0 * x)
    walls = fb.Mechanism(joints=CLAMPS, loads={"sun": sun}, **parts)
    motion = fb.simulate(walls, duration=0.1, step=0.01)
    expected = -5 / 3 * 0.02 * motion.time.values**2
    np.testing.assert_allclose(motion.sel(output="S_M"), expected, atol=1e-10)


@pytest.mark.parametrize("kind", ["cable", "beam"])
def test_heat_softens_a_rod_and_rises_in_time(kind):
    """f = f₀ √(1 + N/Nₑ) between pins; and N follows −EA ε(t) of a slow fire."""
    pins = {"a": fb.Revolute("rod.start", (0.0, 0.0)), "b": fb.Revolute("rod.end", (1.0, 0.0))}
    euler = np.pi**2 * 5 / 3
    strain = -np.array([0.0, -0.5, 0.5, 2.0]) * euler / 2e5
    mechanism = fb.Mechanism(
        bodies={"rod": member(kind)}, joints=pins, sensors={"m": fb.Position("rod.middle")},
        loads={"heat": fb.loads.FreeStrain("rod", strain)},
    )  # fmt: skip
    frequencies = fb.modes(mechanism, 1)["frequency"].values.ravel()
    expected = np.sqrt(1 + np.array([0.0, -0.5, 0.5, 2.0]))
    np.testing.assert_allclose(frequencies / frequencies[0], expected, rtol=2e-3)
    fire = fb.loads.FreeStrain("rod", history=lambda x, t: 1e-5 * t**2 + 0.0 * x)
    motion = fb.simulate(
        fb.Mechanism(bodies={"rod": member(kind, retardation_time=1e-4)}, joints=CLAMPS,
                     loads={"fire": fire}, sensors={"N": fb.SectionForces("rod")}),
        duration=1.0, step=0.01,
    )  # fmt: skip
    t = motion.time.values
    np.testing.assert_allclose(motion.sel(output="N_N"), -2.0 * t**2, atol=1e-6)


@pytest.mark.parametrize("kind", ["cable", "beam"])
def test_damping_of_bending_alone(kind):
    """Bending has the ratio τ_b ω/2, the axial vibration τ ω/2."""
    rod = member(kind, elements=2, retardation_time=1e-6, bending_retardation_time=2e-4)
    mechanism = fb.Mechanism(
        bodies={"rod": rod}, joints={"a": CLAMPS["a"]}, sensors={"end": fb.Position("rod.end")}
    )
    modes = fb.modes(mechanism, 6)
    frequency, ratio = (np.ravel(modes[name].values) for name in ("frequency", "damping_ratio"))
    times = 2 * ratio / (2 * np.pi * frequency)
    shape = np.abs(modes["shape"].sel(output="end_X").values.ravel())
    axial = np.argmax(shape > 0.5 * shape.max())
    assert frequency[axial] == pytest.approx(0.25 * np.sqrt(2e5 / 0.2), rel=0.02)
    assert times[0] == pytest.approx(2e-4, rel=2e-4)
    assert times[axial] == pytest.approx(1e-6, rel=1e-3)


def test_massless_parts_have_no_weight():
    rod = fb.RigidBody(mass=0.0, inertia=0.0, points={"a": (0.0, 0.0), "b": (1.0, 0.0)})
    mechanism = fb.Mechanism(
        bodies={"rod": rod, "m": fb.PointMass(mass=2.0, position=(1.0, 0.0))},
        joints={
            "pin": fb.Revolute("rod.a", (0.0, 0.0)),
            "bob": fb.Revolute("m", "rod.b"),
            "hold": fb.PrescribedRotation("rod", lambda t: 0.0 * t),
        },
        loads={"gravity": fb.Gravity()},
        sensors={"F": fb.Reaction("pin"), "M": fb.ReactionMoment("hold")},
    )
    np.testing.assert_allclose(fb.equilibrium(mechanism), [0.0, 19.62, 19.62], atol=1e-12)


@pytest.mark.parametrize(
    ("build", "text"),
    [
        (lambda: fb.loads.Characteristic([1.0, 2.0]), "needs place, speed or both"),
        (lambda: fb.loads.Characteristic([1.0, 2.0], [1.0, 1.0]), "increasing numbers"),
        (lambda: fb.loads.Characteristic([1.0, 2.0, 3.0], [1.0, 2.0]), r"shape \(2,\)"),
        (lambda: fb.loads.Bushing("a", "b", (1.0, 2.0)), "three numbers, of x, y and angle"),
        (lambda: fb.loads.Bushing("a", "b", (1.0, -2.0, 1.0)), "stiffness of y"),
        (lambda: fb.loads.Bushing("a", "b", [[1, 2, 0], [1, 1, 0], [0, 0, 1]]), "symmetric"),
        (lambda: fb.loads.Bushing("a", "b", (1, 1, 1), tables=[None]), "tables must be three"),
        (lambda: fb.loads.FreeStrain("rod", np.nan), "FreeStrain strain"),
        (lambda: fb.loads.FreeCurvature("rod", np.inf), "FreeCurvature curvature"),
        (lambda: fb.loads.FreeCurvature("rod", factor=1.0), "FreeCurvature factor"),
        (lambda: member("beam", bending_retardation_time=-1.0), "bending_retardation_time"),
    ],
)
def test_bad_parts_are_refused(build, text):
    with pytest.raises(fb.errors.InputError, match=text):
        build()


def test_drawings_show_tables_bushings_and_heat():
    pytest.importorskip("matplotlib")
    table = fb.loads.Characteristic([1.0, 0.0], speed=[0.0, 1.0])
    mechanism = fb.Mechanism(
        bodies={
            "rod": member("beam"),
            "b": fb.RigidBody.disc(radius=0.1, width=0.1, density=10.0, position=(1.1, 0.3)),
        },
        joints={"a": CLAMPS["a"]},
        loads={
            "rubber": fb.loads.Bushing("b", "rod.end", (1.0, 1.0, 1.0)),
            "heat": fb.loads.FreeStrain("rod", 1e-4),
            "sun": fb.loads.FreeCurvature("rod", 1e-4),
            "motor": fb.TorsionSpring("b", "rod.end", torque=table),
            "jack": fb.Spring("b", (1.6, 0.0), pull=table),
        },
    )
    texts = {text.get_text() for text in fb.draw(mechanism).axes[0].texts}
    assert {"rubber, motor", "heat, sun", "jack"} <= texts


@pytest.mark.parametrize("second_clamp", [False, True])
def test_a_strip_that_is_straight_by_nature_may_be_drawn_bent(second_clamp):
    """It straightens, or keeps the arc of 2 1/m in which both ends are clamped, with EI/R = 20."""
    strip = fb.Cable(
        length=1.0, mass_per_length=1.0, axial_stiffness=1e6, bending_stiffness=10.0, elements=8,
        curvature=2.0,
    )  # fmt: skip
    end = np.sin(2.0) / 2, (1 - np.cos(2.0)) / 2
    clamps = {"a": fb.Weld("b.start", (0.0, 0.0))}
    clamps |= {"e": fb.Weld("b.end", end, angle=2.0)} if second_clamp else {}
    rest = fb.equilibrium(
        fb.Mechanism(
            bodies={"b": strip},
            joints=clamps,
            loads={"natural": fb.loads.FreeCurvature("b", -2.0)},
            sensors={"p": fb.Position("b.end"), "M": fb.SectionForces("b", "middle")},
        )
    )
    place, moment = (end, 20.0) if second_clamp else ((1.0, 0.0), 0.0)
    np.testing.assert_allclose(rest.sel(output=["p_X", "p_Y"]), place, atol=2e-6)
    assert rest.sel(output="M_M") == pytest.approx(moment, abs=1e-6)
