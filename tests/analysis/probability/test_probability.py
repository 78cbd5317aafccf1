"""Probabilities of leaving limits, against closed forms, sampling, and over interval inputs."""

import inspect

import numpy as np
import pytest
import xarray as xr
from scipy.stats import norm

import flexband as fb
from flexband.analysis.probability.estimates import clear
from flexband.report.page.answers import limits_table
from flexband.report.text.drawable import is_likely
from tests.rough import search_roughly

NORMAL = fb.Normal(0.0, 1.0)
T = np.linspace(0.0, 1.0, 41)


def over_time(values):
    return xr.DataArray(values, dims=("sample", "time"), coords={"time": T})


def constant(values):
    return values[:, None] * np.ones(3)


def constant_of_x(x):
    return constant(x)


def bounds(probabilities, limit=0):
    """Return the probability over the interval inputs, and its confidence interval, (3, 2)."""
    names = ("probability", "confidence_low", "confidence_high")
    return np.array([probabilities[name].values[:, limit] for name in names])


def agrees(probabilities, exact, tolerance=0.08, limit=0):
    """Check an estimate and that its confidence interval, a little widened, has the exact value."""
    value, low, high = bounds(probabilities, limit)
    np.testing.assert_allclose(value, exact, rtol=tolerance)
    assert np.all(low * 0.97 < exact)
    assert np.all(exact < high * 1.03)


@pytest.mark.parametrize("deviations", [1.0, 4.753, 6.0])
def test_a_linear_response_down_to_1e_9(deviations):
    def response(x, y):
        return constant(3 * x + 4 * y)

    surrogate = fb.expand(response, {"x": NORMAL, "y": NORMAL}, fb.AdaptivePCCI())
    probabilities = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=5 * deviations)
    )
    agrees(probabilities, norm.sf(deviations))
    two_sided = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=5 * deviations, above=-5 * deviations), seed=1
    )
    agrees(two_sided, 2 * norm.sf(deviations))


def test_many_random_inputs():
    """The sum of 40: weights of samples must not depend on what all directions happen to be."""
    names = [f"x{k:02}" for k in range(40)]

    def response(**values):
        return constant(sum(values[name] for name in names) / np.sqrt(40))

    parameters = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY) for name in names]
    response.__signature__ = inspect.Signature(parameters)
    method = fb.methods.PerturbationChebyshev(1)
    surrogate = fb.verify(fb.expand(response, dict.fromkeys(names, NORMAL), method), response)
    probabilities = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=4.5), accuracy=0.05
    )
    agrees(probabilities, norm.sf(4.5), 0.15)


def test_first_passage_is_not_the_largest_probability_at_one_time():
    """The amplitude √(a² + b²) of a cos 2πt + b sin 2πt has the distribution of Rayleigh."""

    def response(a, b):
        return over_time(a[:, None] * np.cos(2 * np.pi * T) + b[:, None] * np.sin(2 * np.pi * T))

    surrogate = fb.expand(response, {"a": NORMAL, "b": NORMAL}, fb.AdaptivePCCI())
    probabilities = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=4.0)
    )
    agrees(probabilities, np.exp(-8.0))
    at_each_time = probabilities["at_each_time"].values[1, 0]
    np.testing.assert_allclose(at_each_time, norm.sf(4.0), rtol=0.5)
    low, high = (probabilities[f"at_each_time_{k}"].values[1, 0] for k in ("low", "high"))
    assert np.mean((low <= norm.sf(4.0)) & (norm.sf(4.0) <= high)) > 0.85
    coarse = fb.expand(
        lambda a, b: response(a, b).isel(time=slice(None, None, 5)),
        {"a": NORMAL, "b": NORMAL},
        fb.AdaptivePCCI(),
    )
    probabilities = fb.analysis.failure_probability(coarse, fb.Requirement("response", below=4.0))
    on_grid, between_times = (
        float(probabilities[k][0, 0]) for k in ("probability", "between_times")
    )
    assert on_grid < 0.85 * np.exp(-8.0)
    assert between_times == pytest.approx(np.exp(-8.0), rel=0.15)


