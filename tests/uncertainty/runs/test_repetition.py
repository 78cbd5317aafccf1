"""Responses that mix their samples, or are not reproducible, are recognized by one run more."""

import warnings

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from benchmarks.numerics.ordinary import refusals
from flexband.report.text.band_tables import constants

INPUTS = {"x": fb.Normal(1.0, 0.2), "e": fb.Interval(1.0, 2.0)}
TIMES = np.linspace(0.0, 1.0, 5)
METHODS = [fb.AdaptivePCCI(), fb.PCCI(2, 2), fb.LHSScanning(5, 3)]


def smooth(x, e):
    return np.exp(x)[:, None] * np.cos(e[:, None] * TIMES)


def logistic(x, e, turn=0):
    """A hundred steps of a chaotic map; the last digits depend on the place in the batch."""
    y = np.full(len(x), 0.3) + 1e-16 * np.arange(len(x)) * turn
    for _ in range(100):
        y = (3.9 + 0.01 * x) * y * (1 - y)
    return (10 * x + e + y)[:, None] * np.ones(2)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "mixed",
    [
        lambda F: F - F.mean(axis=0),
        lambda F: F / np.abs(F).max(axis=0),
        lambda F: F.cumsum(axis=0),
    ],
)
def test_samples_that_change_each_other_are_refused(mixed, method):
    with pytest.raises(
        fb.errors.InputError, match="must not depend on the others of its batch; alone"
    ):
        fb.propagate(lambda x, e: mixed(smooth(x, e)), INPUTS, method)


def noisy(size):
    rng = np.random.default_rng(0)
    return lambda x, e: smooth(x, e) + size * rng.standard_normal((len(x), len(TIMES)))


def test_noise_is_refused_by_expansions_and_remarked_by_samples():
    for method in METHODS[:2]:
        with pytest.raises(
            fb.errors.InputError, match="other values if the same inputs are run again"
        ):
            fb.propagate(noisy(0.3), INPUTS, method)
        with pytest.warns(
            fb.errors.FlexbandWarning, match="are run again: the response differs by"
        ):
            fb.propagate(noisy(1e-4), INPUTS, method)
    with pytest.warns(fb.errors.FlexbandWarning, match="the same inputs are run again"):
        fb.propagate(noisy(0.3), INPUTS, METHODS[2])


def test_a_state_between_calls_is_noticed():
    calls = []

    def response(x, e):
        calls.append(len(x))
        return smooth(x, e) * len(calls)

    with pytest.raises(fb.errors.InputError, match="does it keep a state between calls"):
        fb.propagate(response, INPUTS, fb.PCCI(1, 1))


def test_rounding_is_not_taken_for_neighbours():
    with pytest.raises(fb.errors.InputError, match="or is it chaotic, so that rounding matters"):
        fb.propagate(lambda x, e: logistic(x, e, turn=1), INPUTS, fb.PCCI(1, 1))
    with pytest.warns(
        fb.errors.FlexbandWarning, match="the place of a sample in its batch changes"
    ):
        fb.propagate(lambda x, e: logistic(x, e, turn=1), INPUTS, fb.LHSScanning(5, 3))


def test_samples_that_know_their_number_are_refused():
    for wrong in (lambda F: F + np.arange(len(F))[:, None], lambda F: F + 0.1 * len(F)):
        with pytest.raises(fb.errors.InputError, match="place of a sample in its batch"):
            fb.propagate(lambda x, e, w=wrong: w(smooth(x, e)), INPUTS, fb.AdaptivePCCI())


def test_the_run_is_counted():
    bands = fb.propagate(smooth, INPUTS, fb.PCCI(2, 1))
    assert (bands.attrs["runs"], bands.attrs["runs_repeated"]) == (7, 1)
    constant = fb.propagate(smooth, INPUTS, fb.PCCI(0, 0))
    assert (constant.attrs["runs"], constant.attrs["runs_repeated"]) == (2, 1)


