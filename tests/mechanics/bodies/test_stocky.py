"""Beams that are thick for their length or their curvature, or have much rotary inertia."""

import numpy as np
import pytest

import flexband as fb
from tests.mechanics.models import roots, timoshenko

RUBBER = {"density": 1000.0, "youngs_modulus": 1e9, "poissons_ratio": 0.3}


CONTINUA = [fb.sections.SelectiveIntegration(), fb.sections.FullIntegration()]
SECTION_INERTIA = 100.0 * 1e-2 * 0.1**2 / 12


def middle_rate(inertia, integration=None, youngs_modulus=1e6):
    """Return the speed of a free beam of `SECTION_INERTIA` that starts with 10 rad/s."""
    beam = fb.Beam(
        length=1.0, section=fb.sections.GeneralSection(1e-2, SECTION_INERTIA / 100.0),
        density=100.0, youngs_modulus=youngs_modulus, poissons_ratio=0.3, elements=4,
        rotary_inertia=inertia, rate=10.0, integration=integration,
    )  # fmt: skip
    model = fb.Mechanism(bodies={"b": beam}, sensors={"w": fb.AngularVelocity("b.middle")})
    return fb.simulate(model, duration=0.5, step=1e-3)


@pytest.mark.parametrize("inertia", [1.0, 10.0])
def test_a_beam_of_large_rotary_inertia_keeps_its_speed(inertia):
    """The section's direction must not grow where much inertia pulls at it."""
    np.testing.assert_allclose(middle_rate(inertia), 10.0, rtol=1.5e-3)


@pytest.mark.parametrize("integration", CONTINUA)
def test_a_continuum_keeps_its_speed_or_refuses_its_rotary_inertia(integration):
    """At 1e8 Pa its axis stretches by at most ρω²L²/8E = 1.25e-5."""
    for factor in (1.0, 10.0):
        rate = middle_rate(factor * SECTION_INERTIA, integration, youngs_modulus=1e8)
        np.testing.assert_allclose(rate.mean(), 10.0, rtol=6e-5)
    message = r"at most 0\.00833, 10 times that of the section, .* got 0\.00842\. Leave integration"
    for inertia in (
        10.1 * SECTION_INERTIA,
        np.array([SECTION_INERTIA, 10.1 * SECTION_INERTIA]),
        lambda x: 10.1 * SECTION_INERTIA + 0 * x,
    ):
        with pytest.raises(
            fb.errors.InputError, match="body 'b': Beam rotary_inertia .*" + message
        ):
            middle_rate(inertia, integration)


def arc(ratio, **section):
    """Return the stresses inside and outside an arc under an end moment of 1 N m."""
    radius = 0.1 * ratio
    beam = fb.Beam(length=np.pi / 2 * radius, curvature=1 / radius, elements=8, **RUBBER, **section)
    model = fb.Mechanism(
        bodies={"b": beam},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
        loads={"M": fb.Moment("b.end", 1.0)},
        sensors={"i": fb.Stress("b", y=0.05), "o": fb.Stress("b", y=-0.05)},
    )
    return fb.equilibrium(model).sel(output=["i_xx", "o_xx"]).values


@pytest.mark.parametrize("ratio", [0.8, 1.5, 3.0, 10.0, 1e3])
@pytest.mark.parametrize("shape", ["rectangle", "circle"])
def test_stress_of_a_thick_arc_is_winklers(ratio, shape):
    """σ = −M (r_n − r)/(A e r) with the radius r_n = A/∫dA/r of the neutral fibre, e = R − r_n."""
    radius = 0.1 * ratio
    r = radius + np.array([-0.05, 0.05])
    if shape == "rectangle":
        section = {"height": 0.1, "width": 0.1}
        area = 0.01
        neutral = 0.1 / np.log(r[1] / r[0])
    else:
        section = {"section": fb.sections.Circle(0.1)}
        area = np.pi * 0.05**2
        neutral = (radius + np.sqrt(radius**2 - 0.05**2)) / 2
    exact = -(neutral - r) / (area * (radius - neutral) * r)
    np.testing.assert_allclose(arc(ratio, **section), exact, rtol=1e-5)


@pytest.mark.parametrize("ratio", [0.4, -0.4, 0.5])
def test_an_arc_whose_inside_lies_beyond_its_centre_is_refused(ratio):
    with pytest.raises(fb.errors.InputError, match=r"curvature \[1/m\] must be between -2/height"):
        fb.Beam(length=0.05, height=0.1, width=0.1, curvature=1 / (0.1 * ratio), **RUBBER)
    body = fb.Beam(
        elements=4,
        length=0.05,
        height=0.1,
        width=0.1,
        curvature=lambda s: 1 / (0.1 * ratio) + 0 * s,
        **RUBBER,
    )
    with pytest.raises(fb.errors.InputError, match="body 'b': Beam curvature"):
        fb.simulate(
            fb.Mechanism(bodies={"b": body}, sensors={"b": fb.Position("b.end")}),
            duration=1e-3, step=1e-4,
        )  # fmt: skip


@pytest.mark.parametrize("ratio", [2.0, 3.0, 5.0])
def test_modes_of_thickness_are_marked_and_left_out(ratio):
    """What remains are the bending modes of Timoshenko's clamped beam, and the axial ones.

    Modes of thickness reach beyond Timoshenko's fifth bending mode.
    """
    length = 0.1 * ratio
    h = 0.1
    EI = 1e9 * 0.1**4 / 12
    kGA = 1e9 / 2.6 * 13 / 15.3 * 0.1**2
    beam = fb.Beam(length=length, height=h, width=h, elements=16, **RUBBER)
    model = fb.Mechanism(
        bodies={"b": beam},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
        sensors={"tip": fb.Position("b.end")},
    )

    def determinant(omega):
        across = timoshenko(omega, length, EI, kGA, 1000 * h**2, 1000 * h**4 / 12)
        return np.linalg.det(across[2:, 2:])

    bending = roots(determinant, np.linspace(50, 7000, 700))
    axial = 1000.0 / (4 * length) * np.arange(1, 20, 2)
    exact = np.sort([*bending, *axial])[:9]
    modes = fb.modes(model, 9, about="start")
    assert not modes["thickness"].any()
    np.testing.assert_allclose(modes["frequency"], exact, rtol=1e-3)
    all_modes = fb.modes(model, 40, about="start", thickness=True)
    frequencies = all_modes["frequency"][~all_modes["thickness"]][:9]
    np.testing.assert_allclose(frequencies, modes["frequency"], rtol=1e-9)
    assert all_modes["thickness"].sum() > 10
