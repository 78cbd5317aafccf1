"""The command line, run as a user would."""

import errno
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner
from xarray.backends import ScipyDataStore

import flexband as fb
from flexband.cli import app

STUDY = """
import numpy as np
import xarray as xr
import flexband as fb

time = np.linspace(0, 10, 21)

def response(amplitude, rate, field):
    values = amplitude[:, None] * np.exp(-rate[:, None] * time) + 1e-9 * (field(np.zeros(1)) - 1.0)
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
    assert "improved PCCI (1, 4)" in result.output
    assert "(37 runs, 16 of them to check the result)" in result.output
    with xr.open_dataset(out / "bands.nc", engine="scipy") as bands:
        upper = bands["mean"].sel(output="v", bound="upper")
        np.testing.assert_allclose(upper, 3 * np.exp(-0.1 * bands["time"]), atol=1e-4)
        assert bands["mean"].sel(output="v")["unit"] == "N"
        assert bands.attrs["runs"] == 21
    assert (out / "report.html").stat().st_size > 1e6  # with all that it needs
    before = (out / "report.html").read_bytes()
    (out / "report.html").unlink()
    assert "Report:" in call("report", out).output
    assert (out / "report.html").read_bytes() == before


def test_run_by_another_method(study_file, tmp_path):
    out = tmp_path / "out"
    result = call("run", study_file, "--output", out, "--method", "lhs-scanning",
                  "--samples", 7, "--points", 3, "--sigmas", 2.5)  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "μ ± 2.5σ" in (out / "report.html").read_text(encoding="utf-8")
    with xr.open_dataset(out / "bands.nc", engine="scipy") as bands:
        assert (bands.attrs["runs"], bands.attrs["sigmas"]) == (22, 2.5)
        assert bands.attrs["method"].startswith("LHSScanning(samples=7, points=3")


def call_adaptive(file, out, tolerance, *arguments, status=0):
    result = call("run", file, "--output", out, "--method", "adaptive-pcci",
                  "--tolerance", tolerance, *arguments)  # fmt: skip
    assert result.exit_code == status, result.output
    return " ".join(result.output.split())


def test_a_tolerance_that_is_not_met_is_reported(study_file, tmp_path):
    out = tmp_path / "out"
    output = call_adaptive(study_file, out, 1e-9, "--max-runs", 6, "--verbose", status=3)
    page = (out / "report.html").read_text(encoding="utf-8")
    for text in (output, page):
        assert "Orders: rate" in text
        assert "The tolerance of 1e-7 % is NOT met" in text.replace("−", "-")
    with xr.open_dataset(out / "bands.nc", engine="scipy") as bands:
        assert bands.attrs["expected_error"] > 1e-9


def test_a_tolerance_that_is_met_is_not_mentioned(study_file, tmp_path):
    out = tmp_path / "out"
    output = call_adaptive(study_file, out, 0.1, "--max-runs", 40, "--verbose")
    page = (out / "report.html").read_text(encoding="utf-8")
    for text in (output, page):
        assert "Orders: rate" in text
        assert "NOT met" not in text
    with xr.open_dataset(out / "bands.nc", engine="scipy") as bands:
        assert bands.attrs["expected_error"] < 0.1


def test_new_runs_verify_a_surrogate(study_file, tmp_path):
    out = tmp_path / "out"
    output = call_adaptive(study_file, out, 0.001, "--verbose")
    page = (out / "report.html").read_text(encoding="utf-8")
    for text in (output, page):
        assert (
            "Estimate confirmed: 16 verification runs, 12 of them at the ends of the bands" in text
        )
        assert "no more than expected; the largest error that follows is 0" in text
    assert fb.load_surrogate(out / "surrogate.npz").labels.sizes["output"] == 2
    with xr.open_dataset(out / "verification.nc", engine="scipy") as verification:
        assert verification["confirmed"].values.all()
        assert verification.attrs["runs"] == 16
    assert "onfirmed" not in call_adaptive(study_file, tmp_path / "none", 0.1, "--verify", 0)
    assert not (tmp_path / "none" / "verification.nc").exists()
    result = call("run", study_file, "--output", out, "--method", "lhs-scanning", "--verify", 4)
    assert result.exit_code == 2
    assert "--verify requires a method with a surrogate; got LHS–Scanning" in result.output
    for samples in (1, -1):
        answer = call("run", study_file, "--output", out / "few", "--verify", samples)
        assert answer.exit_code == 2
        assert f"--verify must be 0, or 2 or more; got {samples}" in answer.output
    assert not (out / "few").exists()  # refused before the runs


def test_options_change_the_method_of_the_study(study_file, tmp_path):
    result = call("run", study_file, "--output", tmp_path / "out", "--interval-order", 2)
    assert result.exit_code == 0, result.output
    assert "improved PCCI (1, 2)" in result.output
    assert "(29 runs, " in result.output
    refusal = call("run", study_file, "--output", tmp_path / "out", "--samples", 500)
    assert refusal.exit_code == 2
    message = (
        "options of improved PCCI are --random-order, --interval-order, --correct; got --samples"
    )
    assert message in " ".join(refusal.output.split())


def test_methods_are_those_of_the_package(study_file):
    output = call("run", "--help-methods").output
    for name in ("adaptive-pcci", "phase-resolved-pcci", "improved-pcci", "pcci", "lhs-scanning",
                 "monte-carlo", "--random-order", "--max-runs", "--seed"):  # fmt: skip
        assert name in output
    refusal = call("run", study_file, "--method", "magic")
    assert refusal.exit_code == 2
    assert "--method must be 'adaptive-pcci', " in refusal.output


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
    assert "box: improved PCCI (0, 1)" in result.output
    assert "(19 runs, " in result.output


def test_compare_writes_data_once_figures_and_a_report(study_file, tmp_path, monkeypatch):
    out = tmp_path / "out"
    files = []

    def store(file, **options):
        files.append(file)
        return ScipyDataStore(file, **options)

    monkeypatch.setattr("flexband.study.results.netcdf.ScipyDataStore", store)
    result = call("compare", study_file, "--output", out, "--samples", 50, "--points", 3,
                  "--orders", "1,1 1,4")  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "field: random field, 1 term, largest variance error" in result.output
    assert "Times do not include compilation." in result.output
    assert {p.name for p in out.iterdir()} >= {
        "report.html", "improved_pcci_1_4.nc", "lhs_scanning.nc",
    }  # fmt: skip
    page = (out / "report.html").read_text(encoding="utf-8")
    captions = "Variance error of the random", "Response without uncertainty", "error bar of v, k"
    for caption in (*captions, "Relative errors of u against runs"):
        assert caption in page
    assert len(files) == len(set(files)) == len(list(out.glob("*.nc"))) == 13


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1", "must define `study`, a flexband.Study; got no `study`"),
        (STUDY.replace("study = fb", "mine = fb"), "got no `study`; 'mine' is one, call it study"),
        (STUDY.replace("ImprovedPCCI(1, 4)", "PCCI"), "got the class PCCI: write PCCI(…)"),
        (STUDY.replace("fb.Interval(0.1, 0.2)", "fb.Interval"), "rate"),
        (STUDY.replace("    values =", "    raise SystemExit(0)\n    values =", 1),
         "the response called sys.exit(0)"),
        (STUDY.replace("domain=(0.0, 0.5), ", "")
         .replace("    values =", "    raise SystemExit(0)\n    values =", 1),
         "the study called sys.exit(0)"),
        (STUDY.replace('"rate": fb.Interval(0.1, 0.2)', '"speed": fb.Interval(0.1, 0.2)'),
         "inputs name speed, which the response does not take"),
        (STUDY.replace("Interval(0.1, 0.2)", "Interval(0.3, 0.2)"), "must not be above"),
    ],
)  # fmt: skip
def test_errors_are_one_line_and_exit_with_status_one(tmp_path, text, message):
    file = tmp_path / "bad.py"
    file.write_text(text, encoding="utf-8")
    result = call("run", file, "--output", tmp_path / "out")
    assert result.exit_code == 1
    assert message in " ".join(result.output.split())
    assert "Traceback" not in result.output


def test_debug_prints_the_traceback(tmp_path):
    file = tmp_path / "bad.py"
    file.write_text("study = 1 / 0", encoding="utf-8")
    for arguments in (["--debug", "run", file], ["run", file, "--debug"]):
        assert call(*arguments).exit_code == 1
        assert "Traceback" in call(*arguments).output
    assert "Traceback" not in call("run", file).output


def test_missing_file_and_bad_orders(tmp_path, study_file):
    missing = call("run", tmp_path / "none.py")
    assert missing.exit_code == 1
    assert "file must be a Python file that exists" in missing.output
    for orders in ("three", "", "1,2,3"):
        bad = call("compare", study_file, "--orders", orders)
        assert bad.exit_code == 2
        assert "orders must be pairs k,q such as" in bad.output


WRITTEN = {"bands.nc", "surrogate.npz", "contributions.nc", "page.json", "report.html"}
WRITTEN |= {"results.json"}

NAMES = ["A B", "a/b", "$x_", "[bold]:smile:力", "ü" * 300, ".."]


def test_any_names_of_outputs_are_in_the_report(tmp_path):
    file = tmp_path / "names.py"
    out = tmp_path / "out"
    coords = f'"output": {NAMES}, "unit": ("output", {["m"] * len(NAMES)})'
    text = STUDY.replace('"output": ["u", "v"], "unit": ("output", ["m", "N"])', coords)
    text = text.replace(
        "np.stack([values, 2 * values], axis=1)",
        f"np.stack([k * values for k in range(1, {len(NAMES) + 1})], axis=1)",
    )
    file.write_text(text, encoding="utf-8")
    result = call("run", file, "--output", out)
    assert result.exit_code == 0, result.output
    assert {p.name for p in tmp_path.iterdir()} == {"names.py", "out"}
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("<img") == 1  # realizations of the input
    data = json.loads(re.search('id="data">(.*?)</script>', page)[1])  # pyright: ignore
    assert [output["name"] for output in data["charts"]["outputs"]] == NAMES
    assert "remark" not in result.output


def test_a_figure_that_cannot_be_drawn_is_a_remark(study_file, tmp_path, monkeypatch):
    def fail(fields, along):
        raise ValueError(f"no picture of {', '.join(fields)}")

    monkeypatch.setattr("flexband.report.page.given.fields_picture", fail)
    out = tmp_path / "out"
    result = call("run", study_file, "--output", out, "--no-store")
    assert result.exit_code == 0, result.output
    text = " ".join(result.output.split())
    assert "remark: The fields cannot be shown: no picture of field" in text
    assert {p.name for p in out.iterdir()} == WRITTEN | {"verification.nc"}
    assert "no picture of field" in (out / "report.html").read_text(encoding="utf-8")


def test_results_are_saved_before_anything_else_can_fail(study_file, tmp_path, monkeypatch):
    def fails(*arguments, **options):
        raise RuntimeError("no bands today")

    out = tmp_path / "out"
    monkeypatch.setattr(fb.Surrogate, "bands", fails)
    result = call("run", study_file, "--output", out)
    assert result.exit_code == 1
    assert "flexband: RuntimeError: no bands today (" in result.output
    assert fb.load_surrogate(out / "surrogate.npz").labels.sizes["output"] == 2
    monkeypatch.undo()
    monkeypatch.setattr("flexband.report.text.band_tables.summary_table", fails)
    assert call("run", study_file, "--output", out).exit_code == 1
    assert (out / "bands.nc").exists()


def test_a_surrogate_that_cannot_be_saved_costs_nothing_else(study_file, tmp_path):
    text = STUDY.replace("terms=1)", "terms=1, correlation=lambda d: np.exp(-d * d))")
    study_file.write_text(text, encoding="utf-8")
    result = call("run", study_file, "--output", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "remark: field: <function" in result.output
    assert "surrogate.npz" not in result.output
    assert (tmp_path / "out" / "bands.nc").exists()


def test_a_comparison_is_printed_although_its_report_cannot_be_written(
    study_file, tmp_path, monkeypatch
):
    def full(*arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("flexband.report.study_figures.write_figures", full)
    result = call("compare", study_file, "--output", tmp_path / "out", "--samples", 4,
                  "--points", 2, "--orders", "1,1")  # fmt: skip
    assert result.exit_code == 1
    assert "relative errors against LHS" in result.output
    assert "No space left on device" in result.output


@pytest.mark.parametrize("command", ["run", "compare"])
def test_the_output_is_tried_before_the_first_run(command, tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    study = tmp_path / "study.py"
    study.write_text(STUDY.replace("    values =", "    print('ran')\n    values =", 1))
    for folder in (tmp_path / "file" / "below", tmp_path / ("long" * 100)):
        result = call(command, study, "--output", folder)
        assert result.exit_code == 1
        assert "--output must be a folder to write to" in " ".join(result.output.split())
        assert "ran" not in result.output


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("study = 1 / 0", "line 1: ZeroDivisionError: division by zero"),
        ("x = 1\nstudy = (", "SyntaxError"),
        ("import nowhere_at_all", "line 1: ModuleNotFoundError: No module named"),
        ("raise SystemExit(3)", "line 1: SystemExit: 3"),
        ("import sys; sys.exit()", "SystemExit"),
        (b"\xff\xfe\x00", "Error"),
        ("import flexband as fb\nstudy = fb.Study", "must define `study`"),
        ("import flexband as fb\nstudy = fb.Study(3, {'x': fb.Interval(0, 1)}, fb.PCCI())",
         "line 2: response must be a function with named arguments; got 3"),
        ("import flexband as fb\nstudy = fb.Study(lambda x: x, [1], fb.PCCI())",
         "line 2: inputs must be a dict of names and inputs; got [1]"),
        ("import flexband as fb\nstudy = fb.Study(lambda x: x, {'x': fb.Interval(0, 1)}, 'PCCI')",
         "line 2: method must be one like AdaptivePCCI(0.01); got 'PCCI'"),
        ("import flexband as fb\n"
         "study = fb.Study(lambda x: x[:, None] / [], {'x': fb.Interval(0, 1)}, fb.PCCI())",
         "the response must return a number per run"),
        ("import flexband as fb\n"
         "study = fb.Study(lambda x: {}['k'], {'x': fb.Interval(0, 1)}, fb.PCCI())",
         "flexband: the response raised KeyError: 'k'; inputs of the 4 runs of the call: x from"),
    ],
)  # fmt: skip
def test_odd_study_files_are_one_line(tmp_path, text, message):
    file = tmp_path / "odd.py"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    result = call("run", file, "--output", tmp_path / "out")
    assert result.exit_code == 1
    assert message in " ".join(result.output.split())
    assert "Traceback" not in result.output


def test_warnings_are_remarks(study_file, tmp_path):
    text = STUDY.replace("    values =", "    warn('an odd number')\n    values =", 1)
    study_file.write_text("from flexband.basics.warning import warn\n" + text, encoding="utf-8")
    result = call("run", study_file, "--output", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "flexband: remark: an odd number" in result.output
    assert "FlexbandWarning" not in result.output


def test_an_ascii_terminal_is_enough(study_file, tmp_path):
    text = STUDY.replace('"u", "v"', '"µ ü …", "v"')
    study_file.write_text(text, encoding="utf-8")
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        "PYTHONIOENCODING": "ascii", "LANG": "C", "LC_ALL": "C", "PYTHONUTF8": "0",
    }  # fmt: skip
    program = """
