"""Members that are divided where loads and joints act between their ends."""

import numpy as np
import pytest

import flexband as fb
from tests.mechanics.models import roots, timoshenko

E = 7e10
NU = 0.3
WIDTH = 0.03
RHO = 2700.0
FORCE = 1e-3
"""Small enough that second-order effects on thin members vanish."""

KINDS = ["beam", "continuum", "cable"]


def stiffness(height):
    """EI [N m²] and kGA [N] of the section."""
    area = WIDTH * height
    second = WIDTH * height**3 / 12
    k = 10 * (1 + NU) / (12 + 11 * NU)
    return E * second, k * E / (2 * (1 + NU)) * area


def member(elements, height=0.1, kind="beam", **options):
    if kind == "cable":
        EI, _ = stiffness(height)
        options |= {"mass_per_length": RHO * WIDTH * height, "bending_stiffness": EI}
        return fb.Cable(
            length=1.0, axial_stiffness=E * WIDTH * height, elements=elements, **options
        )
    if kind == "continuum":
        options |= {"integration": fb.sections.SelectiveIntegration()}
    material = {"density": RHO, "youngs_modulus": E, "poissons_ratio": NU}
    return fb.Beam(
        length=1.0, height=height, width=WIDTH, elements=elements, **material, **options
    )  # fmt: skip


def beam_on_supports(body, loads, places, joints=None):
    """A beam on two supports with sensors of section forces at places."""
    supports = {"p": fb.Revolute("b.start", (0.0, 0.0)), "q": fb.Slot("b.end", (0.0, 0.0))}
    return fb.Mechanism(
        bodies={"b": body},
        joints=supports if joints is None else joints,
        loads=loads,
        sensors={place: fb.SectionForces("b", place) for place in places},
    )


def forces(model):
    """N, Q and M at the places, three rows."""
    return np.reshape(fb.equilibrium(model).to_numpy(), (-1, 3)).T


PLACES = ["0.0", "0.1", "0.25", "0.4", "0.49", "0.499999", "0.5", "0.55", "0.75", "1.0"]


@pytest.mark.parametrize("height", [0.2, 0.01, 0.001])
@pytest.mark.parametrize("elements", [2, 4, 5, 7])
def test_three_point_bending(elements, height):
    """Q = ∓F/2 before and behind the force, M = Fx/2, whether there is a node there or not."""
    model = beam_on_supports(
        member(elements, height), {"F": fb.Force("b.middle", y=-FORCE)}, PLACES
    )
    _, Q, M = forces(model)
    x = np.array(PLACES, dtype=float)
    np.testing.assert_allclose(Q, FORCE / 2 * np.where(x < 0.5, -1, 1), rtol=1e-4)
    np.testing.assert_allclose(M, FORCE / 2 * np.minimum(x, 1 - x), atol=1e-4 * FORCE)


