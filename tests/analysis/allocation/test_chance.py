"""Tolerances for a stated probability of violating limits: closed forms and fresh samples."""

import numpy as np
import pytest
import xarray as xr
from scipy.special import ndtri

import flexband as fb

TIME = np.linspace(0.0, 2 * np.pi, 31)


def linear(a, b):
    """Return 3 a − 2 b at one time, and half of that at another."""
    y = (3 * a - 2 * b)[:, None] * np.array([0.5, 1.0])
    return xr.DataArray(y, {"time": [0.0, 1.0]}, ("sample", "time"))


def circle(a, b):
    """Return a cos t + b sin t."""
    y = a[:, None] * np.cos(TIME) + b[:, None] * np.sin(TIME)
    return xr.DataArray(y, {"time": TIME}, ("sample", "time"))


def bent(a, b):
    """Return a cubic function, of which linear surrogates miss much."""
    return (a + b + 0.15 * (4 * a**2 - 1) * a)[:, None]


@pytest.fixture(scope="module")
def plane():
    surrogate = fb.expand(linear, dict.fromkeys("ab", fb.Normal(0.0, 1.0)), fb.PCCI(2, 1))
    return fb.verify(surrogate, linear)


@pytest.mark.parametrize("probability", [1e-2, 1e-5])
def test_one_linear_limit_has_a_closed_form(plane, probability):
    # k √(9 s² + 4 r²) ≤ L with k = −Φ⁻¹(P) and the cost 1/s + 1/r: J² s³ is the same for both
    allocation = fb.analysis.allocate(
        plane, fb.Requirement("response", above=-0.6), {"a": 1.0, "b": 1.0}, probability=probability
    )
    shape = np.array([9.0, 4.0]) ** (-1 / 3)
    std = shape * 0.6 / -ndtri(probability) / np.sqrt(9 * shape[0] ** 2 + 4 * shape[1] ** 2)
    assert allocation["tolerance"].values == pytest.approx(std, rel=0.03)
    assert 1.0 <= allocation.attrs["cost"] / (1 / std).sum() < 1.015
    assert (
        0.85 * probability
        < allocation["probability"]
        <= allocation["confidence_high"]
        <= probability
    )
    assert allocation["at_each_time"].values[0] < 1e-5  # −0.3 instead of −0.6
    assert allocation.attrs["confirmed"] == "no runs were made"
    # ∂ ln P/∂ ln s = k² (J s)² L⁻² k … of the normal tail: its sum is k φ(k)/P
    k = -ndtri(float(allocation["probability"]))
    tail = k * np.exp(-(k**2) / 2) / np.sqrt(2 * np.pi) / float(allocation["probability"])
    assert allocation["elasticity"].sum() == pytest.approx(tail, rel=0.1)


def test_the_worst_of_the_intervals():
    # 3 k s + 2 t ≤ L with the cost 1/s + 2/t, at the lower end of b
    inputs = {"a": fb.Normal(0.0, 1.0), "b": fb.Interval(-1.0, 1.0)}
    surrogate = fb.expand(linear, inputs, fb.PCCI(1, 1))
    costs = {"a": 1.0, "b": 2.0}
    allocation = fb.analysis.allocate(
        surrogate, fb.Requirement("response", below=1.0), costs, probability=1e-3, response=linear
    )
    slope = np.array([-3 * ndtri(1e-3), 2.0])
    cost = np.array([1.0, 2.0])
    t = np.sqrt(cost / slope)
    t /= slope @ t
    assert allocation["tolerance"].values == pytest.approx(t, rel=0.02)
    assert allocation["probability_at"].item() == pytest.approx(-t[1], rel=0.02)
    assert allocation.attrs["confirmed"] == "yes"
    assert allocation["run_probability"] <= 1e-3
    assert allocation.attrs["runs"] == 80


