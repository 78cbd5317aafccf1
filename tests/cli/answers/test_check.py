"""The command `flexband check`: its table, files and figure."""

import json

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from tests.rough import search_roughly


def response(e, x):
    t = np.linspace(0, 1, 21)
    y = (1 + 0.1 * e)[:, None] * np.sin(6 * t) + 0.1 * x[:, None]
    coords = {"output": ["a"], "time": t}
    return xr.DataArray(y[:, None], coords, ("sample", "output", "time"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("study")
    inputs = {"e": fb.Interval(-1, 1), "x": fb.Normal(0, 1)}
    fb.save_surrogate(fb.expand(response, inputs, fb.AdaptivePCCI()), place / "surrogate.npz")
    return place


def test_limits_are_checked_and_written(folder, monkeypatch):
    search_roughly(monkeypatch)
    options = ["check", str(folder), "--below", "a=1.35", "--above", "a=-1.5", "--accuracy", "0.1"]
    result = CliRunner().invoke(app, options)
    assert result.exit_code == 5, result.output
    assert "violated" in result.output
    with xr.open_dataset(folder / "limits.nc") as margins:
        assert float(margins["least_margin"][0]) == pytest.approx(-0.05, abs=0.01)
    assert (folder / "limits.png").read_bytes()[:4] == b"\x89PNG"
    answer = json.loads(CliRunner().invoke(app, [*options, "--json"]).stdout)
    lower, upper = np.ravel(answer["probability"]["probability"])
    assert 0 <= lower < upper < 0.02


def test_limits_of_the_study_are_those_by_default(tmp_path, monkeypatch):
    search_roughly(monkeypatch)
    study = """
import numpy as np
import flexband as fb

def response(e, x):
    return np.outer(e + 0.1 * x, np.linspace(0.5, 1.0, 5))

inputs = {"e": fb.Interval(0.9, 1.1), "x": fb.Normal(0, 1)}
study = fb.Study(response, inputs, fb.AdaptivePCCI()LIMITS)
"""
    for limits, status in ((", requirements=fb.Requirement('response', below=1.2)", 5), ("", 2)):
        file = tmp_path / f"study_{status}.py"
        file.write_text(study.replace("LIMITS", limits), encoding="utf-8")
        call = ["run", str(file), "--output", str(tmp_path / str(status))]
        CliRunner().invoke(app, [*call, "--verify", "0"])
        result = CliRunner().invoke(app, ["check", str(tmp_path / str(status))])
        assert result.exit_code == status, result.output
        if status == 5:
            content = (tmp_path / "5" / "limits.nc").read_bytes()
            answer = CliRunner().invoke(app, ["check", str(tmp_path / "5"), "--below", "9"])
            assert "the report shows the requirements of the study only" in answer.output
            assert (tmp_path / "5" / "limits.nc").read_bytes()[:500] == content[:500]
            for name in ("limits", "probability"):
                with xr.open_dataset(tmp_path / "5" / f"{name}.nc") as dataset:
                    assert dataset["limit"].values.tolist() == ["response below 1.2"]
    assert "unless the study has requirements" in " ".join(result.output.split())
    with xr.open_dataset(tmp_path / "5" / "limits.nc") as margins:
        assert float(margins["below"].max()) == 1.2
    costs = ["allocate", str(tmp_path / "5"), "--cost", "e=1", "--sigmas", "1"]
    assert "response below 1.2" in CliRunner().invoke(app, costs).output


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "requires --below or --above"),
        (["--below", "a=x"], "OUTPUT=NUMBER"),
        (["--below", "b=1"], "must be one of a"),
        (["--below", "a=1", "--below", "a=2"], "given once"),
    ],
)
def test_refused(folder, options, message):
    result = CliRunner().invoke(app, ["check", str(folder), *options])
    assert result.exit_code == 2
    assert message in result.output


def test_a_folder_without_a_surrogate_is_refused(tmp_path):
    result = CliRunner().invoke(app, ["check", str(tmp_path), "--below", "1"])
    assert result.exit_code == 1
    assert "surrogate.npz" in result.output
