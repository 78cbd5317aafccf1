"""Sections of beams, and sizes that vary along a beam."""

import numpy as np
import pytest
from scipy.integrate import quad

import flexband as fb
from tests.mechanics.models import STEEL, clamped_member, tip_compliance


def test_a_tapered_cantilever():
    """δ/P = ∫ x²/EI dx + ∫ 1/kGA dx, x from the free end."""
    height, width, length = (lambda x: 0.05 - 0.03 * x), (lambda x: 0.02 + 0.02 * x), 1.0
    beam = fb.Beam(length=length, height=height, width=width, elements=16, **STEEL)
    E, kG = 2.1e11, 10 * 1.3 / (12 + 11 * 0.3) * 2.1e11 / 2.6
    bending, _ = quad(lambda x: (1 - x) ** 2 * 12 / (E * width(x) * height(x) ** 3), 0, 1)
    shear, _ = quad(lambda x: 1 / (kG * width(x) * height(x)), 0, 1)
    assert float(tip_compliance(beam)) == pytest.approx(bending + shear, rel=2e-3)


SECTIONS = {
    "circle": (fb.sections.Circle(0.03), np.pi * 0.03**2 / 4, np.pi * 0.03**4 / 64),
    "tube": (
        fb.sections.Circle(0.03, 0.026),
        np.pi * (0.03**2 - 0.026**2) / 4,
        np.pi * (0.03**4 - 0.026**4) / 64,
    ),
    "general": (fb.sections.GeneralSection(3e-4, 4e-8), 3e-4, 4e-8),
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
    moving_beam = fb.Beam(length=1.0, section=section, elements=2, velocity=(2.0, 0.0), **STEEL)
    model = fb.Mechanism(bodies={"m": moving_beam}, sensors={"E": fb.KineticEnergy()})
    energy = fb.simulate(model, duration=1e-3, step=1e-3)[0, 0]
    assert float(energy) == pytest.approx(2 * 7800.0 * area, rel=1e-8)


def test_moments_of_sections_against_integrals():
    def value(name, number, check):
        return np.asarray(number, dtype=float)

    for section, width_at in (
        (fb.sections.Circle(2.0), lambda y: 2 * np.sqrt(1 - y**2)),
        (fb.sections.Rectangle(2.0, 0.7), lambda y: 0.7),
    ):
        exact = [quad(lambda y, k=k, w=width_at: y**k * w(y), -1, 1)[0] for k in (0, 2, 4)]
        np.testing.assert_allclose(np.ravel(section.moments(value)), exact, rtol=1e-7)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({}, "either height and width or a section"),
        ({"height": 0.1}, "either height and width or a section"),
        (
            {"section": fb.sections.Circle(0.1), "width": 0.1},
            "either height and width or a section",
        ),
        ({"height": 0.1, "width": -1.0}, "Rectangle width must be positive"),
        ({"section": fb.sections.Circle(0.1), "curvature": np.inf}, "Beam curvature"),
    ],
)
def test_bad_shapes_are_refused(change, text):
    with pytest.raises(fb.errors.InputError, match=text):
        fb.Beam(length=1.0, elements=2, **STEEL, **change)


def test_a_hole_wider_than_the_tube_is_refused():
    beam = fb.Beam(
        length=1.0, elements=2, section=fb.sections.Circle(0.1, lambda x: 0.2 * x), **STEEL
    )
    with pytest.raises(fb.errors.InputError, match="inner_diameter"):
        fb.equilibrium(clamped_member(beam, {}))