def test_impacts_may_turn_a_motion_at_a_time_where_a_parabola_goes_on():
    """A peak at an output time, steeper before than after: at least those who reach it leave."""

    def turning(x):
        slopes = np.where(T < 0.5, 10.0, 2.0)
        return over_time(1 + 0.1 * x[:, None] - slopes * np.abs(T - 0.5))

    surrogate = fb.expand(turning, {"x": NORMAL}, fb.AdaptivePCCI()).with_attrs(impacts=1)
    probabilities = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=1.2)
    )
    ends = [float(probabilities[f"between_times_{k}"][0, 0]) for k in ("low", "high")]
    assert ends[0] < norm.sf(2.0) < ends[1]
    smooth = fb.analysis.failure_probability(
        surrogate.with_attrs(impacts=0), fb.Requirement("response", below=1.2)
    )
    assert float(smooth["between_times_high"][0, 0]) > 1.2 * norm.sf(2.0)


def test_amplitude_and_phase():
    wave = np.sin(2 * np.pi * T)
    swing = fb.expand(
        lambda a: over_time((2 + 0.3 * a)[:, None] * wave), {"a": NORMAL}, fb.AdaptivePCCI()
    )
    agrees(
        fb.analysis.failure_probability(swing, fb.Requirement("response", below=3.2)), norm.sf(4.0)
    )

    def turning(phase):
        return over_time(np.cos(2 * T + phase[:, None]))

    surrogate = fb.expand(turning, {"phase": fb.Uniform(0.5, 3.0)}, fb.AdaptivePCCI(1e-5))
    first = np.pi - np.arccos(0.99) - 2  # −0.99 is passed if the phase is more than this
    agrees(
        fb.analysis.failure_probability(surrogate, fb.Requirement("response", above=-0.99)),
        (3.0 - first) / 2.5,
    )


def test_intervals_and_random_inputs_together():
    def response(e, f, x, y):
        return constant((2 + e) * x + (1 + f / 2) * y + f)

    def exact(e, f, limit):
        return norm.sf((limit - f) / np.hypot(2 + e, 1 + f / 2))

    inputs = {"e": fb.Interval(-1, 1), "f": fb.Interval(-1, 1), "x": NORMAL, "y": NORMAL}
    surrogate = fb.expand(response, inputs, fb.AdaptivePCCI())
    probabilities = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=4.0)
    )
    agrees(probabilities, [exact(-1, -1, 4.0), exact(1, 1, 4.0)])
    np.testing.assert_array_equal(probabilities["probability_at"][:, :, 0], [[-1, 1], [-1, 1]])
    rare = fb.analysis.failure_probability(surrogate, fb.Requirement("response", below=8.0))
    value, _, high = bounds(rare)
    assert value[0] == 0.0
    assert exact(-1, -1, 8.0) < high[0] < 1e-10
    assert f"violated with P ≤ {100 * value[1]:.3g} %" in rare.attrs["verdict"]
    assert value[1] == pytest.approx(exact(1, 1, 8.0), rel=0.08)


def test_an_end_inside_the_box():
    def response(e, x):
        return constant(x + 1 - e**2 + 0.3 * e)

    surrogate = fb.expand(response, {"e": fb.Interval(-1, 1), "x": NORMAL}, fb.AdaptivePCCI())
    probabilities = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=4.0)
    )
    agrees(probabilities, [norm.sf(4.3), norm.sf(3 - 0.15**2)])
    np.testing.assert_allclose(probabilities["probability_at"][0, :, 0], [-1, 0.15], atol=0.06)


