"""The commands `derived`, `p-box`, `path`, and `limits --runs`."""

import json
import re

import numpy as np
import pytest
import xarray as xr
from scipy.stats import norm
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.report.page.answers import answers_in
from flexband.study.presentation.display import Display

STUDY = """
import numpy as np
import xarray as xr
import flexband as fb

def response(e, x):
    t = np.linspace(0, 1, 11)
    angle = 2 * np.pi * t
    wide = (x + 0.15 * (x**2 - 1) + e / 4)[:, None] * np.ones(11)
    size = 10 + e[:, None]
    values = np.stack([size * np.cos(angle), size * np.sin(angle), wide], axis=1)
    coords = {"output": ["X", "Y", "w"], "time": t}
    return xr.DataArray(values, coords, ("sample", "output", "time"))

inputs = {"e": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 1.0)}
study = fb.Study(response, inputs, fb.PCCI(1, 1))
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("study")
    (place / "study.py").write_text(STUDY, encoding="utf-8")
    run("run", place / "study.py", "--output", place)
    return place


def run(*arguments, status=0):
    result = CliRunner().invoke(app, [*map(str, arguments)])
    assert result.exit_code == status, result.output
    return result


def test_peaks_and_distribution_functions(folder):
    answer = json.loads(run("derived", folder, "peak", "X", "--json").stdout)
    assert answer["range"] == pytest.approx([9.0, 11.0], rel=1e-3)
    assert "error bar" in run("derived", folder, "rms", "X", "Y", "--samples", 2000).stdout
    with xr.open_dataset(folder / "derived.nc") as dataset:
        assert dataset["mean"].values == pytest.approx([9.0, 11.0], rel=1e-3)
    run("derived", folder, "spectrum", "w")
    assert (folder / "derived.png").read_bytes()[:4] == b"\x89PNG"

    result = run("distribution", folder, "--kind", "p-box", "w", "--time", 0.5)
    assert "sampling error" in result.stdout
    with xr.open_dataset(folder / "p_box.nc") as dataset:
        value = dataset["value"].values
        exact = norm.cdf([value - 0.25, value + 0.25])
        np.testing.assert_allclose(dataset["distribution"], exact, atol=0.02)
    assert (folder / "p_box.png").is_file()


def test_the_report_has_the_numbers_of_answers_and_says_what_pictures_show(folder):
    for words in (
        ["derived", folder, "peak", "X"],
        ["distribution", folder],
        ["distribution", folder, "--kind", "range"],
        ["distribution", folder, "--kind", "p-box", "w", "--time", 0.5],
        ["sobol", folder],
    ):
        run(*words)
    answers = {answer.title: answer for answer in answers_in(folder, Display())[0]}
    peak = answers["Quantities made of outputs: Peak(of='X')"]
    header, rows = peak.table
    assert header[1:3] == ["lowest", "highest"]
    assert [row[0] for row in rows] == ["mean", "error bar μ ± σ", "range of 99 %"]
    np.testing.assert_allclose([float(v) for v in rows[2][1:3]], [9.0, 11.0], rtol=1e-3)
    indices = answers["Parts of the variance: Sobol' indices"]
    assert indices.pictures == []
    assert indices.remarks == ["x is the only random input: all of the variance is due to it."]
    captions = [caption for answer in answers.values() for caption, _ in answer.pictures]
    assert len(captions) == 3
    assert "values of w, at time 0.5, up to the one on the axis" in " ".join(captions)
    assert all("for all values of the interval inputs" in line for line in captions)


def test_a_path(folder):
    answer = json.loads(run("path", folder, "X", "Y", "--json").stdout)
    assert answer["largest_radius"] == pytest.approx(1.0, rel=0.02)
    assert "from its nominal path, at time" in run("path", folder, "X", "Y").stdout
    assert (folder / "path.png").read_bytes()[:4] == b"\x89PNG"


def test_runs_correct_the_probability_of_limits(folder):
    options = ["check", folder, "--below", "w=3.8", "--accuracy", 0.05, "--json"]
    x = np.linspace(-8, 8, 100_001)
    curve = x + 0.15 * (x**2 - 1)
    exact = [np.trapezoid(norm.pdf(x) * (curve > limit), x) for limit in (4.05, 3.55)]
    linear = np.ravel(json.loads(run(*options, status=3).stdout)["probability"]["probability"])
    assert np.all(linear < 0.5 * np.array(exact))
    first = run(*options, "--runs", 32, "--trust", status=3).stdout
    probabilities = np.ravel(json.loads(first)["probability"]["probability"])
    np.testing.assert_allclose(probabilities, exact, rtol=0.15)
    run_count = fb.execution.open_runs(folder).sizes["run"]
    assert run_count >= 64
    assert run(*options, "--runs", 32, "--trust", status=3).stdout == first
    runs = fb.execution.open_runs(folder)
    assert runs.sizes["run"] == run_count  # none is made twice
    assert runs["output"].astype(str).values.tolist() == ["X", "Y", "w"]


def test_answers_of_an_earlier_run_are_marked(tmp_path):
    (tmp_path / "study.py").write_text(STUDY, encoding="utf-8")
    command = ("run", tmp_path / "study.py", "--output", tmp_path, "--no-store")
    run(*command)
    run("distribution", tmp_path)
    with xr.open_dataset(tmp_path / "quantiles.nc") as first:
        first.load()
    assert "quantiles" not in run(*command).output  # the same results
    text = STUDY.replace("Normal(0.0, 1.0)", "Normal(0.0, 2.0)")
    (tmp_path / "study.py").write_text(text, encoding="utf-8")
    output = " ".join(run(*command).output.replace("\n", "").split())
    for kind in ("nc", "png"):
        assert re.search(rf"Older: [^ ]*quantiles.{kind}, of an earlier run", output)
    with xr.open_dataset(tmp_path / "quantiles.nc") as stale:
        assert "ask again" in stale.attrs.pop("stale")
        xr.testing.assert_identical(stale.load(), first)
    run("distribution", tmp_path)
    with xr.open_dataset(tmp_path / "quantiles.nc") as new:
        assert "stale" not in new.attrs


def refusal(*arguments):
    result = CliRunner().invoke(app, [*map(str, arguments)])
    assert result.exit_code == 2
    return " ".join(result.output.split())


def test_a_series_without_labels_needs_no_names(tmp_path):
    """The largest value of (e + 3) t (1 − t) is (e + 3)/4."""
    t = np.linspace(0, 1, 21)

    def series(e):
        return (e + 3)[:, None] * t * (1 - t)

    surrogate = fb.expand(series, {"e": fb.Interval(-1.0, 1.0)}, fb.PCCI(1, 1))
    fb.save_surrogate(surrogate, tmp_path / "surrogate.npz")
    answer = json.loads(run("derived", tmp_path, "peak", "--json").stdout)
    assert answer["range"] == pytest.approx([0.5, 1.0], rel=1e-6)
    run("distribution", tmp_path, "--kind", "p-box", "--time", 10)
    with xr.open_dataset(tmp_path / "p_box.nc") as distribution:
        assert distribution["value"].values[[0, -1]] == pytest.approx([0.5, 1.0], rel=1e-6)
    assert "positions from 0 to 20, since dim_1 has no labels" in refusal(
        "distribution", tmp_path, "--kind", "p-box", "--time", 3.5
    )
    for command in (("derived", tmp_path, "peak", "x"), ("path", tmp_path, "x", "y")):
        assert "response names no outputs; got 'x'. If it has one only" in refusal(*command)


def test_several_series_without_labels_need_names(tmp_path, folder):
    def two(e):
        return np.stack([e, e + 1], axis=1)[:, :, None] * np.ones(4)

    surrogate = fb.expand(two, {"e": fb.Interval(-1.0, 1.0)}, fb.PCCI(1, 1))
    fb.save_surrogate(surrogate, tmp_path / "surrogate.npz")
    assert 'name them by the labels of a dim "output"' in refusal("derived", tmp_path, "peak")
    assert "one of several outputs: X, Y, w; got none" in refusal("derived", folder, "peak")
