"""Nested points: what is inside what, what they reproduce, and how stable they are."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import hermite_e

from flexband.uncertainty.expansions.families import HERMITE, LEGENDRE
from flexband.uncertainty.expansions.points.sequences import (
    GENZ_KEISTER,
    PATTERSON,
    interval_sequence,
    normal_sequence,
    uniform_sequence,
)
from flexband.uncertainty.expansions.polynomials import chebyshev_values, scaled_chebyshev_zeros

COUNT = 25
SEQUENCES = {
    "interval": interval_sequence,
    "normal": normal_sequence,
    "uniform": uniform_sequence,
}


def product(x, nodes):
    """Π |x − x_j|, of all x."""
    return np.prod(np.abs(x[:, None] - nodes), axis=1)


def lebesgue(points, grid, rate):
    """Largest Σ |ℓ_j| of polynomials weighted by e^{−rate x²}."""
    total = np.zeros_like(grid)
    for j, p in enumerate(points):
        nodes = np.delete(points, j)
        total += np.prod(np.abs((grid[:, None] - nodes) / (p - nodes)), axis=1) * np.exp(
            rate * (p * p - grid**2)
        )
    return total.max()


@pytest.mark.parametrize("sequence", SEQUENCES.values(), ids=SEQUENCES)
def test_fewer_points_are_the_first_of_more(sequence):
    longest = sequence(COUNT)
    assert len(set(longest)) == COUNT
    for count in range(COUNT):
        assert sequence(count).tobytes() == longest[:count].tobytes()


def test_intervals_start_as_the_paper_points():
    """Orders 0, 1 and 2 are an end, both ends, and both ends with the middle."""
    x = interval_sequence(COUNT)
    assert x[:3].tolist() == [1.0, -1.0, 0.0]
    assert np.abs(x).max() == 1.0
    for order in (1, 2):
        np.testing.assert_array_equal(np.sort(x[: order + 1])[::-1], scaled_chebyshev_zeros(order))


def test_leja_points_are_the_largest_of_the_product():
    """Against a scan; the largest of x(1 − x²) is at 1/√3."""
    x = interval_sequence(COUNT)
    grid = np.linspace(-1, 1, 20001)
    assert x[3] == pytest.approx(1 / np.sqrt(3), abs=1e-10)
    for k in range(2, COUNT):
        assert product(x[k : k + 1], x[:k])[0] >= (1 - 1e-9) * product(grid, x[:k]).max()
    x = normal_sequence(COUNT)
    grid = np.linspace(-14, 14, 20001)
    weight = np.exp(-(grid**2) / 4)
    for k in range(9, COUNT, 2):
        value = product(x[k : k + 1], x[:k])[0] * np.exp(-(x[k] ** 2) / 4)
        assert value >= (1 - 1e-9) * (product(grid, x[:k]) * weight).max()


def test_random_points_come_in_pairs_about_the_mean():
    x = normal_sequence(COUNT)
    assert x[0] == 0.0
    np.testing.assert_array_equal(x[1::2], -x[2::2])
    np.testing.assert_allclose(np.sort(x[:3]), HERMITE.gauss(3)[0], atol=1e-15)
    weighted = []  # Leja order among the points of Genz and Keister
    for k in (3, 5, 7):
        rest = x[k:9]
        sizes = product(rest, x[:k]) * np.exp(-(rest**2) / 4)
        weighted.append(sizes[0] == pytest.approx(sizes.max()))
    assert all(weighted)
    assert tuple(x[1:9:2]) == GENZ_KEISTER


@pytest.mark.parametrize(("count", "degree"), [(1, 1), (3, 5), (7, 7), (9, 15)])
def test_means_are_exact_to_the_degree_of_genz_and_keister(count, degree):
    """The first coefficient is a quadrature rule: 1, 3 and 9 points of degree 1, 5 and 15."""
    x = normal_sequence(count)
    rule = np.linalg.inv(HERMITE.values(count - 1, x))[0]
    moments = rule @ (HERMITE.values(degree + 1, x) / np.sqrt(HERMITE.norms(degree + 1)))
    np.testing.assert_allclose(moments[: degree + 1], np.eye(degree + 1)[0], atol=1e-12)
    assert abs(moments[degree + 1]) > 1e-3


@pytest.mark.parametrize(("count", "degree"), [(1, 1), (3, 5), (7, 11), (15, 23)])
def test_means_are_exact_to_the_degree_of_patterson(count, degree):
    x = uniform_sequence(COUNT)
    assert tuple(x[1:15:2]) == PATTERSON
    np.testing.assert_array_equal(x[1::2], -x[2::2])
    rule = np.linalg.inv(LEGENDRE.values(count - 1, x[:count]))[0]
    moments = rule @ LEGENDRE.values(degree + 1, x[:count])
    np.testing.assert_allclose(moments[: degree + 1], np.eye(degree + 1)[0], atol=1e-13)
    assert abs(moments[degree + 1]) > 1e-6


@st.composite
def expansions(draw):
    """A downward closed set of orders, which variables are random, and coefficients."""
    d = draw(st.integers(1, 4))
    tops = draw(st.lists(st.tuples(*[st.integers(0, 4)] * d), min_size=1, max_size=4))
    orders = sorted({v for top in tops for v in np.ndindex(*(q + 1 for q in top))})
    random = draw(st.lists(st.booleans(), min_size=d, max_size=d))
    seed = draw(st.integers(0, 2**32 - 1))
    return np.array(orders), random, np.random.default_rng(seed).uniform(-1, 1, len(orders))


@given(expansions())
def test_polynomials_of_a_downward_closed_set_are_reproduced(case):
    """One run for each order: V c = F gives the coefficients back."""
    orders, random, coefficients = case
    V = np.ones((len(orders), len(orders)))
    for v, is_random in zip(orders.T, random, strict=True):
        q = v.max()
        if is_random:
            basis = HERMITE.values(q, normal_sequence(q + 1)) / np.sqrt(HERMITE.norms(q))
        else:
            basis = chebyshev_values(q, interval_sequence(q + 1))
        V *= basis[np.ix_(v, v)]
    solution = np.linalg.solve(V, V @ coefficients)
    np.testing.assert_allclose(solution, coefficients, atol=1e-8)


def test_constants_of_intervals_grow_slowly():
    """Of orders 1, 2 and 3 they are 1, 5/4 and 3; up to order 24 they stay below q + 1."""
    grid = np.linspace(-1, 1, 4001)
    x = interval_sequence(COUNT)
    constants = np.array([lebesgue(x[: q + 1], grid, 0.0) for q in range(COUNT)])
    np.testing.assert_allclose(constants[[1, 2]], [1.0, 1.25], rtol=1e-6)
    assert constants[3] == pytest.approx(3.0, rel=1e-3)
    assert (constants <= np.arange(COUNT) + 1.0).all()


def test_constants_of_random_variables_grow_slowly():
    """Weighted by √pdf; Gauss–Hermite points, not nested, have 2.8 at order 20."""
    grid = np.linspace(-14, 14, 5601)
    x = normal_sequence(COUNT)
    constants = np.array([lebesgue(x[: q + 1], grid, 0.25) for q in range(COUNT)])
    assert constants[0] == pytest.approx(1.0)
    assert constants[2] == pytest.approx(lebesgue(HERMITE.gauss(3)[0], grid, 0.25))
    assert constants[2::2].max() < 15
    assert constants.max() < 30
    assert lebesgue(hermite_e.hermegauss(21)[0], grid, 0.25) == pytest.approx(2.78, abs=0.01)