def test_each_time_has_bounds_of_its_own():
    """x + e g(t)/2 + (1 − (f − h(t))²)/2: the ends in e change sides, that in f moves."""
    g = np.sin(2 * np.pi * T)
    h = 0.8 * T - 0.4

    def response(e, f, x):
        hump = (1 - (f[:, None] - h) ** 2) / 2
        return over_time(x[:, None] + e[:, None] * g / 2 + hump)

    inputs = {"e": fb.Interval(-1, 1), "f": fb.Interval(-1, 1), "x": NORMAL}
    surrogate = fb.expand(response, inputs, fb.AdaptivePCCI())
    probabilities = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=3.5)
    ).isel(limit=0)
    slope = np.abs(g) / 2
    farthest = 1 + np.abs(h)
    exact = norm.sf([3.5 + slope - (1 - farthest**2) / 2, 3.5 - slope - 0.5])
    low = probabilities["at_each_time_low"].values
    high = probabilities["at_each_time_high"].values
    np.testing.assert_allclose(probabilities["at_each_time"], exact, rtol=0.25)
    assert np.mean((low < exact) & (exact < high)) > 0.85
    e, f = probabilities["at_each_time_at"].values
    side = np.abs(g) > 0.1
    np.testing.assert_array_equal(e[:, side], np.sign(g[side]) * np.array([[-1.0], [1.0]]))
    np.testing.assert_allclose(f[1], h, atol=0.1)
    assert np.all(f[0][np.abs(h) > 0.05] == -np.sign(h[np.abs(h) > 0.05]))
    assert "units" not in probabilities["at_each_time_at"].attrs


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_at_each_time_ends_are_in_order_and_no_sample_stands_alone(seed):
    """A Gaussian process of standard deviation s(t) around e g(t), from 1e-2 down to 1e-30."""
    size = 0.3 + 0.9 * np.sin(np.pi * T) ** 2
    g = 0.3 * np.cos(2 * np.pi * T)

    def response(e, a, b):
        wave = a[:, None] * np.cos(6 * T) + b[:, None] * np.sin(6 * T)
        return over_time(size * wave + e[:, None] * g)

    inputs = {"e": fb.Interval(-1, 1), "a": NORMAL, "b": NORMAL}
    surrogate = fb.expand(response, inputs, fb.AdaptivePCCI())
    probabilities = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=3.0), seed=seed
    ).isel(limit=0)
    exact = norm.sf((3.0 - np.abs(g) * np.array([[-1.0], [1.0]])) / size)
    value, low, high = (probabilities[f"at_each_time{k}"].values for k in ("", "_low", "_high"))
    for ends in (value, low, high):
        assert np.all(ends[0] <= ends[1])
    assert np.all((low <= value) & (value <= high))
    positive = value > 0
    assert 0.3 < np.mean(positive) < 1.0
    np.testing.assert_allclose(np.log(value[positive] / exact[positive]), 0.0, atol=1.2)
    assert np.mean(exact <= high) > 0.85  # samples are common to all times
    assert np.all(exact <= 1.5 * high)
    assert np.mean((low <= exact)[positive]) > 0.85


def test_a_probability_of_few_samples_is_only_bounded():
    """One sample of weight 1 tells as much as one event of Poisson's distribution: 5.57 at most."""
    count = 8000
    counts = np.array([1.0, 10.0, 100.0])
    value, low, high = clear(counts / count, np.sqrt(counts) / count, 1.0, 0.0)
    np.testing.assert_allclose(value * count, [0.0, 10.0, 100.0])
    assert high[0] * count == pytest.approx(5.572, rel=1e-3)
    assert low[0] == 0
    assert np.all(low[1:] < value[1:])


def four_bar(crank, coupler, rocker, ground):
    """The error [°] of a function generator, by the angle of its crank."""
    angle = np.linspace(95.5, 215.5, 61)
    g = np.deg2rad(angle)
    r1, r2, r3, r4 = (v[:, None] for v in (crank, coupler, rocker, ground))
    square = r4**2 + r1**2 - 2 * r1 * r4 * np.cos(g)
    rocker_angle = np.arccos((r2**2 - r3**2 - square) / (2 * r3 * np.sqrt(square)))
    psi = np.arctan2(-r1 * np.sin(g), r4 - r1 * np.cos(g)) + rocker_angle
    target = 76 + 60 * np.sin(0.75 * np.deg2rad(angle - 95.5))
    return xr.DataArray(np.rad2deg(psi) - target, {"angle": angle}, ("sample", "angle"))


