"""A result that was altered on disk is never shown as that of the study."""

import json
import random
import shutil

import pytest
import xarray as xr
from typer.testing import CliRunner

from flexband.cli import app
from flexband.study.results.netcdf import read_netcdf, write_netcdf

STUDY = """
import numpy as np
import flexband as fb

def response(a, x):
    return np.outer(a + 0.1 * x, np.linspace(0.5, 1.0, 5))

inputs = {"a": fb.Interval(0.9, 1.1), "x": fb.Normal(0, 1)}
study = fb.Study(response, inputs, fb.AdaptivePCCI(),
                 requirements=fb.Requirement("response", below=2.0))
"""
RESULTS = (
    "bands.nc", "verification.nc", "contributions.nc", "surrogate.npz", "page.json", "limits.nc",
    "probability.nc",
)  # fmt: skip


def call(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture(scope="module")
def study_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    study = folder / "study.py"
    study.write_text(STUDY, encoding="utf-8")
    result = call("run", study, "--output", folder / "out")
    assert result.exit_code == 0, result.output
    assert call("sobol", folder / "out").exit_code == 0
    return folder


@pytest.fixture
def study_copy(study_folder, tmp_path):
    shutil.copytree(study_folder, tmp_path / "copy")
    return tmp_path / "copy" / "study.py", tmp_path / "copy" / "out"


def flip(file, seed):
    data = bytearray(file.read_bytes())
    generator = random.Random(seed)
    data[generator.randrange(len(data))] ^= 1 << generator.randrange(8)
    file.write_bytes(data)


def text_of(result):
    return " ".join(result.output.split())


@pytest.mark.usefixtures("no_drawing")
def test_every_altered_result_is_refused_and_run_restores_it(study_copy):
    study, out = study_copy
    contents = {name: (out / name).read_bytes() for name in RESULTS}
    for name in RESULTS:
        for seed in range(3):
            flip(out / name, f"{name}{seed}")
            result = call("report", out)
            assert result.exit_code == 1, (name, seed, result.output)
            assert f"{name} is not as written; `flexband run` restores it" in text_of(result)
            (out / name).write_bytes(contents[name])
    flip(out / "sobol.nc", 0)
    result = call("report", out)
    assert result.exit_code == 1
    assert "sobol.nc is not as written; `flexband sobol` restores it" in text_of(result)
    for name in ("bands.nc", "page.json", "limits.nc"):
        flip(out / name, 1)
    result = call("run", study, "--output", out)
    assert result.exit_code == 0, result.output
    assert "no run was made" not in text_of(result)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Answers that are not as written are not shown: sobol" in page
    for name in ("bands.nc", "surrogate.npz"):
        assert (out / name).read_bytes() == contents[name]


def test_bands_with_other_values_and_answers_beside_an_altered_page_are_refused(study_copy):
    _, out = study_copy
    bands = xr.open_dataset(out / "bands.nc").load()
    bands["mean"] = 2 * bands["mean"]
    bands.to_netcdf(out / "bands.nc", engine="scipy")  # which keeps the attributes
    for command in ("report", "distribution"):
        result = call(command, out)
        assert result.exit_code == 1
        assert "bands.nc is not as written" in text_of(result)
    flip(out / "page.json", 2)  # which has the doubts about all answers
    result = call("distribution", out)
    assert (result.exit_code, "page.json is not as written" in text_of(result)) == (1, True)


def test_a_result_in_study_json_that_was_altered_is_not_told(study_copy):
    study, out = study_copy
    record = json.loads((out / "study.json").read_text(encoding="utf-8"))
    record["result"]["label"] = "All is well."
    (out / "study.json").write_text(json.dumps(record), encoding="utf-8")
    assert "result in study.json is not as written" in text_of(call("status", out))
    result = call("run", study, "--output", out)
    assert "All is well." not in result.output
    assert "not as written" not in text_of(call("status", out))


def test_what_is_read_is_what_was_written(study_folder):
    file = study_folder / "out" / "bands.nc"
    with xr.open_dataset(file, engine="scipy") as dataset:
        expected = dataset.load()
    result = read_netcdf(file)
    xr.testing.assert_equal(result, expected)
    assert result.attrs.keys() == expected.attrs.keys() - {"numbering"}
    assert (expected.attrs["refined"], result.attrs["refined"]) == (
        "[]",
        [],
    )  # as `propagate` has it


def test_coordinates_of_other_names_stay_coordinates(tmp_path):
    dataset = xr.Dataset({"y": ("output", [1.0])}, {"output": ["x"], "unit": ("output", ["m"])})
    write_netcdf(dataset, tmp_path / "y.nc")
    xr.testing.assert_equal(read_netcdf(tmp_path / "y.nc"), dataset)
