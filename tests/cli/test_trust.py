"""A folder from somebody else runs nothing that its reader does not know."""

import json

import pytest
from typer.testing import CliRunner

from flexband.cli import app

STUDY = """
from pathlib import Path
import numpy as np
import flexband as fb

Path(__file__).with_name("ran").touch()

def response(a, x):
    return np.outer(a + 0.1 * x, np.linspace(0.5, 1.0, 5))

inputs = {"a": fb.Interval(0.9, 1.1), "x": fb.Interval(-1, 1)}
study = fb.Study(response, inputs, fb.PCCI(1, 1),
                 requirements=fb.Requirement("response", below=2.0))
"""
COMMANDS = {
    "resume": (),
    "check": (),
    "narrow": ("a=0.95..1.05",),
    "allocate": ("--cost", "a=1", "--cost", "x=1", "--no-confirm"),
    "import-results": ("results.csv",),
}


def call(*words):
    result = CliRunner().invoke(app, [str(word) for word in words])
    return result.exit_code, "".join(result.output.split())


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The output of a study, which has gone to other folders."""
    study = tmp_path / "mine" / "study.py"
    out = tmp_path / "mine" / "out"
    study.parent.mkdir()
    study.write_text(STUDY, encoding="utf-8")
    assert call("run", study, "--output", out, "--verify", 4)[0] == 0
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    return out


def move(folder, file):
    """Let the folder name a file that tells if it ran."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(STUDY, encoding="utf-8")
    file.with_name("ran").unlink(missing_ok=True)
    name = folder / "study.json"
    record = json.loads(name.read_text(encoding="utf-8"))
    name.write_text(json.dumps(record | {"file": str(file)}), encoding="utf-8")
    return file


@pytest.mark.parametrize("place", ["theirs/study.py", "mine/out/study.py", "mine/link.py"])
def test_a_file_elsewhere_is_not_run(place, folder, tmp_path):
    file = tmp_path / place
    if file.name == "link.py":
        target = move(folder, tmp_path / "theirs" / "study.py")
        file.symlink_to(target)
        record = (folder / "study.json").read_text(encoding="utf-8")
        name = folder / "study.json"
        name.write_text(record.replace(str(target), str(file)), encoding="utf-8")
        marker = target.with_name("ran")
    else:
        marker = move(folder, file).with_name("ran")
    for command, options in COMMANDS.items():
        status, output = call(command, folder, *options)
        assert status == 2, (command, output)
        assert str(file) in output
        assert "--trust" in output
    assert not marker.exists()
    status, output = call("check", folder, "--trust")
    assert status == 0, output
    assert marker.exists() or (file.parent / "ran").exists()


def test_a_file_below_the_working_directory_or_beside_the_folder_is_run(folder, tmp_path):
    for file in (tmp_path / "mine" / "other.py", tmp_path / "elsewhere" / "deep" / "study.py"):
        marker = move(folder, file).with_name("ran")
        assert call("check", folder)[0] == 0
        assert marker.exists()


def test_a_scheduler_on_another_host_is_not_connected_to(folder):
    name = folder / "study.json"
    record = json.loads(name.read_text(encoding="utf-8"))
    name.write_text(json.dumps(record | {"executor": "tcp://host.invalid:1"}), encoding="utf-8")
    status, output = call("resume", folder)
    assert (status, "tcp://host.invalid:1" in output, "--trust" in output) == (2, True, True)
    status, output = call("resume", folder, "--executor", "processes:1")
    assert (status, "norunwasmade" in output) == (0, True)
