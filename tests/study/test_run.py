"""A study that Python runs into a folder."""

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.report.study_report import headline_of
from flexband.report.text import band_tables
from flexband.study.results.reliability import Doubt, DoubtKind
from flexband.study.results.result import doubts_about
from flexband.study.run import RunOptions, run_study
from flexband.study.study import load_study

STUDY = """
import numpy as np
import flexband as fb

CALLS = []

def response(a, e):
    CALLS.append(len(a))
    if len(CALLS) == STOP:
        raise KeyboardInterrupt
    return np.outer(e + a**2, np.linspace(0.0, 1.0, 5))

study = fb.Study(response, {"a": fb.Normal(1.0, 0.1), "e": fb.Interval(1.0, 2.0)},
                 fb.AdaptivePCCI(), requirements=fb.Requirement("response", below=4.0))
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "sum.py"
    path.write_text(STUDY.replace("STOP", "-1"), encoding="utf-8")
    return path


def test_a_study_is_run_into_a_folder_without_a_word(file, tmp_path, capfd):
    study = load_study(file)
    folder = tmp_path / "out"
    result = study.run_in(folder)
    assert capfd.readouterr() == ("", "")
    assert not list(folder.glob("*.html")) + list(folder.glob("*.png"))
    xr.testing.assert_identical(result.bands, study.run())
    xr.testing.assert_identical(
        result.verification, fb.verify(result.surrogate, study.response).verification
    )
    assert result.limits.margins.attrs["kept"] == "kept"
    assert result.limits.probability is not None
    assert set(result.contributions["name"].values) == {"a", "e"}
    assert (result.doubts, result.reused) == ((), False)
    assert all((folder / name).is_file() for name in result.files)


def test_a_result_that_is_there_is_read(file, tmp_path):
    first = load_study(file).run_in(tmp_path / "out")
    study = load_study(file)
    second = study.run_in(tmp_path / "out")
    assert second.reused
    assert study.response.__globals__["CALLS"] == []
    for name in ("bands", "verification", "contributions"):
        xr.testing.assert_equal(getattr(second, name), getattr(first, name))
    for name in ("label", "runs", "doubts", "files", "limits_unchecked", "seconds_per_run"):
        assert getattr(second, name) == getattr(first, name), name
    xr.testing.assert_identical(second.surrogate.bands(), first.surrogate.bands())
    xr.testing.assert_equal(second.limits.margins, first.limits.margins)


@pytest.mark.usefixtures("no_drawing")
def test_a_result_without_its_limits_is_computed_again(file, tmp_path):
    study = load_study(file)
    folder = tmp_path / "out"
    for name in ("limits", "probability"):
        first = study.run_in(folder)
        (folder / f"{name}.nc").unlink()
        second = study.run_in(folder)
        assert not second.reused
        xr.testing.assert_equal(second.limits.margins, first.limits.margins)
        assert second.limits.probability is not None
    CliRunner().invoke(app, ["check", str(folder), "--below", "response=9"])
    assert study.run_in(folder).reused  # limits of a question do not take their place


def test_a_damaged_study_json_is_written_again(file, tmp_path):
    study = load_study(file)
    folder = tmp_path / "out"
    first = study.run_in(folder)
    (folder / "study.json").write_text("{", encoding="utf-8")
    with pytest.warns(fb.errors.FlexbandWarning, match="cannot be read"):
        second = study.run_in(folder)
    xr.testing.assert_identical(second.bands, first.bands)
    assert study.run_in(folder).reused


@pytest.mark.parametrize("method", [fb.methods.SobolScanning(16, 3), fb.PCCI(2, 2)])
def test_results_of_other_methods_and_of_choices_are_read(method, tmp_path):
    def response(a, kind):
        return np.outer(a * np.where(kind == "x", 1.0, 2.0), np.ones(3))

    inputs = {"a": fb.Interval(1.0, 2.0), "kind": fb.Choice("x", "y")}
    study = fb.Study(response, inputs, method, requirements=fb.Requirement("response", below=5.0))
    first = study.run_in(tmp_path)
    second = study.run_in(tmp_path)
    assert second.reused
    xr.testing.assert_equal(second.bands, first.bands)
    assert second.limits_unchecked == first.limits_unchecked
    assert (second.limits is None) == (first.limits is None) == (first.surrogate is None)
    assert headline_of(study, second) == headline_of(study, first)


@pytest.mark.parametrize("carriers", [0, 1, 2])
def test_what_is_said_of_a_result_that_is_read_is_the_same(carriers, tmp_path):
    t = np.linspace(0.0, 10.0, 400)

    def response(a, e):
        signal = 0.2 * (e + a)[:, None] * t
        for k in range(1, carriers + 1):
            signal = signal + np.cos(2 * np.pi * k**2 * (1 + 0.02 * (a + e))[:, None] * t) / k
        return signal

    inputs = {"a": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}
    study = fb.Study(response, inputs, fb.AdaptivePCCI(0.05))
    first = study.run_in(tmp_path)
    second = study.run_in(tmp_path)
    assert second.reused
    assert np.size(first.bands.attrs["carrier_frequencies"]) == carriers
    for text_of in (band_tables.remarks, band_tables.summary_table):
        assert text_of(second.bands, second.verification) == text_of(
            first.bands, first.verification
        )
    assert headline_of(study, second) == headline_of(study, first)


def test_the_command_line_shows_the_result_of_a_program(file, tmp_path):
    folder = tmp_path / "out"
    result = load_study(file).run_in(folder)
    invocation = CliRunner().invoke(app, ["run", str(file), "--output", str(folder)])
    assert invocation.exit_code == 0, invocation.output
    text = " ".join(invocation.output.split())
    assert "no run was made" in text
    made = result.runs + result.verification.attrs["runs"]
    assert f"report.html ({made} runs, " in text
    assert "PASS response below 4: met with a margin of" in text
    assert (folder / "report.html").is_file()
    refusal = CliRunner().invoke(app, ["resume", str(folder)])
    assert "a Python program runs the study" in " ".join(refusal.output.split())


def test_a_study_that_was_stopped_goes_on(file, tmp_path):
    unbroken = load_study(file)
    study = load_study(file)
    complete = unbroken.run_in(tmp_path / "complete")
    stopping_file = file.with_name("broken.py")
    stopping_file.write_text(STUDY.replace("STOP", "3"), encoding="utf-8")
    with pytest.raises(KeyboardInterrupt):
        load_study(stopping_file).run_in(tmp_path / "out")
    continuation = study.run_in(tmp_path / "out", RunOptions(allow_mismatch=True))
    run_count, all_runs = (sum(s.response.__globals__["CALLS"]) for s in (study, unbroken))
    assert run_count < all_runs
    xr.testing.assert_identical(continuation.bands, complete.bands)


def test_options_of_a_run(file, tmp_path):
    study = load_study(file)
    folder = tmp_path / "out"
    result = run_study(study, folder, RunOptions(verification_runs=0, record=False))
    assert result.verification is None
    assert not (folder / "study.json").exists()
    with pytest.raises(fb.errors.InputError, match="batch"):
        study.run_in(folder, RunOptions(batch=0))
    with pytest.raises(fb.errors.InputError, match="options must be a"):
        study.run_in(folder, 5)
    scan = study.with_method(fb.methods.SobolScanning(16, 3))
    with pytest.raises(
        fb.errors.InputError, match="verification_runs requires a method with a surrogate"
    ):
        scan.run_in(tmp_path / "scanned", RunOptions(verification_runs=4))
    assert scan.run_in(tmp_path / "scanned").verification is None
    other = fb.Study(lambda a: a, {"a": fb.Interval(0.0, 1.0)}, fb.PCCI(0, 1))
    study.run_in(folder)
    with pytest.raises(fb.errors.StoreError, match="results of another study"):
        other.run_in(folder)


@pytest.mark.parametrize(
    ("attrs", "verification", "kinds"),
    [
        ({}, None, []),
        ({"tolerance": 0.1, "expected_error": 0.2}, None, [DoubtKind.TOLERANCE_NOT_MET]),
        ({"not_trusted": "y"}, None, [DoubtKind.NOT_TRUSTED]),
        ({}, ("no", 0.1), [DoubtKind.NOT_CONFIRMED]),
        ({"tolerance": 0.1}, ("yes", 0.3), [DoubtKind.INACCURATE]),
        ({"tolerance": 0.4}, ("yes", 0.3), []),
    ],
)
def test_doubts_are_data(attrs, verification, kinds):
    if verification is not None:
        confirmed, error = verification
        verification = xr.Dataset(
            {"implied_error": ("output", [error]), "bar_width": ("output", np.ones(1))},
            attrs={"confirmed": confirmed},
        )
    doubts = doubts_about(xr.Dataset(attrs=attrs), verification, requested=verification is not None)
    assert [doubt.kind for doubt in doubts] == kinds
    assert [Doubt.from_json(doubt.as_json()) for doubt in doubts] == list(doubts)


def test_a_verification_that_failed_is_a_doubt():
    (doubt,) = doubts_about(xr.Dataset(), None, requested=True)
    assert (doubt.kind, doubt.unreliable) == (DoubtKind.NOT_VERIFIED, False)
