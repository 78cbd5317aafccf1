"""Models that other people run: points out, results in; and runs for other programs."""

import csv
import sys

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.basics.words import are
from flexband.cli import app

TIMES = [0.0, 1 / 3, 2 / 3]
STUDY = f"""
import flexband as fb
response = fb.models.elsewhere("a", "b", "oil", outputs=["u", "v"], times={TIMES})
inputs = {{"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.1, 0.3), "oil": fb.Choice("thin", "thick")}}
study = fb.Study(response, inputs, fb.AdaptivePCCI(0.01))
"""


def model(a, b, oil):
    thick = np.where(np.asarray(oil) == "thick", 2.0, 1.0)[:, None]
    u = np.exp(a[:, None] * np.array(TIMES) * thick) * np.cos(b[:, None])
    return xr.DataArray(
        np.stack([u, 1.0 / (1.0 + u)], axis=1), dims=("sample", "output", "time"),
        coords={"output": ["u", "v"], "time": ("time", TIMES, {"units": "s"})},
    )  # fmt: skip


def call(*arguments, status=0):
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    assert result.exit_code == status, result.output
    return " ".join(result.output.split())


def read_points(out):
    with (out / "points.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def answer(out, to):
    """Run the model at the points, as somebody else would: from the file alone."""
    rows = read_points(out)
    a, b = (np.array([float(row[name]) for row in rows]) for name in "ab")
    values = model(a, b, [row["oil"] for row in rows])
    if to.suffix == ".nc":
        by_point = values.rename(sample="point").isel(output=[1, 0]).transpose("point", ...)
        numbers = "point", [int(row["number"]) for row in rows]
        xr.Dataset({"outputs": by_point, "number": numbers}).to_netcdf(to, engine="scipy")
        return
    header = [f"{name}[time={t!r}]" for name in "uv" for t in TIMES]
    with to.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["b", *header, "number"])
        for row, row_values in reversed(
            list(zip(rows, values.values.reshape(len(rows), -1), strict=True))
        ):
            writer.writerow(
                [f"{float(row['b']):.15g}", *map(repr, row_values.tolist()), row["number"]]
            )


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "wear.py"
    path.write_text(STUDY, encoding="utf-8")
    return path


@pytest.mark.usefixtures("no_drawing")
def test_round_by_round_until_the_method_has_converged(file, tmp_path):
    out = tmp_path / "out"
    rounds = 0
    while (
        result := CliRunner().invoke(app, ["export-points", str(file), "-o", str(out)])
    ).exit_code == 4:
        assert "to be run" in result.output
        rounds += 1
        results = tmp_path / ("results.nc" if rounds % 2 else "results.csv")
        answer(out, results)
        assert f"{are(len(read_points(out)), 'run')} recorded, 0 of" in call(
            "import-results", out, results
        )
    assert result.exit_code == 0, result.output
    assert rounds >= 3
    inputs = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.1, 0.3),
              "oil": fb.Choice("thin", "thick")}  # fmt: skip
    direct = fb.propagate(model, inputs, fb.AdaptivePCCI(0.01))
    with xr.open_dataset(out / "bands.nc", engine="scipy") as bands:
        for name in ("mean", "error_bar"):
            np.testing.assert_array_equal(bands[name], direct[name])
    assert "no run was made" in call("run", file, "-o", out, "--verify", 0)


def test_results_that_do_not_fit_are_refused(file, tmp_path):
    out = tmp_path / "out"
    results = tmp_path / "results.csv"
    assert "points are to be run" in call("export-points", file, "-o", out, status=4)
    assert "waiting" in call("status", out)
    answer(out, results)
    content = results.read_text(encoding="utf-8")
    header, *lines = content.splitlines()
    cells = lines[0].split(",")
    cases = {
        "must have the columns number and u[time=0.0]": content.replace("u[time=0.0]", "w"),
        "number must be that of": "\n".join([header, ",".join([*cells[:-1], "999"])]),
        "b must be ": "\n".join([header, ",".join(["5.0", *cells[1:]])]),
        "is there twice": "\n".join([header, lines[0], lines[0]]),
        "must be a number; got 'x'": "\n".join([header, ",".join([cells[0], "x", *cells[2:]])]),
        "separated by commas": f"{header}\n{lines[0].replace(',', ';')}",
        "must have a header and at least one row": header,
    }
    for message, text in cases.items():
        results.write_text(text, encoding="utf-8")
        assert message in call("import-results", out, results, status=1), message
    assert "cannot be read as a table" in call(
        "import-results", out, tmp_path / "none.csv", status=1
    )
    (tmp_path / "bad.nc").write_bytes(b"none")
    assert "must be a NetCDF 3 file" in call("import-results", out, tmp_path / "bad.nc", status=1)
    text = "\n".join(
        [header, ",".join([cells[0], *[""] * (len(cells) - 2), cells[-1]]), *lines[1:]]
    )
    results.write_text(text, encoding="utf-8")
    output = call("import-results", out, results)
    assert "1 of" in output
    second = call("import-results", out, results)
    assert "0 runs are recorded" in second
    assert "results.csv has no values for it" in call("status", out)
    call("export-points", file, "-o", out, status=4)
    assert read_points(out)[0]["number"] == cells[-1]  # it keeps its number


