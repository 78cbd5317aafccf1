"""The tolerance with which an error bar has a part of its width, against closed forms."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb

T = np.linspace(0.0, 1.0, 7)


def response(a, e, f):
    values = 2 * a[:, None] + 4 * e[:, None] + np.outer(f, T)
    return xr.DataArray(
        np.stack([values, 3 * f[:, None] * T**2], axis=1),
        dims=("sample", "output", "time"),
        coords={"output": ["x", "y"], "unit": ("output", ["m", "N"]), "time": T},
    )


@pytest.fixture(scope="module")
def surrogate():
    inputs = {"a": fb.Normal(0, 1.5), "e": fb.Interval(-1, 2), "f": fb.Interval(1, 3)}
    return fb.expand(response, inputs, fb.AdaptivePCCI())


@pytest.mark.parametrize("sigmas", [1.0, 3.0])
def test_linear_responses(surrogate, sigmas):
    # the width of x is 4 |e| + |f| + 2 k · 2 · 1.5 with full widths 3 and 2, that of y 3 · 2
    width = 12 + 2 + 6 * sigmas
    tolerances = fb.analysis.tolerance_for(surrogate, "e", 0.7, sigmas=sigmas)
    factor = 1 - 0.3 * width / 12
    np.testing.assert_allclose(tolerances["width"], [width, 6], rtol=1e-9)
    np.testing.assert_allclose(tolerances["least_width"], [width - 12, 6], rtol=1e-5)
    assert float(tolerances["factor"].sel(output="x")) == pytest.approx(factor, abs=2e-4)
    assert float(tolerances["tolerance"].sel(output="x")) == pytest.approx(1.5 * factor, abs=3e-4)
    assert np.isnan(tolerances["tolerance"].sel(output="y"))  # which does not depend on e
    random = fb.analysis.tolerance_for(surrogate, "a", 0.9, sigmas=sigmas)
    part = 1 - 0.1 * width / (6 * sigmas)
    assert float(random["tolerance"].sel(output="x")) == pytest.approx(1.5 * part, abs=3e-4)
    assert float(
        fb.analysis.tolerance_for(surrogate, "f")["factor"].sel(output="y")
    ) == pytest.approx(0.5, abs=2e-4)


def test_a_number_has_one_as_well():
    expansion = fb.expand(lambda e, f: e + f, dict.fromkeys("ef", fb.Interval(0, 1)), fb.PCCI(1, 1))
    assert float(fb.analysis.tolerance_for(expansion, "e", 0.75)["factor"]) == pytest.approx(
        0.5, abs=2e-4
    )


@pytest.mark.parametrize(
    ("name", "share", "message"),
    [
        ("b", 0.5, "name must be an input with a tolerance, .* which are a, e, f; got 'b'"),
        (3, 0.5, "got 3"),
        ("a", 0.0, "share must be above 0 and below 1; got 0"),
        ("a", 1.0, "share must be above 0 and below 1; got 1"),
        ("a", "half", "share"),
    ],
)
def test_what_is_refused(surrogate, name, share, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.analysis.tolerance_for(surrogate, name, share)


def test_outputs_without_time_have_one_each_and_sizes_have_none():
    def two(a, b):
        values = np.stack([a, 100 * b], axis=1)
        return xr.DataArray(values, dims=("sample", "output"), coords={"output": ["P", "Q"]})

    expansion = fb.expand(two, dict.fromkeys("ab", fb.Interval(0, 1)), fb.PCCI(1, 1))
    factors = fb.analysis.tolerance_for(expansion, "a")["factor"]
    assert float(factors.sel(output="P")) == pytest.approx(0.5, abs=2e-4)
    assert np.isnan(factors.sel(output="Q"))
    inputs = {"a": fb.Sizing(0.5, 1.0, tolerance=0.1), "b": fb.Interval(0, 1)}
    with pytest.raises(fb.errors.InputError, match="which are b; got 'a'"):
        fb.analysis.tolerance_for(fb.expand(two, inputs, fb.PCCI(1, 1)), "a")
