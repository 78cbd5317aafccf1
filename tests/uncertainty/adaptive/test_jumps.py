"""Responses that jump: what is told of them is marked, and the advice is one that helps."""

import numpy as np
import pytest
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.report.text import tables

INPUTS = {"e": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 1.0)}
STUDY = """
import numpy as np
import flexband as fb

def response(e, x):
    return np.where(x > 0.3, 1.0, 0.0) + 0.1 * e

inputs = {"e": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 1.0)}
study = fb.Study(response, inputs, fb.AdaptivePCCI(), limits=[fb.Limit(below=0.5)])
"""


def response(e, x):
    return np.where(x > 0.3, 1.0, 0.0) + 0.1 * e


@pytest.mark.parametrize("budget", [200, 400])
def test_more_runs_are_not_advised_where_the_highest_orders_are_in_use(budget):
    with pytest.warns(
        fb.errors.FlexbandWarning, match="more runs hardly help.* LHSScanning"
    ) as issued:
        surrogate = fb.expand(response, INPUTS, fb.AdaptivePCCI(max_runs=budget))
    assert "in use in x (8)" in str(issued[0].message)
    told = tables.remarks(surrogate.bands())
    assert any("NOT met: more runs hardly help" in line for line in told)
    assert not any("allow more runs" in line for line in told)


def test_answers_are_marked_where_the_error_is_above_its_tolerance():
    surrogate = fb.expand(response, INPUTS, fb.AdaptivePCCI())
    limit = fb.Limit(below=0.5)
    found = fb.analysis.failure_probability(surrogate, limit)
    above = r"Not reliable: the error expected of the surrogate is .* above the tolerance of 1 %"
    assert found["confidence_high"].isnull().all()
    assert (
        fb.analysis.value_range(surrogate).attrs["surrogate_not_reliable"] in found.attrs["verdict"]
    )
    assert " ".join(found.attrs["verdict"].split(". ")[-1:]).startswith("Not reliable: the error")
    again = fb.analysis.failure_probability(surrogate, limit, response=response, runs=64)
    assert "Not reliable" not in again.attrs["verdict"]  # of a probability that runs correct
    smooth = fb.expand(lambda e, x: e + x, INPUTS, fb.AdaptivePCCI())
    assert (
        "Not reliable"
        not in fb.analysis.failure_probability(smooth, fb.Limit(below=3.0)).attrs["verdict"]
    )
    untrusted = surrogate.with_attrs(not_trusted="response (60 % of it is missed)")
    told = fb.analysis.failure_probability(untrusted, limit).attrs["verdict"]
    assert "Not reliable: response (60 % of it is missed)" in told
    assert above.split(".*", maxsplit=1)[0] in told


def test_a_study_says_that_its_probability_is_not_reliable(tmp_path):
    (tmp_path / "study.py").write_text(STUDY, encoding="utf-8")
    arguments = ["run", str(tmp_path / "study.py"), "-o", str(tmp_path / "out"), "--verify", "0"]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 5, done.output  # runs leave the limit
    told = " ".join(done.output.split())
    assert "Doubtful: the tolerance is not met." in told
    assert "The probability of leaving a limit at any time is" in told
    assert (
        "; this is NOT reliable." in told.split("The probability of leaving")[1].split(" What")[0]
    )
    asked = (
        CliRunner().invoke(app, ["distribution", "--kind", "range", str(tmp_path / "out")]).output
    )
    assert "as probabilities do, is NOT reliable" in " ".join(asked.split())
    assert "Not reliable: the error expected" in " ".join(asked.split())
