"""Methods with given orders have no judge of their own: answers with one and without.

Each response is of a kind at which the terms of the highest order do not show what is missed.
"""

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import quad
from scipy.stats import norm

import flexband as fb
from flexband.analysis.limits.least_margin import LimitVerdict
from flexband.analysis.probability.discrepancy import DiscrepancyModel
from flexband.requirements.verdict import Reason, Verdict
from tests.rough import search_roughly

ANGLE = fb.TruncatedNormal(0.0, 0.35, lower=-1.4, upper=1.4)
LENGTH = fb.Interval(0.99, 1.01)


def lever(L, t):
    """Return a response that is even in t, which the odd order 3 does not see."""
    return (L / np.cos(t))[:, None]


def catenary(L, t):
    return (L * np.cosh(1.2 * t))[:, None]


def kink(x):
    return np.abs(x)[:, None]


def wave(e):
    return np.cos(4 * e)[:, None]


def bilinear(x, y):
    return (x + y + x * y / 2)[:, None]


def interval_of(result, kind="confidence"):
    return [float(result[f"{kind}_{end}"].values.ravel()[-1]) for end in ("low", "high")]


def lever_is_longer(limit):
    """Return the largest probability that L/cos t exceeds a limit."""
    part = np.arccos(1.01 / limit) / 0.35
    ends = norm.cdf(1.4 / 0.35) - norm.cdf(-1.4 / 0.35)
    return 2 * (norm.cdf(1.4 / 0.35) - norm.cdf(part)) / ends


def test_a_surrogate_without_a_judge_states_no_probability_and_runs_give_it_one():
    surrogate = fb.expand(lever, {"L": LENGTH, "t": ANGLE}, fb.PCCI())
    limit = fb.Requirement("response", below=2.5)
    exact = lever_is_longer(2.5)
    with pytest.MonkeyPatch.context() as patch:
        search_roughly(patch)
        without_runs = fb.analysis.failure_probability(surrogate, limit)
        verified = fb.verify(surrogate, lever)
        of_verified = fb.analysis.failure_probability(verified, limit)
        share = fb.production_yield(surrogate, limit, {"L": fb.Uniform(0.99, 1.01)})
    assert interval_of(without_runs) == interval_of(without_runs, "between_times") == [0.0, 1.0]
    assert without_runs.attrs["error"] == "not judged by runs"
    assert "No runs judge its tails" in without_runs.attrs["verdict"]
    assert interval_of(of_verified) == [0.0, 1.0]  # they say nothing about tails
    low, high = interval_of(
        fb.analysis.failure_probability(verified, limit, response=lever, runs=64)
    )
    assert low <= exact <= high < 0.1
    assert interval_of(share, "yield") == [0.0, 1.0]
    plan = fb.analysis.allocate(surrogate, limit, {"L": 1e-3}, probability=1e-2)
    assert interval_of(plan) == [0.0, 1.0]
    assert "not judged by runs" in plan.attrs["verdict"]
    quantile = fb.analysis.quantiles(surrogate, 0.99, samples=2048)
    assert quantile.attrs["surrogate_expected_error"] == "not judged by runs"
    assert "expected_error" in fb.analysis.quantiles(verified, 0.99, samples=2048)


@pytest.mark.parametrize(
    ("response", "inputs", "method", "limit"),
    [
        (kink, {"x": fb.Interval(-1, 1)}, fb.PCCI(), fb.Requirement("response", above=0.02)),
        (
            wave,
            {"e": fb.Interval(-1, 1)},
            fb.ImprovedPCCI(3, 3),
            fb.Requirement("response", below=0.5),
        ),
    ],
)
def test_worst_cases_are_not_decided_by_what_no_run_has_judged(response, inputs, method, limit):
    surrogate = fb.expand(response, inputs, method)
    for candidate in (surrogate, fb.verify(surrogate, response)):
        margins = fb.analysis.check_requirements(candidate, limit)
        assert margins["verdict"].values.item() == LimitVerdict.UNDECIDED
    verified = fb.verify(surrogate, response)
    bands = verified.bands()
    place = np.linspace(-1, 1, 401)
    (name,) = inputs
    true = response(place)
    for bound, value in (("lower", true.min()), ("upper", true.max())):
        error = abs(bands["mean"].sel(bound=bound).item() - value)
        assert error < 2 * float(bands["mean_expected_error"].max()), name


