"""Fields of every kind and a choice in one response, in every method, against exact bands."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import flexband as fb

X = np.linspace(0.0, 1.0, 9)
TIMES = np.linspace(0.0, 2.0, 17)
WEIGHT = np.cos(3 * X) / 9


def limit(x):
    return 1.1 + 0.1 * x


def trend(t):
    return 2 + t


INPUTS = {
    "modulus": fb.RandomField(3.0, 0.3, 1.0, (0.0, 1.0), terms=2),
    "thickness": fb.IntervalField(0.9, limit, 1.0),
    "wind": fb.RandomField(trend, 0.2, 2.0, terms=2, discretization=fb.fields.karhunen_loeve),
    "road": fb.IntervalField(-0.2, 0.1, 2.0, smooth=True),
    "supplier": fb.Choice(1.0, 3.0),
}


def response(modulus, thickness, wind, road, supplier):
    """A linear function of all fields, of position and of time."""
    constant = (modulus(X) + thickness(X)) @ WEIGHT
    values = supplier[:, None] * (constant[:, None] + wind(TIMES) + road(TIMES))
    return xr.DataArray(values, dims=("sample", "time"), coords={"time": TIMES})


def exact():
    """Return the lowest and the highest mean, and σ, with the first supplier."""
    modulus = INPUTS["modulus"]
    wind = replace(INPUTS["wind"], domain=(0.0, 2.0))
    parts = 0.3 * modulus.expansion.basis(X) @ WEIGHT, 0.2 * wind.expansion.basis(TIMES)
    std = np.sqrt(np.sum(parts[0] ** 2) + np.sum(parts[1] ** 2, axis=0))
    thickness = replace(INPUTS["thickness"], domain=(0.0, 1.0))
    ends = thickness.value(np.array([[-1, -1], [-1, 1], [1, -1], [1, 1.0]]))(X) @ WEIGHT
    mean = 3 * WEIGHT.sum() + 2 + TIMES
    return mean + ends.min() - 0.2, mean + ends.max() + 0.1, std


METHODS = {
    fb.ImprovedPCCI(1, 1): 1e-9,
    fb.methods.PhaseResolvedPCCI(1, 1): 1e-3,
    fb.AdaptivePCCI(1e-3): 1e-3,
    fb.methods.RegressionPCCI(1): 1e-9,
    fb.methods.PerturbationChebyshev(1, improved=True): 1e-9,
    fb.methods.SobolScanning(64, 2): 0.03,
    fb.LHSScanning(64, 2): 0.1,
}


@pytest.mark.parametrize("method", METHODS, ids=lambda case: case.name)
def test_fields_and_a_choice(method, tmp_path, monkeypatch):
    for function in (limit, trend):
        monkeypatch.setitem(fb.fields.Field.functions, function.__name__, function)
    low, high, std = exact()
    if hasattr(method, "expand"):
        surrogate = fb.expand(response, INPUTS, method)
        fb.save_surrogate(surrogate, tmp_path / "s.npz")
        bands = fb.load_surrogate(tmp_path / "s.npz").bands()
        xr.testing.assert_identical(bands, surrogate.bands())
    else:
        bands = fb.propagate(response, INPUTS, method)
    np.testing.assert_allclose(bands["mean"], [low, 3 * high], rtol=METHODS[method] / 10)
    deviation = bands["error_bar"] - bands["mean"]
    np.testing.assert_allclose(deviation, [-std, 3 * std], rtol=METHODS[method])
    assert np.all(bands["mean_choice"] == np.array([["1.0"], ["3.0"]]))


@pytest.mark.parametrize(
    "expansion", [fb.fields.eole, fb.fields.karhunen_loeve, fb.fields.orthogonal_series]
)
@pytest.mark.parametrize("method", METHODS, ids=lambda case: case.name)
def test_every_discretization_in_every_method(method, expansion):
    """A field and an interval, of which the response is a linear function."""
    field = fb.RandomField(3.0, 0.3, 1.0, (0.0, 1.0), terms=2, discretization=expansion)

    def response(modulus, load):
        return (modulus(X) @ WEIGHT)[:, None] * (1.0 + TIMES) + load[:, None]

    inputs = {"modulus": field, "load": fb.Interval(0.5, 1.0)}
    bands = fb.propagate(response, inputs, method)
    mean = 3 * WEIGHT.sum() * (1.0 + TIMES)
    std = np.linalg.norm(0.3 * field.expansion.basis(X) @ WEIGHT) * (1.0 + TIMES)
    np.testing.assert_allclose(bands["mean"], [mean + 0.5, mean + 1], rtol=METHODS[method] / 10)
    deviation = abs(bands["error_bar"] - bands["mean"])
    np.testing.assert_allclose(deviation, [std, std], rtol=METHODS[method])
