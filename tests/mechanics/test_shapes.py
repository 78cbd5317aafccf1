"""Curved axes, sections that are no rectangle, and sizes that vary along a member."""

import numpy as np
import pytest
from scipy.integrate import quad

import flexband as fb

STEEL = {"density": 7800.0, "youngs_modulus": 2.1e11, "poissons_ratio": 0.3}
THIN = {"mass_per_length": 0.2, "axial_stiffness": 4e6, "bending_stiffness": 3.0}


def clamped(member, loads):
    return fb.Mechanism(
        bodies={"m": member},
        joints={"clamp": fb.Weld("m.start", (0.0, 0.0))},
        loads=loads,
        sensors={"tip": fb.Position("m.end"), "angle": fb.Angle("m.end")},
    )


def tip_compliance(member, direction=(0.0, 1.0), force=1.0):
    """Displacement of the tip along a small force there, over the force."""
    load = {"P": fb.Force("m.end", *(force * d for d in direction))}
    rest, moved = (fb.equilibrium(clamped(member, loads))[..., :2] for loads in ({}, load))
    return (moved - rest).values @ np.array(direction) / force


@pytest.mark.parametrize("kind", ["constant", "function"])
def test_a_quarter_ring_against_castigliano(kind):
    """Radial force at the free end: δ/P = π/4 (R³/EI + R/EA + R/kGA) of a thin curved bar."""
    R, h = np.array([1.0, 1.3]), 0.02
    curvature = 1 / R if kind == "constant" else lambda s: np.ones_like(s) / R[:, None]
    beam = fb.Beam(
        length=np.pi / 2 * R, curvature=curvature, height=h, width=h, elements=64, **STEEL
    )
    E, G, k = 2.1e11, 2.1e11 / 2.6, 10 * 1.3 / (12 + 11 * 0.3)
    exact = np.pi / 4 * (R**3 / (E * h**4 / 12) + R / (E * h**2) + R / (k * G * h**2))
    # the clamp is at the origin with its tangent along X, so the free end's tangent is along Y and
    # the force along X is radial there
    np.testing.assert_allclose(tip_compliance(beam, (1.0, 0.0)), exact, rtol=5e-4)


def test_a_curved_beam_is_free_of_stress_and_a_moment_straightens_it():
    h, curvature = 0.01, 0.8
    beam = fb.Beam(length=1.0, curvature=curvature, height=h, width=h, elements=16, **STEEL)
    rest = fb.equilibrium(clamped(beam, {}))
    exact = [np.sin(curvature) / curvature, (1 - np.cos(curvature)) / curvature, curvature]
    np.testing.assert_allclose(rest, exact, atol=1e-9)
    moment = -2.1e11 * h**4 / 12 * curvature
    straight = fb.equilibrium(clamped(beam, {"M": fb.Moment("m.end", moment)}), steps=4)
    np.testing.assert_allclose(straight, [1.0, 0.0, 0.0], atol=2e-3)


@pytest.mark.parametrize("member", ["beam", "cable"])
def test_a_member_along_a_path(member):
    """A parabola y = x²/2 from (0, 0) to (1, 1/2): length and end tangent are known."""
    properties = {"height": 0.01, "width": 0.01, **STEEL} if member == "beam" else THIN
    kind = fb.Beam if member == "beam" else fb.Cable
    for path, within in (
        (lambda u: np.stack([u, u**2 / 2], axis=1), 1e-9),
        ([(x, x**2 / 2) for x in np.linspace(0, 1, 41)], 2e-5),  # as far as a spline follows it
    ):
        body = kind.along(path, elements=6, **properties)
        assert body.length == pytest.approx((np.sqrt(2) + np.arcsinh(1)) / 2, rel=1e-6)
        rest = fb.equilibrium(clamped(body, {}))
        np.testing.assert_allclose(rest, [1.0, 0.5, np.pi / 4], atol=within)


def test_a_tapered_cantilever():
    """δ/P = ∫ x²/EI dx + ∫ 1/kGA dx, x from the free end."""
    height, width, length = (lambda x: 0.05 - 0.03 * x), (lambda x: 0.02 + 0.02 * x), 1.0
    beam = fb.Beam(length=length, height=height, width=width, elements=16, **STEEL)
    E, kG = 2.1e11, 10 * 1.3 / (12 + 11 * 0.3) * 2.1e11 / 2.6
    bending, _ = quad(lambda x: (1 - x) ** 2 * 12 / (E * width(x) * height(x) ** 3), 0, 1)
    shear, _ = quad(lambda x: 1 / (kG * width(x) * height(x)), 0, 1)
    assert float(tip_compliance(beam)) == pytest.approx(bending + shear, rel=2e-3)