def test_points_need_a_response_elsewhere(file, tmp_path):
    file.write_text(STUDY.replace("response, inputs", "lambda a, b, oil: a, inputs"))
    output = call("export-points", file, "-o", tmp_path / "out", status=1)
    assert "the response must be one that is run elsewhere" in output
    wrong = [((), {}), (("a b",), {}), (("a", "a"), {}), (("a",), {"outputs": "u"}),
             (("a",), {"times": [1, 0]})]  # fmt: skip
    for names, options in wrong:
        with pytest.raises(fb.errors.InputError):
            fb.models.elsewhere(*names, **options)
    with pytest.raises(fb.errors.RunsNeeded, match="2 runs of a must come from elsewhere") as error:
        fb.propagate(fb.models.elsewhere("a"), {"a": fb.Interval(0.0, 1.0)}, fb.PCCI(0, 1))
    assert error.value.points.shape == (2, 1)


DECAY = """
import numpy as np, xarray as xr, flexband as fb
time = np.array([0.0, 0.5])
def response(a, k):
    if (k > 0.9).any():
        raise ValueError("too much")
    return xr.DataArray(a[:, None, None] * np.exp(-time * k[:, None, None]),
                        dims=("sample", "output", "time"),
                        coords={"output": ["u"], "time": ("time", time, {"units": "s"})})
study = fb.Study(response, {"a": fb.Interval(1.0, 2.0), "k": fb.Uniform(0.0, 1.0)},
                 fb.LHSScanning(16, 2))
"""


def test_runs_are_exported(tmp_path, monkeypatch):
    file = tmp_path / "decay.py"
    out = tmp_path / "out"
    file.write_text(DECAY, encoding="utf-8")
    call("run", file, "-o", out, "--failed", "skip", status=3)  # above 5 % failed
    assert "32 runs" in call("export", out, "--to", tmp_path / "runs.csv")
    with (tmp_path / "runs.csv").open(encoding="utf-8") as file_of_runs:
        rows = list(csv.DictReader(file_of_runs))
    names = ["run", "status", "reason", "setting", "seconds", "finished", "a", "k"]
    assert list(rows[0]) == [*names, "u[time=0.0]", "u[time=0.5]"]
    assert sorted({row["status"] for row in rows}) == ["done", "failed"]
    for row in rows:
        a = float(row["a"])
        k = float(row["k"])
        if row["status"] == "done":
            assert float(row["u[time=0.5]"]) == a * np.exp(-0.5 * k)  # all digits
        else:
            assert (row["u[time=0.5]"], "too much" in row["reason"]) == ("", True)
    call("export", out, "--to", tmp_path / "runs.nc")
    with xr.open_dataset(tmp_path / "runs.nc", engine="scipy", decode_timedelta=False) as runs:
        assert dict(runs.sizes)["run"] == 32
        np.testing.assert_array_equal(runs["time"], [0.0, 0.5])
        np.testing.assert_array_equal(
            runs["outputs"][:, 0, 1].fillna(0.0), [float(r["u[time=0.5]"] or 0) for r in rows]
        )
    refusal = call("export", out, "--to", tmp_path / "runs.xls", status=2)
    assert "--to must be a file whose name ends with .nc, .csv, .parquet" in refusal
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    missing = call("export", out, "--to", tmp_path / "runs.parquet", status=1)
    assert "requires pyarrow: pip install 'flexband[parquet]'" in missing
