"""Runs of a store that serve studies with other intervals."""

import numpy as np
import pytest

import flexband as fb

WIDE = {"a": fb.Interval(1, 2), "b": fb.Normal(0, 1), "c": fb.Interval(0, 1)}
NARROW = {**WIDE, "a": fb.Interval(1.1, 1.8)}


class Response:
    """A smooth function that counts its runs."""

    def __init__(self):
        self.runs = 0

    def __call__(self, a, b, c):
        self.runs += len(a)
        return np.stack([np.exp(a) * np.sin(c) + 0.1 * b**2 * c, a + b * c], axis=1)


def study(folder, inputs, method):
    response = Response()
    bands = fb.propagate(response, inputs, method, store=folder)
    return bands, response.runs


@pytest.fixture
def folder(tmp_path):
    study(tmp_path / "study", WIDE, fb.AdaptivePCCI())
    return tmp_path / "study"


@pytest.mark.parametrize("method", [fb.AdaptivePCCI(), fb.methods.RegressionPCCI(3)])
def test_narrower_intervals_use_runs_inside_them(folder, method):
    exact = fb.propagate(Response(), NARROW, fb.methods.SobolScanning(1024, 9))
    bands, runs = study(folder, NARROW, method)
    reuse_count = bands.attrs["runs_reused"]
    assert reuse_count > 0
    assert bands.attrs["runs"] == runs + reuse_count
    width = exact["error_bar"][1] - exact["error_bar"][0]
    for variable in ("mean", "error_bar"):
        error = abs(bands[variable] - exact[variable]).mean("bound")
        assert (error <= 5 * bands["error_bar_expected_error"] + 0.002 * width).all()


def test_reused_runs_are_generic_and_inside(folder):
    study(folder, WIDE, fb.LHSScanning(5, 3))  # a grid, none of whose points is generic
    earlier_runs = []

    class Method(fb.methods.RegressionPCCI):
        def expand(self, space, evaluate):
            earlier_runs.append(evaluate.earlier_runs(1000))
            return super().expand(space, evaluate)

    study(folder, NARROW, Method(2))
    xi, eta, values, _ = earlier_runs[0]
    assert len(xi) > 0
    assert (abs(eta) <= 1).all()
    for column in (*xi.T, *eta.T):
        assert len(np.unique(column)) == len(column)
    a = 1.45 + 0.35 * eta[:, 0]
    c = 0.5 + 0.5 * eta[:, 1]
    np.testing.assert_allclose(values, Response()(a, xi[:, 0], c), rtol=1e-12)


def test_the_same_intervals_or_other_random_inputs_reuse_no_other_runs(folder):
    bands, runs = study(folder, WIDE, fb.AdaptivePCCI())
    assert runs == 2  # made again to confirm the store
    assert "runs_reused" not in bands.attrs
    bands, _ = study(folder, {**NARROW, "b": fb.Normal(0, 0.5)}, fb.AdaptivePCCI())
    assert "runs_reused" not in bands.attrs


def test_a_study_that_reuses_runs_gives_the_same_when_it_is_resumed(folder):
    first, _ = study(folder, NARROW, fb.AdaptivePCCI())
    second, runs = study(folder, NARROW, fb.AdaptivePCCI())
    assert runs == 2
    assert first.drop_attrs().identical(second.drop_attrs())


def test_domains_of_fields_are_found_once(tmp_path):
    calls = []

    def response(k):
        calls.append(1)
        return k(np.linspace(0.0, 2.0, 5)).sum(axis=1)

    inputs = {"k": fb.RandomField(mean=1.0, std=0.1, correlation_length=1.0, terms=2)}
    first = fb.propagate(response, inputs, fb.PCCI(1, 0), store=tmp_path)
    calls.clear()
    second = fb.propagate(response, inputs, fb.PCCI(1, 0), store=tmp_path)
    assert len(calls) == 1  # the two runs that are made again
    assert first.drop_attrs().identical(second.drop_attrs())
    before = (tmp_path / "domains.json").read_bytes()
    with pytest.raises(fb.errors.StoreError, match="another response"):
        fb.propagate(lambda k: 2 * k(np.linspace(0.0, 3.0, 5)).sum(axis=1), inputs, fb.PCCI(1, 0),
                     store=tmp_path)  # fmt: skip
    assert (tmp_path / "domains.json").read_bytes() == before
