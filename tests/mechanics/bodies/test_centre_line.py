"""Curved axes, and axes along a path."""

import numpy as np
import pytest

import flexband as fb
from tests.mechanics.models import STEEL, THIN, clamped_member, tip_compliance


@pytest.mark.parametrize("kind", ["constant", "function"])
def test_a_quarter_ring_against_castigliano(kind):
    """Radial force at the free end: δ/P = π/4 (R³/EI + R/EA + R/kGA) of a thin curved bar."""
    R = np.array([1.0, 1.3])
    h = 0.02
    curvature = 1 / R if kind == "constant" else lambda s: np.ones_like(s) / R[:, None]
    beam = fb.Beam(
        length=np.pi / 2 * R, curvature=curvature, height=h, width=h, elements=64, **STEEL
    )
    E = 2.1e11
    G = 2.1e11 / 2.6
    k = 10 * 1.3 / (12 + 11 * 0.3)
    exact = np.pi / 4 * (R**3 / (E * h**4 / 12) + R / (E * h**2) + R / (k * G * h**2))
    # the clamp is at the origin with its tangent along X, so the free end's tangent is along Y and
    # the force along X is radial there
    np.testing.assert_allclose(tip_compliance(beam, (1.0, 0.0)), exact, rtol=5e-4)


def test_a_curved_beam_is_free_of_stress_and_a_moment_straightens_it():
    h = 0.01
    curvature = 0.8
    beam = fb.Beam(length=1.0, curvature=curvature, height=h, width=h, elements=16, **STEEL)
    rest = fb.equilibrium(clamped_member(beam, {}))
    exact = [np.sin(curvature) / curvature, (1 - np.cos(curvature)) / curvature, curvature]
    np.testing.assert_allclose(rest, exact, atol=1e-9)
    moment = -2.1e11 * h**4 / 12 * curvature
    straight = fb.equilibrium(clamped_member(beam, {"M": fb.Moment("m.end", moment)}), steps=4)
    np.testing.assert_allclose(straight, [1.0, 0.0, 0.0], atol=2e-3)


@pytest.mark.parametrize("member", ["beam", "cable"])
def test_a_member_along_a_path(member):
    """A parabola y = x²/2 from (0, 0) to (1, 1/2): length and end tangent are known."""
    properties = {"height": 0.01, "width": 0.01, **STEEL} if member == "beam" else THIN
    kind = fb.Beam if member == "beam" else fb.Cable
    for path, tolerance in (
        (lambda u: np.stack([u, u**2 / 2], axis=1), 1e-9),
        ([(x, x**2 / 2) for x in np.linspace(0, 1, 41)], 2e-5),  # as far as a spline follows it
    ):
        body = kind.along(path, elements=6, **properties)
        assert body.length == pytest.approx((np.sqrt(2) + np.arcsinh(1)) / 2, rel=1e-6)
        rest = fb.equilibrium(clamped_member(body, {}))
        np.testing.assert_allclose(rest, [1.0, 0.5, np.pi / 4], atol=tolerance)


@pytest.mark.parametrize("path", [[(0.0, 0.0), (1.0, 0.0)], [(0, 0), (1, 0), (1, 0)], lambda u: u])
def test_bad_paths_are_refused(path):
    with pytest.raises(fb.errors.InputError, match="path"):
        fb.Cable.along(path, elements=2, **THIN)
