"""Sparse regression: its terms, its errors, its points, and the adaptive method with it."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.uncertainty.expansions.families import HERMITE, LEGENDRE
from flexband.uncertainty.expansions.regression.sparse_fit import (
    candidates,
    least_squares,
    normalized_values,
    principal,
    sparse_fit,
)
from flexband.uncertainty.inputs.sampling import nested_points


def normals(count, **others):
    """Return so many standard normal inputs, and others."""
    return {f"a{k}": fb.Normal(0.0, 1.0) for k in range(count)} | others


def stacked(values, count):
    return np.stack([values[f"a{k}"] for k in range(count)], axis=1)


def test_left_out_errors_are_those_of_refits():
    rng = np.random.default_rng(1)
    A = rng.standard_normal((12, 5))
    series = rng.standard_normal((12, 3))
    coefficients, left_out = least_squares(A, series)
    np.testing.assert_allclose(coefficients, np.linalg.lstsq(A, series)[0], atol=1e-12)
    for run in range(12):
        mask = np.arange(12) != run
        coefficients_without = np.linalg.lstsq(A[mask], series[mask])[0]
        np.testing.assert_allclose(
            left_out[run], series[run] - A[run] @ coefficients_without, atol=1e-12
        )


def test_the_correction_is_that_of_the_terms_taken():
    index = candidates(6)
    families = [HERMITE, LEGENDRE] * 2
    xi, eta = nested_points(40, 2, families)
    values = normalized_values(index, xi, eta, families)
    fit = sparse_fit(values, index, np.exp(0.3 * xi[:, :2] + 0.2 * eta[:, :2]))
    A = values[:, fit.which]
    P = len(fit.which)
    assert P > 4
    T = 40 / (40 - P) * (1 + np.trace(np.linalg.inv(A.T @ A)))
    assert fit.correction == pytest.approx(np.sqrt(T), rel=1e-9)


def test_terms_have_unit_mean_square():
    rng = np.random.default_rng(2)
    index = candidates(3)
    assert len(np.unique(index, axis=0)) == len(index) == 20  # all up to the total order 3
    eta = np.cos(np.pi * rng.random((400_000, 1)))
    xi = np.stack([rng.standard_normal(400_000), rng.uniform(-1, 1, 400_000)], axis=1)
    values = normalized_values(index, xi, eta, [HERMITE, LEGENDRE])
    np.testing.assert_allclose(np.mean(values**2, axis=0), 1.0, rtol=0.1)


def test_principal_series_have_the_products_of_all():
    series = np.random.default_rng(3).standard_normal((9, 2)) @ np.ones((2, 500))
    y = principal(series)
    assert y.shape[1] <= 2
    np.testing.assert_allclose(y @ y.T, series @ series.T, atol=1e-9)


def test_noise_is_not_fitted():
    """Among 900 candidates some always fit 48 random numbers; none is worth its choice."""
    index = candidates(40)
    xi, eta = nested_points(48, 0, [HERMITE] * 40)
    values = normalized_values(index, xi, eta, [HERMITE] * 40)
    for seed in range(5):
        noise = np.random.default_rng(seed).standard_normal((48, 1))
        np.testing.assert_array_equal(sparse_fit(values, index, noise).which, [0])


def test_points_stay_where_they_are_and_reach_the_ends():
    families = [HERMITE] * 30
    xi, eta = nested_points(100, 5, families)
    for count in (8, 16, 40):
        for longer, shorter in zip((xi, eta), nested_points(count, 5, families), strict=True):
            np.testing.assert_array_equal(longer[:count], shorter)
    assert 0.2 < np.mean(np.abs(eta) == 1) < 0.4
    assert abs(xi.mean()) < 0.02
    assert xi.std() == pytest.approx(1, abs=0.02)


def test_a_sparse_polynomial_in_forty_variables():
    """Six of 941 terms, from 64 runs: bounds and moments to round-off."""

    def response(x, y, **a):
        a = stacked(a, 38)
        return 3 + x * (2 + y) + a[:, 3] * a[:, 7] + 0.5 * a[:, 0] + 0.4 * (a[:, 20] ** 2 - 1)

    inputs = normals(38, x=fb.Interval(-1.0, 1.0), y=fb.Interval(-1.0, 1.0))
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI(1e-8, max_runs=64))
    assert len(candidates(40)) == 901
    assert bands.attrs["runs"] <= 64
    assert bands.attrs["expected_error"] < 1e-8
    assert bool(bands["trusted"])
    std = np.sqrt(1 + 0.25 + 2 * 0.16)
    np.testing.assert_allclose(bands["mean"], [0.0, 6.0], atol=1e-9)
    np.testing.assert_allclose(bands["error_bar"], [-std, 6 + std], atol=1e-9)
    orders = dict(zip(bands["variable"].values, bands["orders"].values, strict=True))
    assert {k for k, order in orders.items() if order} == {"x", "y", "a0", "a3", "a7", "a20"}


def test_moments_of_a_quadratic_form_of_a_field():
    """The mean square of a field of 40 terms, whose moments are known, within 1 %."""
    field = fb.RandomField(1.0, 0.2, correlation_length=0.08, domain=(0.0, 1.0), terms=40)
    x = np.linspace(0.0, 1.0, 161)

    def response(stiffness, load):
        return load * np.mean(stiffness(x) ** 2, axis=1)

    inputs = {"stiffness": field, "load": fb.Interval(1.0, 2.0)}
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI(0.01, max_runs=120))
    basis = 0.2 * field.expansion.basis(x)
    square = basis @ basis.T / len(x)
    linear = 2 * basis.mean(axis=1)
    mean = 1 + np.trace(square)
    std = np.sqrt(linear @ linear + 2 * np.sum(square**2))
    np.testing.assert_allclose(bands["mean"], [mean, 2 * mean], rtol=0.01)
    np.testing.assert_allclose(bands["error_bar"], [mean - std, 2 * (mean + std)], rtol=0.01)
    assert bool(bands["trusted"])


TIMES = np.arange(250) * 0.04


def ringing(x, **a):
    """An oscillator whose frequency depends on all terms of a field, exactly linearly."""
    along = stacked(a, 30) @ (0.8 ** np.arange(30))
    w = 2 * np.pi * (1 + 0.01 * along + 0.03 * x)
    values = np.cos(w[:, None] * TIMES)
    return xr.DataArray(values, dims=("sample", "time"), coords={"time": TIMES})


def test_an_oscillator_whose_frequency_is_a_field():
    """E cos(ω t) = cos(ω̄ t) e^{−s²t²/2} and its variance in closed form, over a fine scan of η."""
    bands = fb.propagate(ringing, normals(30, x=fb.Interval(-1.0, 1.0)), fb.AdaptivePCCI(0.01))
    s = 2 * np.pi * 0.01 * np.linalg.norm(0.8 ** np.arange(30)) * TIMES
    angle = 2 * np.pi * (1 + 0.03 * np.linspace(-1, 1, 401)[:, None]) * TIMES
    mean = np.cos(angle) * np.exp(-(s**2) / 2)
    std = np.sqrt(0.5 + 0.5 * np.cos(2 * angle) * np.exp(-2 * s**2) - mean**2)
    width = np.mean((mean + std).max(0) - (mean - std).min(0))
    for name, low, high in (("mean", mean, mean), ("error_bar", mean - std, mean + std)):
        truth = np.stack([low.min(0), high.max(0)])
        assert np.abs(bands[name] - truth).values.mean() < 0.01 * width
    assert bands.attrs["runs_fitted"] <= 40  # interpolation starts with 62
    assert bands.attrs["expected_error"] < 0.01
    assert bool(bands["trusted"])


def test_runs_are_the_same_every_time():
    inputs = normals(30, x=fb.Interval(-1.0, 1.0))
    first, second = (fb.propagate(ringing, inputs, fb.AdaptivePCCI(max_runs=18)) for _ in range(2))
    xr.testing.assert_identical(first, second)


@pytest.mark.filterwarnings("ignore:the response. the bands have no width")
@pytest.mark.parametrize("runs", [24, 48, 96])
def test_a_kink_in_many_variables_is_not_trusted(runs):
    def response(x, **a):
        return 5 + np.abs(stacked(a, 40).sum(axis=1) / np.sqrt(40) + 0.3 * x)

    inputs = normals(40, x=fb.Interval(-1.0, 1.0))
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI(0.01, max_runs=runs))
    assert bands.attrs["runs"] == runs + 1
    assert not bool(bands["trusted"])
    assert "of its variation in check runs is missed" in bands.attrs["not_trusted"]
    assert bands.attrs["expected_error"] > 0.1
    assert float(bands["error_bar_expected_error"].max()) > 0.1


def test_outputs_that_do_not_vary_do_no_harm():
    def response(**a):
        a = stacked(a, 40)
        return np.stack([a[:, 0] + a[:, 1], np.full(len(a), 7.0), np.zeros(len(a))], axis=1)

    bands = fb.propagate(response, normals(40), fb.AdaptivePCCI(1e-6, max_runs=64))
    assert bands.attrs["expected_error"] < 1e-6
    np.testing.assert_allclose(bands["error_bar"][1], [2**0.5, 7.0, 0.0], atol=1e-9)


def test_fewer_runs_than_variables_are_enough_but_not_fewer_than_eighteen():
    def response(**a):
        return 1 + stacked(a, 60)[:, 4]

    bands = fb.propagate(response, normals(60), fb.AdaptivePCCI(1e-6, max_runs=64))
    np.testing.assert_allclose(bands["error_bar"], [0.0, 2.0], atol=1e-9)
    assert bands.attrs["runs"] <= 40 + 1
    with pytest.raises(
        fb.errors.InputError, match="max_runs must be 18 or more for 60 variables; got 17"
    ):
        fb.propagate(response, normals(60), fb.AdaptivePCCI(1e-6, max_runs=17))