def test_first_passage_and_not_each_time():
    # the largest of a cos t + b sin t is Rayleigh distributed: P = exp(−L²/2σ²)
    surrogate = fb.expand(circle, dict.fromkeys("ab", fb.Normal(0.0, 1.0)), fb.PCCI(1, 1))
    allocation = fb.analysis.allocate(
        surrogate, fb.Requirement("response", below=1.0), {"a": 1.0, "b": 1.0}, probability=1e-3
    )
    assert allocation["tolerance"].values == pytest.approx(1 / np.sqrt(-2 * np.log(1e-3)), rel=0.02)
    assert allocation["at_each_time"].max() < 5e-4


def test_runs_correct_the_probability():
    surrogate = fb.expand(bent, dict.fromkeys("ab", fb.Normal(0.0, 0.5)), fb.PCCI(1, 1))
    limit = fb.Requirement("response", below=1.6)
    costs = {"a": 1.0, "b": 1.0}
    uncorrected = fb.analysis.allocate(surrogate, limit, costs, probability=1e-3)
    allocation = fb.analysis.allocate(surrogate, limit, costs, probability=1e-3, response=bent)
    z = np.random.default_rng(3).standard_normal((2, 400_000))
    failure_shares = [
        float(np.mean(bent(*(z * result["tolerance"].values[:, None])) > 1.6))
        for result in (uncorrected, allocation)
    ]
    assert failure_shares[0] > 3e-3
    assert failure_shares[1] == pytest.approx(0.9e-3, rel=0.4)
    assert allocation.attrs["confirmed"] == "yes"
    assert allocation["run_probability"] <= 1e-3


def arc(a, b):
    """Return an angle that is always below π/2, though its expansions are not."""
    return (np.arctan(0.4 * a) + 0.1 * b)[:, None]


@pytest.fixture(scope="module")
def angle():
    return fb.expand(arc, dict.fromkeys("ab", fb.Normal(0.0, 1.0)), fb.AdaptivePCCI(0.01))


def test_rare_probabilities_of_an_inexact_surrogate_are_bounded(angle):
    limit = fb.Requirement("response", below=1.0)
    costs = {"a": 1.0, "b": 1.0}
    allocation = fb.analysis.allocate(angle, limit, costs, probability=2e-5)
    assert (allocation["probability"], allocation["confidence_low"]) == (0.0, 0.0)
    assert allocation["confidence_high"] >= 1e-4
    assert 1e-5 < allocation["surrogate_probability"] < 2e-5
    assert np.isnan(allocation["at_each_time"]).all()
    assert "probability below 0.0001; the surrogate alone finds" in allocation.attrs["verdict"]
    by_runs = fb.analysis.allocate(angle, limit, costs, probability=2e-5, response=arc)
    assert 0.0 < by_runs["run_probability"] <= 2e-5
    assert "Confirmed" in by_runs.attrs["verdict"]


def test_the_interval_allows_for_the_error_of_the_surrogate(angle):
    limit = fb.Requirement("response", below=0.6)
    costs = {"a": 1.0, "b": 1.0}
    allocation = fb.analysis.allocate(angle, limit, costs, probability=1e-2)
    tolerances = {k: fb.Normal(0.0, float(allocation["tolerance"].sel(name=k))) for k in "ab"}
    probabilities = fb.analysis.failure_probability(
        angle.narrowed(**tolerances), limit, accuracy=0.02
    )
    intervals = [[float(np.ravel(result[k])[-1]) for k in ("confidence_low", "confidence_high")]
              for result in (allocation, probabilities)]  # fmt: skip
    assert intervals[0] == pytest.approx(intervals[1], rel=0.1)
    assert allocation["confidence_high"] > 1e-2
    assert (
        "runs of the model (response=…) tell whether it is above 0.01"
        in allocation.attrs["verdict"]
    )