def test_a_four_bar_leaves_its_structural_error():
    """Sampling of the formula gives 4.0e-2, 6.4e-3 and 7.0e-4."""
    lengths = {"crank": 53.0, "coupler": 122.0, "rocker": 66.5, "ground": 100.0}
    inputs = {name: fb.Normal(length, 0.1) for name, length in lengths.items()}
    surrogate = fb.expand(four_bar, inputs, fb.AdaptivePCCI(0.001))
    for limit, exact, tolerance in ((0.7, 4.0e-2, 0.05), (0.8, 6.4e-3, 0.05), (0.9, 7.0e-4, 0.1)):
        probabilities = fb.analysis.failure_probability(
            surrogate, fb.Requirement("response", below=limit, above=-limit), accuracy=0.015
        )
        assert float(probabilities["probability"][0, 0]) == pytest.approx(exact, rel=tolerance)


def test_several_limits_and_the_expected_error():
    """x and −x leave their limits in different samples; tanh is missed by its surrogate."""

    def response(x):
        y = np.stack([x, -x], 1)[:, :, None] * np.ones(3)
        return xr.DataArray(y, {"output": ["a", "b"]}, ("sample", "output", "time"))

    surrogate = fb.expand(response, {"x": NORMAL}, fb.AdaptivePCCI())
    limits = [fb.Requirement("a", below=3.0), fb.Requirement("b", below=3.5)]
    probabilities = fb.analysis.failure_probability(surrogate, limits)
    assert probabilities["limit"].values.tolist()[-1] == "any limit"
    exact = [norm.sf(3.0), norm.sf(3.5), norm.sf(3.0) + norm.sf(3.5)]
    np.testing.assert_allclose(probabilities["probability"][0], exact, rtol=0.08)

    inexact = fb.expand(
        lambda x: constant(np.tanh(2 * x)), {"x": NORMAL}, fb.AdaptivePCCI(0.05, 24)
    )
    probabilities = fb.analysis.failure_probability(inexact, fb.Requirement("response", below=0.8))
    looser, value, tighter = (
        float(probabilities[k][0, 0]) for k in ("limit_looser", "probability", "limit_tighter")
    )
    assert looser < value < tighter
    assert looser < norm.sf(np.arctanh(0.8) / 2) < tighter
    error = 4 * float(inexact.bands()["error_bar_expected_error"][0])
    tighter_limit = fb.analysis.failure_probability(
        inexact, fb.Requirement("response", below=0.8 - error)
    )
    assert tighter == pytest.approx(float(tighter_limit["probability"][0, 0]), rel=0.1)


def tolerances_and_chance(inputs):
    """Return a sum of intervals, which hardly scatters, and a sum that does, each (n,)."""
    e = [inputs[f"e{k}"] for k in range(5)]
    signs = (1, -1, 1, 1, -1), (1, 1, -1, 1, -1)
    of_corner, of_chance = (
        sum(s * value for s, value in zip(sign, e, strict=True)) for sign in signs
    )
    return of_corner + 1e-3 * inputs["c"], inputs["b"] + 0.04 * of_chance


FIVE = {f"e{k}": fb.Interval(-1.0, 1.0) for k in range(5)} | {"b": NORMAL, "c": NORMAL}


@pytest.mark.parametrize("seed", range(2))
def test_a_limit_that_one_corner_breaks_beside_one_that_chance_breaks(seed):
    """At another time of the same output: no rare sample of all inputs is in that corner."""

    def response(**inputs):
        of_corner, of_chance = tolerances_and_chance(inputs)
        zero = np.zeros_like(of_corner)
        y = np.stack([of_corner, zero, zero, zero, 2.5 * of_chance, zero, zero], axis=1)
        return xr.DataArray(y, {"time": np.arange(7.0)}, ("sample", "time"))

    surrogate = fb.expand(response, FIVE, fb.AdaptivePCCI())
    probabilities = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=4.9), seed=seed
    )
    assert probabilities["probability"].values[1, 0] == pytest.approx(1.0, abs=0.08)
    corner = probabilities["probability_at"].sel(bound="upper").values.ravel()
    np.testing.assert_array_equal(corner, [1.0, -1.0, 1.0, 1.0, -1.0])
    smallest = probabilities["probability"].values[0, 0]
    assert smallest == pytest.approx(norm.sf(4.9 / 2.5 + 0.04 * 5), rel=0.15)  # elsewhere