SECTIONS = {
    "circle": (fb.Circle(0.03), np.pi * 0.03**2 / 4, np.pi * 0.03**4 / 64),
    "tube": (
        fb.Circle(0.03, 0.026),
        np.pi * (0.03**2 - 0.026**2) / 4,
        np.pi * (0.03**4 - 0.026**4) / 64,
    ),
    "general": (fb.GeneralSection(3e-4, 4e-8), 3e-4, 4e-8),
}


@pytest.mark.parametrize("name", SECTIONS)
def test_sections_carry_their_area_and_second_moment(name):
    section, area, second = SECTIONS[name]
    beam = fb.Beam(length=1.0, section=section, elements=16, **STEEL)
    E, G, nu = 2.1e11, 2.1e11 / 2.6, 0.3
    k = {  # Cowper 1966
        "circle": 6 * (1 + nu) / (7 + 6 * nu),
        "tube": 2 * (1 + nu) / (4 + 3 * nu),  # of a thin wall
        "general": 5 / 6,
    }[name]
    exact = 1 / (3 * E * second) + 1 / (k * G * area)
    assert float(tip_compliance(beam)) == pytest.approx(exact, rel=2e-3)
    free = fb.Mechanism(bodies={"m": beam}, sensors={"E": fb.KineticEnergy()})
    sailing = fb.Beam(length=1.0, section=section, elements=2, velocity=(2.0, 0.0), **STEEL)
    free = fb.Mechanism(bodies={"m": sailing}, sensors={"E": fb.KineticEnergy()})
    energy = fb.simulate(free, duration=1e-3, step=1e-3)[0, 0]
    assert float(energy) == pytest.approx(2 * 7800.0 * area, rel=1e-8)


def test_moments_of_sections_against_integrals():
    def value(name, number, check):
        return np.asarray(number, dtype=float)

    for section, wide in (
        (fb.Circle(2.0), lambda y: 2 * np.sqrt(1 - y**2)),
        (fb.Rectangle(2.0, 0.7), lambda y: 0.7),
    ):
        exact = [quad(lambda y, k=k, w=wide: y**k * w(y), -1, 1)[0] for k in (0, 2, 4)]
        np.testing.assert_allclose(np.ravel(section.moments(value)), exact, rtol=1e-7)


def test_a_damped_cable_decays_as_its_retardation_tells():
    """Bending of a clamped cable: decay ratio e^(−2πζ/√(1−ζ²)) a period with ζ = τω/2."""
    cable = fb.Cable(length=1.0, elements=8, **THIN)
    omega = 2 * np.pi * float(fb.modes(clamped(cable, {}), 1, about="start")["frequency"][0])
    ratio = 0.03
    damped = fb.Cable(length=1.0, elements=8, retardation=2 * ratio / omega, **THIN)
    plucked = clamped(damped, {"P": fb.Force("m.end", y=lambda t: 1e-4 * (t <= 0))})
    period = 2 * np.pi / omega
    motion = fb.simulate(
        plucked, duration=8 * period, step=period / 200,
        integrator=fb.GeneralizedAlpha(spectral_radius=0.9),
    ).sel(output="tip_Y").values  # fmt: skip
    swings = np.array([np.abs(motion[400 * k : 400 * (k + 1)]).max() for k in range(1, 4)])
    exact = np.exp(-2 * 2 * np.pi * ratio / np.sqrt(1 - ratio**2))
    np.testing.assert_allclose(swings[1:] / swings[:-1], exact, rtol=0.02)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({}, "either height and width or a section"),
        ({"height": 0.1}, "either height and width or a section"),
        ({"section": fb.Circle(0.1), "width": 0.1}, "either height and width or a section"),
        ({"height": 0.1, "width": -1.0}, "Rectangle width must be positive"),
        ({"section": fb.Circle(0.1), "curvature": np.inf}, "Beam curvature"),
    ],
)
def test_bad_shapes_are_refused(change, text):
    with pytest.raises(fb.InputError, match=text):
        fb.Beam(length=1.0, elements=2, **STEEL, **change)


def test_a_hole_wider_than_the_tube_is_refused():
    beam = fb.Beam(length=1.0, elements=2, section=fb.Circle(0.1, lambda x: 0.2 * x), **STEEL)
    with pytest.raises(fb.InputError, match="inner_diameter"):
        fb.equilibrium(clamped(beam, {}))


@pytest.mark.parametrize("path", [[(0.0, 0.0), (1.0, 0.0)], [(0, 0), (1, 0), (1, 0)], lambda u: u])
def test_bad_paths_are_refused(path):
    with pytest.raises(fb.InputError, match="path"):
        fb.Cable.along(path, elements=2, **THIN)
