"""Natural frequencies and mode shapes against closed forms."""

import numpy as np
import pytest
from scipy.optimize import brentq

import flexband as fb

STRIP = {"height": 0.02, "width": 0.02, "density": 2700.0, "youngs_modulus": 70e9}


def test_cantilever_frequencies_are_euler_bernoullis():
    """Clamped–free: cos β cosh β = −1; rotary inertia and shear lower them by parts of (h/L)²."""
    length = np.array([1.0, 1.2])
    model = fb.Mechanism(
        bodies={"b": fb.Beam(length=length, poissons_ratio=0.3, elements=48, **STRIP)},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
        sensors={"tip": fb.Position("b.end"), "middle": fb.Position("b.middle")},
    )
    modes = fb.modes(model, 3, about="start")
    beta = [
        brentq(lambda b: np.cos(b) * np.cosh(b) + 1, *r) for r in ((1.5, 2.5), (4, 5.5), (7, 8.5))
    ]
    for k, b in enumerate(beta):
        exact = b**2 / (2 * np.pi) * np.sqrt(70e9 * 0.02**2 / 12 / 2700) / length**2
        loss = 0.5 * b**2 * 0.02**2 / 12 / length**2 * (1 + 3.12)  # Timoshenko, about
        np.testing.assert_allclose(modes["frequency"][:, k], exact * (1 - loss), rtol=2.5e-3)
    shape = modes["shape"].sel(mode=0)
    ratio = float(shape.sel(output="middle_Y")[0] / shape.sel(output="tip_Y")[0])
    assert ratio == pytest.approx(0.33952, rel=2e-3)  # of the exact first mode
    modal_mass = 2700 * 0.02**2 * 1.0 / 4  # of a cantilever whose tip moves by one
    assert abs(float(shape.sel(output="tip_Y")[0])) == pytest.approx(modal_mass**-0.5, rel=2e-3)


def test_pendulum_and_inverted_pendulum():
    def model(angle):
        return fb.Mechanism(
            bodies={"m": fb.PointMass(mass=2.0, position=(np.cos(angle), np.sin(angle)))},
            joints={"rod": fb.Distance("m", (0.0, 0.0), 1.0)},
            loads={"gravity": fb.Gravity()},
            sensors={"m": fb.Position("m")},
        )

    exact = np.sqrt(9.81) / (2 * np.pi)
    hanging_modes = fb.modes(model(-np.pi / 2), 5)
    np.testing.assert_allclose(hanging_modes["frequency"], [exact], rtol=1e-9)
    np.testing.assert_allclose(np.abs(hanging_modes["shape"][0]), [2.0**-0.5, 0.0], atol=1e-9)
    upright_modes = fb.modes(model(np.pi / 2), 5, about="start")
    np.testing.assert_allclose(upright_modes["frequency"], [-exact], rtol=1e-9)


def test_free_beam_has_three_free_motions():
    body = fb.Beam(length=1.0, poissons_ratio=0.0, elements=32, **STRIP)
    model = fb.Mechanism(bodies={"b": body}, sensors={"b": fb.Position("b.start")})
    frequency = fb.modes(model, 4, about="start")["frequency"].values
    beta = brentq(lambda b: np.cos(b) * np.cosh(b) - 1, 4, 5.5)
    exact = beta**2 / (2 * np.pi) * np.sqrt(70e9 * 0.02**2 / 12 / 2700)
    np.testing.assert_array_equal(frequency[:3], 0.0)
    assert frequency[3] == pytest.approx(exact, rel=5e-3)


def test_bad_requests_are_refused():
    model = fb.Mechanism(bodies={"m": fb.PointMass(mass=1.0)})
    with pytest.raises(fb.errors.InputError, match="count must be 1 or more; got 0"):
        fb.modes(model, 0)
    with pytest.raises(
        fb.errors.InputError, match="about must be 'start', 'equilibrium' or 'sliding'; got 'rest'"
    ):
        fb.modes(model, 1, about="rest")  # type: ignore[arg-type]
    mechanism = fb.Mechanism(
        bodies={"b": fb.RigidBody(mass=1.0, inertia=1.0)}, joints={"w": fb.Weld("b", (0.0, 0.0))}
    )
    with pytest.raises(fb.errors.InputError, match="no degree of freedom"):
        fb.modes(mechanism, 1)


def oscillator(**loads):
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=2.0)},
        joints={"guide": fb.Slot("m", (0.0, 0.0))},
        loads=loads,
        sensors={"m": fb.Position("m")},
    )


