"""EOLE against published errors and Karhunen–Loève eigenvalues."""

import re
from dataclasses import replace

import numpy as np
import pytest

import flexband as fb
from flexband.report.text.band_tables import remarks


def test_the_papers_field():
    field = fb.RandomField(69e9, 0.69e9, correlation_length=2.0, domain=(0.0, 0.45))
    assert field.dimension == 1  # chosen by the tolerance of 5 %
    assert field.largest_variance_error() == pytest.approx(0.0248, abs=2e-4)


@pytest.mark.parametrize(
    ("correlation", "nodes", "terms", "mean", "largest"),
    [
        (fb.fields.exponential, 11, 2, 0.2397486, 0.3484593),
        (fb.fields.exponential, 11, 4, 0.1286046, 0.1544195),
        (fb.fields.squared_exponential, 21, 2, 0.08043861, 0.2687913),
        (fb.fields.squared_exponential, 21, 4, 0.001699396, 0.007598037),
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
        0.0, 1.0, 1.0, domain=(0.0, 2.0), terms=4, nodes=401, correlation=fb.fields.exponential
    )
    eigenvalues = field.expansion.eigenvalues * 2.0 / 401
    np.testing.assert_allclose(
        eigenvalues, [1.1493104327, 0.3909412374, 0.1570492108, 0.0795565770], rtol=8e-3
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
    values = field.value(xi)(x)
    for k in range(4):
        np.testing.assert_allclose(values[k], field.value(xi)(x[k])[k], rtol=1e-14)


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
    with_domain = inputs | {"field": replace(inputs["field"], domain=(0.5, 2.5))}
    np.testing.assert_array_equal(
        bands["mean"], fb.propagate(response, with_domain, fb.ImprovedPCCI(1, 1))["mean"]
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
    with pytest.raises(fb.errors.InputError, match=text):
        fb.RandomField(**({"mean": 1.0, "std": 0.1, "correlation_length": 2.0} | change))


def test_a_field_is_not_extrapolated():
    field = fb.RandomField(1.0, 0.1, 0.05, domain=(0.0, 0.1), tolerance=0.2)
    samples = field.value(np.zeros((2, field.dimension)))
    assert samples(np.array([0.0, 0.1])).shape == (2, 2)
    with pytest.raises(
        fb.errors.InputError, match=r"evaluated at 0.2, outside its domain \(0, 0.1\)"
    ):
        samples(np.array([0.05, 0.2]))


def test_expansions_that_are_not_possible():
    settings = {"correlation": fb.fields.exponential, "domain": (0.0, 10.0), "nodes": 5}
    with pytest.raises(
        fb.errors.InputError, match=r"tolerance 0.01 .* not met by 5 terms on 5 nodes"
    ):
        _ = fb.RandomField(0.0, 1.0, 1.0, tolerance=0.01, **settings).dimension
    with pytest.raises(fb.errors.InputError, match="terms must be 5 or less here; got 9"):
        _ = fb.RandomField(0.0, 1.0, 1.0, terms=9, **settings).dimension
    with pytest.raises(fb.errors.InputError, match="domain must be given"):
        _ = fb.RandomField(0.0, 1.0, 1.0).dimension


def test_a_field_that_would_fill_the_memory_is_refused():
    field = fb.RandomField(1.0, 0.1, correlation_length=1e-4, domain=(0.0, 1.0))
    with pytest.raises(fb.errors.InputError, match="nodes must be 4000 or less; got 80001"):
        field.dimension  # noqa: B018


@pytest.mark.parametrize(
    "correlation",
    [lambda d: 1.0, lambda d: d[0], lambda d: None, lambda d: d / 0j, lambda d: d.nothing],
)
@pytest.mark.filterwarnings("ignore:.*encountered:RuntimeWarning")
def test_correlations_are_numbers_for_every_distance(correlation):
    field = fb.RandomField(1.0, 0.1, 1.0, domain=(0.0, 1.0), correlation=correlation)
    with pytest.raises(fb.errors.InputError, match="RandomField correlation"):
        field.expansion  # noqa: B018


@pytest.mark.parametrize("domain", [None, (0.0, 1.0)])
@pytest.mark.parametrize("x", ["x", None, [np.nan, 1.0], [], 1j, [True, False], np.zeros((3, 2))])
def test_positions_are_numbers_for_all_runs(domain, x):
    inputs = {"e": fb.RandomField(1.0, 0.1, 1.0, domain=domain)}
    with pytest.raises(fb.errors.InputError, match=r"positions|one position"):
        fb.propagate(lambda e: e(x), inputs, fb.PCCI(1, 1))


EXPANSIONS = [fb.fields.eole, fb.fields.karhunen_loeve, fb.fields.orthogonal_series]
UNIT = {"mean": 0.0, "std": 1.0, "correlation_length": 1.0, "domain": (0.0, 2.0)}


@pytest.mark.parametrize("expansion", EXPANSIONS[1:])
def test_eigenvalues_are_those_of_the_exponential_kernel(expansion):
    """Published for a length of 2; the eigenfunctions are sines and cosines."""
    field = fb.RandomField(
        **UNIT, terms=4, nodes=24, correlation=fb.fields.exponential, discretization=expansion
    )
    exact = [1.1493104327, 0.3909412374, 0.1570492108, 0.0795565770]
    np.testing.assert_allclose(field.expansion.eigenvalues, exact, rtol=2e-8)
    x = np.linspace(-1, 1, 41)
    w = np.sqrt(2 / np.array(exact) - 1)  # λ = 2/(1 + w²)
    sign = np.array([1, -1, 1, -1])
    shapes = np.where(sign[:, None] > 0, np.cos(np.outer(w, x)), np.sin(np.outer(w, x)))
    shapes *= np.sqrt(exact / (1 + sign * np.sin(2 * w) / (2 * w)))[:, None]
    basis = field.expansion.basis(x + 1)
    basis *= np.sign(np.sum(basis * shapes, axis=1))[:, None]
    np.testing.assert_allclose(basis, shapes, atol=1e-6)
    np.testing.assert_allclose(
        field.variance_error(x + 1), 1 - np.sum(shapes**2, axis=0), atol=1e-6
    )


def test_orthogonal_series_approach_karhunen_loeve():
    settings = UNIT | {"domain": (0.0, 6.0), "terms": 6, "correlation": fb.fields.Matern(1.5)}
    exact = fb.RandomField(**settings, nodes=96, discretization=fb.fields.karhunen_loeve).expansion
    errors = []
    for nodes in (6, 9, 12, 18):
        series = fb.RandomField(**settings, nodes=nodes, discretization=fb.fields.orthogonal_series)
        errors.append(np.abs(series.expansion.eigenvalues - exact.eigenvalues).max())
    assert np.all(np.array(errors[1:]) < 0.3 * np.array(errors[:-1]))
    assert errors[-1] < 1e-5


@pytest.mark.parametrize(
    "correlation", [fb.fields.squared_exponential, fb.fields.triangular, fb.fields.Matern(0.8)]
)
@pytest.mark.parametrize("expansion", EXPANSIONS)
def test_the_variance_error_is_that_of_samples(expansion, correlation):
    """E[(u − û)²] from the covariances of u at positions and of û, for few polynomials as well."""
    field = fb.RandomField(
        **UNIT, terms=3, nodes=5, correlation=correlation, discretization=expansion
    )
    x, weights = np.polynomial.legendre.leggauss(200)
    x = 1 + x
    series = field.expansion
    if expansion is fb.fields.eole:  # ξ_i = φ_iᵀ u(nodes)/√χ_i
        factors = series.eigenvectors / np.sqrt(series.eigenvalues)
        covariance = correlation(x[:, None] - series.nodes) @ factors
    else:  # ξ_i = ∫ f_i u/√λ_i
        functions = (series.basis(x) / series.eigenvalues[:, None]) * weights
        covariance = correlation(x[:, None] - x) @ functions.T
    basis = series.basis(x)
    expected = 1 - 2 * np.sum(covariance.T * basis, axis=0) + np.sum(basis**2, axis=0)
    np.testing.assert_allclose(
        field.variance_error(x),
        expected,
        atol=1e-3 if correlation is fb.fields.triangular else 1e-4,
    )
    assert np.all(field.variance_error(x) > -1e-12)


def test_matern_correlations():
    d = np.array([0.0, 1e-9, 0.02, 0.3, 1.0, -1.0, 4.0])
    np.testing.assert_allclose(fb.fields.Matern(0.5)(d), fb.fields.exponential(d), rtol=1e-12)
    s = np.sqrt(3) * np.abs(d)
    np.testing.assert_allclose(fb.fields.Matern(1.5)(d), (1 + s) * np.exp(-s), rtol=1e-12)
    s = np.sqrt(5) * np.abs(d)
    np.testing.assert_allclose(
        fb.fields.Matern(2.5)(d), (1 + s + s**2 / 3) * np.exp(-s), rtol=1e-12
    )
    limit = fb.fields.squared_exponential(d / np.sqrt(2))
    gaps = [np.abs(fb.fields.Matern(nu)(d) - limit).max() for nu in (25, 50, 100)]
    np.testing.assert_allclose(gaps[:-1], 2 * np.array(gaps[1:]), rtol=0.05)  # O(1/ν)
    for nu in (1.0, 2.0, 37.3):  # the series at small distances meets the function
        distances = np.geomspace(1e-12, 0.5, 400)
        assert np.all(np.diff(fb.fields.Matern(nu)(distances)) <= 1e-12)
        assert fb.fields.Matern(nu)(np.zeros(1))[0] == 1.0


@pytest.mark.parametrize("expansion", EXPANSIONS)
def test_lognormal_fields(expansion):
    """Exact moments; the correlation is that of the logarithm; the mean needs no terms."""
    profile = {"mean": lambda x: 2.0 + x, "std": lambda x: 1.0 + 0.5 * x**2}
    settings = UNIT | profile | {"distribution": "lognormal", "discretization": expansion}
    field = fb.RandomField(**settings, tolerance=1e-6)
    x = np.array([0.1, 0.9, 2.0])
    xi, w = np.polynomial.hermite_e.hermegauss(60)
    square = np.log1p(((1 + 0.5 * x**2) / (2 + x)) ** 2)
    basis = field.expansion.basis(x)
    covariance = np.expm1(np.sqrt(np.outer(square, square)) * (basis.T @ basis))
    expected = np.expm1(np.sqrt(np.outer(square, square)) * np.exp(-((x[:, None] - x) ** 2)))
    np.testing.assert_allclose(covariance, expected, rtol=2e-5)
    single = fb.RandomField(**settings, terms=1)
    values = single.value(xi[:, None])(x)
    np.testing.assert_allclose(w @ values / w.sum(), 2 + x, rtol=1e-12)
    second = w @ (values - 2 - x) ** 2 / w.sum()
    if expansion is fb.fields.eole:  # the best estimate: what it has, and what it lacks, add up
        std = 1 + 0.5 * x**2
        np.testing.assert_allclose(second + single.variance_error(x) * std**2, std**2, rtol=1e-9)


def test_profiles_are_functions_of_position():
    field = fb.RandomField(lambda x: 1 + x, lambda x: 0.1 + x**2, 1.0, domain=(0.0, 2.0), terms=4)
    x = np.array([[0.0, 0.5], [1.0, 2.0]])
    xi = np.random.default_rng(0).standard_normal((2, 4))
    u = replace(field, mean=0.0, std=1.0).value(xi)(x)
    np.testing.assert_allclose(field.value(xi)(x), 1 + x + (0.1 + x**2) * u, rtol=1e-14)
    bands = fb.propagate(
        lambda f: f(np.linspace(0, 2, 3)), {"f": replace(field, domain=None)}, fb.PCCI(1, 0)
    )
    np.testing.assert_allclose(bands["mean"], [[1, 2, 3]] * 2, rtol=1e-12)


def test_a_mean_of_which_only_limits_are_known():
    field = fb.RandomField(fb.Interval(4.0, 6.0), 0.5, 1.0, domain=(0.0, 1.0), terms=2)
    x = np.array([0.2, 0.7])
    bands = fb.propagate(lambda f: f(x), {"f": field}, fb.ImprovedPCCI(1, 1))
    std = 0.5 * np.sqrt(1 - field.variance_error(x))
    np.testing.assert_allclose(bands["mean"], [[4, 4], [6, 6]], rtol=1e-12)
    np.testing.assert_allclose(bands["error_bar"], [4 - std, 6 + std], rtol=1e-12)
    assert list(bands["input"].values) == ["f.mean"]


def test_realizations_are_seeded():
    field = fb.RandomField(**UNIT, tolerance=1e-3)
    x = np.linspace(0, 2, 5)
    first, second, third = (field.realizations(x, 7, seed=k) for k in (1, 1, 2))
    np.testing.assert_array_equal(first, second)
    assert first.shape == (7, 5)
    assert not np.any(first == third)


def test_rough_fields_get_more_nodes():
    field = fb.RandomField(**(UNIT | {"domain": (0.0, 10.0)}), correlation=fb.fields.exponential)
    assert field.largest_variance_error() <= 0.0501
    assert field.dimension < len(field.expansion.nodes) / 2


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"std": lambda x: x - 0.5}, r"RandomField std must be positive; got -0.5"),
        ({"std": lambda x: np.ones(3)}, r"RandomField std must return one value per position"),
        ({"mean": lambda x: "a"}, "RandomField mean"),
        ({"mean": lambda x: 1 / 0}, "RandomField mean raised an error"),
        ({"mean": lambda x: x - 1, "distribution": "lognormal"}, "mean of the lognormal"),
        ({"mean": -1.0, "distribution": "lognormal"}, "mean of the lognormal .* got -1"),
        ({"mean": fb.Interval(-1, 1), "distribution": "lognormal"}, "mean of the lognormal"),
        ({"std": fb.Interval(0, 1)}, "std must be positive; got 0"),
        ({"distribution": "weibull"}, "must be 'normal' or 'lognormal'; got 'weibull'"),
        ({"correlation": lambda d: np.where(abs(d) < 1, 1.0, 0.0)}, "positive semidefinite"),
        ({"correlation": lambda d: np.exp(-d - d * d)}, "the same at distances d and -d"),
        ({"correlation": lambda d: 0.5 * np.exp(-d * d)}, "must be 1 at distance 0; got 0.5"),
        ({"discretization": "eole"}, "discretization must be a function; got 'eole'"),
        ({"discretization": lambda *a: None}, "discretization returns must be a Series"),
        ({"terms": 9, "nodes": 8}, "terms must be 8 or less here; got 9"),
    ],
)
@pytest.mark.parametrize("expansion", EXPANSIONS)
def test_impossible_fields_are_refused(change, text, expansion):
    with pytest.raises(fb.errors.InputError, match=text):
        fb.RandomField(**(UNIT | {"mean": 5.0, "discretization": expansion} | change)).dimension  # noqa: B018


