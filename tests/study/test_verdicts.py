"""Verdicts on requirements: what a margin, its error and a run decide."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.analysis.labelled_answers import NOT_JUDGED
from flexband.analysis.limits.least_margin import LeastMargin, LimitVerdict
from flexband.analysis.limits.limit_verdicts import _by_margin
from flexband.cli import app
from flexband.requirements.verdict import Reason, Verdict
from flexband.study.nominal import with_runs


def least_of(verdict, margin, margin_between, error, at_most=None):
    at_most = margin if at_most is None else at_most
    return SimpleNamespace(
        margin=margin,
        margin_between=margin_between,
        at_most=at_most,
        error=error,
        verdict=verdict,
    )


def verdict_of(
    margin, margin_between, error=0.1, run=np.nan, estimate="error_bar_expected_error", at_most=None
):
    limit_verdict = LimitVerdict.KEPT if min(margin, margin_between) > 0 else LimitVerdict.NOT_KEPT
    least_margin = least_of(limit_verdict, margin, margin_between, error, at_most)
    limit = xr.Dataset({"run_margin": run})
    margins = xr.Dataset(attrs={"error": estimate})
    return _by_margin(limit, least_margin, margins, None)[:2]


@pytest.mark.parametrize(
    ("margin", "margin_between", "verdict", "reason"),
    [
        (0.5, 0.5, Verdict.PASS, Reason.MARGIN),
        (0.5, 0.05, Verdict.UNDECIDED, Reason.ERROR),
        (0.05, 0.05, Verdict.UNDECIDED, Reason.ERROR),
        (-0.05, -0.05, Verdict.UNDECIDED, Reason.ERROR),
        (-0.5, -0.5, Verdict.FAIL, Reason.MARGIN),
        (0.2, -0.5, Verdict.UNDECIDED, Reason.BETWEEN),  # the error is not that of such peaks
    ],
)
def test_a_margin_decides_where_it_exceeds_its_error(margin, margin_between, verdict, reason):
    assert verdict_of(margin, margin_between) == (verdict, reason)


@pytest.mark.parametrize("limit_verdict", [LimitVerdict.NOT_KEPT, LimitVerdict.UNDECIDED])
def test_bounds_left_only_between_times_say_so(limit_verdict):
    least_margin = least_of(limit_verdict, 0.0, -4e-7, 2e-15)
    verdict = _by_margin(
        xr.Dataset(), least_margin, xr.Dataset(attrs={"error": "truncation"}), None
    )
    assert verdict[:2] == (Verdict.UNDECIDED, Reason.BETWEEN)


def test_bounds_surely_left_between_times_fail():
    assert verdict_of(0.2, -0.5, at_most=-0.3) == (Verdict.FAIL, Reason.MARGIN)
    assert verdict_of(0.2, -0.5, at_most=-0.05) == (Verdict.UNDECIDED, Reason.BETWEEN)


def test_a_run_beyond_the_bounds_decides_whatever_the_surrogate_says():
    assert verdict_of(0.5, 0.5, run=-0.01) == (Verdict.FAIL, Reason.RUN)
    assert verdict_of(0.5, 0.5, run=0.01) == (Verdict.PASS, Reason.MARGIN)


@pytest.mark.parametrize(
    ("misses_tolerance", "run_margin", "verdict", "reason"),
    [
        (True, 0.01, Verdict.UNDECIDED, Reason.RUNS_DIFFER),
        (True, -0.01, Verdict.FAIL, Reason.MARGIN),
        (False, 0.01, Verdict.FAIL, Reason.MARGIN),  # rare values leave bounds that runs keep
    ],
)
@pytest.mark.parametrize("inside", [False, True])
def test_runs_must_agree_with_an_expansion_that_misses_its_tolerance(
    misses_tolerance, run_margin, verdict, reason, inside
):
    least_margin = least_of(LimitVerdict.NOT_KEPT, -0.5, -0.5, 0.1)
    if inside:
        least_margin = least_of(LimitVerdict.KEPT, 0.5, 0.5, 0.1)
        run_margin = -run_margin
        verdict = Verdict.PASS if verdict is Verdict.FAIL else verdict
    limit = xr.Dataset({"run_required": misses_tolerance, "recorded_margin": run_margin})
    margins = xr.Dataset(attrs={"error": "error_bar_expected_error"})
    assert _by_margin(limit, least_margin, margins, None)[:2] == (verdict, reason)


class Level:
    """A number that is 1 below x = 0.3 and 2 above, by an impact if there is one."""

    def __init__(self, impacts):
        self.hits = impacts

    def __call__(self, x):
        return 1.0 + (x > 0.3)

    def impacts(self, x):
        return self.hits


@pytest.mark.parametrize(
    ("below", "impacts", "verdict", "reason"),
    [
        (2.1, True, Verdict.UNDECIDED, Reason.RUNS_DIFFER),  # which the expansion exceeds, by 0.026
        (2.1, False, Verdict.FAIL, Reason.MARGIN),
        (1.9, True, Verdict.FAIL, Reason.RUN),
    ],
)
def test_after_impacts_it_takes_a_run_to_show_that_intervals_leave_their_bounds(
    below, impacts, verdict, reason
):
    inputs = {"x": fb.Interval(0.0, 1.0)}
    limit = fb.Requirement("response", below=below)
    study = fb.Study(Level(impacts), inputs, fb.PCCI(4, 5), requirements=[limit])
    surrogate = fb.expand(study.response, inputs, study.method)
    surely = xr.Dataset(
        {"least_margin_error": ("limit", [0.01]), "verdict": ("limit", ["not kept"])}
    )
    margins = fb.analysis.check_requirements(surrogate, limit)
    margins_of_runs, runs = with_runs(study, surrogate, [limit], margins.assign(surely))
    of_limit = margins_of_runs.assign_attrs(error="error_bar_expected_error").isel(limit=0)
    assert _by_margin(of_limit, LeastMargin.from_result(of_limit), of_limit, None)[:2] == (
        verdict,
        reason,
    )
    assert runs == impacts


def test_without_an_error_nothing_is_decided():
    assert verdict_of(5.0, 5.0, estimate=NOT_JUDGED) == (Verdict.UNDECIDED, Reason.NOT_JUDGED)


STUDY = """
import numpy as np
import xarray as xr
import flexband as fb