@pytest.mark.parametrize("damping", [3.0, 30.0])
def test_a_damped_oscillator(damping):
    """The roots of m s² + d s + k, of a spring with a damper and of a spring with friction."""
    spring = fb.Spring("m", (-1.0, 0.0), 100.0, 1.0)
    friction = fb.ViscousFriction("m", (0.0, 0.0), damping)
    damper = fb.Spring("m", (-1.0, 0.0), 100.0, 1.0, damping=damping)
    roots = np.roots([2.0, damping, 100.0])
    exact = sorted(roots[roots.imag >= 0], key=abs)
    for loads in ({"s": damper}, {"s": spring, "f": friction}):
        modes = fb.modes(oscillator(**loads), 3)
        np.testing.assert_allclose(modes["eigenvalue"], exact, rtol=1e-8)
        np.testing.assert_allclose(modes["frequency"], np.abs(exact) / (2 * np.pi), rtol=1e-8)
        np.testing.assert_allclose(
            modes["damping_ratio"], -np.real(exact) / np.abs(exact), rtol=1e-8
        )
        assert not modes["unstable"].any()
    free_modes = fb.modes(oscillator(f=friction), 3)
    np.testing.assert_allclose(free_modes["eigenvalue"], [0.0, -damping / 2.0], rtol=1e-8)


def test_material_damping_is_half_the_retardation_times_the_frequency():
    cable = fb.Cable(
        length=1.0, mass_per_length=1.0, axial_stiffness=1e4, bending_stiffness=1.0, elements=8,
        retardation_time=2e-3,
    )  # fmt: skip
    model = fb.Mechanism(bodies={"c": cable}, joints={"clamp": fb.Weld("c.start", (0.0, 0.0))})
    modes = fb.modes(model, 3)
    np.testing.assert_allclose(
        modes["damping_ratio"], 1e-3 * 2 * np.pi * modes["frequency"], rtol=1e-6
    )


def column(load, **stiffness):
    """A clamped cable of length, mass and bending stiffness 1 under a force that follows it."""
    material = {"mass_per_length": 1.0, "axial_stiffness": 1e8, "bending_stiffness": 1.0}
    return fb.Mechanism(
        bodies={"c": fb.Cable(length=1.0, elements=12, **(material | stiffness))},
        joints={"clamp": fb.Weld("c.start", (0.0, 0.0))},
        loads={"P": fb.Force("c.end", x=-load, following=True)},
        sensors={"tip": fb.Position("c.end")},
    )


def test_becks_column_flutters():
    """A load without potential: two modes meet at 20.051 EI/L² and one of them grows from there."""
    modes = fb.modes(column(np.array([3.0, 10.0, 20.0, 20.1])), 2)
    exact = [[3.913096, 21.09872], [5.175762, 18.58679]]
    np.testing.assert_allclose(2 * np.pi * modes["frequency"][:2], exact, rtol=5e-5)
    np.testing.assert_array_equal(modes["unstable"], [[False] * 2] * 3 + [[False, True]])
    np.testing.assert_array_equal(modes["damping_ratio"][:3], 0.0)
    assert float(modes["damping_ratio"][3, 0]) == -float(modes["damping_ratio"][3, 1]) > 0.03
    with pytest.warns(fb.errors.FlexbandWarning, match="of 1 of 2 samples is not stable"):
        at_rest = fb.equilibrium(column(np.array([20.0, 20.1])))
    np.testing.assert_array_equal(at_rest["stable"], [True, False])


def push(t, x, v, p, force):
    """A force p₀ across the position, as of oil in a bearing."""
    force[0, 0] = -p[0] * x[0, 1]
    force[0, 1] = p[0] * x[0, 0]


def test_a_force_law_across_the_displacement():
    """z̈ + k z = i c z for z = x + i y: s² = −k ± i c."""
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)},
        loads={"l": fb.ForceLaw(["m"], push, [3.0]), "s": fb.Spring("m", (0, 0), 100.0, 0.0)},
        sensors={"m": fb.Position("m")},
    )
    modes = fb.modes(model, 4)
    np.testing.assert_allclose(modes["eigenvalue"][1], np.sqrt(-100 + 3j), rtol=1e-8)
    np.testing.assert_array_equal(modes["unstable"], [False, True])
    shape = modes["shape"][1]
    np.testing.assert_allclose(np.abs(shape[0] / shape[1]), 1.0, rtol=1e-6)  # a circle
    with pytest.warns(fb.errors.FlexbandWarning, match="of 1 of 1 sample is not stable"):
        assert not fb.equilibrium(model)["stable"]