@pytest.mark.parametrize("seed", range(2))
def test_leaving_any_limit_is_as_likely_as_leaving_one_of_them(seed, monkeypatch):
    def response(**inputs):
        y = np.stack(tolerances_and_chance(inputs), axis=1)[:, :, None] * np.ones(3)
        return xr.DataArray(y, {"output": ["a", "b"]}, ("sample", "output", "time"))

    surrogate = fb.expand(response, FIVE, fb.AdaptivePCCI())
    limits = [fb.Requirement("a", below=4.9), fb.Requirement("b", below=1.8)]
    search_roughly(monkeypatch)
    probabilities = fb.analysis.failure_probability(surrogate, limits, seed=seed)
    for name in ("probability", "between_times", "at_each_time"):
        values = probabilities[name].fillna(0.0)
        assert np.all(values.isel(limit=2) >= values.isel(limit=[0, 1]).max("limit"))
    assert probabilities["confidence_high"].values[1, 2] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("seed", range(2))
def test_a_limit_that_is_left_for_certain_has_a_probability_of_one(seed):
    """Weights of samples that stay within the limits tell it exactly: there are none."""

    def response(e, x, y):
        values = np.stack([e + 1e-4 * x, 0.2 * e + y + 0.1 * x * y], axis=1)
        return xr.DataArray(values, {"output": ["a", "b"]}, ("sample", "output"))

    inputs = {"e": fb.Interval(-1, 1), "x": fb.Normal(0, 1), "y": fb.Normal(0, 1)}
    surrogate = fb.verify(fb.expand(response, inputs, fb.PCCI(2, 1)), response)
    limits = [fb.Requirement("a", below=0.99), fb.Requirement("b", below=4.8)]
    probabilities = fb.analysis.failure_probability(surrogate, limits, seed=seed)
    for name in ("probability", "confidence_low", "confidence_high", "limit_tighter"):
        np.testing.assert_allclose(probabilities[name].values[1, [0, 2]], 1.0, atol=1e-6)
    assert probabilities["probability"].sel(bound="upper").values[1] < 1e-4
    certain = fb.analysis.failure_probability(
        surrogate, fb.Requirement("a", below=-1.0001), seed=seed
    )["probability"]
    np.testing.assert_allclose(certain[:, 0], [norm.cdf(1.0), 1.0], rtol=0.05)


def test_choices_and_seeds():
    def response(x, kind):
        return constant(x * np.where(kind == "steel", 1.0, 1.5))

    inputs = {"x": NORMAL, "kind": fb.Choice("steel", "brass")}
    surrogate = fb.expand(response, inputs, fb.AdaptivePCCI())
    probabilities = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=3.0)
    )
    agrees(probabilities, [norm.sf(3.0), norm.sf(2.0)])
    assert probabilities["probability_choice"].values[:, 0].tolist() == ["steel", "brass"]
    xr.testing.assert_identical(
        probabilities,
        fb.analysis.failure_probability(surrogate, fb.Requirement("response", below=3.0)),
    )
    reseeded = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=3.0), seed=1
    )
    assert np.all(bounds(reseeded)[0] != bounds(probabilities)[0])


def curved(x, y):
    return constant(x + 0.1 * y + 0.15 * (y**2 - 1))


def beyond(limit):
    """Return the probability that `curved` exceeds a limit, by quadrature over y."""
    y = np.linspace(-10, 10, 4001)
    return np.trapezoid(norm.pdf(y) * norm.sf(limit - 0.1 * y - 0.15 * (y**2 - 1)), y)


