"""Residual and tangent against each other, and the sparse factorization."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import flexband as fb
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.kernels.pattern import analyse
from flexband.mechanics.kernels.types.record import RecordType
from tests.mechanics.models import Dense, gears, slider_crank, spring_and_moment


def test_the_structures_of_all_mechanisms_have_one_layout():
    """The engine is compiled for one. What a mechanism does not have are empty arrays."""
    point = fb.Mechanism(bodies={"p": fb.PointMass(mass=1.0)}, sensors={"x": fb.Position("p")})
    bodies, joints = gears((0.1, 0.25), (0.4, 0.3))
    gear_train = fb.Mechanism(
        bodies=bodies,
        joints=joints,
        loads={"law": fb.ForceLaw(["1"], spring_and_moment, (4.0, 0.01))},
        sensors={"angle": fb.Angle("1")},
    )
    layouts = {RecordType(assemble(m).structure) for m in (point, gear_train, slider_crank())}
    assert len(layouts) == 1


@pytest.mark.parametrize(
    "integration", [fb.sections.FullIntegration(), fb.sections.SelectiveIntegration()]
)
def test_tangent_is_the_derivative_of_the_residual(integration):
    dense = Dense(slider_crank(integration=integration, youngs_modulus=1e6))
    rng = np.random.default_rng(0)
    size = dense.structure.pattern.unknowns
    unknowns = np.concatenate([dense.start, np.zeros(size - len(dense.start))])
    unknowns += 0.05 * rng.standard_normal(size)
    n = dense.structure.state.coordinates
    step = 1e-5  # central differences: the error is third derivatives times step²/6
    exact = np.stack(
        [
            (dense.residual(unknowns + step * e) - dense.residual(unknowns - step * e)) / (2 * step)
            for e in np.eye(size)
        ],
        axis=1,
    )
    exact[:n, :n] += dense.mass()
    np.testing.assert_allclose(dense.tangent(unknowns), exact, atol=1e-8 * np.abs(exact).max())


@pytest.mark.filterwarnings("ignore:'b' has 1 element:flexband.errors.ResolutionWarning")
def test_tangent_of_gears_and_laws_is_the_derivative_of_the_residual():
    """Gears, a rack, a drive along a beam, and laws and a moment on bodies and on its sections, in
    any state, multipliers too.
    """
    r1 = 0.1
    r2 = 0.25
    bodies, joints = gears((r1, r2), (0.4, 0.3))
    beam = fb.Beam(length=0.4, height=0.02, width=0.01, elements=1, density=1000.0,
                   youngs_modulus=1e4, poissons_ratio=0.3, start=(r1 + r2, 0.2))  # fmt: skip
    model = fb.Mechanism(
        bodies=bodies | {"b": beam},
        joints={
            "mesh": joints["mesh"],
            "rack": fb.Rack("b.0.3", "2", 0.2, axis=(0.6, 0.8)),
            "travel": fb.PrescribedTravel("2", "b.0.8", lambda t: 0.4 + t, axis=(0.6, 0.8)),
            "more": fb.Gear("b.end", "1", 0.3, 0.1),
        },
        loads={
            "t": fb.TorsionSpring("b.0.7", "1", 3.0, rest_angle=0.2, cubic=2.0),
            "l": fb.ForceLaw(["1", "b.0.3"], spring_and_moment, (4.0, 0.01)),
            "M": fb.Moment("b.0.6", 1.5),
        },
    )  # fmt: skip
    dense = Dense(model)
    count = dense.structure.state.coordinates
    rng = np.random.default_rng(3)
    unknowns = np.concatenate(
        [dense.start + 0.05 * rng.standard_normal(count), rng.standard_normal(4)]
    )
    step = 1e-6
    exact = np.stack(
        [
            (dense.residual(unknowns + step * e) - dense.residual(unknowns - step * e)) / (2 * step)
            for e in np.eye(len(unknowns))
        ],
        axis=1,
    )
    tangent = dense.tangent(unknowns) - dense.tangent(unknowns, 0.0)
    Phi = dense.tangent(unknowns, 0.0)
    np.testing.assert_allclose(tangent[:count, :count], exact[:count, :count], atol=2e-6)
    np.testing.assert_allclose(Phi[count:, :count], exact[count:, :count], atol=1e-8)


def test_factorization_solves_the_saddle_point_system():
    dense = Dense(slider_crank(youngs_modulus=1e4))
    size = dense.structure.pattern.unknowns
    unknowns = np.concatenate([dense.start, np.zeros(size - len(dense.start))])
    right = np.random.default_rng(0).standard_normal(size)
    matrix = dense.tangent(unknowns)
    np.testing.assert_allclose(
        dense.solved(unknowns, right), np.linalg.solve(matrix, right), rtol=1e-7
    )


@given(st.integers(1, 6), st.integers(0, 10_000))
def test_a_multiplier_comes_after_its_coordinates(multipliers, seed):
    rng = np.random.default_rng(seed)
    coordinates = 12
    stiffness = {(i, i) for i in range(1, coordinates + 1)}
    stiffness |= {tuple(sorted(rng.integers(1, coordinates + 1, 2))) for _ in range(15)}
    jacobian = {
        (int(i), coordinates + 1 + k)
        for k in range(multipliers)
        for i in rng.choice(np.arange(1, coordinates + 1), 3, replace=False)
    }
    count = coordinates + multipliers
    pairs = [(i, i + 1 if i < count else 0) for i in range(1, count + 1, 2)]
    pattern, _ = analyse(pairs, coordinates, stiffness | jacobian)
    pattern_pairs = np.stack([pattern.first, pattern.second], axis=1)
    place = {int(i): k for k, pair in enumerate(pattern_pairs) for i in pair}
    assert sorted(place.keys() - {0}) == list(range(1, count + 1))
    assert all(place[i] < place[j] for i, j in jacobian)


def test_a_chain_costs_in_proportion_to_its_length():
    def products(elements):
        dense = Dense(slider_crank(elements=elements))
        return len(dense.structure.pattern.product_v)

    assert products(64) - products(32) == 2 * (products(32) - products(16))
