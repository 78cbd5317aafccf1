"""EOLE against published errors and Karhunen–Loève eigenvalues."""

from dataclasses import replace

import numpy as np
import pytest

import flexband as fb


def test_the_papers_field():
    field = fb.RandomField(69e9, 0.69e9, correlation_length=2.0, domain=(0.0, 0.45))
    assert field.dimension == 1  # chosen by the tolerance of 5 %
    assert field.largest_variance_error() == pytest.approx(0.0248, abs=2e-4)


@pytest.mark.parametrize(
    ("correlation", "nodes", "terms", "mean", "largest"),
    [
        (fb.exponential, 11, 2, 0.2397486, 0.3484593),
        (fb.exponential, 11, 4, 0.1286046, 0.1544195),
        (fb.squared_exponential, 21, 2, 0.08043861, 0.2687913),
        (fb.squared_exponential, 21, 4, 0.001699396, 0.007598037),
    ],
)
def test_variance_errors(correlation, nodes, terms, mean, largest):
    field = fb.RandomField(
        0.0, 1.0, 5.0, domain=(0.0, 10.0), terms=terms, nodes=nodes, correlation=correlation
    )
    x = np.linspace(0, 10, 20001)
    error = field.variance_error(x)
    assert error.mean() == pytest.approx(mean, rel=2e-4)
    assert error.max() == pytest.approx(largest, rel=1e-4)


def test_eigenvalues_approach_karhunen_loeve():
    field = fb.RandomField(
        0.0, 1.0, 1.0, domain=(0.0, 2.0), terms=4, nodes=2001, correlation=fb.exponential
    )
    found = field.expansion.eigenvalues * 2.0 / 2001
    np.testing.assert_allclose(
        found, [1.1493104327, 0.3909412374, 0.1570492108, 0.0795565770], rtol=2e-3
    )


def test_moments_of_the_samples():
    field = fb.RandomField(5.0, 2.0, 1.0, domain=(0.0, 2.0), terms=6)
    xi = np.random.default_rng(0).standard_normal((200_000, 6))
    x = np.array([0.0, 0.3, 1.7])
    samples = field.value(xi)(x)
    assert samples.shape == (200_000, 3)
    np.testing.assert_allclose(samples.mean(axis=0), 5.0, atol=0.02)
    covariance = 4 * np.exp(-((x[:, None] - x) ** 2))
    np.testing.assert_allclose(np.cov(samples.T), covariance, atol=0.04)


def test_positions_may_differ_between_samples():
    field = fb.RandomField(5.0, 2.0, 1.0, domain=(0.0, 2.0), terms=3)
    xi = np.random.default_rng(0).standard_normal((4, 3))
    x = np.linspace(0, 2, 4)[:, None] * np.array([0.2, 1.0])
    own = field.value(xi)(x)
    for k in range(4):
        np.testing.assert_allclose(own[k], field.value(xi)(x[k])[k], rtol=1e-14)


def test_a_field_without_a_domain_is_located():
    calls = []

    def response(field, scale):
        calls.append(len(scale))
        x = 0.5 + np.linspace(0.0, 1.0, 5) * scale[:, None]
        return np.mean(field(x), axis=1) * scale

    inputs = {"field": fb.RandomField(3.0, 0.1, 4.0, terms=1), "scale": fb.Interval(1, 2)}
    bands = fb.propagate(response, inputs, fb.ImprovedPCCI(1, 1))
    assert calls == [2, 4, 1]  # both ends of the interval, the design, one run again
    assert bands.attrs["runs"] == 7
    known = inputs | {"field": replace(inputs["field"], domain=(0.5, 2.5))}
    np.testing.assert_array_equal(
        bands["mean"], fb.propagate(response, known, fb.ImprovedPCCI(1, 1))["mean"]
    )
    np.testing.assert_allclose(bands["mean"], [3.0, 6.0])


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"correlation_length": 0.0}, "correlation_length must be positive; got 0"),
        ({"std": -1.0}, "std must be positive; got -1"),
        ({"mean": np.nan}, "mean"),
        ({"domain": (1.0, 0.0)}, "must run upwards"),
        ({"domain": (0.0, 1.0, 2.0)}, "domain .* must be 2 numbers"),
        ({"terms": 0}, "terms must be 1 or more; got 0"),
        ({"nodes": 1}, "nodes must be 2 or more"),
        ({"tolerance": 0.0}, "tolerance must be positive"),
    ],
)
def test_bad_numbers_are_refused(change, text):
    with pytest.raises(fb.InputError, match=text):
        fb.RandomField(**({"mean": 1.0, "std": 0.1, "correlation_length": 2.0} | change))


def test_a_field_is_not_extrapolated():
    field = fb.RandomField(1.0, 0.1, 0.05, domain=(0.0, 0.1), tolerance=0.2)
    samples = field.value(np.zeros((2, field.dimension)))
    assert samples(np.array([0.0, 0.1])).shape == (2, 2)
    with pytest.raises(fb.InputError, match=r"evaluated at 0.2, outside its domain \(0, 0.1\)"):
        samples(np.array([0.05, 0.2]))


def test_expansions_that_are_not_possible():
    rough = {"correlation": fb.exponential, "domain": (0.0, 10.0), "nodes": 5}
    with pytest.raises(fb.InputError, match=r"tolerance 0.01 .* not met by 5 terms on 5 nodes"):
        _ = fb.RandomField(0.0, 1.0, 1.0, tolerance=0.01, **rough).dimension
    with pytest.raises(fb.InputError, match="terms must be 5 or less here; got 9"):
        _ = fb.RandomField(0.0, 1.0, 1.0, terms=9, **rough).dimension
    with pytest.raises(fb.InputError, match="domain must be given"):
        _ = fb.RandomField(0.0, 1.0, 1.0).dimension


def test_a_field_that_would_fill_the_memory_is_refused():
    field = fb.RandomField(1.0, 0.1, correlation_length=1e-4, domain=(0.0, 1.0))
    with pytest.raises(fb.InputError, match="nodes must be 4000 or less; got 80001"):
        field.dimension  # noqa: B018


@pytest.mark.parametrize(
    "correlation",
    [lambda d: 1.0, lambda d: d[0], lambda d: None, lambda d: d / 0j, lambda d: d.nothing],
)
@pytest.mark.filterwarnings("ignore:.*encountered:RuntimeWarning")
def test_correlations_are_numbers_for_every_distance(correlation):
    field = fb.RandomField(1.0, 0.1, 1.0, domain=(0.0, 1.0), correlation=correlation)
    with pytest.raises(fb.InputError, match="RandomField correlation"):
        field.expansion  # noqa: B018


@pytest.mark.parametrize("domain", [None, (0.0, 1.0)])
@pytest.mark.parametrize("x", ["x", None, [np.nan, 1.0], [], 1j, [True, False], np.zeros((3, 2))])
def test_positions_are_numbers_for_all_runs(domain, x):
    inputs = {"e": fb.RandomField(1.0, 0.1, 1.0, domain=domain)}
    with pytest.raises(fb.InputError, match=r"positions|one position"):
        fb.propagate(lambda e: e(x), inputs, fb.PCCI(1, 1))
