"""Results of commit ce872fc, before the format of results changed, open or say what to do."""

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.basics.computation import NUMBERING
from flexband.cli import app
from flexband.errors import InputError

OLDER = Path(__file__).parent / "results_of_ce872fc.zip"
"""The folder of a study of 9 runs and 16 verification runs, and a surrogate with a carrier."""

RESTORED = "`flexband run` restores it"


def unpack(archive, name, path):
    """Return the folder of a study in an archive, beside its file."""
    with zipfile.ZipFile(archive) as container:
        container.extractall(path)
    file = path / name / "study.json"
    record = json.loads(file.read_text(encoding="utf-8"))
    record["file"] = str(path / f"{name}.py")
    file.write_text(json.dumps(record), encoding="utf-8")
    return path / name


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The folder of a study, beside its file."""
    monkeypatch.chdir(tmp_path)
    return unpack(OLDER, "decay", tmp_path)


def call(*words, status=0):
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == status, result.output
    return " ".join(result.output.split())


def test_surrogates_open(folder):
    pairs = [("decay/surrogate.npz", "decay/bands.nc"), ("ringing.npz", "ringing.nc")]
    for file, data in pairs:
        surrogate = fb.load_surrogate(folder.parent / file, outdated=True)
        with xr.open_dataset(folder.parent / data, engine="scipy") as bands:
            for name in ("mean", "error_bar"):
                np.testing.assert_allclose(surrogate.bands(1.0)[name], bands[name], rtol=1e-6)
    refusal = call("contributions", folder.parent / "ringing.npz", status=1)
    assert "computes runs and answers otherwise now" in refusal


def test_runs_open_and_are_used_once_that_is_asked_for(folder):
    runs = fb.execution.open_runs(folder)
    rate = runs["inputs"].sel(input="rate").values
    amplitude = runs["inputs"].sel(input="amplitude").values
    exact = amplitude[:, None] * np.exp(-rate[:, None] * np.linspace(0.0, 1.0, 11))
    np.testing.assert_allclose(runs["outputs"], exact, rtol=1e-12)
    run_count = runs.sizes["run"]
    assert run_count == 24
    for command in (("resume", folder), ("run", folder.with_name("decay.py"), "-o", folder)):
        refusal = call(*command, status=1)
        assert "flexband's mechanics changed. Take another folder" in refusal
        assert "If its runs are valid still" in refusal
        assert "--allow-mismatch" in refusal
    assert "runs, 16 of them to check the result)" in call("resume", folder, "--allow-mismatch")
    assert (
        fb.execution.open_runs(folder).sizes["run"] <= run_count + 16 + 2
    )  # runs that verify, and repeated
    assert "Doubts" not in call("status", folder)
    assert "has this result already" in call("resume", folder)


def test_answers_and_reports_say_how_the_result_is_restored(folder):
    older = "an older version of flexband has written the result"
    assert f"{older}; {RESTORED}" in call("status", folder)
    for command in ("report", "contributions", "check", "distribution"):
        assert RESTORED in call(command, folder, status=1)


OUTDATED = Path(__file__).parent / "results_of_3bd77716.zip"
"""The folder of a study with contact, which has a PASS; numbers of runs and answers rose since."""

AGAIN = "computes runs and answers otherwise now; `flexband run` computes them again"


@pytest.fixture
def bob(tmp_path, monkeypatch):
    """The folder of a study with lower numbers, beside its file."""
    monkeypatch.chdir(tmp_path)
    return unpack(OUTDATED, "bob", tmp_path)


@pytest.fixture(scope="module")
def replacement(tmp_path_factory):
    """The folder after the study was run anew, and what that said."""
    folder = unpack(OUTDATED, "bob", tmp_path_factory.mktemp("replaced"))
    return folder, call("run", folder.with_name("bob.py"), "-o", folder, "--replace")


@pytest.mark.parametrize(
    "command",
    [["report"], ["check"], ["contributions"], ["yield"], ["sobol"], ["path", "bob_X", "bob_Y"]],
    ids=lambda command: command[0],
)
def test_outdated_verdicts_are_not_shown(bob, command):
    name, *outputs = command
    output = call(name, bob, *outputs, status=1)
    assert AGAIN in output
    assert "PASS" not in output


def test_status_says_that_results_are_outdated(bob):
    output = call("status", bob)
    assert AGAIN in output
    assert "PASS" not in output


def test_outdated_runs_are_not_used(bob, replacement):
    refusal = call("run", bob.with_name("bob.py"), "-o", bob, status=1)
    assert "flexband's mechanics changed" in refusal
    assert "`flexband run --replace`" in refusal
    assert "PASS" not in refusal
    folder, second = replacement
    assert "PASS" in second
    assert AGAIN not in call("status", folder)


@pytest.mark.parametrize(("field", "word"), [("runs", "runs"), ("answers", "answers")])
def test_a_number_that_rises_makes_results_outdated(replacement, field, word, monkeypatch):
    folder, _ = replacement
    numbering = NUMBERING._replace(**{field: getattr(NUMBERING, field) + 1})
    monkeypatch.setattr("flexband.basics.computation.NUMBERING", numbering)
    assert f"computes {word} otherwise now" in call("report", folder, status=1)
    with pytest.raises(InputError, match=f"computes {word} otherwise now"):
        fb.load_surrogate(folder / "surrogate.npz")
