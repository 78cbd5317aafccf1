"""Energies that add up, section forces, strains, stresses and reactions."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import flexband as fb
from tests.mechanics.models import ROD, STEEL, motion_of, pendulum_driven, slider_crank, two_blocks

h = 0.02
b = 0.03
L = 1.0


A = b * h
second = b * h**3 / 12


def cantilever(force, sensors, elements=8, kind="beam", **change):
    body = (
        fb.Beam(length=L, height=h, width=b, elements=elements, **(STEEL | change))
        if kind == "beam"
        else fb.Cable(
            length=L, elements=elements, mass_per_length=7800 * A,
            axial_stiffness=2.1e11 * A, bending_stiffness=2.1e11 * second,
        )
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"b": body},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
        loads={"P": fb.Force("b.end", *force)},
        sensors=sensors,
    )


@pytest.mark.parametrize("kind", ["beam", "cable"])
@pytest.mark.parametrize("place", ["start", "0.3", "middle", "0.9"])
def test_section_forces_are_those_of_statics(kind, place):
    """N = F, Q = P, M = P (L − x) for a small force (F, P) at the free end."""
    F = 3.0
    P = 0.02
    x = {"start": 0.0, "middle": 0.5}[place] if place.isalpha() else float(place)
    model = cantilever((F, P), {"s": fb.SectionForces("b", place)}, kind=kind)
    N, Q, M = fb.equilibrium(model).values
    assert float(N) == pytest.approx(F, rel=1e-4)
    assert float(Q) == pytest.approx(P, rel=1e-3)
    assert float(M) == pytest.approx(P * (L - x), rel=1e-3)


def axial_force_of(force, shear, EA, EI, kGA):
    """Return the axial force along Reissner's cantilever of length 1 under a force across its end.

    φ′ = M/EI and M′ = −r₀′ × F, with φ = 0 at the clamp and M = 0 at the end.
    """

    def rates(_, z):
        N = force * np.sin(z[0])
        Q = force * np.cos(z[0])
        return np.stack(
            [z[1] / EI, -force * ((1 + N / EA) * np.cos(z[0]) - shear * Q / kGA * np.sin(z[0]))]
        )

    s = np.linspace(0, 1, 41)
    guess = np.stack([force / EI * s * (2 - s) / 4, force * (1 - s)])
    solution = solve_bvp(
        rates, lambda a, b: np.array([a[0], b[1]]), s, guess, tol=1e-9, max_nodes=9999
    )
    return lambda s: force * np.sin(solution.sol(s)[0])


@pytest.mark.filterwarnings("ignore::flexband.errors.StrainWarning")
@pytest.mark.parametrize("load", [0.1, 1.0, 4.0])  # P L²/EI
@pytest.mark.parametrize("slenderness", [5, 20])
@pytest.mark.parametrize("kind", ["beam", "cable"])
def test_axial_force_under_shear_is_that_of_reissners_beam(load, slenderness, kind):
    """Within 0.5 % of the force with 8 elements at all places; the cable is stiff in shear."""
    E = 1e6
    nu = 0.45
    height = 1 / slenderness
    width = 0.1
    EA = E * height * width
    EI = E * width * height**3 / 12
    k = 10 * (1 + nu) / (12 + 11 * nu)
    force = load * EI
    body = (
        fb.Beam(
            length=1.0, height=height, width=width, density=1000.0, youngs_modulus=E,
            poissons_ratio=nu, elements=8,
        )
        if kind == "beam"
        else fb.Cable(
            length=1.0, mass_per_length=1.0, axial_stiffness=EA, bending_stiffness=EI, elements=8
        )
    )  # fmt: skip
    places = [0.0, 0.0625, 0.125, 0.2, 0.375, 0.5, 0.5625, 0.8, 1.0]
    mechanism = fb.Mechanism(
        bodies={"b": body},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
        loads={"P": fb.Force("b.end", y=force)},
        sensors={f"{s}": fb.SectionForces("b", f"{s}") for s in places},
    )
    rest = fb.equilibrium(mechanism, steps=4)
    N = [float(rest.sel(output=f"{s}_N")) for s in places]
    exact = axial_force_of(
        force, float(kind == "beam"), EA, EI, k * E / (2 * (1 + nu)) * height * width
    )
    np.testing.assert_allclose(N, exact(np.array(places)), rtol=0, atol=5e-3 * force)


@pytest.mark.parametrize(
    "integration", [fb.sections.SelectiveIntegration(), fb.sections.FullIntegration()]
)
def test_stress_and_strain_of_tension(integration):
    """σ = F/A and ε = σ/E, contraction −νε."""
    F = np.array([1e3, 2e3])
    model = cantilever(
        (F, 0.0),
        {"E": fb.Strain("b", "0.3", y=0.3 * h), "S": fb.Stress("b", y=-h / 2)},
        integration=integration,
    )
    rest = fb.equilibrium(model)
    strain = F / A / 2.1e11
    np.testing.assert_allclose(rest.sel(output="E_xx"), strain, rtol=1e-4)
    np.testing.assert_allclose(rest.sel(output="E_yy"), -0.3 * strain, rtol=1e-3)
    np.testing.assert_allclose(rest.sel(output="S_xx"), F / A, rtol=1e-3)
    np.testing.assert_allclose(rest.sel(output="S_yy"), 0.0, atol=1e3 / A * 1e-3)


def test_stress_of_bending():
    """σ = −M y/I: a force to the left bends the beam to the left and presses its left side."""
    P = 10.0
    sensors = {f"{y:g}": fb.Stress("b", "0.25", y=y * h) for y in (-0.5, 0.25, 0.5)}
    rest = fb.equilibrium(cantilever((0.0, P), sensors))
    for y in (-0.5, 0.25, 0.5):
        exact = -P * 0.75 * L * y * h / second
        assert float(rest.sel(output=f"{y:g}_xx")) == pytest.approx(exact, rel=5e-3)


@pytest.mark.parametrize("place", ["start", "0.3", "middle"])
@pytest.mark.parametrize("y", [-h / 2, 0.0, 0.2 * h, h / 2])
def test_stress_follows_from_section_forces(place, y):
    """σ = N/A − M y/I, with a tip force that is large, at rest and in motion."""
    force = (4e3, 200.0)
    sensors = {"s": fb.SectionForces("b", place), "S": fb.Stress("b", place, y)}
    model = cantilever(force, sensors, elements=4, retardation_time=1e-4)
    for outputs in (fb.equilibrium(model), fb.simulate(model, duration=5e-3, step=1e-5)):
        N, M, S = (outputs.sel(output=name).values for name in ("s_N", "s_M", "S_xx"))
        assert np.max(np.abs(N)) > 1e3
        assert np.max(np.abs(M)) > 10
        scale = np.max(np.abs(N)) / A + np.max(np.abs(M)) * h / 2 / second
        np.testing.assert_allclose(S, N / A - M * y / second, rtol=0, atol=1e-13 * scale)


def test_a_curved_beam_at_rest_has_no_section_forces_and_a_loaded_one_those_of_statics():
    """Quarter ring, radial force P at the free end."""
    P = 0.1
    R = 1.0

    def ring(force):
        beam = fb.Beam(
            length=np.pi / 2 * R, curvature=1 / R, height=h, width=b, elements=64, **STEEL
        )
        return fb.Mechanism(
            bodies={"b": beam},
            joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
            loads={"P": fb.Force("b.end", x=force)},
            sensors={"s": fb.SectionForces("b", "0.5078125")},  # the middle of an element
        )

    np.testing.assert_allclose(fb.equilibrium(ring(0.0)), 0.0, atol=1e-6)
    N, Q, M = fb.equilibrium(ring(P)).values
    angle = 0.5078125 * np.pi / 2  # of the section's normal; the lever from it to the end is in Y
    assert float(N) == pytest.approx(P * np.cos(angle), rel=2e-2)
    assert float(Q) == pytest.approx(-P * np.sin(angle), rel=2e-2)
    assert float(M) == pytest.approx(-P * R * np.cos(angle), rel=1e-3)


@pytest.mark.parametrize("kind", ["beam", "cable"])
def test_elastic_energy_is_half_the_work_of_a_small_force(kind):
    P = np.array([0.1, 0.2])
    model = cantilever((0.0, P), {"E": fb.ElasticEnergy(), "tip": fb.Position("b.end")}, kind=kind)
    rest = fb.equilibrium(model)
    np.testing.assert_allclose(rest.sel(output="E"), 0.5 * P * rest.sel(output="tip_Y"), rtol=1e-5)


@pytest.mark.parametrize("curvature", [0.0, 1.0])
def test_energy_of_a_falling_member_is_kept(curvature):
    """At ρ∞ = 1 kinetic, elastic and potential energy, and the work of a force, add up."""
    beam = fb.Beam(
        length=0.5, height=0.004, width=0.01, density=1000.0, youngs_modulus=1e8,
        poissons_ratio=0.3, elements=4, curvature=curvature,
    )  # fmt: skip
    cable = fb.Cable(
        length=0.3, elements=4, mass_per_length=0.04, axial_stiffness=4e3, bending_stiffness=5e-3,
        curvature=curvature,
    )  # fmt: skip
    model = fb.Mechanism(
        bodies={"beam": beam, "cable": cable},
        joints={
            "pin": fb.Revolute("beam.start", (0.0, 0.0)),
            "end": fb.Revolute("cable.start", "beam.end"),
        },
        loads={
            "g": fb.Gravity(),
            "spring": fb.Spring("beam.middle", (0.3, 0.4), 3.0, rest_length=0.2),
            "push": fb.Force("cable.end", x=lambda t: 0.1 * np.sin(20 * t), y=0.05),
        },
        sensors={
            "T": fb.KineticEnergy(), "U": fb.ElasticEnergy(), "V": fb.PotentialEnergy(),
            "W": fb.Work("push"), "Ws": fb.Work("spring"), "Wg": fb.Work("g"),
            "tip": fb.Position("cable.end"),
        },
    )  # fmt: skip

    def run(step):
        motion = fb.simulate(
            model, duration=0.4, step=step, integrator=fb.GeneralizedAlpha(spectral_radius=1.0)
        )
        T, U, V, W, Ws, Wg = motion[:6].values
        total = T + U + V - W
        assert np.ptp(V) > 0.01
        np.testing.assert_allclose(Wg, V[0] - V, atol=1e-8)
        return np.abs(total - total[0]).max() / np.ptp(V), T, U, V, W, Ws

    coarse, *_ = run(2e-4)
    fine, *_ = run(1e-4)
    assert fine < 3e-4
    assert 3.0 < coarse / fine < 5.0  # second order


def test_the_work_of_a_drive_and_of_a_spring_is_what_the_energy_gains():
    model = slider_crank()
    model = fb.Mechanism(
        bodies=model.bodies, joints=model.joints, loads=model.loads,
        sensors={
            "T": fb.KineticEnergy(), "U": fb.ElasticEnergy(), "W": fb.Work("motor"),
            "S": fb.Work("spring"), "F": fb.SpringForce("spring"), "A": fb.Work("A"),
        },
    )  # fmt: skip
    motion = fb.simulate(
        model, duration=0.1, step=1e-4, integrator=fb.GeneralizedAlpha(spectral_radius=1.0)
    )
    T, U, W, S, _, length, at_rest = motion.values
    energy_change = T + U - T[0] - U[0]
    assert np.ptp(energy_change) > 1.0
    np.testing.assert_allclose(W, energy_change, atol=2e-3 * np.ptp(energy_change))
    stretch = length - length[0]
    np.testing.assert_allclose(S, -500.0 * stretch**2, atol=1e-9)
    np.testing.assert_allclose(at_rest, 0.0, atol=1e-9)


def test_of_a_joint_and_a_load_with_one_name_the_joint_is_meant():
    """A motor turns a wheel by t²/2 against a moment of its name, W = ½ J ω² + M θ."""
    model = fb.Mechanism(
        bodies={"w": fb.RigidBody(mass=1.0, inertia=2.0)},
        joints={"pin": fb.Revolute("w", (0.0, 0.0)),
                "motor": fb.PrescribedRotation("w", lambda t: t**2 / 2)},
        loads={"motor": fb.Moment("w", -3.0)},
        sensors={"W": fb.Work("motor"), "P": fb.sensors.Power("motor")},
    )  # fmt: skip
    work, power = fb.simulate(model, duration=1.0, step=1e-3).values[:, -1]
    assert work == pytest.approx(0.5 * 2.0 + 3.0 / 2, rel=1e-5)
    assert power == pytest.approx(2.0 + 3.0, rel=1e-5)
    brake = fb.contact.Brake("w", (0.0, 0.0), friction=0.4, radius=0.1, force=1.0)
    with pytest.raises(fb.errors.InputError, match="'motor' must not have the name of a load"):
        replace(model, loads={"motor": brake})


@pytest.mark.parametrize(
    ("sensor", "text"),
    [
        (fb.Strain("b", "middle", y=1.0), "must be from -0.01 to 0.01; got 1"),
        (fb.SectionForces("x"), "beam 'x' is not in the mechanism"),
        (fb.SectionForces("b", "top"), "point must be 'start', .*; got 'top'"),
        (fb.Work("nothing"), "'nothing' is not in the mechanism"),
    ],
)
def test_sensors_of_what_is_not_there_are_refused(sensor, text):
    with pytest.raises(fb.errors.InputError, match=text):
        cantilever((0.0, 1.0), {"s": sensor})


def test_stresses_of_a_cable_are_refused():
    with pytest.raises(fb.errors.InputError, match="stresses need a Beam"):
        cantilever((0.0, 1.0), {"s": fb.Stress("b")}, kind="cable")


@pytest.mark.parametrize("load", [fb.Force((1.0, 0.0), y=3.0), fb.Gravity(0.0, 0.0)])
def test_a_load_that_moves_nothing_does_no_work(load):
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, velocity=(1.0, 0.0))},
        loads={"l": load},
        sensors={"W": fb.Work("l")},
    )
    assert not fb.simulate(model, duration=0.1, step=0.01).values.any()


def test_reaction_in_body_axes_is_the_same_force():
    parts = {
        "bodies": {"bar": fb.RigidBody.bar(**ROD, angle=0.4)},
        "joints": {"pin": fb.Revolute("bar.start", (0.0, 0.0))},
        "loads": {"gravity": fb.Gravity()},
        "sensors": {
            "F": fb.Reaction("pin"), "own": fb.Reaction("pin", axes="body"), "a": fb.Angle("bar"),
        },
    }  # fmt: skip
    motion = motion_of(**parts)
    a = motion.sel(output="a")
    X = motion.sel(output="F_X")
    Y = motion.sel(output="F_Y")
    np.testing.assert_allclose(motion.sel(output="own_x"), X * np.cos(a) + Y * np.sin(a), atol=1e-9)
    np.testing.assert_allclose(motion.sel(output="own_y"), Y * np.cos(a) - X * np.sin(a), atol=1e-9)


def test_deflection_is_seen_from_the_chord():
    body = fb.Cable(
        length=2.0, elements=4, mass_per_length=1.0, axial_stiffness=1e6, bending_stiffness=10.0,
        curvature=0.5, angle=0.7,
    )  # fmt: skip
    model = fb.Mechanism(bodies={"c": body}, sensors={"d": fb.Deflection("c")})
    sag = -(1 - np.cos(0.5)) / 0.5  # an arc to the left has its middle to the right of the chord
    start = fb.simulate(model, duration=1e-3, step=1e-3).isel(time=0)
    assert float(start.squeeze()) == pytest.approx(sag, rel=1e-9)
    with pytest.raises(fb.errors.InputError, match="spring 'x' is not in the mechanism"):
        fb.Mechanism(bodies={"c": body}, sensors={"s": fb.SpringForce("x")})


def test_a_deflection_is_positive_to_the_left_of_the_chord():
    """Of a cantilever F L³/EI (5/48 − 1/6), of a bar on two supports F L³/(48 EI) and shear."""
    length = 0.5
    size = 0.005
    modulus = 2e11
    force = 1.0
    unit = force * length**3 / (modulus * size**4 / 12)
    sensors = {"d": fb.Deflection("b")}

    def deflection(joints, point, y):
        body = fb.Beam(
            length=length, height=size, width=size, density=7800.0, youngs_modulus=modulus,
            poissons_ratio=0.3, elements=8,
        )  # fmt: skip
        loads = {"up": fb.Force(point, 0.0, y)}
        model = fb.Mechanism(bodies={"b": body}, joints=joints, loads=loads, sensors=sensors)
        return float(fb.equilibrium(model).squeeze())

    clamp = {"root": fb.Weld("b.start", (0.0, 0.0))}
    assert deflection(clamp, "b.end", force) == pytest.approx(-unit / 16, rel=3e-3)
    assert deflection(clamp, "b.end", -force) == pytest.approx(unit / 16, rel=3e-3)
    supports = {
        "a": fb.Revolute("b.start", (0.0, 0.0)),
        "b": fb.Slot("b.end", (0.0, 0.0), axis=(1.0, 0.0)),
    }
    assert deflection(supports, "b.middle", force) == pytest.approx(unit / 48, rel=3e-3)


def slider_crank_with(**sensors):
    model = slider_crank()
    return fb.Mechanism(bodies=model.bodies, joints=model.joints, sensors=sensors)


@pytest.mark.parametrize(
    ("build", "text"),
    [
        (
            lambda: fb.Reaction("a", axes="sideways"),
            "axes must be 'global' or 'body'; got 'sideways'",
        ),
        (
            lambda: slider_crank_with(x=fb.Position("link.1.5")),
            "point must be .* from '0' to '1'; got '1.5'",
        ),
        (lambda: slider_crank_with(M=fb.ReactionMoment("A")), "exerts no moment"),
        (
            lambda: two_blocks(sensors={"F": fb.Reaction("B")}),
            "sensor 'F': joint 'B' is not in the mechanism; there is none",
        ),
        (lambda: two_blocks(sensors={"x": fb.Position("c")}), "sensor 'x': body 'c'"),
        (
            lambda: pendulum_driven(lambda t: 0.0, sensors={"M": fb.Reaction("motor")}),
            "sensor 'M': joint 'motor' exerts a moment and no force",
        ),
    ],
)
def test_bad_sensors_are_refused(build, text):
    with pytest.raises(fb.errors.InputError, match=text):
        build()