@pytest.mark.parametrize("nu", [0.0, -1.0, 101.0, np.nan, "a"])
def test_impossible_smoothness_is_refused(nu):
    with pytest.raises(fb.errors.InputError, match="Matern nu"):
        fb.fields.Matern(nu)


def test_methods_for_many_terms_are_named():
    inputs = {"road": fb.RandomField(0.0, 1.0, 0.3, domain=(0.0, 10.0))}

    def response(road):
        return road(np.linspace(0, 10, 3))

    text = r"road has \d+; LHSScanning, SobolScanning and MonteCarlo take any number"
    for method in (fb.PCCI(1, 0), fb.methods.RegressionPCCI(3), fb.AdaptivePCCI(max_runs=40)):
        with pytest.raises(fb.errors.InputError, match=text):
            fb.propagate(response, inputs, method)
    with pytest.warns(
        fb.errors.FlexbandWarning, match="bands have no width although the runs differ"
    ):
        bands = fb.propagate(response, inputs, fb.AdaptivePCCI(max_runs=41))
    assert any(re.search(f"NOT met.*{text}", line) for line in remarks(bands))
    bands = fb.propagate(response, inputs, fb.LHSScanning(200, 2))
    np.testing.assert_allclose(bands["error_bar"], [[-1] * 3, [1] * 3], atol=0.2)


