"""Responses that mix their samples, or are not reproducible, are recognized by one run more."""

import numpy as np
import pytest

import flexband as fb

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
    with pytest.raises(fb.InputError, match="must not depend on the others of its batch; alone"):
        fb.propagate(lambda x, e: mixed(smooth(x, e)), INPUTS, method)


def noisy(size):
    rng = np.random.default_rng(0)
    return lambda x, e: smooth(x, e) + size * rng.standard_normal((len(x), len(TIMES)))


def test_noise_is_refused_by_expansions_and_remarked_by_samples():
    for method in METHODS[:2]:
        with pytest.raises(fb.InputError, match="other values if the same inputs are run again"):
            fb.propagate(noisy(0.3), INPUTS, method)
        with pytest.warns(fb.FlexbandWarning, match="the same inputs are run again: it differs by"):
            fb.propagate(noisy(1e-4), INPUTS, method)
    with pytest.warns(fb.FlexbandWarning, match="the same inputs are run again"):
        fb.propagate(noisy(0.3), INPUTS, METHODS[2])


def test_a_state_between_calls_is_noticed():
    calls = []

    def response(x, e):
        calls.append(len(x))
        return smooth(x, e) * len(calls)

    with pytest.raises(fb.InputError, match="does it keep a state between calls"):
        fb.propagate(response, INPUTS, fb.PCCI(1, 1))


def test_rounding_is_not_taken_for_neighbours():
    with pytest.raises(fb.InputError, match="or is it chaotic, so that rounding matters"):
        fb.propagate(lambda x, e: logistic(x, e, turn=1), INPUTS, fb.PCCI(1, 1))
    with pytest.warns(fb.FlexbandWarning, match="the place of a sample in its batch changes"):
        fb.propagate(lambda x, e: logistic(x, e, turn=1), INPUTS, fb.LHSScanning(5, 3))


def test_samples_that_know_their_number_are_refused():
    for wrong in (lambda F: F + np.arange(len(F))[:, None], lambda F: F + 0.1 * len(F)):
        with pytest.raises(fb.InputError, match="place of a sample in its batch"):
            fb.propagate(lambda x, e, w=wrong: w(smooth(x, e)), INPUTS, fb.AdaptivePCCI())


def test_the_run_is_counted():
    bands = fb.propagate(smooth, INPUTS, fb.PCCI(2, 1))
    assert (bands.attrs["runs"], bands.attrs["runs_repeated"]) == (7, 1)
    one = fb.propagate(smooth, INPUTS, fb.PCCI(0, 0))
    assert (one.attrs["runs"], one.attrs["runs_repeated"]) == (2, 1)


@pytest.mark.parametrize("method", [fb.PCCI(2, 7), fb.AdaptivePCCI(1e-9, max_runs=24)], ids=repr)
def test_the_count_of_a_resumed_study_is_that_of_one_that_was_not_stopped(method, tmp_path):
    left = [10]

    def stopped(x, e):
        left[0] -= len(x)
        if left[0] < 0:
            raise KeyboardInterrupt
        return smooth(x, e)

    def counts(**options):
        attrs = fb.propagate(stopped, INPUTS, method, batch=4, **options).attrs
        return attrs["runs"], attrs["runs_repeated"]

    for allowed in (10, 12):
        left[0] = allowed
        with pytest.raises(KeyboardInterrupt):
            counts(store=tmp_path)
    left[0] = 1000
    assert counts(store=tmp_path) == counts(store=tmp_path) == counts() == (25, 1)