def test_no_probability_of_a_surrogate_that_missed_its_tolerance():
    def step(a, b):
        return (np.tanh(2 * a) + b)[:, None]

    inputs = dict.fromkeys("ab", fb.Normal(0.0, 1.0))
    surrogate = fb.expand(step, inputs, fb.AdaptivePCCI(1e-4, 20))
    limit = fb.Requirement("response", below=2.0)
    costs = {"a": 1.0, "b": 1.0}
    names = "probability", "confidence_low", "confidence_high", "at_each_time"
    allocation = fb.analysis.allocate(surrogate, limit, costs, probability=1e-2)
    assert all(np.isnan(allocation[name]).all() for name in (*names, "surrogate_probability"))
    assert "not given by the surrogate, which missed its tolerance" in allocation.attrs["verdict"]
    assert "above the tolerance of 0.01 %" in allocation.attrs["verdict"]
    by_runs = fb.analysis.allocate(surrogate, limit, costs, probability=1e-2, response=step)
    assert all(np.isnan(by_runs[name]).all() for name in names)
    a, b = np.random.default_rng(5).standard_normal((2, 400_000))
    s = by_runs["tolerance"].values
    exact = float(np.mean(step(s[0] * a, s[1] * b) > 2.0))
    assert by_runs["run_probability"] == pytest.approx(exact, rel=0.3)
    narrow = surrogate.narrowed(a=fb.Normal(0.0, 0.5))  # nor of a part of it
    assert np.isnan(fb.analysis.failure_probability(narrow, limit)["probability"]).all()


def test_the_largest_scatter_is_likely_enough(plane):
    allocation = fb.analysis.allocate(
        plane, fb.Requirement("response", below=20.0), {"a": 1.0, "b": 1.0}, probability=0.01
    )
    assert allocation["tolerance"].values.tolist() == [1.0, 1.0]


def test_sizes_and_scatter_for_a_probability():
    # μ = p(a), σ = s: p(a) + k s ≤ 1, with the least p
    def valleys(a, b):
        return (a**4 - 0.5 * a**3 - a**2 + 0.2 * a + 1 + b)[:, None]

    inputs = {"a": fb.Sizing(-1.0, 1.0), "b": fb.Normal(0.0, 1.0)}
    surrogate = fb.expand(valleys, inputs, fb.PCCI(1, 4))
    allocation = fb.analysis.allocate(
        surrogate, fb.Requirement("response", below=1.0), {"b": 1.0}, probability=1e-3
    )
    p = valleys(np.linspace(-1, 1, 20001), 0.0).min()
    assert allocation["tolerance"].item() == pytest.approx((1 - p) / -ndtri(1e-3), rel=0.02)


@pytest.mark.parametrize(
    ("probability", "message"),
    [(0.0, "from 1e-08 to 0.3"), (0.5, "from 1e-08 to 0.3"), ("x", "probability")],
)
def test_refused_probabilities(plane, probability, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.analysis.allocate(
            plane, fb.Requirement("response", below=1.0), {"a": 1.0}, probability=probability
        )


def test_what_a_probability_does_not_go_with(plane):
    limit = fb.Requirement("response", below=1.0)
    inputs = {"a": fb.Interval(-1, 1), "b": fb.Interval(-1, 1)}
    with pytest.raises(fb.errors.InputError, match="needs an input that is random"):
        fb.analysis.allocate(
            fb.expand(linear, inputs, fb.PCCI(1, 1)), limit, {"a": 1.0}, probability=0.01
        )
    inputs = {"a": fb.Normal(0, 1), "b": fb.Compensator(-1, 1)}
    with pytest.raises(fb.errors.InputError, match="where an input is a Compensator"):
        fb.analysis.allocate(
            fb.expand(linear, inputs, fb.PCCI(1, 1)), limit, {"a": 1.0}, probability=0.01
        )
    grades = {"a": fb.analysis.Grades({"fine": (0.1, 1.0)})}
    with pytest.raises(fb.errors.InputError, match="cannot be stated for Grades"):
        fb.analysis.allocate(plane, limit, grades, probability=0.01)
    with pytest.raises(fb.errors.InputError, match="cannot be met"):
        fb.analysis.allocate(
            plane, fb.Requirement("response", below=-1.0), {"a": 1.0}, probability=0.01
        )