def test_runs_correct_a_wrong_surrogate():
    """A linear surrogate of x + 0.1 y + 0.15 (y² − 1) finds a fifth of the probability.

    A response that jumps by one, faster than runs tell, leaves disagreements, which are counted.
    """
    plane = fb.expand(curved, {"x": NORMAL, "y": NORMAL}, fb.PCCI(1, 1))
    limit = fb.Requirement("response", below=4.75)
    exact = beyond(4.75)
    probabilities = fb.analysis.failure_probability(plane, limit, response=curved)
    agrees(probabilities, exact)
    assert float(probabilities["surrogate_probability"][0, 0]) < 0.25 * exact
    assert probabilities["runs"].values[0, 0] == 64
    assert "corrected with 80 runs of the model" in probabilities.attrs["verdict"]

    def torn(x):
        return constant(x + 0.5 * np.sign(np.sin(40 * x)))

    x = np.linspace(-8, 8, 1_000_001)
    line = fb.expand(torn, {"x": NORMAL}, fb.PCCI(1, 1))
    limit = fb.Requirement("response", below=2.5)
    exact = np.trapezoid(norm.pdf(x) * (torn(x)[:, 0] > 2.5), x)
    estimates = [
        fb.analysis.failure_probability(line, limit, response=torn, runs=32, seed=k)
        for k in range(18)
    ]
    value, low, high = np.array([bounds(estimate)[:, 0] for estimate in estimates]).T
    assert sum(estimate["disagreements"].values[0, 0] > 0 for estimate in estimates) > 4
    assert np.sum((low <= exact) & (exact <= high)) >= 17
    assert abs(value.mean() - exact) < 3 * value.std() / np.sqrt(18)
    assert np.all(high - low > 0.02 * exact)  # not a bare number where nothing disagreed


def test_runs_correct_at_intervals_and_choices(tmp_path):
    calls = []

    def response(e, x, y, kind):
        calls.append(len(x))
        return curved(x, y) * np.where(kind == "steel", 1.0, 1.2)[:, None] + 0.3 * e[:, None]

    inputs = {"e": fb.Interval(-1, 1), "kind": fb.Choice("steel", "brass"), "x": NORMAL}
    surrogate = fb.expand(response, inputs | {"y": NORMAL}, fb.PCCI(1, 1))
    options = {"response": response, "runs": 32, "accuracy": 0.05, "store": tmp_path / "runs"}
    calls.clear()
    reports = []
    limit = fb.Requirement("response", below=4.0)
    probabilities = fb.analysis.failure_probability(
        surrogate, limit, progress=lambda *k: reports.append(k), **options
    )
    agrees(probabilities, [beyond(4.3), beyond(3.7 / 1.2)], 0.15)
    assert probabilities["probability_choice"].values[:, 0].tolist() == ["steel", "brass"]
    assert sum(calls) >= 120  # a sample may be drawn twice
    assert reports[-1] == (144, 144)
    calls.clear()
    xr.testing.assert_identical(
        probabilities, fb.analysis.failure_probability(surrogate, limit, **options)
    )
    assert sum(calls) <= 4  # the others are in the store


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"accuracy": 0.0}, "accuracy must be from 0.002 to 0.5"),
        ({"accuracy": np.nan}, "accuracy must be"),
        ({"seed": -1}, "seed must be"),
        ({"requirements": []}, "requirements must be a Requirement"),
        (
            {
                "requirements": [
                    fb.Requirement("response", below=-1.0),
                    fb.Requirement("response", above=1.0),
                ]
            },
            "something between",
        ),
        ({"surrogate": "x"}, "surrogate must be"),
        ({"response": "x"}, "response must be"),
        ({"response": lambda y: y}, "does not take|response needs"),
        ({"response": constant_of_x, "runs": 8}, "runs must be"),
        ({"response": lambda x: constant(x)[:, :2]}, "must return"),
    ],
)
def test_refused_by_name(options, message):
    surrogate = fb.expand(constant_of_x, {"x": NORMAL}, fb.PCCI(1, 1))
    with pytest.raises(fb.errors.InputError, match=message):
        fb.analysis.failure_probability(
            **{"surrogate": surrogate, "requirements": fb.Requirement("response", below=1.0)}
            | options
        )


