"""What is of earlier results is never shown as new, also after an interrupt."""

import pytest
import xarray as xr
from typer.testing import CliRunner

from flexband.cli import app

STUDY = """
import numpy as np
import flexband as fb

def response(a, x):
    return np.outer(a + 0.1 * x, np.linspace(0.5, 1.0, 5))

inputs = {{"a": fb.Interval(0.9, {upper}), "x": fb.Normal(0, 1)}}
study = fb.Study(response, inputs, fb.AdaptivePCCI())
"""


def call(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def test_answers_of_earlier_results_are_left_out_after_an_interrupt(tmp_path, monkeypatch):
    study = tmp_path / "study.py"
    out = tmp_path / "out"
    study.write_text(STUDY.format(upper=1.1), encoding="utf-8")
    run = ("run", study, "--output", out)
    assert call(*run).exit_code == 0
    assert call("distribution", out).exit_code == 0

    def interrupt(*_, **__):
        raise KeyboardInterrupt

    study.write_text(STUDY.format(upper=1.02), encoding="utf-8")
    with monkeypatch.context() as patch:
        patch.setattr("flexband.study.steps.verify", interrupt)
        assert call(*run).exit_code == 130
    refusal = call("report", out)  # new bands with what was said of the others
    assert refusal.exit_code == 1
    assert "must have results of `flexband run`" in " ".join(refusal.output.split())
    result = call(*run)
    assert result.exit_code == 0, result.output
    assert "quantiles.nc, of an earlier run" in result.output.replace("\n", "")
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Answers of earlier results are not shown: quantiles" in page


def test_contributions_of_other_deviations_are_not_those_of_the_report(tmp_path):
    study = tmp_path / "study.py"
    out = tmp_path / "out"
    study.write_text(STUDY.format(upper=1.1), encoding="utf-8")
    assert call("run", study, "--output", out).exit_code == 0
    before = (out / "report.html").read_bytes()
    assert call("contributions", out, "--sigmas", 9).exit_code == 0
    with xr.open_dataset(out / "contributions.nc") as dataset:
        assert dataset.attrs["sigmas"] == 9
    assert call("report", out).exit_code == 0
    assert (out / "report.html").read_bytes() == before


def test_a_report_that_fails_does_not_lose_the_results(tmp_path, monkeypatch):
    def fail(*_, **__):
        raise ValueError("no charts today")

    study = tmp_path / "study.py"
    out = tmp_path / "out"
    study.write_text(STUDY.format(upper=1.1), encoding="utf-8")
    assert call("run", study, "--output", out).exit_code == 0
    study.write_text(STUDY.format(upper=1.02), encoding="utf-8")
    monkeypatch.setattr("flexband.report.page.study.chart_data", fail)
    result = call("run", study, "--output", out)
    assert result.exit_code == 0, result.output
    assert "the report is not written: ValueError: no charts today" in " ".join(
        result.output.split()
    )
    assert (out / "bands.nc").exists()
    assert not (out / "report.html").exists()  # that of the bands before


@pytest.mark.parametrize("values", ['["A", "B", "C"]', "[3.0, 2.0, 1.0]"])
def test_outputs_over_names_or_decreasing_numbers_have_a_report(tmp_path, values):
    study = tmp_path / "study.py"
    study.write_text(
        f"""
import numpy as np
import xarray as xr
import flexband as fb

def response(a):
    values = np.outer(a, np.arange(1.0, 4.0))
    return xr.DataArray(values, dims=("sample", "station"), coords={{"station": {values}}})

study = fb.Study(response, {{"a": fb.Interval(0, 1)}}, fb.PCCI(0, 2))
""",
        encoding="utf-8",
    )
    result = call("run", study, "--output", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "remark" not in result.output
    assert (tmp_path / "out" / "report.html").exists()
