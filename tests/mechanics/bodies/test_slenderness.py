"""The default beam, of any slenderness, with four elements; thin members do not lock."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import flexband as fb
from tests.mechanics.models import Dense

E = 2.1e11
NU = 0.3
FACTOR = 10 * (1 + NU) / (12 + 11 * NU)
ELASTICA = {1: (0.0564332363, 0.3017207738), 10: (0.5549955978, 0.8106090249)}


def beam(slenderness, elements=4, **change):
    height = 1.0 / slenderness
    properties = {"length": 1.0, "height": height, "width": 0.01, "density": 7800.0}
    properties |= {"youngs_modulus": E, "poissons_ratio": NU, "elements": elements}
    return fb.Beam(**(properties | change))


def cantilever(member, **loads):
    return fb.Mechanism(
        bodies={"b": member},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
        loads=loads,
        sensors={"tip": fb.Position("b.end"), "U": fb.ElasticEnergy()},
    )


def stiffness(slenderness):
    """Return EI [N m²]."""
    return E * 0.01 / slenderness**3 / 12


def timoshenko(slenderness, count=3, factor=FACTOR, inertia=1.0):
    """Return the frequencies of a clamped–free beam over √(EI/ρA L⁴), to all digits."""
    rotary = inertia / (12 * slenderness**2)
    shear = 2 * (1 + NU) / factor / (12 * slenderness**2)

    def end_determinant(w):  # moment and shear force at the end for those at the clamp
        A = [[0, 1, 0, shear], [0, 0, 1, 0], [0, -w * w * rotary, 0, -1], [-w * w, 0, 0, 0]]
        return np.linalg.det(expm(np.array(A))[2:, 2:])

    w = np.linspace(0.5, 70, 700)
    values = [end_determinant(x) for x in w]
    signs = np.flatnonzero(np.diff(np.sign(values)))
    return np.array([brentq(end_determinant, w[k], w[k + 1]) for k in signs[:count]])


@pytest.mark.parametrize("slenderness", [5, 20, 100])
def test_frequencies_of_four_elements(slenderness):
    modes = fb.modes(cantilever(beam(slenderness)), 6, about="start")
    bending = np.abs(modes["shape"][:, 1]) > np.abs(modes["shape"][:, 0])
    rate = 2 * np.pi * modes["frequency"][bending.values][:3].values
    rate /= np.sqrt(stiffness(slenderness) / (7800 * 0.01 / slenderness))
    errors = np.abs(rate / timoshenko(slenderness) - 1)
    assert np.all(errors < [1e-4, 1.5e-3, 1.2e-2])


@pytest.mark.parametrize("slenderness", [5, 20, 100])
def test_the_tip_of_four_elements_is_exact_in_the_linear_limit(slenderness):
    load = 1e-4 * stiffness(slenderness)
    rest = fb.equilibrium(cantilever(beam(slenderness), P=fb.Force("b.end", y=load)))
    shear = 2 * (1 + NU) / (12 * FACTOR * slenderness**2)
    assert float(rest.sel(output="tip_Y")) == pytest.approx(1e-4 * (1 / 3 + shear), rel=1e-7)


@pytest.mark.parametrize(("slenderness", "a"), [(100, 1), (500, 1), (500, 10)])
def test_elastica_of_four_elements(slenderness, a):
    load = fb.Force("b.end", y=a * stiffness(slenderness))
    x, y, _ = fb.equilibrium(cantilever(beam(slenderness), P=load), steps=8).values
    u, w = ELASTICA[a]
    np.testing.assert_allclose([1 - x, y], [u, w], atol=1e-3)


@pytest.mark.parametrize("cable", [False, True])
def test_a_member_of_four_elements_rolls_up_to_a_circle(cable):
    member = beam(100)
    bending = stiffness(100)
    if cable:
        rope = {"mass_per_length": 1.0, "axial_stiffness": 1e8 * bending}
        member = fb.Cable(length=1.0, elements=4, bending_stiffness=bending, **rope)
    load = fb.Moment("b.end", 2 * np.pi * bending)
    x, y, energy = fb.equilibrium(cantilever(member, M=load), steps=20).values
    np.testing.assert_allclose([x, y], 0.0, atol=1e-8)
    assert energy == pytest.approx(2 * np.pi**2 * bending, rel=1e-8)


def test_shear_factor_and_rotary_inertia():
    """Other ones than those of the section, against Timoshenko's beam."""
    moment = 7800.0 * 0.01 * 0.2**3 / 12
    member = beam(5, 8, shear_factor=0.5, rotary_inertia=3 * moment)
    rate = 2 * np.pi * fb.modes(cantilever(member), 1, about="start")["frequency"].item()
    rate /= np.sqrt(stiffness(5) / (7800 * 0.01 / 5))
    assert rate == pytest.approx(timoshenko(5, 1, 0.5, 3.0)[0], rel=1e-5)
    with pytest.raises(fb.errors.InputError, match="shear_factor"):
        beam(5, shear_factor=0.5, integration=fb.sections.SelectiveIntegration())


def test_rigid_motion_causes_no_forces_and_the_tangent_is_exact():
    body = beam(5, 2, curvature=lambda x: 0.5 + x, youngs_modulus=1e4, angle=0.7)
    dense = Dense(fb.Mechanism(bodies={"b": body}))
    c = np.cos(2.0)
    s = np.sin(2.0)
    rotated_start = (dense.start.reshape(-1, 2) @ np.array([[c, s], [-s, c]])).ravel()
    assert np.abs(dense.residual(rotated_start)).max() < 1e-12 * 1e4
    q = dense.start + 0.1 * np.random.default_rng(0).standard_normal(len(dense.start))
    step = 1e-6
    exact = np.stack(
        [(dense.residual(q + step * e) - dense.residual(q - step * e)) / (2 * step)
         for e in np.eye(len(q))], axis=1)  # fmt: skip
    tangent = dense.tangent(q) - dense.tangent(q, 0.0)
    np.testing.assert_allclose(tangent, exact, atol=1e-8 * np.abs(exact).max())


def test_an_element_that_folds_is_refused():
    """A push of 1.2 EA would turn the element inside out."""
    load = fb.Force("b.end", x=-1.2 * E * 0.01 / 5)
    with pytest.raises(fb.errors.AssemblyError):
        fb.equilibrium(cantilever(beam(5, 1), P=load), steps=5)
