"""The command line, run as a user would."""

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.study.comparison import compare, relative_error

STUDY = """
import numpy as np
import xarray as xr
import flexband as fb

time = np.linspace(0, 10, 21)

def response(amplitude, rate, field):
    values = amplitude[:, None] * np.exp(-rate[:, None] * time) + 0 * field(np.zeros(1))
    return xr.DataArray(
        np.stack([values, 2 * values], axis=1),
        dims=("sample", "output", "time"),
        coords={"output": ["u", "v"], "unit": ("output", ["m", "N"]),
                "time": ("time", time, {"units": "s"})},
    )

inputs = {
    "amplitude": fb.Normal(1.5, 0.2),
    "rate": fb.Interval(0.1, 0.2),
    "field": fb.RandomField(1.0, 0.1, 2.0, domain=(0.0, 0.5), terms=1),
}
study = fb.Study(response, inputs, fb.ImprovedPCCI(1, 4))
"""


@pytest.fixture
def study_file(tmp_path):
    file = tmp_path / "decay.py"
    file.write_text(STUDY, encoding="utf-8")
    return file


def call(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_run_writes_data_and_figures(study_file, tmp_path):
    out = tmp_path / "out"
    result = call("run", study_file, "--output", out)
    assert result.exit_code == 0, result.output
    assert "improved PCCI (1, 4), 20 runs" in result.output
    with xr.open_dataset(out / "bands.nc", engine="scipy") as bands:
        upper = bands["mean"].sel(output="v", bound="upper")
        np.testing.assert_allclose(upper, 3 * np.exp(-0.1 * bands["time"]), atol=1e-4)
        assert bands["mean"].sel(output="v")["unit"] == "N"
        assert bands.attrs["runs"] == 20
    for name in ("report.html", "bands_u.png", "bands_v.png"):
        assert (out / name).stat().st_size > 500


def test_run_by_another_method(study_file, tmp_path):
    out = tmp_path / "out"
    result = call("run", study_file, "--output", out, "--method", "lhs-scanning",
                  "--samples", 7, "--points", 3)  # fmt: skip
    assert result.exit_code == 0, result.output
    with xr.open_dataset(out / "bands.nc", engine="scipy") as bands:
        assert bands.attrs["runs"] == 21
        assert bands.attrs["method"].startswith("LHSScanning(samples=7, points=3")


def test_fresh_runs_and_what_the_method_says(study_file, tmp_path):
    out = tmp_path / "out"
    result = call("run", study_file, "--output", out, "--method", "adaptive-pcci",
                  "--tolerance", 0.001, "--max-runs", 9, "--verify", 4)  # fmt: skip
    assert result.exit_code == 0, result.output
    plain = " ".join(result.output.split())
    assert "Orders: rate" in plain
    assert "Fresh runs at the extremes of the error bar: 16" in plain
    assert ("NOT met" in plain) == (xr.open_dataset(out / "bands.nc").expected_error > 0.001)
    assert "Orders: rate" in (out / "report.html").read_text(encoding="utf-8")
    assert fb.load_surrogate(out / "surrogate.npz").labels.sizes["output"] == 2
    with xr.open_dataset(out / "verification.nc", engine="scipy") as checked:
        assert float(abs(checked["difference"]).max()) < 0.01
    none = call("run", study_file, "--output", out, "--method", "lhs-scanning", "--verify", 4)
    assert none.exit_code == 1
    assert "has no surrogate for --verify" in none.output


def test_options_change_the_studys_own_method(study_file, tmp_path):
    result = call("run", study_file, "--output", tmp_path / "out", "--interval-order", 2)
    assert result.exit_code == 0, result.output
    assert "improved PCCI (1, 2), 12 runs" in result.output
    wrong = call("run", study_file, "--output", tmp_path / "out", "--samples", 500)
    assert wrong.exit_code == 1
    assert "improved PCCI has no option --samples" in wrong.output


def test_output_is_checked_before_the_runs(study_file):
    result = call("run", study_file, "--output", study_file / "below")
    assert result.exit_code == 1
    assert "Traceback" not in result.output
    assert "runs" not in result.output


def test_version():
    assert call("--version").output.strip() == fb.__version__


def test_any_response_can_be_run(tmp_path):
    file = tmp_path / "box.py"
    file.write_text(
        "import numpy as np, flexband as fb\n"
        "study = fb.Study(lambda x: x[:, None, None] * np.ones((3, 4)),\n"
        "                 {'x': fb.Interval(0, 1)}, fb.ImprovedPCCI(0, 1))\n",
        encoding="utf-8",
    )
    result = call("run", file, "--output", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "response" in result.output


def test_compare(study_file, tmp_path):
    out = tmp_path / "out"
    result = call("compare", study_file, "--output", out, "--samples", 50, "--points", 3,
                  "--orders", "1,1 1,4")  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "largest variance error" in result.output
    assert {p.name for p in out.iterdir()} >= {
        "report.html", "variance_error.png", "deterministic.png", "errors_u.png",
        "bands_v_1_4.png", "improved_pcci_1_4.nc", "lhs_scanning.nc",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1", "must define `study`, a flexband.Study; got None"),
        (STUDY.replace('"rate": fb.Interval(0.1, 0.2)', '"speed": fb.Interval(0.1, 0.2)'),
         "inputs name speed, which the response does not take"),
        (STUDY.replace("Interval(0.1, 0.2)", "Interval(0.3, 0.2)"), "must not be above"),
    ],
)  # fmt: skip
def test_errors_are_one_line_and_status_one(tmp_path, text, message):
    file = tmp_path / "bad.py"
    file.write_text(text, encoding="utf-8")
    result = call("run", file, "--output", tmp_path / "out")
    assert result.exit_code == 1
    assert message in " ".join(result.output.split())
    assert "Traceback" not in result.output


def test_missing_file_and_bad_orders(tmp_path, study_file):
    missing = call("run", tmp_path / "none.py")
    assert missing.exit_code == 1
    assert "there is no file" in missing.output
    for orders in ("three", "", "1,2,3"):
        bad = call("compare", study_file, "--orders", orders)
        assert bad.exit_code == 1
        assert "orders must be like" in bad.output


def test_relative_error_is_over_both_bounds():
    reference = xr.DataArray([[1.0, 1.0], [3.0, -3.0]], dims=("bound", "time"))
    found = xr.DataArray([[1.0, 2.0], [3.0, -3.0]], dims=("bound", "time"))
    assert relative_error(found, reference) == 1 / 8
    both = xr.concat([reference, 1e-14 * reference], dim="output")
    assert np.isnan(relative_error(both, both)).values.tolist() == [False, True]


def test_compare_needs_no_labels():
    study = fb.Study(lambda x: x**2, {"x": fb.Interval(0, 1)}, fb.PCCI(0, 2))
    reference, found = compare(study, fb.LHSScanning(2, 11), [fb.ImprovedPCCI(0, 2)])
    assert reference.errors is None
    assert found.errors is not None
    assert float(found.errors["mean"]) < 1e-12
    assert (reference.runs, found.runs) == (11, 3)