def test_intervals_alone_have_no_probability():
    surrogate = fb.expand(constant_of_x, {"x": fb.Interval(0, 1)}, fb.PCCI(1, 1))
    with pytest.raises(fb.errors.InputError, match="must have random inputs"):
        fb.analysis.failure_probability(surrogate, fb.Requirement("response", below=0.5))


@pytest.mark.parametrize("seed", [2, 3])
def test_the_interval_of_a_largest_probability_inside_the_box_holds_it(seed):
    """The maximum of c over the box decides; a search with few samples is 10 % below it."""

    def response(x, y, e, g):
        return (-2.54 * ((e - 0.61) ** 2 + (g + 0.38) ** 2) + 0.24 * e + 0.62 * x + 0.3 * y)[
            :, None
        ]

    intervals = {"e": fb.Interval(-1, 1), "g": fb.Interval(-1, 1)}
    inputs = {"x": NORMAL, "y": NORMAL} | intervals
    surrogate = fb.verify(fb.expand(response, inputs, fb.PCCI(1, 2)), response)
    limit = fb.Requirement("response", below=2.2805194)
    exact = norm.sf((2.2805194 - 0.24 * 0.61 - 0.12**2 / 2.54) / np.hypot(0.62, 0.3))
    probabilities = fb.analysis.failure_probability(surrogate, limit, seed=seed)
    value, low, high = bounds(probabilities)[:, 1]
    assert low <= exact <= high
    assert high < 1.12 * low
    assert value == pytest.approx(exact, rel=0.05)
    narrow = surrogate.narrowed(e=fb.Interval(0.3, 0.9))
    narrower = bounds(fb.analysis.failure_probability(narrow, limit, seed=seed))[:, 1]
    assert narrower[0] <= high
    assert narrower[1] <= exact <= narrower[2]


@pytest.mark.parametrize("seed", range(4))
def test_corners_are_named_by_common_samples_where_the_probability_hardly_changes(seed):
    def response(e, x):
        return constant(x + 2e-3 * e)

    surrogate = fb.expand(response, {"e": fb.Interval(-1, 1), "x": NORMAL}, fb.PCCI(1, 1))
    probabilities = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=3.0), seed=seed
    )
    np.testing.assert_array_equal(probabilities["probability_at"].values.ravel(), [-1.0, 1.0])
    assert probabilities["probability"].values[0, 0] <= probabilities["probability"].values[1, 0]


def test_no_probability_of_a_surrogate_that_missed_its_tolerance():
    """Unless runs of the model correct it; tables and charts have no number either."""

    def response(x):
        return constant(np.tanh(2 * x))

    surrogate = fb.expand(response, {"x": NORMAL}, fb.AdaptivePCCI(1e-4, 12))
    assert surrogate.diagnostics.attrs["expected_error"] > 1e-4
    limit = fb.Requirement("response", below=0.8)
    probabilities = fb.analysis.failure_probability(surrogate, limit)
    names = ("probability", "confidence_high", "between_times", "limit_tighter", "at_each_time")
    assert all(np.isnan(probabilities[name]).all() for name in names)
    assert "not given" in probabilities.attrs["verdict"]
    assert (
        limits_table(fb.analysis.check_requirements(surrogate, limit), probabilities)[1][0][-2:]
        == ["not given"] * 2
    )
    assert not is_likely(probabilities)
    by_runs = fb.analysis.failure_probability(surrogate, limit, response=response)
    agrees(by_runs, norm.sf(np.arctanh(0.8) / 2), 0.15)
    assert np.isnan(by_runs["at_each_time"]).all()
    assert "corrected with 80 runs of the model" in by_runs.attrs["verdict"]