TIMES = np.linspace(0.0, 1.0, 5)

def response(a, b, x):
    sums = (a + b)[:, None] + 0.01 * x[:, None] + 3 * TIMES
    values = np.stack([sums, 2 * sums], axis=1)
    coords = {"output": ["y", "z"], "time": TIMES, "unit": ("output", ["m", "N"])}
    return xr.DataArray(values, coords, ("sample", "output", "time"))

study = fb.Study(
    response,
    {"a": fb.Interval(-1.0, 1.0), "b": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 1.0)},
    fb.AdaptivePCCI(),
    requirements=[
        fb.Requirement("near", "y", within=1500, unit="mm"),
        fb.Requirement("rare", "y", below=5.015, criterion=fb.analysis.Probability(1e-3)),
        fb.Requirement("most", "y", within=1.0, criterion=fb.analysis.ShareOfParts(0.3)),
        fb.Requirement("many", "z", within=2.0, criterion=fb.analysis.ShareOfParts(0.2)),
    ],
    scatter={"a": fb.Uniform(-1.0, 1.0), "b": fb.Uniform(-1.0, 1.0)},
)
"""


@pytest.mark.usefixtures("no_drawing")
def test_every_criterion_is_judged_from_the_file_to_the_page(tmp_path):
    """|a + b| > 1 has the share 1/4; y is beyond 5.015 with Φ(−1.5) = 0.067, if a + b = 2.

    The worst case is 2.03 from the nominal, 0.53 beyond what is allowed.
    """
    (tmp_path / "study.py").write_text(STUDY, encoding="utf-8")
    call = CliRunner().invoke(app, ["run", str(tmp_path / "study.py"), "-o", str(tmp_path / "out")])
    assert call.exit_code == 5, call.output
    text = " ".join(call.output.split())
    for line in (
        r"FAIL near \(nominal ± 1500 mm\): violated by 530 mm at",
        r"FAIL rare \(below 5.015\): probability 0.06[67] \(95 % confidence: 0.06",
        r"PASS most \(nominal ± 1\): 2[4-6] % of the parts fail \(95 % confidence: 2",
        r"FAIL many \(nominal ± 2\): 2[4-6] % of the parts fail \(95 % confidence: 2",
    ):
        assert re.search(line, text)
    namespace = {}
    exec(STUDY, namespace)
    study = namespace["study"]
    result = study.run_in(tmp_path / "out")
    verdicts = result.verdicts
    assert [str(verdict.verdict) for verdict in verdicts] == ["FAIL", "FAIL", "PASS", "FAIL"]
    assert verdicts[0].margin == pytest.approx(-530.0, abs=0.1)
    production = result.production_yield(study.requirements[2:], study.scatter)
    np.testing.assert_allclose(production["failing"], 0.25, atol=0.02)
    assert "FAIL" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    table = CliRunner().invoke(app, ["yield", str(tmp_path / "out"), "--trust"]).output
    assert re.search(r"most \(nominal ± 1\)\s+.\s+7\d[.\d]* % ", table)


def test_a_recorded_run_beyond_a_limit_of_intervals_decides(tmp_path):
    """A narrow peak that one run meets: bands between which it is averaged out keep the limit."""
    inputs = {"x": fb.Interval(0.0, 1.0)}
    fb.Study(lambda x: 1.0 * x, inputs, fb.AdaptivePCCI()).run_in(tmp_path / "smooth")
    x_of_runs = fb.execution.open_runs(tmp_path / "smooth")["inputs"].sel(input="x").values
    place = x_of_runs[np.argmin(np.abs(x_of_runs - 0.4))]

    def peaked(x):
        return np.sin(x) + 2.0 * np.exp(-0.5 * ((x - place) / 1e-3) ** 2)

    limit = fb.Requirement("response", below=2.2)
    study = fb.Study(peaked, inputs, fb.AdaptivePCCI(max_runs=40), requirements=[limit])
    (verdict,) = study.run_in(tmp_path / "peaked").verdicts
    assert (verdict.verdict, verdict.reason) == (Verdict.FAIL, Reason.RUN)
    assert verdict.margin == pytest.approx(2.2 - 2.0 - np.sin(place), abs=1e-9)
