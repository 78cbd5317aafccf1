"""Limits that belong to a study are checked by `flexband run`."""

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
                 fb.{method}, limits={limits})
"""


def run(folder, **parts):
    file = folder / "study.py"
    file.write_text(STUDY.format(**{"method": "AdaptivePCCI()"} | parts), encoding="utf-8")
    result = CliRunner().invoke(app, ["run", str(file), "--output", str(folder / "out")])
    assert result.exit_code == 0, result.output
    return " ".join(result.output.split())


def test_a_study_tells_whether_its_limits_are_kept(tmp_path):
    # the highest μ + 3σ is 2.3
    told = run(tmp_path, limits="fb.Limit(below=2.5)")
    assert "The limit response below 2.5 is kept by μ ± 3σ: least margin 0.2" in told
    again = run(tmp_path, limits="[fb.Limit(below=2.2)]")  # another study, with the same runs
    assert "The limit response below 2.2 is NOT kept by μ ± 3σ: least margin -0.1" in again
    with xr.open_dataset(tmp_path / "out" / "probability.nc") as found:
        (probability,) = found["probability"].sel(bound="upper").values
    assert probability == pytest.approx(0.02275, rel=0.1)  # that of 2σ
    assert "has this result already" in run(tmp_path, limits="fb.Limit(below=2.2)")


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"limits": 'fb.Limit("F", below=1.0)'}, "limits are not checked: Limit output must be"),
        (
            {"limits": "fb.Limit(below=9.0)", "method": "LHSScanning(8, 3)"},
            "limits are not checked: the method expands no response",
        ),
    ],
)
def test_results_are_there_although_limits_cannot_be_checked(tmp_path, parts, message):
    assert message in run(tmp_path, **parts)
    assert (tmp_path / "out" / "bands.nc").exists()


@pytest.mark.parametrize("limits", [3.0, "F", [1.0], None])
def test_what_is_no_limit_is_refused(limits):
    with pytest.raises(fb.InputError, match="limits must be a Limit or a list of them; got"):
        fb.Study(lambda a: a, {"a": fb.Interval(0, 1)}, fb.PCCI(), limits=limits)
