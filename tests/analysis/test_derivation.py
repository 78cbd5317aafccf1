"""Bands of quantities made of outputs, against closed forms of oscillations."""

import re

import numpy as np
import pytest
import xarray as xr
from scipy.stats import norm

import flexband as fb

TIME = np.linspace(0.0, 2.0, 81)
OMEGA = 2 * np.pi


def with_labels(*series):
    return xr.DataArray(
        np.stack(series, axis=1),
        dims=("sample", "output", "time"),
        coords={
            "output": ["x", "y"], "unit": ("output", ["N", "N"]),
            "time": ("time", TIME, {"units": "s"}),
        },
    )  # fmt: skip


def decaying(amplitude, damping):
    size = amplitude[:, None] * np.exp(-damping[:, None] * TIME)
    return with_labels(size * np.sin(OMEGA * TIME), size * np.cos(OMEGA * TIME))


AMPLITUDE = fb.Normal(3.0, 0.2)
INPUTS = {"amplitude": AMPLITUDE, "damping": fb.Interval(0.5, 1.5)}


@pytest.fixture(scope="module")
def oscillation():
    return fb.expand(decaying, INPUTS, fb.PCCI(1, 6))


def height(damping):
    ratio = damping / OMEGA
    return np.exp(-ratio * np.arctan(1 / ratio)) / np.sqrt(1 + ratio**2)


ENDS = height(np.array([1.5, 0.5]))


def test_peak_of_a_decaying_oscillation(oscillation):
    derivation = fb.analysis.derived(
        oscillation, fb.analysis.Peak("x"), sigmas=2, probability=0.9, samples=1024
    )
    z = norm.ppf(0.95)
    np.testing.assert_allclose(derivation["mean"], 3 * ENDS, rtol=1e-3)
    np.testing.assert_allclose(derivation["error_bar"], [2.6 * ENDS[0], 3.4 * ENDS[1]], rtol=2e-3)
    exact = (3 + 0.2 * z * np.array([-1, 1])) * ENDS
    np.testing.assert_allclose(derivation["range"], exact, rtol=2e-3)
    for name in ("mean", "error_bar", "range"):
        assert derivation[f"{name}_at"].values.tolist() == [[1.5, 0.5]]
        assert derivation[name].attrs["units"] == "N"


def test_sampling_errors_hold(oscillation):
    exact = {"mean": 3 * ENDS, "error_bar": np.array([2.8, 3.2]) * ENDS}
    count_inside = 0
    for seed in range(10):
        derivation = fb.analysis.derived(
            oscillation, fb.analysis.Peak("x"), probability=0.8, samples=128, seed=seed
        )
        for name, values in exact.items():
            excess = np.abs(derivation[name].values - values) - 4e-4 * 3  # of the parabola
            count_inside += np.sum(excess <= derivation[f"{name}_sampling_error"].values)
    assert count_inside >= 36


def test_time_of_the_peak_and_trough(oscillation):
    derivation = fb.analysis.derived(
        oscillation, fb.analysis.PeakTime("x"), probability=0.9, samples=256
    )
    at = np.arctan(OMEGA / np.array([1.5, 0.5])) / OMEGA
    np.testing.assert_allclose(derivation["mean"], at, atol=2e-4)
    assert derivation["mean"].attrs["units"] == "s"
    lowest = fb.analysis.derived(
        oscillation, fb.analysis.Trough("x"), probability=0.9, samples=256
    )["mean"]
    exact = -3 * height(np.array([0.5, 1.5])) * np.exp(-np.array([0.5, 1.5]) / 2)
    np.testing.assert_allclose(lowest, exact, rtol=1e-3)


def sine(amplitude, offset):
    wave = amplitude[:, None] * np.sin(OMEGA * TIME[:-1]) + offset[:, None]
    return xr.DataArray(wave, dims=("sample", "time"), coords={"time": TIME[:-1]})