def test_extrapolation_of_a_field_of_one_term_is_warned_of():
    inputs = {"f": fb.RandomField(1.0, 0.1, 9.0, domain=(0.0, 1.0))}
    surrogate = fb.expand(lambda f: f(np.array([0.5]))[:, 0], inputs, fb.PCCI(1, 0))
    with pytest.warns(fb.errors.FlexbandWarning, match=r"f \(ξ = 7\) is beyond its runs"):
        surrogate.evaluate(f=np.array([[7.0]]))


@pytest.mark.parametrize("expansion", [fb.fields.karhunen_loeve, fb.fields.orthogonal_series])
@pytest.mark.parametrize("length", [1e-300, 1e-310, 1e-3])
def test_a_length_that_polynomials_cannot_follow_is_refused(expansion, length):
    with pytest.raises(fb.errors.InputError, match="too short for"):
        expansion(fb.fields.exponential, length, (0.0, 1.0), 12)


def test_bands_name_functions_of_fields_without_their_addresses():
    def mean(x):
        return 1.0 + x

    field = fb.RandomField(mean, 0.1, correlation_length=2.0, domain=(0.0, 1.0), terms=1)
    bands = fb.propagate(lambda E: E(np.zeros(1))[:, 0], {"E": field}, fb.PCCI(1, 0))
    text = bands.attrs["inputs"]
    assert "discretization=eole" in text
    assert "mean," in text
    assert "0x" not in text