@pytest.mark.parametrize("kind", KINDS)
def test_four_point_bending(kind):
    """Between the forces there is no shear force, and M is constant."""
    loads = {"F": fb.Force("b.0.3", y=-FORCE), "G": fb.Force("b.0.7", y=-FORCE)}
    places = ["0.1", "0.299", "0.3", "0.5", "0.699", "0.7", "0.9"]
    _, Q, M = forces(beam_on_supports(member(6, kind=kind), loads, places))
    np.testing.assert_allclose(Q / FORCE, [-1, -1, 0, 0, 0, 1, 1], atol=1e-3)
    np.testing.assert_allclose(M / FORCE, [0.1, 0.299, 0.3, 0.3, 0.3, 0.3, 0.1], atol=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_the_axial_force_jumps(kind):
    loads = {"F": fb.Force("b.0.6", x=100.0)}
    N, _, _ = forces(
        beam_on_supports(member(4, kind=kind), loads, ["0.1", "0.4", "0.599", "0.6", "0.9"])
    )
    np.testing.assert_allclose(N, [100, 100, 100, 0, 0], atol=1e-6)


def test_a_cantilever_propped_at_an_interior_support():
    """Timoshenko's beam, clamped at the start, on a support at a, with a force at the end."""
    a = 0.6
    height = 0.2
    EI, kGA = stiffness(height)
    prop = FORCE * (a**2 * (3 - a) / (6 * EI) + a / kGA) / (a**3 / (3 * EI) + a / kGA)
    joints = {"w": fb.Weld("b.start", (0.0, 0.0)), "s": fb.Slot("b.0.6", (0.0, 0.0))}
    places = ["0.0", "0.3", "0.599999", "0.6", "0.8", "1.0"]
    model = beam_on_supports(member(4, height), {"F": fb.Force("b.end", y=-FORCE)}, places, joints)
    _, Q, M = forces(model)
    x = np.array(places, dtype=float)
    exact = np.where(x < a, prop - FORCE, -FORCE)
    np.testing.assert_allclose(Q, exact, rtol=1e-4)
    exact = -FORCE * (1 - x) + prop * np.maximum(0, a - x)
    np.testing.assert_allclose(M, exact, atol=1e-4 * FORCE)


def test_beams_that_a_link_joins_in_their_middles():
    """The link between two simply supported beams carries what makes their deflections equal."""
    height = 0.2
    b = 0.25
    EI, kGA = stiffness(height)
    deflection = b * (3 - 4 * b**2) / (48 * EI) + b / (2 * kGA)  # in the middle, of a force at b
    link_force = FORCE * deflection / (2 * (1 / (48 * EI) + 1 / (4 * kGA)))
    upper = member(5, height)
    lower = member(3, height, start=(0.0, -0.5))
    model = fb.Mechanism(
        bodies={"b": upper, "l": lower},
        joints={
            "p": fb.Revolute("b.start", (0.0, 0.0)), "q": fb.Slot("b.end", (0.0, 0.0)),
            "r": fb.Revolute("l.start", (0.0, -0.5)), "s": fb.Slot("l.end", (0.0, -0.5)),
            "link": fb.Distance("b.middle", "l.middle", 0.5),
        },
        loads={"F": fb.Force("b.0.25", y=-FORCE)},
        sensors={"R": fb.Reaction("link")}
        | {f"l{place}": fb.SectionForces("l", place) for place in ("0.2", "0.49", "0.5", "0.9")},
    )  # fmt: skip
    outputs = fb.equilibrium(model).to_numpy()
    assert outputs[1] == pytest.approx(link_force, rel=1e-4)
    Q = outputs[3::3]
    np.testing.assert_allclose(Q, link_force / 2 * np.array([-1, -1, 1, 1]), rtol=1e-4)


def beam_on_pivot(elements, **options):
    """A free beam on a pivot at 0.4 of its length."""
    return fb.Mechanism(
        bodies={"b": member(elements, height=0.2, **options)},
        joints={"pivot": fb.Revolute("b.0.4", (0.4, 0.0))},
        loads={"g": fb.Gravity()},
        sensors={
            "T": fb.KineticEnergy(), "U": fb.ElasticEnergy(), "V": fb.PotentialEnergy(),
            "F": fb.Reaction("pivot"), "before": fb.SectionForces("b", "0.399999"),
            "behind": fb.SectionForces("b", "0.4"),
        },
    )  # fmt: skip


def test_modes_of_a_beam_on_a_pivot():
    """Timoshenko's beam, free at both ends, by transfer matrices of w, φ, M and the shear force."""
    a = 0.4
    height = 0.2
    EI, kGA = stiffness(height)
    mass = RHO * WIDTH * height
    rotary = RHO * WIDTH * height**3 / 12

    def determinant(omega):
        before, behind = (timoshenko(omega, span, EI, kGA, mass, rotary) for span in (a, 1 - a))
        at_pivot = [*before[0, :2], 0.0]  # w, of w and φ at the start and of the force of the pivot
        end = behind @ np.column_stack([before[:, :2], [0, 0, 0, 1]])
        return np.linalg.det([at_pivot, *end[2:]])

    exact = roots(determinant, np.linspace(300, 3000, 200))
    frequencies = fb.modes(beam_on_pivot(10), 3, about="start").frequency.to_numpy()
    np.testing.assert_allclose(frequencies[1:], exact, rtol=3e-4)  # the first is the free swing


def test_a_seesaw_keeps_its_energy_and_the_pivot_bears_the_jump():
    """The sections beside the pivot differ by its force, along and across the sections."""
    run = fb.simulate(
        beam_on_pivot(5),
        duration=0.2,
        step=1e-3,
        integrator=fb.GeneralizedAlpha(spectral_radius=1.0),
    ).to_numpy()
    energy = run[:3].sum(axis=0)
    assert np.ptp(energy) < 5e-6 * np.ptp(run[2])
    jump, reaction = (np.hypot(*two) for two in (run[5:7] - run[8:10], run[3:5]))
    np.testing.assert_allclose(jump[1:], reaction[1:], atol=0.04 * reaction.max())  # it rings


def test_samples_of_divided_members_do_not_depend_on_each_other():
    """Lengths and a stiffness along the beam that differ by sample."""

    def build(length, modulus):
        beam = fb.Beam(
            length=length, height=0.05, width=WIDTH, density=RHO, youngs_modulus=modulus,
            poissons_ratio=NU, elements=5, curvature=0.3,
        )  # fmt: skip
        clamp = {"w": fb.Weld("b.start", (0.0, 0.0))}
        return beam_on_supports(beam, {"F": fb.Force("b.0.7", y=-30.0)}, ["0.3", "0.7"], clamp)

    length = np.array([1.0, 1.3, 0.8])
    factor = np.array([[1.0], [1.2], [0.9]])
    batch = fb.equilibrium(build(length, lambda x: E * factor * (1 + x))).to_numpy()
    for k in range(3):
        mechanism = build(length[k : k + 1], lambda x, k=k: E * factor[k] * (1 + x))
        np.testing.assert_array_equal(fb.equilibrium(mechanism).to_numpy(), batch[k])


@pytest.mark.parametrize("kind", ["beam", "cable"])
def test_elements_are_shared_among_the_parts(kind):
    def mesh(elements, *points, parts=1):
        loads = {point: fb.Force(f"b.{point}", y=1.0) for point in points}
        return (
            beam_on_supports(member(elements, kind=kind), loads, [])
            .refined(parts)
            .model.member("b")[0]
        )

    even = mesh(4, "start", "1.0", parts=2)
    assert even.mesh.even
    assert even.size == 9 * even.per_node
    assert mesh(4, "0.25", "middle").mesh.even
    uneven = mesh(5, "0.3")
    np.testing.assert_allclose(uneven.element_lengths[0], [0.15, 0.15, *3 * [0.7 / 3]])
    assert uneven.size == 7 * uneven.per_node
    assert uneven.element_position("0.3") == 2
    assert uneven.element_position("node 3") == pytest.approx(2 + 9 / 7)
    refined_member = mesh(5, "0.3", parts=3)
    np.testing.assert_allclose(
        refined_member.element_lengths[0], np.repeat(uneven.element_lengths / 3, 3)
    )
    assert refined_member.elements == 15
    assert refined_member.element_position("node 5") == 15
    np.testing.assert_array_equal(mesh(4, "0.5", "0.501", "0.999").mesh.doubled, [2])  # too close


def test_too_few_elements_are_warned_of():
    loads = {point: fb.Force(f"b.{point}", y=-FORCE) for point in ("0.2", "0.6")}
    with pytest.warns(
        fb.errors.ResolutionWarning, match="2 elements but 3 parts .* elements=3 or more"
    ):
        fb.equilibrium(beam_on_supports(member(2), loads, ["0.1"]))