def turntable(rate, stiffness, rest, *loads, drive=True):
    """A mass on four springs on a table that turns; k in x and y of the table."""
    table = fb.RigidBody(
        mass=5.0, inertia=3.0, rate=rate,
        points={"a": (-1.0, 0.0), "b": (1.0, 0.0), "c": (0.0, 1.0), "d": (0.0, -1.0)},
    )  # fmt: skip
    joints = {"pin": fb.Revolute("t.center", (0.0, 0.0))}
    if drive:
        joints["drive"] = fb.PrescribedRotation("t", lambda t: rate * t)
    springs = {k: fb.Spring("m", f"t.{k}", stiffness[k in "cd"] / 2, rest) for k in "abcd"}
    return fb.Mechanism(
        bodies={"t": table, "m": fb.PointMass(mass=1.0)}, joints=joints,
        loads=springs | {f"load {k}": load for k, load in enumerate(loads)},
        sensors={"m": fb.Position("m")},
    )  # fmt: skip


def test_a_mass_on_a_turning_table():
    """Foucault: ω ± Ω; with two stiffnesses it is unstable where Ω² is between k and k₂."""
    modes = fb.modes(turntable(3.0, (40.0, 90.0), 0.0), 9, about=fb.SteadyRotation(3.0))
    omega = np.sqrt(40.0 + 90.0)
    np.testing.assert_allclose(2 * np.pi * modes["frequency"], [omega - 3, omega + 3], rtol=1e-9)
    np.testing.assert_array_equal(modes["damping_ratio"], 0.0)
    for rate in (3.0, 7.0, 12.0):
        modes = fb.modes(turntable(rate, (40.0, 90.0), 1.0), 9, about=fb.SteadyRotation(rate))
        matrix = np.zeros((4, 4))
        matrix[:2, 2:] = np.eye(2)
        matrix[2:, :2] = np.diag([rate**2 - 40.0, rate**2 - 90.0])
        matrix[2, 3] = 2 * rate
        matrix[3, 2] = -2 * rate
        exact = np.linalg.eigvals(matrix)
        exact = exact[exact.imag > -1e-9]
        error = np.abs(modes["eigenvalue"].values[:, None] - exact)
        assert error.min(axis=0).max() < 1e-8
        assert modes["unstable"].any() == (rate == 7.0)


def test_friction_against_the_ground_drives_a_rotor():
    """z̈ + (2iΩ + d) ż + (k − Ω² + i d Ω) z = 0 for z = x + i y in axes that turn."""
    rate = 5.0
    d = 0.5
    model = turntable(rate, (60.0, 40.0), 0.0, fb.ViscousFriction("m", (0.0, 0.0), d))
    eigenvalues = fb.modes(model, 4, about=fb.SteadyRotation(rate))["eigenvalue"].values
    exact = np.roots([1.0, 2j * rate + d, 100.0 - rate**2 + 1j * d * rate])
    exact = exact.real + 1j * np.abs(exact.imag)
    np.testing.assert_allclose(eigenvalues, sorted(exact, key=abs), rtol=1e-8)


def blade(rate, hub=0.0, **loads):
    """A cable of length, mass and bending stiffness 1 on a hub that turns."""
    cable = fb.Cable(
        length=1.0, mass_per_length=1.0, axial_stiffness=1e8, bending_stiffness=1.0, elements=12,
        start=(hub, 0.0),
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"hub": fb.RigidBody(mass=1.0, inertia=1.0, points={"rim": (hub, 0.0)}), "c": cable},
        joints={
            "pin": fb.Revolute("hub", (0.0, 0.0)),
            "drive": fb.PrescribedRotation("hub", lambda t: rate * t),
            "root": fb.Weld("c.start", "hub.rim"),
        },
        loads=loads,
        sensors={"tip": fb.Position("c.end")},
    )


def test_a_rotating_cantilever():
    """Wright et al. (1982): η out of the plane is √(ω² + Ω²) of ω in the plane of rotation."""
    rate = np.array([2.0, 4.0, 12.0])
    frequencies = fb.modes(blade(rate), 1, about=fb.SteadyRotation(rate))["frequency"][:, 0]
    out_of_plane = np.hypot(2 * np.pi * frequencies, rate)
    np.testing.assert_allclose(out_of_plane, [4.1373, 5.5850, 13.1702], rtol=1e-4)