import sys
from flexband.cli import app

file, out, missing = sys.argv[1:]
for words in (["run", file, "--output", out], ["run", "--help"], ["run", missing]):
    try:
        app(words)
    except SystemExit as end:
        print("status", end.code, flush=True)
"""
    arguments = [study_file, tmp_path / "oüt", tmp_path / "fehlt µ.py"]
    process = subprocess.run([sys.executable, "-c", program, *map(str, arguments)], env=environment,
                          capture_output=True, check=True)  # fmt: skip
    assert re.findall(rb"^status (\d)", process.stdout, re.MULTILINE) == [b"0", b"0", b"1"]
    assert b"Traceback" not in process.stderr
    assert b"UnicodeEncodeError" not in process.stderr
    (process.stdout + process.stderr).decode("ascii")


def test_files_of_an_earlier_run_are_not_taken_for_new_ones(study_file, tmp_path):
    out = tmp_path / "out"
    assert call("run", study_file, "--output", out, "--verify", 2, "--no-store").exit_code == 0
    foreign_files = {"mine.png", "notes.txt"}
    for name in foreign_files:
        (out / name).write_text("mine", encoding="utf-8")
    first = WRITTEN | {"verification.nc"}
    assert {p.name for p in out.iterdir()} == foreign_files | first
    renamed = STUDY.replace('"u", "v"', '"u", "w"')
    study_file.write_text(renamed, encoding="utf-8")
    result = call("run", study_file, "--output", out, "--method", "lhs-scanning", "--samples", 3,
                  "--no-store")  # fmt: skip
    assert result.exit_code == 0, result.output
    assert {
        p.name for p in out.iterdir()
    } == foreign_files | first  # nothing that was computed is removed
    text = " ".join(result.output.replace("\n", "").split())
    for name in ("surrogate.npz", "verification.nc", "contributions.nc"):
        assert re.search(rf"Older: [^ ]*{name}, of an earlier run", text)


def test_a_full_disk_is_named_and_leaves_older_files(study_file, tmp_path, monkeypatch):
    out = tmp_path / "out"
    assert call("run", study_file, "--output", out, "--no-store").exit_code == 0
    content = {p.name: p.read_bytes() for p in out.iterdir()}

    def full(self, *arguments, **options):
        if self.name.endswith(".partial") and not self.name.startswith("holder"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return open_path(self, *arguments, **options)

    open_path = Path.open
    monkeypatch.setattr(Path, "open", full)
    monkeypatch.setattr(Path, "write_text", full)
    monkeypatch.setattr(
        "flexband.study.results.netcdf.ScipyDataStore", lambda to, **_: full(Path(to))
    )
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda figure, file, **_: full(file))
    result = call("run", study_file, "--output", out, "--interval-order", 2, "--no-store")
    assert result.exit_code == 1
    text = " ".join(result.output.replace("\n", "").split())
    for name in ("surrogate.npz", "bands.nc", "report.html"):
        assert re.search(rf"No space left on device: '[^']*{name}'", text), name
    assert {p.name: p.read_bytes() for p in out.iterdir()} == content


def test_a_comparison_keeps_the_methods_that_are_finished(study_file, tmp_path, monkeypatch):
    def fails(*arguments):
        raise KeyboardInterrupt

    out = tmp_path / "out"
    monkeypatch.setattr("flexband.study.comparison.warm_up", lambda *_: None)
    monkeypatch.setattr(fb.methods.PhaseResolvedPCCI, "solve", fails)
    result = call("compare", study_file, "--output", out, "--samples", 4, "--points", 2,
                  "--orders", "1,1")  # fmt: skip
    assert result.exit_code == 130
    assert {p.name for p in out.iterdir()} == {
        "lhs_scanning.nc", "pcci_1_1.nc", "improved_pcci_1_1.nc", "results.json"
    }  # fmt: skip


def test_help_shows_units_and_defaults_in_brackets():
    output = " ".join(call("run", "--help").output.replace("│", " ").split())
    assert "Time limit [s] of one call" in output
    assert "0 for none. [default: 16]" in output


def test_the_help_of_run_fits_a_screen():
    lines = CliRunner().invoke(app, ["run", "--help"], env={"COLUMNS": "80"}).output.splitlines()
    assert len(lines) <= 40
    assert max(map(len, lines)) <= 80
    assert "--help-methods" in "".join(lines)


def test_a_misspelled_name_in_a_builder_is_told_with_its_line_and_the_nearest_name(tmp_path):
    file = tmp_path / "arm.py"
    file.write_text(
        "import flexband as fb\n\n\ndef arm(length):\n"
        "    return fb.Mechanism(bodies={'a': fb.RigidBoby.bar(length=length)}, joints={})\n\n\n"
        "study = fb.Study(fb.dynamic_response(arm, duration=0.1), {'length': fb.Interval(1, 2)},\n"
        "                 fb.AdaptivePCCI())\n",
        encoding="utf-8",
    )
    result = call("run", file, "--output", tmp_path / "out")
    assert result.exit_code == 1
    text = " ".join(result.output.split())
    assert "no attribute 'RigidBoby'; did you mean 'flexband.RigidBody'?" in text
    assert "arm.py, line 5)" in "".join(result.output.split("\n")).replace("  ", " ")