def test_what_an_exact_surrogate_keeps_is_kept_once_runs_have_judged_it():
    def line(x, e):
        return (2 * x + e)[:, None]

    inputs = {"x": fb.Normal(0, 1), "e": fb.Interval(-1, 1)}
    surrogate = fb.expand(line, inputs, fb.PCCI(2, 1))
    limit = fb.Requirement("response", below=8.0)
    assert fb.analysis.check_requirements(surrogate, limit)["verdict"].values.item() == "undecided"
    verified = fb.verify(surrogate, line, runs=8)
    assert fb.analysis.check_requirements(verified, limit)["verdict"].values.item() == "kept"
    low, high = interval_of(fb.analysis.failure_probability(verified, limit))
    assert low < norm.sf(3.5) < high < 1.5 * low
    assert verified.bands().attrs["runs"] == surrogate.bands().attrs["runs"]


def test_a_verified_surrogate_is_saved_with_its_runs(tmp_path):
    inputs = {"x": fb.Normal(0, 1), "e": fb.Interval(-1, 1)}
    surrogate = fb.expand(lambda x, e: np.exp(x / 4 + e)[:, None], inputs, fb.PCCI(2, 2))
    verified = fb.verify(surrogate, lambda x, e: np.exp(x / 4 + e)[:, None])
    fb.save_surrogate(verified, tmp_path / "s.npz")
    copy = fb.load_surrogate(tmp_path / "s.npz")
    assert copy.verification.identical(verified.verification)
    part = {"e": fb.Interval(-0.5, 0.5)}
    for actual, expected in (
        (copy, verified),
        (copy.narrowed(**part), verified.narrowed(**part)),
    ):
        np.testing.assert_array_equal(
            actual.bands()["error_bar_expected_error"], expected.bands()["error_bar_expected_error"]
        )
    narrow = verified.narrowed(**part).bands()["error_bar_expected_error"]
    assert float(narrow.max()) <= float(verified.bands()["error_bar_expected_error"].max())


@pytest.mark.parametrize(
    ("response", "inputs", "method", "limit", "exact"),
    [
        (catenary, {"L": LENGTH, "t": fb.Normal(0, 1)}, fb.PCCI(), 20.0, 2.17e-3),
        (
            bilinear,
            {"x": fb.Normal(0, 1), "y": fb.Normal(0, 1)},
            fb.methods.PerturbationChebyshev(2),
            6.0,
            1.874e-3,
        ),
    ],
)
@pytest.mark.parametrize("factor", [0.2, 5.0])
def test_a_study_runs_the_model_where_a_required_probability_is_decided(
    tmp_path, response, inputs, method, limit, exact, factor
):
    requirement = fb.Requirement(
        "q", below=limit, criterion=fb.analysis.Probability(factor * exact)
    )
    study = fb.Study(response, inputs, method, requirements=[requirement])
    result = study.run_in(tmp_path)
    (verdict,) = result.verdicts
    assert verdict.verdict in (Verdict.PASS if factor > 1 else Verdict.FAIL, Verdict.UNDECIDED)
    assert verdict.share[1] <= exact <= verdict.share[2]
    place_count, first_runs = divmod(int(result.limits.probability["runs"].max()), 64)
    assert place_count in (1, 2, 3)
    assert first_runs == 16
    with pytest.MonkeyPatch.context() as patch:
        search_roughly(patch)
        without = study.run_in(tmp_path / "without", fb.RunOptions(verification_runs=0))
    (verdict,) = without.verdicts
    assert (verdict.verdict, verdict.reason) == (Verdict.UNDECIDED, Reason.NOT_JUDGED)


@pytest.mark.filterwarnings("error")
def test_a_probability_in_a_window_is_searched_over_the_intervals():
    """Of (x + e) t above 1 from 0.33 to 0.55: P(x + 1 > 1/0.55), with runs and without."""
    time = np.linspace(0.0, 1.0, 11)

    def ramp(x, e):
        values = (np.asarray(x) + np.asarray(e))[:, None] * time
        return xr.DataArray(values[:, None], {"output": ["u"], "time": time},
                            ("sample", "output", "time"))  # fmt: skip

    inputs = {"x": fb.Normal(0.0, 0.3), "e": fb.Interval(-1.0, 1.0)}
    surrogate = fb.expand(ramp, inputs, fb.AdaptivePCCI(0.01))
    requirement = fb.Requirement("u", "u", below=1.0, during=(0.33, 0.55))
    exact = norm.sf((1 / 0.55 - 1) / 0.3)
    for judge in ({}, {"response": ramp, "runs": 32}):
        answer = fb.analysis.failure_probability(surrogate, requirement, **judge)
        names = ("between_times_low", "between_times_high")
        low, high = (float(answer[name].sel(bound="upper")[0]) for name in names)
        assert 0.6 * exact < low < exact < high < 1.5 * exact
        assert float(answer["probability_at"].sel(input="e", bound="upper")[0]) == 1.0


