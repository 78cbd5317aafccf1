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
    result = run("contributions", folder, "--shapley")
    assert result.exit_code == 0, result.output
    assert result.output.index("e ") < result.output.index("x ")
    with xr.open_dataset(folder / "contributions.nc") as contributions:
        assert contributions["shapley"].sum("name").values == pytest.approx(
            contributions["width"].values
        )
    assert (folder / "contributions.png").read_bytes()[:4] == b"\x89PNG"
    contributions = json.loads(run("contributions", folder, "--json").stdout)
    assert contributions["share_at_widest"]["a"] == pytest.approx([2.0 / 2.5, 0.5 / 2.5])


def test_inputs_are_narrowed(folder):
    answer = json.loads(run("narrow", folder, "e=-0.5..0.5", "x.std=0.1", "--json").stdout)
    assert answer["mean_width_before"]["a"] == pytest.approx(1.0 + 0.5)
    assert answer["mean_width"]["a"] == pytest.approx(0.5 + 0.2)
    assert "Estimated accuracy: ±" in run("narrow", folder, "e=0").output
    for change, text in (
        ("e", "a change must be"),
        ("z=1", "z must be one"),
        ("e=0..2", "values must be from -1 to 1"),
        ("e.std=0.1", "e is an Interval, which is narrowed by its two ends, e=LOWER..UPPER"),
    ):
        result = run("narrow", folder, change)
        assert result.exit_code == 2
        assert text in " ".join(result.output.split())


def test_scatter_is_given_as_inputs_have_it(tmp_path):
    inputs = {"e": fb.Interval(-1, 1), "x": fb.LogNormal(1.0, cv=0.2)}
    fb.save_surrogate(fb.expand(response, inputs, fb.AdaptivePCCI()), tmp_path / "surrogate.npz")
    widths = [json.loads(run("narrow", tmp_path, change, "--json").stdout)["mean_width"]["a"]
             for change in ("x.cv=0.1", "x.std=0.1")]  # fmt: skip
    assert widths[0] == pytest.approx(widths[1])
    assert widths[0] == pytest.approx(1.0 + 0.2, rel=5e-3)
    result = run("narrow", tmp_path, "x.width=0.1")
    assert result.exit_code == 2
    message = " ".join(result.output.split())
    assert (
        "x is a LogNormal, which is narrowed by x.mean=NUMBER or x.std=NUMBER or x.cv=N" in message
    )


def test_an_earlier_answer_is_not_replaced_silently(folder):
    run("narrow", folder, "e=-0.5..0.5")
    assert "is replaced" not in run("narrow", folder, "e=-0.5..0.5").output
    output = " ".join(run("narrow", folder, "e=-0.25..0.25").output.split())
    assert "The earlier narrowed.nc is replaced (e: -0.5 … 0.5 (0 ± 0.5))" in output


def test_sobol(folder, tmp_path):
    inputs = {"e": fb.Normal(0, 1), "x": fb.Normal(0, 0.25)}
    surrogate = fb.expand(response, inputs, fb.AdaptivePCCI())
    fb.save_surrogate(surrogate, tmp_path / "surrogate.npz")
    result = run("sobol", tmp_path)
    assert "with interactions" in result.stdout
    assert "the variance vanishes at" in result.stdout
    assert (tmp_path / "sobol.png").is_file()
    assert "x is the only random input" in run("sobol", folder).stdout
    answer = json.loads(run("sobol", folder, "--json").stdout)
    with xr.open_dataset(folder / "sobol.nc") as dataset:
        assert answer["inputs"] == dataset["name"].values.tolist()
        ends = next(iter(answer["total"].values()))[0]
        index = dataset["std"].argmax(...)
        total = dataset["total"].isel(name=0, **{dim: int(k) for dim, k in index.items()})
        assert ends == total.values.tolist()
