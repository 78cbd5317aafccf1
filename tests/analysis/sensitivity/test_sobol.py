"""Sobol' indices against closed forms, over interval inputs, of fields and of phases."""

import inspect

import numpy as np
import xarray as xr

import flexband as fb

NORMAL = fb.Normal(0.0, 1.0)
T = np.linspace(0.0, 1.0, 11)


def over_time(values):
    return xr.DataArray(values, dims=("sample", "time"), coords={"time": T})


def indices(sobol, name, kind):
    """Return the bounds of an index of an input."""
    return sobol[kind].sel(name=name).values


def test_ishigami():
    """Ishigami and Homma (1990): a = 7, b = 0.1, here with b from an interval."""

    def response(b, x1, x2, x3):
        return np.sin(x1) + 7 * np.sin(x2) ** 2 + b * x3**4 * np.sin(x1)

    angle = fb.Uniform(-np.pi, np.pi)
    inputs = {"b": fb.Interval(0.05, 0.1), "x1": angle, "x2": angle, "x3": angle}
    surrogate = fb.expand(response, inputs, fb.PCCI(14, 2))
    sobol = fb.analysis.sobol_indices(surrogate)

    def exact(b):
        of_x1 = 0.5 * (1 + b * np.pi**4 / 5) ** 2
        second = 49 / 8
        interaction = b**2 * np.pi**8 * (1 / 18 - 1 / 50)
        return np.array([of_x1, second, 0.0, of_x1 + interaction, second, interaction]) / (
            of_x1 + second + interaction
        )

    ends = np.array([exact(b) for b in (0.05, 0.1)])
    names = [("first_order", k) for k in ("x1", "x2", "x3")] + [
        ("total", k) for k in ("x1", "x2", "x3")
    ]
    for (kind, name), pair in zip(names, ends.T, strict=True):
        np.testing.assert_allclose(indices(sobol, name, kind), np.sort(pair), atol=2e-5)
    assert sobol["name"].values[0] in ("x1", "x2")
    assert sobol["total_at"].sel(name="x3").values.ravel().tolist() == [0.05, 0.1]


def test_g_function():
    """Saltelli and Sobol' (1995): a product of (|4x − 2| + a)/(1 + a), with squares for kinks."""
    a = np.array([0.0, 1.0, 4.5, 9.0])
    names = [f"x{k}" for k in range(4)]

    def response(**x):
        square = np.stack([(4 * x[name] - 2) ** 2 * 0.75 for name in names])
        return np.prod((square + a[:, None]) / (1 + a[:, None]), axis=0)

    parameters = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY) for name in names]
    response.__signature__ = inspect.Signature(parameters)
    inputs = dict.fromkeys(names, fb.Uniform(0.0, 1.0))
    sobol = fb.analysis.sobol_indices(fb.expand(response, inputs, fb.PCCI(2, 1)))
    part = 0.8 / (1 + a) ** 2  # the variance of 3 (2x − 1)² is 4/5
    variance = np.prod(1 + part) - 1
    for k, name in enumerate(names):
        first = part[k] / variance
        total = part[k] * np.prod(1 + np.delete(part, k)) / variance
        np.testing.assert_allclose(indices(sobol, name, "first_order"), first, rtol=1e-9)
        np.testing.assert_allclose(indices(sobol, name, "total"), total, rtol=1e-9)
    assert sobol["name"].values.tolist() == names


def test_an_interval_coefficient_and_no_variance():
    """e sin 2πt x + y cos 2πt: shares of squares; at t = 1/4 no y, and e = 0 leaves nothing."""
    wave = np.sin(2 * np.pi * T)
    cosine = np.round(np.cos(2 * np.pi * T), 12)

    def response(e, x, y):
        return over_time(e[:, None] * wave * x[:, None] + cosine * y[:, None])

    inputs = {"e": fb.Interval(1.0, 3.0), "x": fb.Normal(0.0, 2.0), "y": NORMAL}
    sobol = fb.analysis.sobol_indices(fb.expand(response, inputs, fb.PCCI(1, 1)))
    exact = [(2 * e * wave) ** 2 / ((2 * e * wave) ** 2 + cosine**2) for e in (1.0, 3.0)]
    np.testing.assert_allclose(indices(sobol, "x", "total"), exact, atol=1e-9)
    np.testing.assert_allclose(
        indices(sobol, "y", "first_order"), 1 - np.array(exact)[::-1], atol=1e-9
    )
    assert np.all(sobol["defined"])
    assert sobol.attrs["undefined"].startswith("the variance vanishes at 0 of")

    surrogate = fb.expand(
        lambda e, x: over_time(100 + e[:, None] * wave * x[:, None]),
        {"e": fb.Interval(0.0, 1.0), "x": NORMAL},
        fb.PCCI(1, 1),
    )
    sobol = fb.analysis.sobol_indices(surrogate)
    zero_mask = np.abs(wave) < 1e-9
    np.testing.assert_array_equal(np.isnan(indices(sobol, "x", "total")), [zero_mask, zero_mask])
    np.testing.assert_allclose(indices(sobol, "x", "total")[:, ~zero_mask], 1.0)
    assert not np.any(sobol["defined"])  # there is none at e = 0
    assert sobol.attrs["undefined"].startswith("the variance vanishes at 11 of 11")


