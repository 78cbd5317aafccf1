"""What the what-if panel knows of inputs and outputs."""

import dataclasses
import json

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.report.page.what_if.panel import what_if

TIME = np.linspace(0.0, 1.0, 5)


def response(a, b, c, d, e, f, g, h):
    line = (a * f)[:, None] * TIME + (b * c + d)[:, None] + (e * g)[:, None] * TIME**2
    values = np.stack([line, 1e3 * line + h(TIME)], axis=1)
    coords = {"output": ["x", "y"], "time": TIME, "unit": ("output", ["m", "N"])}
    return xr.DataArray(values, coords, ("sample", "output", "time"))


INPUTS = {
    "a": fb.Normal(2.0, 0.1),
    "b": fb.LogNormal(3.0, 0.2),
    "c": fb.Uniform(1.0, 2.0),
    "d": fb.Triangular(0.0, 1.0, 2.0),
    "e": fb.Normal(fb.Interval(1.0, 2.0), 0.1),
    "f": fb.Interval(-1.0, 3.0),
    "g": fb.Interval(1.0, 1.0),
    "h": fb.RandomField(1.0, 0.1, 2.0, domain=(0.0, 1.0), terms=1),
}


@pytest.fixture(scope="module")
def surrogate():
    return fb.expand(response, INPUTS, fb.PCCI(1, 2))


def test_inputs_that_can_be_narrowed_and_why_others_cannot(surrogate):
    data, why = what_if(surrogate, surrogate.bands(2.0))
    assert not why
    assert json.loads(json.dumps(data, allow_nan=False))["sigmas"] == 2.0
    assert [entry["name"] for entry in data["intervals"]] == ["e.mean", "f"]
    assert [entry["name"] for entry in data["sizes"]] == ["a", "b", "c", "h"]
    assert data["remarks"] == [
        "d keeps its scatter: it is a Triangular.",
        "e keeps its scatter: it is a Normal with intervals as parameters.",
    ]
    assert data["outputs"] == [{"name": "x", "unit": "m"}, {"name": "y", "unit": "N"}]
    bar = surrogate.bands(2.0)["error_bar"]
    np.testing.assert_allclose(data["width"], (bar[1] - bar[0]).max("time"))


def test_half_the_scatter_is_what_the_python_of_the_panel_says(surrogate):
    data, _ = what_if(surrogate, surrogate.bands())
    expected = {
        "a": fb.Normal(2.0, 0.05),
        "b": fb.LogNormal.of_logarithm(*(np.array(INPUTS["b"].logarithm) * [1.0, 0.5])),
        "c": fb.Uniform(1.25, 1.75),
        "h": dataclasses.replace(INPUTS["h"], std=0.05),
    }
    for size in data["sizes"]:
        text = size["python"].format(*(a + b * 0.5 for a, b in size["ends"]))
        names = {"fb": fb, "dataclasses": dataclasses, "surrogate": surrogate}
        assert eval(text, names) == expected[size["name"]]
    fixed = {size["name"]: size["fixed"] for size in data["sizes"]}
    median = float(INPUTS["b"].value(np.zeros((1, 1)))[0])
    assert fixed == pytest.approx({"a": 2.0, "b": median, "c": 1.5, "h": None})


def test_responses_and_inputs_without_a_panel():
    def total(x, y):
        return (x + y)[:, None] * TIME

    correlated = fb.Correlated({"x": fb.Normal(0, 1), "y": fb.Normal(0, 1)}, [[1, 0.5], [0.5, 1]])
    of_pair = fb.expand(total, {"pair": correlated}, fb.PCCI(1, 1))
    assert what_if(of_pair, of_pair.bands()) == (
        None,
        [f"{name} keeps its scatter: it is correlated with other inputs." for name in "xy"],
    )
    data, why = what_if(None, of_pair.bands())
    assert data is None
    assert "makes no surrogate" in why[0]


def test_a_surrogate_that_is_too_large_for_a_page(surrogate):
    assert what_if(surrogate, surrogate.bands(), max_coefficients=10)[0] is None
