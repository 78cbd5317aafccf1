"""Bounds of polynomials over products of discs and intervals."""

import numpy as np
import pytest
from scipy.optimize import minimize

import flexband as fb
from flexband.uncertainty.adaptive.held_out_points import generic_points
from flexband.uncertainty.expansions.bounds.discs import RADIUS, in_discs
from flexband.uncertainty.expansions.bounds.extremes import extremes
from flexband.uncertainty.expansions.families import HERMITE
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.index_sets import bounded_terms
from flexband.uncertainty.inputs.sampling import nested_points
from tests.polynomials import drawn_polynomial


def expansion(m, order, discs, series=20, seed=0):
    index = bounded_terms(m, order, 1.0, 5000)
    rng = np.random.default_rng(seed)
    coefficients = rng.standard_normal((len(index), series)) * 0.6 ** index.sum(1)[:, None]
    return HybridExpansion((), index, coefficients, discs)


def scan_points(m, discs, count=50_000):
    rng = np.random.default_rng(1)
    points = rng.uniform(-1, 1, (count, m))
    ends = rng.random(points.shape) < 0.5
    points[ends] = np.sign(points[ends])
    for k in discs:
        angle = rng.uniform(0, 2 * np.pi, count)
        radius = RADIUS * np.where(ends[:, k], 1.0, np.sqrt(rng.random(count)))
        points[:, k] = radius * np.cos(angle)
        points[:, k + 1] = radius * np.sin(angle)
    return points


@pytest.mark.parametrize(("m", "discs"), [(2, (0,)), (3, (1,)), (5, (0, 3)), (8, (0, 2, 4, 6))])
def test_a_linear_response_reaches_its_slope_times_the_radius(m, discs):
    linear = expansion(m, 1, discs)
    slopes = linear.coefficients[np.argsort(linear.index @ np.arange(1, m + 1))][1:]
    reach = np.abs(slopes)
    for k in discs:
        reach[k] = RADIUS * np.hypot(slopes[k], slopes[k + 1])
        reach[k + 1] = 0.0
    (bounds,) = extremes(linear, [0.0])
    exact = linear.coefficients[0] + np.array([[-1.0], [1.0]]) * reach.sum(axis=0)
    np.testing.assert_allclose(bounds.values, exact, rtol=1e-9)


@pytest.mark.parametrize(
    ("m", "order", "discs"), [(2, 2, (0,)), (2, 4, (0,)), (3, 3, (1,)), (5, 2, (0, 3))]
)
def test_bounds_of_random_polynomials_are_not_below_a_dense_scan(m, order, discs):
    polynomials = expansion(m, order, discs)
    (bounds,) = extremes(polynomials, [0.0])
    values = polynomials.evaluate(np.zeros((50_000, 0)), scan_points(m, discs))
    width = np.ptp(values, axis=0)
    assert np.all(bounds.values[0] <= values.min(axis=0) + 1e-9 * width)
    assert np.all(bounds.values[1] >= values.max(axis=0) - 1e-9 * width)
    at = bounds.places.reshape(-1, m)
    values_at_places = polynomials.evaluate(np.zeros((len(at), 0)), at).reshape(2, 20, 20)
    np.testing.assert_allclose(
        np.einsum("bss->bs", values_at_places), bounds.values, rtol=1e-10, atol=1e-12
    )
    for k in discs:
        assert np.hypot(at[:, k], at[:, k + 1]).max() <= RADIUS * (1 + 1e-12)


def minimum(polynomial, discs, start):
    """Return the minimum near a place, in the radius and the angle of each disc, by SciPy."""
    x = start.copy()
    bounds = [(-1.0, 1.0)] * len(start)
    for k in discs:
        x[k] = np.hypot(*start[k : k + 2])
        x[k + 1] = np.arctan2(start[k + 1], start[k])
        bounds[k : k + 2] = (0.0, RADIUS), (None, None)

    def value(x):
        eta = x.copy()
        for k in discs:
            eta[k : k + 2] = x[k] * np.cos(x[k + 1]), x[k] * np.sin(x[k + 1])
        return polynomial(eta[None])[0]

    return minimize(value, x, bounds=bounds).fun