def test_a_hinged_blade_and_a_mass_on_a_spring():
    """Lead and lag, Ω √(3e/2l); an orbit, √(k + 3mΩ²) and a free motion along it."""
    rate = np.array([0.5, 7.0])
    bar = fb.RigidBody.bar(
        length=1.0, height=1e-4, width=0.1, density=1e5, start=(0.5, 0.0), angle=0.3
    )
    model = fb.Mechanism(
        bodies={"hub": fb.RigidBody(mass=1.0, inertia=1.0, points={"e": (0.5, 0.0)}), "b": bar},
        joints={
            "pin": fb.Revolute("hub", (0.0, 0.0)),
            "drive": fb.PrescribedRotation("hub", lambda t: rate * t),
            "hinge": fb.Revolute("b.start", "hub.e"),
        },
    )
    frequencies = fb.modes(model, 2, about=fb.SteadyRotation(rate))["frequency"][:, 0]
    np.testing.assert_allclose(2 * np.pi * frequencies, rate * np.sqrt(0.75), rtol=1e-7)
    orbit = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.0, 0.0))},
        loads={"s": fb.Spring("m", (0.0, 0.0), 100.0, 1.0)},
    )
    rate = np.array([0.0, 2.0, 9.0])
    eigenvalues = fb.modes(orbit, 2, about=fb.SteadyRotation(rate))["eigenvalue"]
    np.testing.assert_allclose(eigenvalues[:, 1], 1j * np.sqrt(100 + 3 * rate**2), rtol=1e-8)
    np.testing.assert_array_equal(eigenvalues[:, 0], 0.0)


def test_a_spinning_free_cable_is_stable():
    """Its centre moves at Ω in axes that turn, twice; one motion is free."""
    cable = fb.Cable(
        length=1.0, mass_per_length=1.0, axial_stiffness=1e6, bending_stiffness=1.0, elements=8,
        start=(-0.5, 0.0),
    )  # fmt: skip
    modes = fb.modes(fb.Mechanism(bodies={"c": cable}), 4, about=fb.SteadyRotation(5.0))
    np.testing.assert_allclose(2 * np.pi * modes["frequency"][:3], [0.0, 5.0, 5.0], rtol=1e-4)
    assert not modes["unstable"].any()


def test_a_rotation_that_is_not_steady_is_refused():
    with pytest.raises(fb.errors.InputError, match="loads depend on its angle"):
        fb.modes(blade(2.0, g=fb.Gravity()), 1, about=fb.SteadyRotation(2.0))
    with pytest.raises(fb.errors.InputError, match="joint 'drive' does not turn with it"):
        fb.modes(blade(2.0), 1, about=fb.SteadyRotation(2.1))
    with pytest.raises(fb.errors.InputError, match="joint 'clamp' does not turn with it"):
        fb.modes(column(0.0), 1, about=fb.SteadyRotation(2.0))
    support = [fb.Spring("m", (x, 0.0), 5.0, 1.0) for x in (-1.0, 1.0)]
    with pytest.raises(fb.errors.InputError, match="stiffness or damping depends on its angle"):
        fb.modes(turntable(3.0, (40.0, 40.0), 0.0, *support), 1, about=fb.SteadyRotation(3.0))
    with pytest.raises(fb.errors.InputError, match="SteadyRotation rate"):
        fb.SteadyRotation(np.nan)


def test_a_mechanism_that_moves_at_the_start_is_not_taken_for_one_at_rest():
    with pytest.raises(fb.errors.InputError, match="must not be 'start' if the mechanism moves"):
        fb.modes(blade(2.0), 1, about="start")
    with pytest.warns(fb.errors.FlexbandWarning, match=r"about=SteadyRotation\(rate\)"):
        frequencies = fb.modes(blade(2.0), 1)["frequency"]
    np.testing.assert_allclose(2 * np.pi * frequencies, 1.875104**2, rtol=1e-4)


def test_soft_and_stiff_parts_have_the_frequencies_they_have_alone():
    soft = np.array([1e-3, 1e-6])
    model = fb.Mechanism(
        bodies={
            "a": fb.PointMass(mass=1.0, position=(1.0, 0.0)),
            "b": fb.PointMass(mass=1e-3, position=(2.0, 0.0)),
        },
        joints={"ga": fb.Slot("a", (0.0, 0.0)), "gb": fb.Slot("b", (0.0, 0.0))},
        loads={
            "s": fb.Spring("a", (0.0, 0.0), 1e9, 1.0),
            "t": fb.Spring("b", "a", soft, 1.0),
            "f": fb.Force("b", x=soft),
        },
        sensors={"b": fb.Position("b")},
    )
    np.testing.assert_allclose(fb.equilibrium(model).sel(output="b_X"), 3.0, rtol=1e-8)
    frequencies = 2 * np.pi * fb.modes(model, 2)["frequency"]
    np.testing.assert_allclose(frequencies[:, 0], np.sqrt(soft / 1e-3), rtol=1e-8)
    np.testing.assert_allclose(frequencies[:, 1], np.sqrt(1e9), rtol=1e-8)


