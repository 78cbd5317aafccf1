"""Limits that belong to a study are checked by `flexband run`."""

import re

import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app

STUDY = """
import numpy as np
import flexband as fb

def response(a, e):
    return np.outer(e + a, np.linspace(0.0, 1.0, 5))

study = fb.Study(response, {{"a": fb.Normal(0.0, 0.1), "e": fb.Interval(1.0, 2.0)}},
                 fb.{method}, requirements={requirements})
"""


def run(folder, status=0, **parts):
    file = folder / "study.py"
    file.write_text(STUDY.format(**{"method": "AdaptivePCCI()"} | parts), encoding="utf-8")
    result = CliRunner().invoke(app, ["run", str(file), "--output", str(folder / "out")])
    assert result.exit_code == status, result.output
    return " ".join(result.output.split())


@pytest.mark.usefixtures("no_drawing")
def test_a_study_tells_whether_its_limits_are_kept(tmp_path):
    # the highest μ + 3σ is 2.3
    output = run(tmp_path, requirements="fb.Requirement('response', below=2.5)")
    assert output.index("PASS response below 2.5: met with a margin of 0.2 (") < output.index(
        "Report:"
    )
    assert "(worst tolerances, 3σ)" in output
    second = run(
        tmp_path, 5, requirements="[fb.Requirement('response', below=2.2)]"
    )  # another study, with the same runs
    assert "FAIL response below 2.2: violated by 0.1 (" in second
    assert "mostly due to" in second
    with xr.open_dataset(tmp_path / "out" / "probability.nc") as dataset:
        (probability,) = dataset["probability"].sel(bound="upper").values
    assert probability == pytest.approx(0.02275, rel=0.1)  # that of 2σ
    assert "has this result already" in run(
        tmp_path, 5, requirements="fb.Requirement('response', below=2.2)"
    )


def test_results_are_there_although_limits_cannot_be_checked(tmp_path):
    parts = {"requirements": "fb.Requirement('response', below=9.0)", "method": "LHSScanning(8, 3)"}
    line = "response below 9: not checked: the method expands no response"
    assert f"UNDECIDED {line}" in run(tmp_path, 3, **parts)
    assert (tmp_path / "out" / "bands.nc").exists()
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert f"<b>UNDECIDED</b> {line}" in page
    assert "has this result already" in (second := run(tmp_path, 3, **parts))
    assert f"UNDECIDED {line}" in second


@pytest.mark.parametrize("method", ["AdaptivePCCI()", "LHSScanning(40, 30)"])
@pytest.mark.parametrize(
    ("limit", "message"),
    [
        (
            '"F", "F", below=1.0',
            "'F' output must be None, since the response has one output; got 'F'",
        ),
        (
            '"w", below=[1.0, 2.0]',
            "Requirement 'w' below must be one number, or numbers of shape (5,)",
        ),
        ('"w", below=1.0, during=(0.0, 1.0)', "Requirement 'w' during requires times"),
    ],
)
def test_limits_that_do_not_fit_end_a_study_after_its_first_runs(tmp_path, method, limit, message):
    file = tmp_path / "study.py"
    text = STUDY.format(method=method, requirements=f"fb.Requirement({limit})")
    file.write_text(text.replace("    return np", "    print(len(a), 'runs'); return np"), "utf-8")
    result = CliRunner().invoke(app, ["run", str(file), "--output", str(tmp_path / "out")])
    assert result.exit_code == 1
    assert message in " ".join(result.output.split())
    assert result.output.count(" runs\n") <= 2  # whatever tells the progress
    assert not (tmp_path / "out" / "bands.nc").exists()


@pytest.mark.parametrize("requirements", [3.0, "F", [1.0], None])
def test_what_is_no_requirement_is_refused(requirements):
    with pytest.raises(fb.errors.InputError, match="requirements must be a Requirement or a list"):
        fb.Study(lambda a: a, {"a": fb.Interval(0, 1)}, fb.PCCI(), requirements=requirements)


def test_what_new_runs_find_to_be_wrong_is_doubted(tmp_path):
    """Without orders the surrogate is a constant, whose error bar has no width."""
    output = run(
        tmp_path, 3, requirements="fb.Requirement('response', below=2.5)", method="PCCI(0, 0)"
    )
    assert "verification runs find an error of more than 1000 % of the band's width" in output
    assert "UNDECIDED response below 2.5: probably met with a margin of 1" in output
    assert "Estimated accuracy: ± more than 1000 % of the band's width" in output
    assert "No probability: the method does not trust its result" in output
    assert re.search(
        r"result\. The largest value in \d+ runs is 2(\.\d+)? \(limit 2\.5\)\.", output
    )
    answer = CliRunner().invoke(app, ["check", str(tmp_path / "out")])
    assert "Not reliable: the response (100 % of its variation" in " ".join(answer.output.split())


def test_remarks_on_inputs_are_printed_by_the_run_alone(tmp_path):
    text = STUDY.format(method="PCCI(1, 1)", requirements="fb.Requirement('response', below=99.0)")
    file = tmp_path / "study.py"
    file.write_text(text.replace("Normal(0.0, 0.1)", "Normal(1.0, cv=5.0)"), encoding="utf-8")
    outputs = [
        CliRunner().invoke(app, [*words, str(tmp_path / "out")]).output
        for words in (["run", str(file), "--verify", "0", "-o"], ["check", "--trust"])
    ]
    assert ["is it in per" in " ".join(text.split()) for text in outputs] == [True, False]