def test_root_mean_square_and_spectrum_of_a_sine():
    inputs = {"amplitude": AMPLITUDE, "offset": fb.Interval(-1.0, 0.5)}
    surrogate = fb.expand(sine, inputs, fb.PCCI(1, 1))
    derivation = fb.analysis.derived(surrogate, fb.analysis.RootMeanSquare())
    exact = surrogate.standard(np.linspace(-4, 4, 2001)[:, None], np.array([[1 / 3]] * 2001))
    # the square is integrated over two periods less one step
    z = np.linspace(-4, 4, 2001)
    lowest = np.average(np.sqrt(np.trapezoid(exact**2, TIME[:-1]) / TIME[-2]), weights=norm.pdf(z))
    np.testing.assert_allclose(derivation["mean"].values[0], lowest, rtol=2e-3)
    np.testing.assert_allclose(derivation["mean_at"].values[0, 0], 0.0, atol=0.03)
    lines = fb.analysis.derived(surrogate, fb.analysis.Spectrum(), probability=0.9, samples=512)
    at = int(np.argmin(np.abs(lines["frequency"].values - 1.0)))
    np.testing.assert_allclose(lines["mean"].values[:, at], 3.0, rtol=1e-3)
    np.testing.assert_allclose(lines["error_bar"].values[:, at], [2.8, 3.2], rtol=2e-3)
    np.testing.assert_allclose(lines["mean"].values[:, 0], [0.0, 1.0], atol=6e-3)
    others = np.delete(lines["mean"].values, [0, at], axis=1)
    np.testing.assert_allclose(others, 0.0, atol=1e-6)


def test_magnitude_of_a_vector(oscillation):
    derivation = fb.analysis.derived(
        oscillation, fb.analysis.Magnitude("x", "y"), probability=0.9, samples=256
    )
    exact = 3 * np.exp(-np.array([[1.5], [0.5]]) * TIME)
    np.testing.assert_allclose(derivation["mean"], exact, rtol=2e-3)
    assert derivation["mean"].dims == ("bound", "time")
    peak = fb.analysis.derived(
        oscillation, fb.analysis.Peak(fb.analysis.Magnitude("x", "y")),
        probability=0.9, samples=256,
    )  # fmt: skip
    np.testing.assert_allclose(peak["mean"], 3.0, rtol=1e-3)


def test_without_random_inputs_and_without_intervals():
    of_interval = fb.expand(lambda e: e, {"e": fb.Interval(-1.0, 2.0)}, fb.PCCI(1, 1))
    derivation = fb.analysis.derived(of_interval, np.abs, samples=8)
    for name in ("mean", "error_bar", "range"):
        np.testing.assert_allclose(derivation[name], [0.0, 2.0], atol=0.02)
        assert float(derivation[f"{name}_sampling_error"].max()) == 0
    of_normal = fb.expand(lambda a: a, {"a": fb.Normal(0.0, 1.0)}, fb.PCCI(1, 1))
    derivation = fb.analysis.derived(of_normal, np.abs, probability=0.9)
    np.testing.assert_allclose(derivation["mean"], np.sqrt(2 / np.pi), rtol=2e-3)
    np.testing.assert_allclose(derivation["range"], norm.ppf([0.525, 0.975]), atol=0.01)
    assert "mean_at" not in derivation


def test_expected_errors_are_carried_over():
    surrogate = fb.expand(decaying, INPUTS, fb.AdaptivePCCI(tolerance=0.1, phase_resolved=False))
    derivation = fb.analysis.derived(surrogate, fb.analysis.Peak("x"), probability=0.9, samples=256)
    expected_error = derivation["mean_expected_error"].values
    assert (expected_error > 0).all()
    largest = surrogate.diagnostics["error_bar_expected_error"].values.max()
    assert (expected_error <= 2 * largest).all()


@pytest.mark.parametrize(
    ("quantity", "message"),
    [
        (fb.analysis.Peak("z"), "output must be one of x, y; got 'z'"),
        (lambda F: F.isel(sample=0), "one number or array per sample"),
        (lambda F: F / 0, "finite numbers"),
        (None, "quantity must be a function"),
    ],
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_refused(oscillation, quantity, message):
    with pytest.raises(fb.errors.InputError, match=re.escape(message)):
        fb.analysis.derived(oscillation, quantity)


def test_refused_quantities():
    with pytest.raises(fb.errors.InputError, match="two different names or more"):
        fb.analysis.Magnitude("x")
    with pytest.raises(fb.errors.InputError, match="given by its name; got 3"):
        fb.analysis.Peak(3)
    uneven = xr.DataArray(np.ones((1, 3)), dims=("sample", "time"), coords={"time": [0.0, 1, 3]})
    with pytest.raises(fb.errors.InputError, match="equidistant times; got steps from 1 to 2"):
        fb.analysis.Spectrum()(uneven)
    with pytest.raises(fb.errors.InputError, match="at least three times"):
        fb.analysis.Peak()(uneven.isel(time=0))
