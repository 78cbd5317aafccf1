"""Verification: new runs confirm expected errors that are right, and find those that are not."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq
from scipy.special import chdtr

import flexband as fb
from benchmarks.honesty.verification_kinks import hides_error, judge_response
from flexband.analysis.verification import verify as verification
from flexband.report.text.band_tables import remarks
from flexband.uncertainty.adaptive.response_runs import RareRuns, ResponseRuns
from flexband.uncertainty.expansions.direct import DirectExpansion
from flexband.uncertainty.inputs.sampling import latin_hypercube_normals, stretch_samples
from flexband.uncertainty.phase_resolved import method
from flexband.uncertainty.surrogates.surrogate import Surrogate

TIMES = np.linspace(0.0, 2.0, 41)
INPUTS = {"e": fb.Interval(-1.0, 1.0), "f": fb.Interval(1.0, 2.0), "x": fb.Normal(5.0, 0.5)}


def response(e, f, x):
    """Twenty outputs of different frequencies; none is a polynomial."""
    e, f, x = (v[:, None, None] for v in (e, f, x))
    k = np.arange(1, 21)[:, None] / 20
    values = np.sin(k * f * TIMES + e) * np.exp(0.3 * x) + np.tanh(e + x - 5)
    return xr.DataArray(
        values,
        dims=("sample", "output", "time"),
        coords={"output": [f"u{j}" for j in range(20)], "time": ("time", TIMES, {"units": "s"})},
    )


def later(e, f, x):
    """The same, but for an output that differs near an end of an interval from 1 s on."""
    F = response(e, f, x)
    F.values[:, 7, TIMES >= 1] += 5.0 * (e > 0.9)[:, None]
    return F


@pytest.fixture(scope="module")
def surrogate():
    return fb.expand(response, INPUTS, fb.AdaptivePCCI(0.01, phase_resolved=False))


def test_right_expected_errors_are_confirmed_by_few_runs(surrogate):
    calls = []

    def counting(e, f, x):
        calls.append(len(e))
        return response(e, f, x)

    verdicts = [fb.verify(surrogate, counting, seed=seed).verification.attrs for seed in range(25)]
    assert sum(record["confirmed"] != "yes" for record in verdicts) <= 1
    assert calls == [16] * 25
    opening = "Estimate confirmed: 16 verification runs, 12 of them at the ends of"
    assert verdicts[0]["verdict"].startswith(opening)
    five_runs = fb.verify(surrogate, response, runs=5, sigmas=3).verification
    assert (five_runs.attrs["runs"], five_runs.attrs["sigmas"]) == (5, 3)


def test_verdicts_agree_with_their_numbers(surrogate):
    """Where an error above the expected one is confirmed, the least one with confidence is told."""
    diagnostics = surrogate.diagnostics
    words = set()
    for share in (0.1, 0.4, 0.6, 0.8, 1.0, 1.5):
        estimates = diagnostics.assign(
            error_bar_expansion_error=diagnostics["error_bar_expansion_error"] * share
        )
        for seed in range(6):
            comparison = fb.verify(
                replace(surrogate, diagnostics=estimates), response, runs=8, seed=seed
            ).verification
            text, sentence = comparison.attrs["verdict"].rsplit(". ", 1)
            assert re.fullmatch("An effect .* of the input space can go unnoticed", sentence)
            percents = [
                float(percent) for percent in re.findall(r"([\d.e-]+) % (?:of|or|is)", text)
            ]
            words.add(text.split(":")[0])
            if text.startswith("Estimate confirmed:"):
                largest = float((comparison["implied_error"] / comparison["bar_width"]).max())
                assert percents == [pytest.approx(100 * largest, rel=0.06)]
                assert float((comparison["missed"] / comparison["allowed"]).max()) <= 1
            elif text.startswith("Estimate confirmed"):
                estimate, lower_bound, expected = percents
                assert lower_bound <= expected <= estimate
    opening = "Estimate confirmed"
    assert words == {opening, f"{opening} within the scatter of so few runs", "NOT confirmed"}


def test_the_least_error_is_the_smallest_that_is_not_refuted():
    """Of runs that are all missed alike, by the root of one equation; of others, by the test."""
    bets = [0.01, 0.02, *np.linspace(0.05, 0.95, 19)]

    def evidence(q):
        return np.mean([np.prod(1 + bet * (np.asarray(q) - 1)) for bet in bets])

    ratio = brentq(lambda r: evidence([r**2] * 16) - 20.0, 1.0, 2.0)
    least_error = verification._at_least(np.full((16, 1), 9.0))
    assert least_error == pytest.approx([3.0 / ratio], rel=1e-9)
    square = np.random.default_rng(0).chisquare(1, (12, 3)) ** 3
    for sample, bound in zip(square.T, verification._at_least(square), strict=True):
        assert (
            evidence(sample / (1.001 * bound) ** 2) < 60 < evidence(sample / (0.999 * bound) ** 2)
        )


def test_expected_errors_that_are_too_small_are_found(surrogate):
    diagnostics = surrogate.diagnostics
    true = np.abs(surrogate.bands()["error_bar"] - bounds()).mean(("bound", "time"))
    expected_error = diagnostics["error_bar_expansion_error"].mean("time")
    share = float((true / expected_error).max()) / 10
    assert share < 1
    small = diagnostics.assign(
        error_bar_expansion_error=diagnostics["error_bar_expansion_error"] * share
    )
    wrong = replace(surrogate, diagnostics=small)
    verdicts = [
        fb.verify(wrong, response, seed=seed).verification.attrs["confirmed"] for seed in range(10)
    ]
    assert verdicts.count("no") >= 9


def bounds():
    """Return the error bar of the response on a grid of the intervals."""
    x, w = np.polynomial.hermite_e.hermegauss(24)
    e, f = (v.ravel() for v in np.meshgrid(np.linspace(-1, 1, 25), np.linspace(1, 2, 25)))
    F = np.stack(
        [response(e, f, 5 + 0.5 * v).values for v in np.repeat(x[:, None], len(e), axis=1)]
    )
    mean = np.tensordot(w / w.sum(), F, 1)
    std = np.sqrt(np.tensordot(w / w.sum(), F**2, 1) - mean**2)
    return np.stack([(mean - std).min(axis=0), (mean + std).max(axis=0)])


def test_the_verdict_says_where_and_by_how_much(surrogate):
    comparison = fb.verify(surrogate, later).verification
    assert comparison["output"].values[~comparison["confirmed"].values].tolist() == ["u7"]
    verdict = comparison.attrs["verdict"]
    assert verdict.startswith("NOT confirmed: 16 verification runs")
    assert "most in u7 at time" in verdict
    assert " s with e = " in verdict
    row = comparison.sel(output="u7")
    run = int(row["missed_most_in"])
    e = float(comparison["run_values"].sel(input="e")[run])
    assert e > 0.9
    assert TIMES[int(row["missed_most_at"])] >= 1
    weight = comparison["run_weight"].values
    hit = weight * (comparison["run_values"].sel(input="e").values > 0.9)
    rms = np.sqrt(25.0 * np.mean(TIMES >= 1) * hit.mean())
    assert float(row["missed"]) == pytest.approx(rms, rel=0.05)
    assert float(row["implied_error"]) == pytest.approx(rms / 2, rel=0.05)


def test_of_many_inputs_a_verdict_names_those_that_are_farthest_out():
    inputs = {f"e{k}": fb.Interval(-1.0, 1.0) for k in range(12)}

    def peak(**e):
        values = np.stack(list(e.values()), axis=1)
        return np.exp(3 * values[:, 2] + 0.1 * values.sum(axis=1))

    surrogate = fb.expand(peak, inputs, fb.methods.RegressionPCCI(1))
    assert isinstance(surrogate, Surrogate)
    diagnostics = surrogate.diagnostics
    diagnostics = diagnostics.assign(
        error_bar_expected_error=1e-6 * diagnostics["error_bar_expected_error"]
    )
    comparison = fb.verify(replace(surrogate, diagnostics=diagnostics), peak).verification
    verdict = comparison.attrs["verdict"]
    assert comparison.attrs["confirmed"] == "no"
    assert " and 8 other inputs; bands may be off" in verdict
    assert len(re.findall(r"e\d+ = ", verdict)) == 4


def test_without_random_inputs_no_place_is_run_twice():
    """The bounds of (1 + x)² on the expansion of order one are off by its second order, 1/8."""
    inputs = {"x": fb.Interval(0.0, 1.0)}
    surrogate = fb.expand(lambda x: (1 + x) ** 2, inputs, fb.PCCI(0, 1))
    comparison = fb.verify(surrogate, lambda x: (1 + x) ** 2).verification
    x = comparison["run_values"].values[0]
    assert len(np.unique(x)) == 16
    assert sorted(x[comparison["run_place"] != "anywhere"]) == [0.0, 1.0]
    np.testing.assert_allclose(comparison["missed_in_run"], np.abs((1 + x) ** 2 - 0.875 - 3 * x))
    assert comparison.attrs["confirmed"] == "no error was expected"
    assert "does not estimate the error" in comparison.attrs["verdict"]


def test_constants_and_exact_polynomials_are_confirmed():
    def exact(x, e):
        return np.stack([x * e + e**2, 0 * x + 0.1, 0 * x], axis=1)[:, :, None]

    inputs = {"x": fb.Normal(1.0, 1.0), "e": fb.Interval(0.0, 3.0)}
    surrogate = fb.expand(exact, inputs, fb.AdaptivePCCI())
    comparison = fb.verify(surrogate, exact).verification
    assert comparison.attrs["confirmed"] == "yes"
    assert float((comparison["implied_error"] / comparison["bar_width"]).max()) < 1e-3


def test_what_inputs_that_are_left_out_do_is_in_the_estimate():
    """They move every end of the bands by the sum of their effects, which are linear here."""
    m = 30
    effects = 0.1 / (1 + np.arange(30))
    inputs = {f"e{k:02d}": fb.Interval(-1.0, 1.0) for k in range(m)} | {"x": fb.Normal(0.0, 0.1)}

    def linear(x, **e):
        return x + np.stack([e[k] for k in sorted(e)], axis=1) @ effects

    full = fb.expand(linear, inputs, fb.methods.RegressionPCCI(1))
    assert isinstance(full, Surrogate)
    expansion = full.expansions[0]
    assert isinstance(expansion, DirectExpansion)
    values = expansion.values
    terms = np.flatnonzero(~values.index[:, 3:m].any(axis=1))  # three intervals and x
    values = replace(values, index=values.index[terms], coefficients=values.coefficients[terms])
    subset = replace(full, expansions=(replace(expansion, values=values),))
    true = effects[3:].sum()
    for runs, ratio in ((16, 2.0), (256, 1.02)):
        implied_errors = [
            float(fb.verify(subset, linear, runs=runs, seed=k).verification["implied_error"])
            for k in range(5)
        ]
        assert true * 0.99 < min(implied_errors)
        assert max(implied_errors) < ratio * true
    at = fb.verify(subset, linear).verification["run_values"].values[:m].T
    assert np.all(np.ptp(at[:2, :3], axis=0) == 0)
    np.testing.assert_allclose(at[0, 3:], -at[1, 3:])


def test_no_verdict_states_less_than_its_runs_can_see(monkeypatch):
    """A kink that 8 % of the samples reach: half of the width is missing there, and no run is."""

    def kink(x, e):
        values = np.maximum(x - 1 + 0.3 * e, 0)[:, None] + 0.1 * e[:, None] * TIMES
        return xr.DataArray(values, dims=("sample", "time"), coords={"time": TIMES})

    inputs = {"x": fb.Normal(0, 0.5), "e": fb.Interval(-1, 1)}

    def no_rare_runs(error, space, evaluate):
        points = np.zeros((0, 1)), np.zeros((0, 1))
        return RareRuns(ResponseRuns(*points, error.choice.missed[:0]), np.zeros(0))

    monkeypatch.setattr(method, "_rare_runs", no_rare_runs)
    with pytest.warns(fb.errors.FlexbandWarning, match="'x' changes no output"):
        surrogate = fb.expand(kink, inputs, fb.methods.PhaseResolvedPCCI(1, 1))
    assert isinstance(surrogate, Surrogate)
    assert 4e-6 < surrogate.diagnostics.attrs["expected_error"] < 4e-5
    lines = " ".join(remarks(surrogate.bands()))
    sentence = "An effect confined to less than {} of the input space can go unnoticed"
    assert sentence.format("two thirds") in lines  # 53 %, which 4 runs miss by 5 % chance
    assert pytest.approx(0.05, rel=0.03) == 0.47**4
    assert pytest.approx(0.05, rel=0.03) == 0.69**8
    for seed in range(10):
        comparison = fb.verify(surrogate, kink, seed=seed).verification
        assert comparison.attrs["confirmed"] == "no"
        assert sentence.format("a third") in comparison.attrs["verdict"]
    smooth = fb.verify(surrogate, lambda x, e: kink(x - 9, e)).verification
    assert smooth.attrs["confirmed"] == "yes"
    assert "follows is 0.002 % of the error bar's width" in smooth.attrs["verdict"]
    assert sentence.format("a third") in smooth.attrs["verdict"]


def test_runs_that_are_farther_out_are_weighted_to_have_the_moments_of_samples():
    """E[1; |z| < 3] and E[z⁴; |z| < 3] of one variable, and the covariance of three."""
    normals = latin_hypercube_normals(20000, 1, 0)
    z, weight = stretch_samples(normals, 3.0, np.random.default_rng(0))
    moments = chdtr(1, 9.0), 3 * chdtr(5, 9.0)
    np.testing.assert_allclose([weight.mean(), (weight * z[:, 0] ** 4).mean()], moments, rtol=1e-3)
    assert np.abs(z).max() <= 3
    assert np.mean(np.abs(z) > 2) == pytest.approx(1 / 3, abs=1e-3)
    normals = latin_hypercube_normals(100_000, 3, 0)
    z, weight = stretch_samples(normals, 3.0, np.random.default_rng(0))
    np.testing.assert_allclose((weight[:, None] * z).T @ z / len(z), np.eye(3), atol=0.03)


def test_kinks_of_random_place_and_share_are_found_and_smooth_responses_confirmed():
    """Of a sample of the benchmark, none of whose wrong claims is hidden."""
    method = fb.methods.PhaseResolvedPCCI(1, 1)
    seeds = range(8)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        of_kinks, of_smooth = (
            [claim for k in seeds for claim in judge_response(k, method, 2, smooth=smooth)]
            for smooth in (False, True)
        )
    wrong = [verdict for verdict in of_kinks if verdict[0] == "wrong"]
    assert wrong
    assert not any(map(hides_error, wrong))
    assert [confirmed for _, confirmed, _ in of_smooth].count("no") <= 1
