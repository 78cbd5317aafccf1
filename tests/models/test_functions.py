"""Functions of one sample as responses: stacked sample by sample."""

import inspect
import math
import pickle

import numpy as np
import pytest
import xarray as xr

import flexband as fb

INPUTS = {"x": fb.Normal(1.0, 0.1), "e": fb.Interval(0.5, 1.0)}
T = np.linspace(0.0, 1.0, 9)


def with_math(x, e):
    return math.sin(x) * e


def of_as_many_times(x, e):
    """Return (times,), which is the shape (n,) of a method with nine runs."""
    return e * np.exp(-x * T)


def with_labels(x, e):
    values = e * np.exp(-x * T)
    return xr.DataArray([values, values**2], dims=("output", "time"), coords={"time": T})


def vectorized(x, e):
    return e[:, None] * np.exp(-x[:, None] * T)


def test_samples_are_stacked():
    bands = fb.propagate(vectorized, INPUTS, fb.PCCI(3, 3))
    of_samples = fb.propagate(fb.models.samplewise(of_as_many_times), INPUTS, fb.PCCI(3, 3))
    for name in ("mean", "error_bar"):
        np.testing.assert_allclose(of_samples[name], bands[name], rtol=1e-12)
    result = fb.models.samplewise(with_labels)(x=np.array([0.0, 1.0]), e=np.ones(2))
    assert result.dims == ("sample", "output", "time")
    np.testing.assert_array_equal(result["time"], T)
    np.testing.assert_allclose(result[1, 0], np.exp(-T))
    np.testing.assert_array_equal(
        fb.models.samplewise(with_math)(x=1.0, e=2.0), [2 * math.sin(1.0)]
    )


def test_arguments_are_plain_numbers_and_texts():
    arguments = []

    def looking(x, material, turns):
        arguments.append((x, material, turns))
        return x if material == "steel" and turns == 3 else 2 * x

    inputs = {"x": fb.Interval(1.0, 2.0), "material": fb.Choice("steel", "brass"), "turns": 3}
    bands = fb.propagate(fb.models.samplewise(looking), inputs, fb.PCCI(1, 1))
    np.testing.assert_allclose(bands["mean"], [1.0, 4.0])
    assert {tuple(map(type, values)) for values in arguments} == {(float, str, int)}


def bar(youngs_modulus, load):
    """Return the elongation ∫ F/EA dx of a bar of 1 m."""
    x, weights = np.polynomial.legendre.leggauss(8)
    modulus = youngs_modulus((x + 1) / 2)
    assert modulus.shape == x.shape
    assert isinstance(youngs_modulus(0.5), float)
    return float(load * np.sum(weights / 2 / modulus))


@pytest.mark.parametrize("domain", [None, (0.0, 1.0)])
def test_fields_are_functions_of_positions(domain):
    field = fb.RandomField(10.0, 1.0, correlation_length=2.0, domain=domain)
    inputs = {"youngs_modulus": field, "load": fb.Interval(1.0, 2.0)}
    bands = fb.propagate(fb.models.samplewise(bar), inputs, fb.PCCI(2, 1))
    assert float(bands["mean"][0]) == pytest.approx(0.1 * (1 + 0.01), rel=2e-3)  # E[1/E] by Taylor


def test_a_field_alone_tells_how_many_samples_there_are():
    field = fb.IntervalField(1.0, 2.0, length=1.0, domain=(0.0, 1.0))
    response = fb.models.samplewise(lambda f: f(0.25) + f(np.array([0.5, 1.0])).sum())
    result = response(f=field.value(np.array([[-1.0] * 2, [0.0] * 2, [1.0] * 2])))
    np.testing.assert_allclose(result, [3.0, 4.5, 6.0])


def test_signature_pickling_and_names():
    response = fb.models.samplewise(with_math)
    assert list(inspect.signature(response).parameters) == ["x", "e"]
    assert response.__wrapped__ is with_math
    assert response.one_by_one
    assert pickle.loads(pickle.dumps(response)) == response
    with pytest.raises(
        fb.errors.InputError, match="inputs name e, which the response does not take"
    ):
        fb.propagate(fb.models.samplewise(lambda x: x), INPUTS, fb.PCCI(1, 1))
    with pytest.raises(fb.errors.InputError, match="function_of_one must be a function; got 3"):
        fb.models.samplewise(3)


@pytest.mark.parametrize(
    ("result", "text"),
    [
        (lambda x: None, "must return a number, an array or a DataArray; got None"),
        (lambda x: {"u": x}, "must return a number, an array or a DataArray; got {'u'"),
        (lambda x: np.ma.masked_less([x], 5.0), "got a masked array"),
        (lambda x: 1j * x, "of real numbers; got"),
        (lambda x: [[x], [x, x]], "must return a number, an array"),
        (lambda x: np.zeros(int(x)), r"shape of the first one, \(1,\); got \(2,\)"),
        (lambda x: xr.DataArray([x], dims="t", coords={"t": [x]}), "coordinate 't' must be the"),
        (lambda x: xr.DataArray([x], dims="tu"[int(x) - 1]), r"dims of the first one, \('t',\)"),
        (lambda x: xr.DataArray(x) if x < 2 else x, "either arrays or DataArrays; got both"),
        (lambda x: xr.DataArray([x, x], dims="sample"), "of this sample; got 2 samples"),
    ],
)
def test_other_results_are_refused(result, text):
    with pytest.raises(fb.errors.InputError, match=text):
        fb.models.samplewise(result)(x=[1.0, 2.0])


def test_an_error_tells_the_sample():
    with pytest.raises(ZeroDivisionError) as error:
        fb.models.samplewise(lambda x, y: 1 / x)(x=[1.0, 0.0], y=[5.0, 6.0])
    assert error.value.__notes__ == ["in sample 1: x = 0.0, y = 6.0"]
    with pytest.raises(fb.errors.InputError, match="y has 3 samples; others have 2"):
        fb.models.samplewise(lambda x, y: x)(x=np.ones(2), y=np.ones(3))