def test_fields_and_correlated_inputs_count_as_one():
    def response(stiffness, x, y):
        at = np.stack([stiffness(np.full(1, p))[:, 0] for p in (0.0, 0.5, 1.0)], axis=1)
        return at.sum(axis=1) + x + y

    field = fb.RandomField(2.0, 0.5, 1.0, domain=(0.0, 1.0), terms=3)
    pair = fb.Correlated({"x": NORMAL, "y": NORMAL}, [[1.0, 0.5], [0.5, 1.0]])
    surrogate = fb.expand(response, {"stiffness": field, "pair": pair}, fb.PCCI(1, 1))
    sobol = fb.analysis.sobol_indices(surrogate)
    assert set(sobol["name"].values.tolist()) == {"stiffness", "pair"}
    assert isinstance(surrogate, fb.Surrogate)
    _, std = surrogate.standard_moments(np.zeros((1, 0)))
    np.testing.assert_allclose(indices(sobol, "pair", "first_order"), 3 / std[0] ** 2)
    np.testing.assert_allclose(sobol["first_order"].sum("name"), 1.0)


def test_errors_of_samples_cancel_where_one_input_acts_alone():
    """Samples of the variance scatter by some per cent, but all of it is due to x."""
    time = np.linspace(0.0, 1.0, 401)

    def response(e, x, y):
        phase = 150 * time * (1 + 0.01 * x[:, None]) + 0.1 * e[:, None]
        size = 1 + 1e-4 * y[:, None]
        return xr.DataArray(size * np.cos(phase), {"time": time}, ("sample", "time"))

    inputs = {"e": fb.Interval(-1, 1), "x": NORMAL, "y": NORMAL}
    surrogate = fb.expand(response, inputs, fb.methods.PhaseResolvedPCCI())
    sobol = fb.analysis.sobol_indices(surrogate, at={"time": [0.25, 0.8, 1.0]})
    for kind in ("first_order", "total"):
        np.testing.assert_allclose(indices(sobol, "x", kind), 1.0, atol=1e-5)
        np.testing.assert_allclose(indices(sobol, "y", kind), 0.0, atol=1e-5)
    assert sobol["sampling_error"].max() < 1e-3
    assert sobol.attrs["sampling"].startswith("sampling error where σ is largest: below")


def test_phases_are_sampled():
    """cos(40 t + e + x) with an amplitude 2 + y: closed forms of the moments of exp(ix)."""
    time = np.linspace(0.0, 1.0, 401)

    def response(e, x, y):
        phase = 150 * time * (1 + 0.01 * x[:, None]) + 0.1 * e[:, None]
        return xr.DataArray(
            (2 + 0.2 * y[:, None]) * np.cos(phase), {"time": time}, ("sample", "time")
        )

    inputs = {"e": fb.Interval(-1, 1), "x": NORMAL, "y": NORMAL}
    surrogate = fb.expand(response, inputs, fb.methods.PhaseResolvedPCCI())
    sobol = fb.analysis.sobol_indices(surrogate, at={"time": [0.25, 0.8, 1.0]})
    assert "sampling_error" in sobol
    e = np.linspace(-1, 1, 401)[:, None]
    t = sobol["time"].values
    s = 1.5 * t
    angle = 150 * t + 0.1 * e
    first = np.exp(-(s**2) / 2) * np.cos(angle)
    second = np.exp(-2 * s**2) * np.cos(2 * angle)
    variance = 4.04 * (1 + second) / 2 - 4 * first**2
    of_x = 4 * ((1 + second) / 2 - first**2) / variance
    of_y = 0.04 * first**2 / variance
    for name, exact in (("x", of_x), ("y", of_y)):
        ends = [exact.min(axis=0), exact.max(axis=0)]
        error = sobol["sampling_error"].sel(name=name).values
        assert np.all(error < 0.06)
        assert np.all(np.abs(indices(sobol, name, "first_order") - ends) < 2 * error + 0.003)


def test_a_surrogate_may_not_depend_on_an_interval():
    def response(e, x, y):
        return over_time(np.outer(x + e * y, 1 + T))

    inputs = {"e": fb.Interval(1.0, 3.0), "x": NORMAL, "y": NORMAL}
    sobol = fb.analysis.sobol_indices(fb.expand(response, inputs, fb.PCCI(1, 0)))
    np.testing.assert_allclose(indices(sobol, "x", "total"), 0.2, atol=1e-9)  # 1/(1 + 2²)
    assert not np.any(
        fb.analysis.sobol_indices(fb.expand(response, inputs, fb.PCCI(0, 0)))["defined"]
    )
