"""Inputs of one kind alone, and more inputs than NumPy has dimensions, in every method."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.uncertainty.expansions.families import HERMITE, LEGENDRE
from flexband.uncertainty.expansions.hybrid import tensor_points
from flexband.uncertainty.phases.integration.rules import PhaseChange, resolving_rule

TIMES = np.linspace(0.0, 8.0, 161)
SPREAD = 0.02
"""The wave's phase changes by 1 rad at the end, for e from 0 to 1."""


def with_labels(values):
    return xr.DataArray(values, dims=("sample", "time"), coords={"time": TIMES})


def wave(e):
    return with_labels(np.cos(2 * np.pi * (1 + SPREAD * e[:, None]) * TIMES))


def decay(e):
    return with_labels(np.exp(-(0.2 + 0.04 * e[:, None]) * TIMES))


def moments(response, kind):
    """Return μ and σ of the response to a random input, by Gauss quadrature."""
    rule = {
        "normal": np.polynomial.hermite_e.hermegauss,
        "uniform": np.polynomial.legendre.leggauss,
    }[kind]
    x, w = rule(60)
    values = response(x).values
    w = w / w.sum()
    mean = w @ values
    return mean, np.sqrt(w @ (values - mean) ** 2)


def exact(response, kind):
    """Return the lowest μ − σ and the highest μ + σ."""
    if kind == "interval":
        values = response(np.linspace(-1, 1, 4001)).values
        return np.stack([values.min(axis=0), values.max(axis=0)])
    mean, std = moments(response, kind)
    return np.stack([mean - std, mean + std])


INPUTS = {
    "interval": fb.Interval(-1, 1),
    "normal": fb.Normal(0, 1),
    "uniform": fb.Uniform(-1, 1),
}
METHODS = [
    (fb.AdaptivePCCI(1e-3), 3e-3),
    (fb.AdaptivePCCI(1e-3, phase_resolved=False), 1e-2),
    (fb.methods.PhaseResolvedPCCI(2, 2), 3e-3),
    (fb.ImprovedPCCI(9, 8), 1e-2),
    (fb.PCCI(9, 8), 1e-2),
    (fb.LHSScanning(400, 60), 3e-2),
    (fb.MonteCarlo(400, 60), 0.1),
]


@pytest.mark.parametrize(("method", "tolerance"), METHODS, ids=lambda v: getattr(v, "label", ""))
@pytest.mark.parametrize("kind", INPUTS)
@pytest.mark.parametrize("response", [wave, decay])
def test_one_input_of_one_kind(response, kind, method, tolerance, tmp_path):
    """Bands, moments, values, files and verification where no input is random, or none interval."""
    inputs = {"e": INPUTS[kind]}
    bands = fb.propagate(response, inputs, method)
    np.testing.assert_allclose(bands.error_bar, exact(response, kind), atol=tolerance)
    if not hasattr(method, "expand"):
        return
    surrogate = fb.expand(response, inputs, method)
    xr.testing.assert_identical(surrogate.bands(), bands)
    at = np.array([-0.4, 0.7])
    np.testing.assert_allclose(surrogate.evaluate(e=at), response(at), atol=3 * tolerance)
    if kind == "interval":
        mean = response(at).values
        std = 0.0
        result = surrogate.moments(e=at)
    else:
        mean, std = moments(response, kind)
        result = surrogate.moments()
    np.testing.assert_allclose(result["mean"] - mean, 0, atol=3 * tolerance)
    np.testing.assert_allclose(result["std"] - std, 0, atol=3 * tolerance)
    fb.save_surrogate(surrogate, tmp_path / "surrogate.npz")
    copy = fb.load_surrogate(tmp_path / "surrogate.npz")
    np.testing.assert_array_equal(copy.bands().error_bar, bands.error_bar)
    assert fb.verify(surrogate, response).verification.attrs["confirmed"] != "no"


def linear(**values):
    """Return 1 + Σ c_k x_k t, with coefficients c_k = (k + 1)/60."""
    total = sum((k + 1) / 60 * x for k, x in enumerate(values.values()))
    return np.asarray(1 + total[:, None] * np.array([0.5, 1.0]))


@pytest.mark.parametrize(("intervals", "normals"), [(60, 0), (0, 60), (40, 40)])
def test_many_inputs(intervals, normals):
    inputs = {f"a{k:02d}": fb.Interval(-1, 1) for k in range(intervals)}
    inputs |= {f"b{k:02d}": fb.Normal(0, 1) for k in range(normals)}
    bands = fb.propagate(linear, inputs, fb.AdaptivePCCI(0.01, max_runs=160))
    c = (np.arange(intervals + normals) + 1) / 60
    half = c[:intervals].sum() + np.sqrt(np.sum(c[intervals:] ** 2))
    expected = 1 + np.outer([-half, half], [0.5, 1.0])
    np.testing.assert_allclose(bands.error_bar, expected, rtol=1e-6)
    if intervals:
        np.testing.assert_array_equal(abs(bands.error_bar_at), 1.0)


def test_a_field_of_many_terms():
    field = fb.RandomField(1.0, 0.1, correlation_length=0.02, domain=(0.0, 1.0))
    assert field.dimension > 32

    def response(f):
        return f(np.array([0.3])) * np.ones(2)

    bands = fb.propagate(response, {"f": field}, fb.AdaptivePCCI(0.01))
    std = 0.1 * np.sqrt(1 - field.variance_error(np.array([0.3])).item())
    np.testing.assert_allclose(bands.error_bar, [[1 - std] * 2, [1 + std] * 2], rtol=1e-6)


@pytest.mark.parametrize("order", [0, 1, 3])
@pytest.mark.parametrize("method", [fb.PCCI, fb.ImprovedPCCI, fb.methods.PhaseResolvedPCCI])
def test_tensor_designs_of_many_inputs_are_refused_by_their_runs(method, order):
    inputs = {f"a{k:02d}": fb.Interval(-1, 1) for k in range(60)}
    design = method(order, order)
    if order == 0:
        assert fb.propagate(linear, inputs, design).attrs["runs"] <= 1 + 4 + 1
        return
    with pytest.raises(
        fb.errors.InputError, match=r"would take about 10\^\d+ runs, with 0 random and 60"
    ):
        fb.propagate(linear, inputs, design)


def test_scans_of_many_inputs_are_refused_by_their_runs():
    inputs = {f"a{k:03d}": fb.Interval(-1, 1) for k in range(8000)}
    with pytest.raises(fb.errors.InputError, match=r"would take about 10\^8000 runs"):
        fb.propagate(linear, inputs, fb.LHSScanning(100, 10))


def test_points_of_forty_variables():
    points = tensor_points([np.zeros(1)] * 38 + [np.array([1.0, 2.0])] * 2)
    assert points.shape == (4, 40)
    np.testing.assert_array_equal(points[:, -2:], [[1, 1], [1, 2], [2, 1], [2, 2]])


def test_a_rule_in_forty_variables_is_too_large():
    orders = np.full(40, np.int64(3))
    reach = np.full(40, 0.1)
    for family in (HERMITE, LEGENDRE):
        change = PhaseChange([family] * 40, orders, reach, np.ones((1, 40)))
        assert resolving_rule(change) is None
