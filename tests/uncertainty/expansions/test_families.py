"""Families of polynomials, and inputs that are not normal, against closed forms."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

import flexband as fb
from flexband.uncertainty.expansions.expansion import SIGMAS
from flexband.uncertainty.expansions.families import HERMITE, LEGENDRE, mean_squares, transform
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.methods.scanning import Scanning
from flexband.uncertainty.phases import terms
from flexband.uncertainty.phases.integration.rules import sobol_normal
from tests.uncertainty.phases.test_phases import surrogate

FAMILIES = pytest.mark.parametrize("family", [HERMITE, LEGENDRE], ids=lambda case: case.name)
STD = 12**-0.5
"""Of a number that is uniform on an interval of length one."""


def test_legendre_norms_and_moments():
    np.testing.assert_allclose(LEGENDRE.norms(5), 1 / (2 * np.arange(6) + 1), rtol=1e-15)
    x, w = LEGENDRE.gauss(4)
    moments = [w @ x**k for k in range(8)]
    np.testing.assert_allclose(moments, [1, 0, 1 / 3, 0, 1 / 5, 0, 1 / 7, 0], atol=1e-15)


@FAMILIES
def test_polynomials_are_orthogonal_with_their_norms(family):
    x, w = family.gauss(12)
    P = family.values(10, x)
    gram = (P * w[:, None]).T @ P
    scale = np.sqrt(np.outer(family.norms(10), family.norms(10)))
    np.testing.assert_allclose(gram / scale, np.eye(11), atol=1e-12)
    values = family.values(4, family.gauss(5)[0])
    np.testing.assert_allclose(transform(family, 4) @ values, np.eye(5), atol=1e-13)


@FAMILIES
def test_a_function_of_a_normal_variable_has_the_distribution(family):
    """Its moments, as expectations over the normal variable, are those of the Gauss rule."""
    z = np.linspace(-9, 9, 4001)
    density = np.exp(-z * z / 2)
    x, w = family.gauss(5)
    assert np.all(np.diff(family.of_normal(z[1000:3000])) > 0)
    for k in range(9):
        mean = density @ family.of_normal(z) ** k / density.sum()
        assert mean == pytest.approx(w @ x**k, abs=1e-8)


def test_mean_squares_of_products():
    index = np.array([[0, 0], [2, 0], [1, 3]])
    squares = mean_squares(index, [HERMITE, LEGENDRE])
    np.testing.assert_allclose(squares, [1, 2, 1 / 7])
    np.testing.assert_array_equal(mean_squares(np.zeros((2, 0), int), ()), [1, 1])


METHODS = [fb.PCCI(2, 2), fb.ImprovedPCCI(2, 2), fb.AdaptivePCCI(1e-6)]


@pytest.mark.parametrize("method", METHODS, ids=lambda case: case.name)
def test_a_linear_response_of_a_uniform_input(method):
    inputs = {"u": fb.Uniform(2.0, 5.0), "e": fb.Interval(-1.0, 1.0)}
    bands = fb.propagate(lambda u, e: u + e, inputs, method)
    np.testing.assert_allclose(bands["mean"], [2.5, 4.5], rtol=1e-14)
    bar = [2.5 - 3 * STD, 4.5 + 3 * STD]
    np.testing.assert_allclose(bands["error_bar"], bar, rtol=1e-14)


@pytest.mark.parametrize("method", METHODS, ids=lambda case: case.name)
def test_a_quadratic_response_of_uniform_normal_and_interval(method):
    """E = E u² + e E u a = 7/3 + 1.5 e, with a ~ N(1, 0.3)."""
    inputs = {"u": fb.Uniform(1.0, 2.0), "a": fb.Normal(1.0, 0.3), "e": fb.Interval(-1.0, 1.0)}
    bands = fb.propagate(lambda u, a, e: u**2 + e * u * a, inputs, method)
    mean = 7 / 3 + 1.5 * np.array([-1, 1])
    uu = 7 / 3
    uuu = 15 / 4
    uuuu = 31 / 5
    aa = 1.09
    var = uuuu + 2 * np.array([-1, 1]) * uuu + uu * aa - mean**2
    np.testing.assert_allclose(bands["mean"], mean, rtol=1e-12)
    np.testing.assert_allclose(bands["error_bar"][1], (mean + np.sqrt(var))[1], rtol=1e-12)


@given(st.integers(2, 50), st.integers(0, 100))
def test_latin_hypercubes_have_one_sample_in_each_stratum(samples, seed):
    batches = []

    def response(u):
        batches.append(u)
        return u

    fb.propagate(response, {"u": fb.Uniform(0.0, 1.0)}, fb.LHSScanning(samples, 2, seed))
    strata = np.sort(np.floor(batches[0] * samples))
    np.testing.assert_array_equal(strata, np.arange(samples))


def test_samples_of_a_users_method_are_transformed():
    class Three(Scanning):
        def normals(self, dimension):
            return np.array([[-40.0], [0.0], [40.0]])

    bands = fb.propagate(lambda u: u, {"u": fb.Uniform(1.0, 3.0)}, Three(3, 2))
    np.testing.assert_allclose(bands["error_bar"], [1.0, 3.0], rtol=1e-15)


def test_bounds_of_a_uniform_input_are_values(tmp_path):
    inputs = {"u": fb.Uniform(0.1, 0.4), "a": fb.Normal(1.0, 0.1)}
    surrogate = fb.expand(lambda u, a: a * u**2, inputs, fb.ImprovedPCCI(2, 2))
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    for expansion in (surrogate, fb.load_surrogate(tmp_path / "s.npz")):
        np.testing.assert_allclose(
            expansion.evaluate(u=[0.1, 0.4], a=1.0), [0.01, 0.16], rtol=1e-12
        )
        with pytest.raises(
            fb.errors.InputError, match=r"u: values must be from 0\.1 to 0\.4; got 0\.41"
        ):
            expansion.evaluate(u=0.41, a=1.0)


TIMES = np.linspace(0.0, 30.0, 601)


def ringing(u, e):
    """About 48 periods, the last of which differ by 5 between the ends of u."""
    phase = (10 + 0.5 * u[:, None] + 0.2 * e[:, None]) * TIMES
    dims = ("sample", "time")
    return xr.DataArray(np.cos(phase), dims=dims, coords={"time": TIMES})


def moments_of_waves(uniform, normal, interval, times, eta):
    """Return μ and σ of cos((10 + uniform·u + normal·ξ + interval·η) t), u on [−1, 1]."""

    def average(k):
        rotation = np.exp(1j * k * (10 + interval * eta) * times)
        spread = np.prod(np.sinc(k * np.multiply.outer(uniform, times) / np.pi), axis=0)
        return rotation * spread * np.exp(-((k * np.linalg.norm(normal) * times) ** 2) / 2)

    mean = average(1).real
    return mean, np.sqrt(np.maximum((1 + average(2).real) / 2 - mean**2, 0.0))


@pytest.mark.parametrize("method", [fb.methods.PhaseResolvedPCCI(1, 1), fb.AdaptivePCCI()])
@pytest.mark.parametrize("interval", [0.2, 0.0])
def test_a_frequency_that_is_uniform(method, interval):
    """E cos = cos ωt sin(at)/(at), over many periods, with an interval and alone."""
    inputs: dict = {"u": fb.Uniform(-1.0, 1.0), "e": fb.Interval(-1.0, 1.0)}
    response = ringing
    eta = np.linspace(-1, 1, 4001)[:, None]
    if not interval:
        del inputs["e"]
        eta = np.zeros((1, 1))

        def response(u):
            return ringing(u, 0 * u)

    bands = fb.propagate(response, inputs, method)
    mean, std = moments_of_waves([0.5], [0.0], interval, TIMES, eta)
    limit = 1e-5  # of the scan of η, and of the split of runs
    np.testing.assert_allclose(bands["mean"], [mean.min(0), mean.max(0)], atol=limit)
    bar = [(mean - std).min(0), (mean + std).max(0)]
    np.testing.assert_allclose(bands["error_bar"], bar, atol=limit)


def waves(uniform, normal, times, mixed=0.0):
    """Return the phase expansion of `moments_of_waves`, with mixed t between all pairs of ξ."""
    n = len(uniform) + len(normal)
    unit = np.eye(n + 1, dtype=int)
    pairs = [unit[a] + unit[b] for a in range(1, n + 1) for b in range(1, a)]
    index = np.array([0 * unit[0], *unit, *pairs])
    phase = np.outer([10.0, 0.3, *uniform, *normal, *[mixed] * len(pairs)], times)
    zero = np.zeros((len(index), 1, len(times)))
    envelope = zero.copy()
    envelope[0] = 1.0
    families = [LEGENDRE] * len(uniform) + [HERMITE] * len(normal)
    return surrogate(index, [phase], [envelope], zero, families)


@pytest.mark.parametrize(
    ("uniform", "normal", "kernel"),
    [
        ([0.5, 0.3], [], "by_points"),
        ([0.5], [0.1], "by_points"),
        ([1.0], [2.0], "without_turning"),
        ([0.9, 0.5, 0.7, 0.3], [0.1], "by_axes"),
    ],
)
def test_phases_of_several_inputs(uniform, normal, kernel, monkeypatch):
    """Exact products of sin(at)/(at) and e^{−s²t²/2}, by whatever quadrature."""
    calls = []
    original = getattr(terms, kernel)
    monkeypatch.setattr(terms, kernel, lambda *a: (calls.append(1), original(*a)))
    times = np.linspace(4.0, 12.0, 4)
    results = waves(uniform, normal, times).extremes(SIGMAS)
    mean, std = moments_of_waves(uniform, normal, 0.3, times, np.linspace(-1, 1, 20001)[:, None])
    for c, result in zip(SIGMAS, results, strict=True):
        values = mean + c * std
        np.testing.assert_allclose(result.values[0, 0], values.min(axis=0), atol=3e-6)
        np.testing.assert_allclose(result.values[1, 0], values.max(axis=0), atol=3e-6)
    assert calls


def test_phases_in_which_inputs_interact():
    """Against 2¹⁶ samples; the interaction moves phases by 2.2 rad, each input alone by 6 to 10."""
    families = [LEGENDRE] * 3 + [HERMITE]
    s = waves([0.9, 0.5, 0.7], [0.2], np.linspace(0.0, 12.0, 7), mixed=0.03)
    eta = np.array([[0.4]])
    xi = of_normals(sobol_normal(4, 2**16), families)
    F = s.evaluate(xi, np.tile(eta, (len(xi), 1)))
    mean, std = s.moments(eta)
    np.testing.assert_allclose(mean[0], F.mean(axis=0), atol=2e-3)
    np.testing.assert_allclose(std[0], F.std(axis=0), atol=2e-3)