def test_loads_that_the_start_does_not_balance_are_named():
    heavy = fb.modes(column(np.array([0.0, 3.0])), 1, about="start")
    assert heavy.attrs["unbalanced"] == [1]
    assert "unbalanced" not in fb.modes(column(3.0), 1).attrs


@pytest.mark.parametrize("mass_per_length", [1.0, 1e6])
def test_a_slow_member_keeps_its_free_motion_and_its_frequencies(mass_per_length):
    """The stiffness is not rounded relative to the mass, which is much larger in these units."""
    cable = fb.Cable(
        length=100.0, mass_per_length=mass_per_length, axial_stiffness=1e-2,
        bending_stiffness=1.0, elements=12,
    )  # fmt: skip
    mechanism = fb.Mechanism(bodies={"b": cable}, sensors={"p": fb.Position("b.end")})
    modes = fb.modes(mechanism, 40, about="start")
    assert not modes["unstable"].any()
    assert np.count_nonzero(modes["frequency"] == 0) == 3
    axial = np.pi * np.sqrt(1e-2 / mass_per_length) / 100.0
    bending = np.array([4.730041, 7.853205]) ** 2 / 100.0**2 / np.sqrt(mass_per_length)
    omega = np.abs(modes["eigenvalue"].values)
    for exact in (axial, *bending):
        assert np.abs(omega / exact - 1).min() < 2e-3


def test_stiff_motions_that_are_not_resolved_do_not_count_as_growing():
    cable = fb.Cable(
        length=0.0112, mass_per_length=6.9e-3, axial_stiffness=2e15, bending_stiffness=1.7e4,
        elements=4, retardation_time=1e-4,
    )  # fmt: skip
    mechanism = fb.Mechanism(bodies={"b": cable}, sensors={"p": fb.Position("b.end")})
    assert not fb.modes(mechanism, 6, about="start")["unstable"].any()


def test_small_inertias_are_not_lost_next_to_large_ones():
    """A thin cable on a wheel of 1e12 times its inertia vibrates as if it were clamped there."""
    L = 0.1
    J = 1e10
    wheel = fb.RigidBody(mass=1.0, inertia=J, points={"rim": (3.0, 4.0)})
    cable = fb.Cable(
        length=L, mass_per_length=1.0, axial_stiffness=1e6, bending_stiffness=1.0, elements=8,
        start=(3.0, 4.0), angle=0.7,
    )  # fmt: skip
    mechanism = fb.Mechanism(
        bodies={"cable": cable, "wheel": wheel},
        joints={
            "axle": fb.Revolute("wheel", (0.0, 0.0)),
            "weld": fb.Weld("cable.start", "wheel.rim", angle=0.7),
        },
        sensors={"tip": fb.Position("cable.end")},
    )
    omega = np.abs(fb.modes(mechanism, 3)["eigenvalue"].values)
    assert omega[1:] * L**2 == pytest.approx([3.516015, 22.034492], rel=1e-3)


def test_a_contact_is_as_stiff_as_its_law_however_small_its_depth():
    """√(n K δⁿ⁻¹/m), with depths from 1e-3 to 1e-8 of the mechanism."""
    for exponent, stiffness in ((1.0, 1e4), (1.0, 1e9), (1.5, 1e9)):
        law = fb.contact.KeepsRestitution(stiffness=stiffness, exponent=exponent)
        ground = fb.contact.Contact("m", (0.0, 0.0), fb.contact.CircleOnLine(), law,
                                    closed_at_start=True)  # fmt: skip
        model = fb.Mechanism(
            bodies={"m": fb.PointMass(mass=1.0)},
            joints={"guide": fb.Slot("m", (0.0, 0.0), axis=(0.0, 1.0))},
            loads={"g": fb.Gravity(), "ground": ground},
        )
        depth = (9.81 / stiffness) ** (1 / exponent)
        exact = np.sqrt(exponent * 9.81 / depth) / (2 * np.pi)
        assert fb.modes(model, 1)["frequency"].values == pytest.approx(exact, rel=1e-6)
