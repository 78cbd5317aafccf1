"""Error bars of μ ± kσ: exact bounds, labels, and the errors expected of them."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from benchmarks.accuracy.references import normal_rule

INPUTS = {"e": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 1.0)}


def moving(e, x):
    """μ = e and σ = 1 + e/2: the lowest μ − kσ changes its end of the interval at k = 2."""
    return (e + (1 + e / 2) * x)[:, None] * np.ones(2)


@pytest.mark.parametrize(
    "method", [fb.AdaptivePCCI(), fb.PCCI(1, 1), fb.methods.PhaseResolvedPCCI(1, 1)]
)
@pytest.mark.parametrize(("sigmas", "lower"), [(0.5, -1.25), (1, -1.5), (3, -3.5), (10, -14.0)])
def test_bounds_are_exact(method, sigmas, lower):
    bands = fb.propagate(moving, INPUTS, method, sigmas=sigmas)
    np.testing.assert_allclose(bands["mean"][:, 0], [-1, 1], atol=1e-9)
    np.testing.assert_allclose(bands["error_bar"][:, 0], [lower, 1 + 1.5 * sigmas], atol=1e-9)
    assert bands.attrs["sigmas"] == sigmas
    surrogate = fb.expand(moving, INPUTS, method)
    xr.testing.assert_identical(surrogate.bands(sigmas), bands)


def test_samples_are_scanned_too():
    one_sigma, three_sigma = (
        fb.propagate(moving, INPUTS, fb.LHSScanning(50, 3), sigmas=k)["error_bar"] for k in (1, 3)
    )
    mean = fb.propagate(moving, INPUTS, fb.LHSScanning(50, 3))["mean"]
    np.testing.assert_allclose((three_sigma - mean)[1], 3 * (one_sigma - mean)[1])


def test_expected_errors_grow_and_stay_honest():
    """Of tanh(2x) + e, against quadrature: errors grow with k, and so does what is expected."""

    def response(e, x):
        return np.tanh(2 * x)[:, None] + e[:, None] * np.ones(3)

    surrogate = fb.expand(response, INPUTS, fb.AdaptivePCCI(0.01, 24))
    x, weights = normal_rule(801)
    std = np.sqrt(weights @ np.tanh(2 * x) ** 2)
    for k in (1, 2, 3, 6):
        bands = surrogate.bands(sigmas=k)
        true = abs(float(bands["error_bar"][1, 0]) - 1 - k * std)
        estimate = float(bands["error_bar_expected_error"][0])
        assert estimate / 5 < true < 5 * estimate
        width = float(np.diff(bands["error_bar"], axis=0).mean())
        assert bands.attrs["expected_error"] == pytest.approx(estimate / width, rel=0.01)
    one_sigma = surrogate.bands()["error_bar_expected_error"]
    np.testing.assert_allclose(bands["error_bar_expected_error"], one_sigma * np.sqrt(37 / 2))


@pytest.mark.parametrize("sigmas", [0, -1.0, np.nan, "three", None])
def test_sigmas_must_be_positive(sigmas):
    with pytest.raises(fb.errors.InputError, match="sigmas must be"):
        fb.propagate(moving, INPUTS, fb.PCCI(1, 1), sigmas=sigmas)
    with pytest.raises(fb.errors.InputError, match="sigmas must be"):
        fb.Study(moving, INPUTS, fb.PCCI(), sigmas=sigmas)
