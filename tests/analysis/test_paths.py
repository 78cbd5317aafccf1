"""Paths and the regions of their points, against closed forms."""

import numpy as np
import pytest
import xarray as xr
from scipy.stats import norm

import flexband as fb

T = np.linspace(0.0, 1.0, 13)
ANGLE = 2 * np.pi * T
NORMAL = fb.Normal(0.0, 1.0)


def point(x, y, time=T):
    coords = {"output": ["X", "Y"], "time": time, "unit": ("output", ["mm", "mm"])}
    return xr.DataArray(np.stack([x, y], axis=1), coords, ("sample", "output", "time"))


def crank(length):
    return point(length[:, None] * np.cos(ANGLE), length[:, None] * np.sin(ANGLE))


def test_a_crank_with_an_uncertain_length():
    """The region is a segment along the crank."""
    surrogate = fb.expand(crank, {"length": fb.Interval(9.0, 11.0)}, fb.PCCI(1, 1))
    path = fb.analysis.path(surrogate, "X", "Y")
    np.testing.assert_allclose(path["x_nominal"], 10 * np.cos(ANGLE), atol=1e-9)
    normals = np.cos(np.deg2rad(path["direction"].values)[:, None] - ANGLE)
    np.testing.assert_allclose(path["support"], np.maximum(9 * normals, 11 * normals), atol=1e-9)
    longest = path["support_at"].sel(input="length").values
    assert np.all(longest[normals > 1e-9] == 11.0)
    quarter = path.isel(time=3)  # along y: its ends are those of a direction
    assert float(quarter["y"].max()) == pytest.approx(11.0)
    assert float(quarter["y"].min()) == pytest.approx(9.0)
    assert np.abs(quarter["x"].values).max() < 0.2
    assert quarter["radius"] == pytest.approx(1.0, rel=0.02)
    assert path["x"].attrs["units"] == "mm"


def test_linear_responses_have_zonotopes():
    """Sums of segments: the support function is a sum, and each edge is parallel to a segment."""
    angles = np.pi * np.array([0.0, 0.25, 0.5, 0.875])
    sides = np.array([1.0, 0.5, 2.0, 0.7])

    def response(a, b, c, d):
        values = np.stack([a, b, c, d], axis=1) * sides
        x, y = (values @ function(angles) for function in (np.cos, np.sin))
        return point(x[:, None] * np.ones(2), 3 + y[:, None] * np.ones(2), [0.0, 1.0])

    inputs = dict.fromkeys("abcd", fb.Interval(-1, 1))
    path = fb.analysis.path(fb.expand(response, inputs, fb.PCCI(1, 1)), "X", "Y", directions=16)
    angle = np.deg2rad(path["direction"].values)
    exact = np.abs(np.cos(angle[:, None] - angles)) @ sides + 3 * np.sin(angle)
    np.testing.assert_allclose(path["support"][:, 0], exact, rtol=1e-12)
    corners = np.array(np.meshgrid(*[[-1, 1]] * 4)).reshape(4, -1).T * sides
    exact_corners = np.stack([corners @ np.cos(angles), 3 + corners @ np.sin(angles)], axis=1)
    x = path["x"].values[:, 0]
    y = path["y"].values[:, 0]
    area = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    pairs = [
        4 * sides[i] * sides[j] * abs(np.sin(angles[i] - angles[j]))
        for i in range(4) for j in range(i)
    ]  # fmt: skip
    assert area == pytest.approx(sum(pairs), rel=1e-12)  # all normals are among the directions
    distance = np.hypot(x[:, None] - exact_corners[:, 0], y[:, None] - exact_corners[:, 1])
    assert distance.min(axis=1).max() < 1e-9  # every vertex is one of the zonotope


def test_random_inputs_make_ellipses_or_boxes():
    def response(x, y):
        return point(2 * x[:, None] * np.ones(2), (x + y)[:, None] * np.ones(2), [0.0, 1.0])

    surrogate = fb.expand(response, {"x": NORMAL, "y": NORMAL}, fb.PCCI(1, 1))
    path = fb.analysis.path(surrogate, "X", "Y", sigmas=3)
    angle = np.deg2rad(path["direction"].values)
    slopes = 2 * np.cos(angle) + np.sin(angle), np.sin(angle)
    np.testing.assert_allclose(path["support"][:, 0], 3 * np.hypot(*slopes), rtol=1e-12)
    path = fb.analysis.path(surrogate, "X", "Y", probability=0.99)
    z = norm.isf((1 - 0.99**0.5) / 2)
    np.testing.assert_allclose(path["support"][:, 0], z * np.sum(np.abs(slopes), axis=0), rtol=1e-9)


def test_choices_and_phases():
    """X turns fast and Y does not; each has an expansion of its own."""
    time = np.linspace(0.0, 1.0, 201)

    def response(e, x, kind):
        phase = 80 * time * (1 + 0.01 * x[:, None]) + 0.2 * e[:, None]
        size = np.where(kind == "short", 1.0, 2.0)[:, None]
        return point(size * np.cos(phase), (2 + 0.1 * e[:, None]) * time, time)

    inputs = {"e": fb.Interval(-1, 1), "x": NORMAL, "kind": fb.Choice("short", "long")}
    surrogate = fb.expand(response, inputs, fb.AdaptivePCCI(1e-3))
    path = fb.analysis.path(surrogate, "X", "Y", directions=8)
    bands = surrogate.bands()["error_bar"]
    for direction, output, bound, sign in ((0, "X", 1, 1), (2, "Y", 1, 1), (4, "X", 0, -1)):
        np.testing.assert_allclose(
            path["support"][direction], sign * bands.sel(output=output)[bound], atol=2e-3
        )
    e = np.linspace(-1, 1, 201)[:, None]
    first = np.exp(-((0.8 * time) ** 2) / 2) * np.cos(80 * time + 0.2 * e)
    second = np.exp(-2 * (0.8 * time) ** 2) * np.cos(2 * (80 * time + 0.2 * e))
    std = np.sqrt(np.maximum((1 + second) / 2 - first**2, 0))
    upper_ends = [size * first + (2 + 0.1 * e) * time + size * std for size in (1, 2)]
    np.testing.assert_allclose(
        path["support"][1], np.max(upper_ends, axis=(0, 1)) / np.sqrt(2), atol=4e-3
    )
    assert set(np.unique(path["support_choice"])) == {"short", "long"}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"x": "Z"}, "output must be one of X, Y"),
        ({"directions": 10}, "multiple of 4"),
        ({"sigmas": 0}, "sigmas"),
        ({"probability": 2.0}, "probability must be above 0"),
        ({"at": {"time": 0.5}}, "requires a response with the dims"),
    ],
)
def test_refused_by_name(options, message):
    surrogate = fb.expand(crank, {"length": fb.Interval(9.0, 11.0)}, fb.PCCI(1, 1))
    with pytest.raises(fb.errors.InputError, match=message):
        fb.analysis.path(surrogate, **({"x": "X", "y": "Y"} | options))