@pytest.mark.parametrize("seed", [107, 114, 117])
def test_minima_beside_lower_points_of_the_scan_are_found(seed):
    """Of the first 40 seeds from 100 on, six had a bound that was too narrow by up to 0.4 %."""
    plays = {"crank": fb.Play(0.2), "length": fb.Interval(-1.0, 1.0)}
    plays |= {"load": fb.Normal(0.0, 0.3), "pin": fb.Play(0.1)}
    rng = np.random.default_rng(seed)
    crank, pin = rng.uniform(0.1, 1, 2)
    length = fb.Interval(*np.sort(rng.uniform(-1, 1, 2)))
    narrower = fb.expand(drawn_polynomial(seed), plays, fb.PCCI(2, 2)).narrowed(
        crank=fb.Play(0.2 * crank), pin=fb.Play(0.1 * pin), length=length
    )
    (expansion,) = narrower.expansions
    mean = narrower.bands()["mean"].values
    points = scan_points(5, (0, 3), 5000)
    of_points = expansion.moments(points)[0].reshape(len(points), -1)
    width = np.ptp(mean, axis=0)
    for k, sign in enumerate((1.0, -1.0)):
        for t in range(11):
            start = points[np.argmin(sign * of_points[:, t])]
            best = minimum(lambda eta: sign * expansion.moments(eta)[0].reshape(-1, 11)[:, t],  # noqa: B023
                         (0, 3), start)  # fmt: skip
            assert sign * mean[k, t] <= best + 1e-7 * width[t]


def test_an_optimum_inside_a_disc_is_found():
    # (x − 0.3)² + (y + 0.2)² with T_2 = 2 x² − 1
    index = np.array([[0, 0], [1, 0], [0, 1], [2, 0], [0, 2]])
    series = np.array([[1 + 0.3**2 + 0.2**2], [-0.6], [0.4], [0.5], [0.5]])
    (bounds,) = extremes(HybridExpansion((), index, series, (0,)), [0.0])
    np.testing.assert_allclose(bounds.values[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(bounds.places[0, 0], [0.3, -0.2], atol=1e-6)
    farthest = (RADIUS + np.hypot(0.3, 0.2)) ** 2
    np.testing.assert_allclose(bounds.values[1], farthest, rtol=1e-9)


def test_bounds_of_a_standard_deviation_are_over_the_disc():
    # ξ (2 + x + y): σ is largest at the rim, 2 + √2 √2
    index = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]])
    scattering = HybridExpansion((HERMITE,), index, np.array([[0.0], [2.0], [1.0], [1.0]]), (0,))
    _, upper = extremes(scattering, [0.0, 1.0])
    np.testing.assert_allclose(upper.values[1], 4.0, rtol=1e-9)


def test_squares_become_discs_and_keep_their_middle():
    square = np.array([[1.0, 1.0, 0.5], [1.0, 0.0, -1.0], [0.0, 0.0, 0.0], [-0.5, 0.2, 1.0]])
    points = in_discs(square, [0])
    np.testing.assert_allclose(np.hypot(*points[:, :2].T), RADIUS * np.array([1, 1, 0, 0.5]))
    np.testing.assert_array_equal(points[:, 2], square[:, 2])
    np.testing.assert_allclose(points[0, :2], [1.0, 1.0])


def test_points_that_judge_reach_out_of_the_square():
    for points in (generic_points(0, 64, 3, (), (1,)), nested_points(64, 3, (), discs=(1,))):
        eta = points[1]
        assert np.abs(eta[:, 0]).max() <= 1
        assert RADIUS * (1 + 1e-12) >= np.hypot(*eta[:, 1:].T).max() > 1.3
        assert np.abs(eta[:, 1:]).max() > 1.2
