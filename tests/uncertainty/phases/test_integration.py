"""Moments of phases that bend: against exact integrals, and the second rule that judges them."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.uncertainty.phases import terms
from flexband.uncertainty.phases.integration.rules import resolving_rule

TIMES = np.linspace(0.0, 20.0, 241)
INPUTS = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(0.999, 1.001)}


def bent(x, e):
    """Return cos(2π e (1 − x²/50) t)."""
    frequency = np.asarray(e)[:, None] * (1 - 0.02 * np.asarray(x)[:, None] ** 2)
    values = np.cos(2 * np.pi * frequency * TIMES)
    return xr.DataArray(values, {"time": TIMES}, ("sample", "time"))


def exact_moments(e):
    """Return μ and σ: E e^{iax²} = (1 − 2ia)^{−1/2} of a normal x."""
    first, second = (
        np.exp(2j * np.pi * k * e * TIMES) / np.sqrt(1 + 2j * (2 * np.pi * k * 0.02 * e * TIMES))
        for k in (1, 2)
    )
    mean = first.real
    return mean, np.sqrt(0.5 + 0.5 * second.real - mean**2)


@pytest.fixture(scope="module")
def surrogate():
    return fb.expand(bent, INPUTS, fb.AdaptivePCCI(0.01))


def test_moments_of_a_frequency_that_is_quadratic_in_a_random_input(surrogate):
    moments = surrogate.moments(e=1.0)
    exact = exact_moments(1.0)
    np.testing.assert_allclose(moments["mean"].values.ravel(), exact[0], atol=1e-4)
    np.testing.assert_allclose(moments["std"].values.ravel() ** 2, exact[1] ** 2, atol=1e-4)
    assert surrogate.diagnostics.attrs["integration_error"] < 1e-4


def test_the_second_rule_finds_moments_of_a_rule_that_is_too_coarse(surrogate, monkeypatch):
    right = surrogate.bands()
    monkeypatch.setattr(
        terms, "resolving_rule", lambda change: resolving_rule(change, fineness=0.4)
    )
    coarse = fb.expand(bent, INPUTS, fb.AdaptivePCCI(0.01))
    bands = coarse.bands()
    width = float((right["error_bar"][1] - right["error_bar"][0]).mean())
    true = np.abs(bands["error_bar"] - right["error_bar"]).mean("bound").values.ravel()
    claim = bands["error_bar_integration_error"].values.ravel()
    assert true.mean() > 0.01 * width
    assert true.mean() / 2 < claim.mean() < 5 * true.mean()
    assert (true <= 5 * np.maximum(claim, 1e-3 * width)).mean() > 0.98
    assert bands.attrs["integration_error"] <= bands.attrs["expansion_error"]
    narrower = coarse.narrowed(e=fb.Interval(0.9995, 1.0005)).bands()
    of_integration = narrower["error_bar_integration_error"]
    assert (narrower["error_bar_expansion_error"] >= of_integration).all()


@pytest.mark.parametrize("cv", [0.1, 0.5])
def test_moments_of_a_frequency_with_a_lognormal_factor(cv):
    """E cos(2π f t) of a log-normal f, against a dense rule for its logarithm."""
    inputs = {"f": fb.LogNormal(1.0, cv=cv), "e": fb.Interval(0.999, 1.001)}
    time = TIMES[: 120 if cv > 0.2 else 241]

    def wave(f, e):
        f = np.asarray(f)[:, None]
        e = np.asarray(e)[:, None]
        values = np.cos(2 * np.pi * e * (1 + 0.05 * np.tanh(f - 1)) * time)
        return xr.DataArray(values, {"time": time}, ("sample", "time"))

    expansion = fb.expand(wave, inputs, fb.AdaptivePCCI(0.01))
    z = np.linspace(-8, 8, 4001)
    s = np.sqrt(np.log1p(cv**2))
    weights = np.exp(-z * z / 2) / np.exp(-z * z / 2).sum()
    values = wave(np.exp(s * z - s * s / 2), np.ones_like(z)).values
    mean = weights @ values
    moments = expansion.moments(e=1.0)
    bands = expansion.bands()
    error = np.abs(moments["mean"].values.ravel() - mean).mean()
    width = float((bands["error_bar"][1] - bands["error_bar"][0]).mean())
    assert error < 2 * bands.attrs["expected_error"] * width
    assert bands.attrs["integration_error"] < 1e-3
