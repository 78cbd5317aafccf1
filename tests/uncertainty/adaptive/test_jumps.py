"""Responses that jump: what is told of them is marked, and the advice is one that helps."""

import re

import numpy as np
import pytest
import xarray as xr
from scipy.stats import norm
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.report.text import band_tables

INPUTS = {"e": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 1.0)}
STUDY = """
import numpy as np
import flexband as fb

def response(e, x):
    return np.where(x > 0.3, 1.0, 0.0) + 0.1 * e

inputs = {"e": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 1.0)}
study = fb.Study(response, inputs, fb.AdaptivePCCI(),
                 requirements=[fb.Requirement("response", below=0.5)])
"""


def response(e, x):
    return np.where(x > 0.3, 1.0, 0.0) + 0.1 * e


@pytest.mark.parametrize("budget", [200, 400])
def test_more_runs_are_not_advised_where_the_highest_orders_are_in_use(budget):
    with pytest.warns(
        fb.errors.FlexbandWarning, match="more runs hardly help.* LHSScanning"
    ) as records:
        surrogate = fb.expand(response, INPUTS, fb.AdaptivePCCI(max_runs=budget))
    assert "in use in x (8)" in str(records[0].message)
    lines = band_tables.remarks(surrogate.bands())
    assert any("NOT met: more runs hardly help" in line for line in lines)
    assert not any("allow more runs" in line for line in lines)


def count_and_wave(e, x):
    """What 0.3 % of the parts count at 0.6, and all others at 0.7, beside something smooth."""
    t = np.linspace(0.0, 1.0, 11)
    instant = np.where((x > 0.93) & (x < 0.94), 0.55, 0.65)
    count = np.where(t >= instant[:, None], 1.0, 0.0)
    wave = np.sin(3 * t) * (1 + 0.1 * x + 0.1 * e)[:, None]
    coords = {"output": ["count", "wave"], "time": t}
    return xr.DataArray(np.stack([count, wave], 1), coords, ("sample", "output", "time"))


@pytest.mark.parametrize(
    "method",
    [fb.AdaptivePCCI(), fb.methods.PhaseResolvedPCCI(2, 2), fb.methods.RegressionPCCI(2)],
)
def test_a_count_that_is_alike_in_all_runs_may_change_earlier_or_later(method):
    bands = fb.propagate(count_and_wave, INPUTS, method)
    count = bands.sel(output="count")
    assert np.ptp(count["error_bar"].values, axis=0).max() < 1e-12
    share = norm.cdf(0.94) - norm.cdf(0.93)
    error = count["error_bar_expected_error"].values
    assert (np.sqrt(share * (1 - share)) < error[6:8]).all()
    assert (error[6:8] < 0.5).all()
    assert np.delete(error, [6, 7]).max() < 1e-12
    assert bands.sel(output="wave")["error_bar_expected_error"].max() < 1e-5


def test_a_count_that_is_alike_in_all_runs_is_named_and_decides_no_close_limit():
    surrogate = fb.expand(count_and_wave, INPUTS, fb.AdaptivePCCI())
    ends = {"far": (5.0, (0.0, 1.0)), "close": (0.1, (0.0, 0.65)), "beyond": (0.5, (0.0, 1.0))}
    limits = [
        fb.Requirement(name, "count", below=below, during=during)
        for name, (below, during) in ends.items()
    ]
    margins = fb.analysis.check_requirements(surrogate, limits)
    assert margins["verdict"].values.tolist() == ["kept", "undecided", "not kept"]
    (message,) = [
        line for line in band_tables.remarks(surrogate.bands()) if "count the same" in line
    ]
    assert message.startswith("count: all runs count the same at all times, but up to ")


def test_answers_are_marked_where_the_error_is_above_its_tolerance():
    surrogate = fb.expand(response, INPUTS, fb.AdaptivePCCI())
    limit = fb.Requirement("response", below=0.5)
    probabilities = fb.analysis.failure_probability(surrogate, limit)
    above = r"Not reliable: the error expected of the surrogate is .* above the tolerance of 1 %"
    assert probabilities["confidence_high"].isnull().all()
    assert (
        fb.analysis.value_range(surrogate).attrs["surrogate_not_reliable"]
        in probabilities.attrs["verdict"]
    )
    assert " ".join(probabilities.attrs["verdict"].split(". ")[-1:]).startswith(
        "Not reliable: the error"
    )
    by_runs = fb.analysis.failure_probability(surrogate, limit, response=response, runs=64)
    assert "Not reliable" not in by_runs.attrs["verdict"]  # of a probability that runs correct
    smooth = fb.expand(lambda e, x: e + x, INPUTS, fb.AdaptivePCCI())
    assert (
        "Not reliable"
        not in fb.analysis.failure_probability(smooth, fb.Requirement("response", below=3.0)).attrs[
            "verdict"
        ]
    )
    untrusted = surrogate.with_attrs(not_trusted="response (60 % of it is missed)")
    verdict = fb.analysis.failure_probability(untrusted, limit).attrs["verdict"]
    assert "Not reliable: response (60 % of it is missed)" in verdict
    assert above.split(".*", maxsplit=1)[0] in verdict


def test_a_study_says_that_its_probability_is_not_reliable(tmp_path):
    (tmp_path / "study.py").write_text(STUDY, encoding="utf-8")
    arguments = ["run", str(tmp_path / "study.py"), "-o", str(tmp_path / "out"), "--verify", "0"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 5, result.output  # runs leave the limit
    output = " ".join(result.output.split())
    pattern = r"ccuracy target was missed \([\d.e-]+ % instead of [\d.e-]+ %\)\."
    assert re.search(f"A{pattern}".replace(" was", ""), output)
    assert re.search(f"No probability: the a{pattern}", output)
    answer = (
        CliRunner().invoke(app, ["distribution", "--kind", "range", str(tmp_path / "out")]).output
    )
    assert "as probabilities do, is NOT reliable" in " ".join(answer.split())
    assert "Not reliable: the error expected" in " ".join(answer.split())