@pytest.mark.parametrize("method", [fb.PCCI(2, 7), fb.AdaptivePCCI(1e-9, max_runs=24)], ids=repr)
def test_the_count_of_a_resumed_study_is_that_of_one_that_was_not_stopped(method, tmp_path):
    remaining = [10]

    def stopping(x, e):
        remaining[0] -= len(x)
        if remaining[0] < 0:
            raise KeyboardInterrupt
        return smooth(x, e)

    def counts(**options):
        attrs = fb.propagate(stopping, INPUTS, method, batch=4, **options).attrs
        return attrs["runs"], attrs["runs_repeated"]

    for budget in (10, 12):
        remaining[0] = budget
        with pytest.raises(KeyboardInterrupt):
            counts(store=tmp_path)
    remaining[0] = 1000
    assert counts(store=tmp_path) == counts(store=tmp_path) == counts() == (25, 1)


STEEL = {"height": 0.02, "width": 0.02, "density": 7800.0}


def slider_crank(crank, speed):
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=crank, **STEEL),
            "rod": fb.RigidBody.bar(length=0.5, start=(crank, 0.0), **STEEL),
            "slider": fb.RigidBody(mass=5.0, inertia=0.01, position=(crank + 0.5, 0.0)),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("rod.start", "crank.end"),
            "C": fb.Revolute("slider", "rod.end"),
            "guide": fb.Prismatic("slider", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: speed * t),
        },
        sensors={"x": fb.Position("slider")},
    )


def test_a_height_that_is_rounding_is_constant():
    """The slider is at r cos φ + √(l² − r² sin² φ) and at height zero."""
    inputs = {"crank": fb.Interval(0.19, 0.21), "speed": fb.Normal(14.0, 0.3)}
    response = fb.dynamic_response(slider_crank, duration=0.5, step=4e-3)
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI())
    assert constants(bands) == ["x_Y"]
    assert bands["trusted"].values.all()
    z, weights = np.polynomial.hermite_e.hermegauss(40)
    phase = (14 + 0.3 * z) * bands["time"].values[:, None]
    r = np.linspace(0.19, 0.21, 41)[:, None, None]
    mean = (r * np.cos(phase) + np.sqrt(0.25 - (r * np.sin(phase)) ** 2)) @ (
        weights / weights.sum()
    )
    bounds = bands["mean"].sel(output="x_X")
    np.testing.assert_allclose(bounds, [mean.min(axis=0), mean.max(axis=0)], atol=2e-5)


@pytest.mark.parametrize("seed", [1, 4, 6])
def test_ordinary_mechanisms_are_not_refused(seed):
    """A quick return, gears at constant speed and an elastic crank, with sensors that are zero."""
    with warnings.catch_warnings(action="ignore"):
        assert list(refusals(seed)) == []


def beside_large(small):
    """Return a response with an output of the same unit that is 10⁶ times as large."""

    def response(x, e):
        F = smooth(x, e)
        labels = {"output": ["large", "small"], "unit": ("output", ["m", "m"]), "time": TIMES}
        return xr.DataArray(
            np.stack([1e6 * F, small(F)], axis=1), labels, ("sample", "output", "time")
        )

    return response


def test_an_output_beside_a_much_larger_one_is_still_judged():
    """By its own variation, down to 10⁻⁶ of the largest output of its unit."""
    rng = np.random.default_rng(0)
    with pytest.raises(fb.errors.InputError, match="alone, small of one of the samples"):
        fb.propagate(beside_large(lambda F: F - F.mean(axis=0)), INPUTS, fb.PCCI(2, 2))
    noise = beside_large(lambda F: F + 1e-3 * F.std() * rng.standard_normal(F.shape))
    with pytest.warns(fb.errors.FlexbandWarning, match="are run again: small differs by 0.1"):
        fb.propagate(noise, INPUTS, fb.PCCI(2, 2))
    bands = fb.propagate(beside_large(lambda F: F.mean() < F), INPUTS, fb.AdaptivePCCI())
    assert constants(bands) == []
    assert bands["relative_expected_error"].sel(output="small") > 0.05
