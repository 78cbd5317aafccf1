"""The commands `flexband contributions` and `flexband narrow`: tables, files and figure."""

import json

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app


def response(e, x):
    t = np.linspace(0, 1, 21)
    y = e[:, None] * t + x[:, None]
    coords = {"output": ["a"], "time": t}
    return xr.DataArray(y[:, None], coords, ("sample", "output", "time"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("study")
    inputs = {"e": fb.Interval(-1, 1), "x": fb.Normal(0, 0.25)}
    fb.save_surrogate(fb.expand(response, inputs, fb.AdaptivePCCI()), place / "surrogate.npz")
    return place


def run(*arguments):
    return CliRunner().invoke(app, [*map(str, arguments)])


def test_contributions_are_ranked_and_drawn(folder):
    printed = run("contributions", folder, "--shapley")
    assert printed.exit_code == 0, printed.output
    assert printed.output.index("e ") < printed.output.index("x ")
    with xr.open_dataset(folder / "contributions.nc") as found:
        assert found["shapley"].sum("name").values == pytest.approx(found["width"].values)
    assert (folder / "contributions.png").read_bytes()[:4] == b"\x89PNG"
    found = json.loads(run("contributions", folder, "--json").stdout)
    assert found["share_at_widest"]["a"] == pytest.approx([2.0 / 2.5, 0.5 / 2.5])


def test_inputs_are_narrowed(folder):
    found = json.loads(run("narrow", folder, "e=-0.5..0.5", "x.std=0.1", "--json").stdout)
    assert found["mean_width_before"]["a"] == pytest.approx(1.0 + 0.5)
    assert found["mean_width"]["a"] == pytest.approx(0.5 + 0.2)
    assert "expected error" in run("narrow", folder, "e=0").output
    for change, text in (
        ("e", "a change must be"),
        ("z=1", "z must be one"),
        ("e=0..2", "between"),
    ):
        refused = run("narrow", folder, change)
        assert refused.exit_code != 0
        assert text in " ".join(refused.output.split())


def test_sobol(folder):
    printed = run("sobol", folder)
    assert "with interactions" in printed.stdout
    assert "the variance vanishes at" in printed.stdout
    assert (folder / "sobol.png").is_file()
    found = json.loads(run("sobol", folder, "--json").stdout)
    with xr.open_dataset(folder / "sobol.nc") as saved:
        assert found["inputs"] == saved["name"].values.tolist()
        ends = next(iter(found["total"].values()))[0]
        widest = saved["std"].argmax(...)
        one = saved["total"].isel(name=0, **{dim: int(k) for dim, k in widest.items()})
        assert ends == one.values.tolist()
