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
    assert "Estimated accuracy: ±" in run("narrow", folder, "e=0").output
    for change, text in (
        ("e", "a change must be"),
        ("z=1", "z must be one"),
        ("e=0..2", "values must be from -1 to 1"),
        ("e.std=0.1", "e is an Interval, which is narrowed by its two ends, e=LOWER..UPPER"),
    ):
        refused = run("narrow", folder, change)
        assert refused.exit_code == 2
        assert text in " ".join(refused.output.split())


def test_scatter_is_given_as_inputs_have_it(tmp_path):
    inputs = {"e": fb.Interval(-1, 1), "x": fb.LogNormal(1.0, cv=0.2)}
    fb.save_surrogate(fb.expand(response, inputs, fb.AdaptivePCCI()), tmp_path / "surrogate.npz")
    found = [json.loads(run("narrow", tmp_path, own, "--json").stdout)["mean_width"]["a"]
             for own in ("x.cv=0.1", "x.std=0.1")]  # fmt: skip
    assert found[0] == pytest.approx(found[1])
    assert found[0] == pytest.approx(1.0 + 0.2, rel=5e-3)
    refused = run("narrow", tmp_path, "x.width=0.1")
    assert refused.exit_code == 2
    told = " ".join(refused.output.split())
    assert "x is a LogNormal, which is narrowed by x.mean=NUMBER or x.std=NUMBER or x.cv=N" in told


def test_an_earlier_answer_is_not_replaced_silently(folder):
    run("narrow", folder, "e=-0.5..0.5")
    assert "is replaced" not in run("narrow", folder, "e=-0.5..0.5").output
    again = " ".join(run("narrow", folder, "e=-0.25..0.25").output.split())
    assert "The earlier narrowed.nc is replaced (e: -0.5 … 0.5 (0 ± 0.5))" in again


def test_sobol(folder, tmp_path):
    inputs = {"e": fb.Normal(0, 1), "x": fb.Normal(0, 0.25)}
    surrogate = fb.expand(response, inputs, fb.AdaptivePCCI())
    fb.save_surrogate(surrogate, tmp_path / "surrogate.npz")
    printed = run("sobol", tmp_path)
    assert "with interactions" in printed.stdout
    assert "the variance vanishes at" in printed.stdout
    assert (tmp_path / "sobol.png").is_file()
    assert "x is the only random input" in run("sobol", folder).stdout
    found = json.loads(run("sobol", folder, "--json").stdout)
    with xr.open_dataset(folder / "sobol.nc") as saved:
        assert found["inputs"] == saved["name"].values.tolist()
        ends = next(iter(found["total"].values()))[0]
        widest = saved["std"].argmax(...)
        one = saved["total"].isel(name=0, **{dim: int(k) for dim, k in widest.items()})
        assert ends == one.values.tolist()
