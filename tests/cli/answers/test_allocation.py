"""The command `flexband allocate`: table, files and figure."""

import json

import pytest
import xarray as xr
from typer.testing import CliRunner

from flexband.cli import app

STUDY = """
import numpy as np, xarray as xr, flexband as fb

def response(a, b):
    y = (3 * a - 2 * b)[:, None] * np.linspace(0, 1, 5)
    coords = {"output": ["y"], "time": np.linspace(0, 1, 5)}
    return xr.DataArray(y[:, None], coords, ("sample", "output", "time"))

study = fb.Study(response, {k: fb.Interval(-1.0, 1.0) for k in "ab"}, fb.PCCI(1, 2))
"""


def run(*arguments):
    return CliRunner().invoke(app, [*map(str, arguments)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("study")
    (place / "linear.py").write_text(STUDY, encoding="utf-8")
    result = run("run", place / "linear.py", "-o", place / "out", "--verify", 0)
    assert result.exit_code == 0, result.output
    return place / "out"


def test_tolerances_are_allocated_and_confirmed(folder):
    arguments = ("allocate", folder, "--below", "y=0.6", "--cost", "a=3", "--cost", "b=2")
    result = run(*arguments)
    assert result.exit_code == 0, result.output
    assert "Checked by 1 verification run" in " ".join(result.output.split())
    with xr.open_dataset(folder / "allocation.nc") as allocation:
        assert allocation["tolerance"].values == pytest.approx([0.12, 0.12], rel=1e-5)
    assert (folder / "allocation.png").read_bytes()[:4] == b"\x89PNG"
    allocation = json.loads(run(*arguments, "--no-confirm", "--json").stdout)
    assert allocation["confirmed"] == "no runs were made"
    assert allocation["cost"] == pytest.approx(5 / 0.12, rel=1e-5)


def test_grades_and_refusals(folder):
    grades = ("--cost", "a=0.1:5,0.2:1", "--cost", "b=0.1:5,0.2:1", "--below", "0.75")
    allocation = json.loads(run("allocate", folder, *grades, "--json").stdout)
    assert allocation["tolerance"] == pytest.approx([0.1, 0.2])
    result = run("allocate", folder, "--below", "y=1", "--cost", "a")
    assert result.exit_code == 2
    assert "--cost must be NAME=NUMBER" in " ".join(result.output.split())


SCATTER = (
    STUDY[: STUDY.index("study =")]
    + """
inputs = {"a": fb.Normal(0.0, 1.0), "b": fb.Sizing(-1.0, 1.0)}
study = fb.Study(response, inputs, fb.PCCI(1, 1))
"""
)


def test_a_probability_and_a_size(tmp_path):
    (tmp_path / "scatter.py").write_text(SCATTER, encoding="utf-8")
    result = run("run", tmp_path / "scatter.py", "-o", tmp_path / "out", "--verify", 0, "--verbose")
    assert "over all values of b" in " ".join(result.output.split())
    options = ("--above", "y=-1", "--below", "y=8", "--cost", "a=1", "--probability", 0.01)
    allocation = json.loads(run("allocate", tmp_path / "out", *options, "--json").stdout)
    assert allocation["size"] == pytest.approx([-1.0])  # 3 a + 2 > −1
    assert allocation["tolerance"][0] == pytest.approx(1 / 2.326, rel=0.02)
    assert allocation["confirmed"] == "yes"
    result = run("allocate", tmp_path / "out", *options, "--no-confirm")
    assert "share of the change of P" in " ".join(result.output.split())