@pytest.mark.parametrize("seed", range(3))
def test_what_few_runs_teach_does_not_lose_the_worst_interval(seed):
    """Of e^{0.8 z} + 0.05 y with z = (x + y)/√2, for order 1 a plane: it is worst at e = −1."""

    def response(x, y, e):
        z = (np.asarray(x) + np.asarray(y)) / np.sqrt(2)
        return -(np.exp(0.8 * z) + 0.05 * np.asarray(y) + 0.06 * np.asarray(e))[:, None]

    inputs = {"x": fb.Normal(0, 1), "y": fb.Normal(0, 1), "e": fb.Interval(-1, 1)}
    x, y = np.random.default_rng(5).standard_normal((2, 400_000))
    limit = float(np.quantile(response(x, y, -1.0), 0.8))
    surrogate = fb.verify(fb.expand(response, inputs, fb.PCCI(1, 2)), response)
    answer = fb.analysis.failure_probability(
        surrogate, fb.Requirement("q", below=limit), response=response, runs=64, seed=seed
    )
    low, high = (
        float(answer[f"confidence_{end}"].sel(bound="upper")[0]) for end in ("low", "high")
    )
    assert low < 0.2 < high


def even_is_exceeded(limit):
    """Return the probability of −cosh(1.1 x) − 0.3 y + 0.1 e above a limit at e = 1."""

    def part(x):
        return norm.pdf(x) * norm.cdf((0.1 - np.cosh(1.1 * x) - limit) / 0.3)

    return quad(part, -8.0, 8.0)[0]


def centred_product_is_exceeded(limit):
    """Return the probability of 0.7 (x² − 1) y + 0.05 x + 0.1 e above a limit at e = 1."""

    def part(x):
        slope = 0.7 * (x**2 - 1)
        return norm.pdf(x) * norm.cdf((0.1 + 0.05 * x - limit) / abs(slope)) if slope else 0.0

    return quad(part, -8.0, 8.0, points=[-1.0, 1.0], limit=200)[0]


@pytest.mark.parametrize(
    ("response", "method", "limit", "is_exceeded"),
    [
        (
            lambda x, y, e: (0.1 * e - np.cosh(1.1 * x) - 0.3 * y)[:, None],
            fb.methods.RegressionPCCI(1), -0.3, even_is_exceeded,
        ),
        (
            lambda x, y, e: (0.7 * (x**2 - 1) * y + 0.05 * x + 0.1 * e)[:, None],
            fb.methods.PerturbationChebyshev(1), 3.5, centred_product_is_exceeded,
        ),
    ],
)  # fmt: skip
def test_runs_find_tails_on_sides_to_which_a_surrogate_does_not_point(
    response, method, limit, is_exceeded
):
    """What leaves the limit is rare for the surrogate, and elsewhere."""
    inputs = {"x": fb.Normal(0, 1), "y": fb.Normal(0, 1), "e": fb.Interval(-1, 1)}
    answer = fb.analysis.failure_probability(
        fb.expand(response, inputs, method), fb.Requirement("q", below=limit),
        response=response, runs=64,
    )  # fmt: skip
    low, high = interval_of(answer)
    assert low < is_exceeded(limit) < high < 5 * is_exceeded(limit)


def test_a_discrepancy_with_a_kink_is_known_where_runs_are():
    """A quadratic function alone misses |x| by 0.3 between the runs, and says so little of it."""
    x = np.linspace(-3, 3, 25)[:, None]
    places = np.linspace(-2.9, 2.9, 200)[:, None]
    kink = DiscrepancyModel(x, np.abs(x[:, 0]))
    errors = np.abs(kink.predict(places) - np.abs(places[:, 0]))
    assert errors.max() < 0.15
    assert errors.mean() < 0.02
    assert np.mean(errors <= 2 * kink.scatter(places)) > 0.95
    quadratic = DiscrepancyModel(x, x[:, 0] ** 2 - 1)
    remote_point = np.array([[5.0]])
    assert abs(quadratic.predict(remote_point)[0] - 24.0) < 1e-2
    assert quadratic.scatter(remote_point)[0] < 0.1
