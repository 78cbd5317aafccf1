"""Symbolic links in an output folder are never followed."""

import os
import shutil

import pytest
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app

STUDY = """
import numpy as np
import flexband as fb

def response(a, x):
    return np.outer(a + 0.1 * x, np.linspace(0.5, 1.0, 5))

inputs = {"a": fb.Interval(0.9, 1.1), "x": fb.Normal(0, 1)}
study = fb.Study(response, inputs, fb.AdaptivePCCI(),
                 requirements=fb.Requirement("response", below=2.0))
"""

pytestmark = pytest.mark.skipif(os.name == "nt", reason="links require rights")


def call(*words):
    result = CliRunner().invoke(app, [str(word) for word in words])
    return result.exit_code, " ".join(result.output.split())


@pytest.fixture(scope="module")
def study_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    (folder / "study.py").write_text(STUDY, encoding="utf-8")
    assert call("run", folder / "study.py", "--output", folder / "out", "--verify", 0)[0] == 0
    assert call("distribution", folder / "out")[0] == 0
    return folder


def linked(name, target):
    """Put a link in place of a file."""
    name.unlink(missing_ok=True)
    name.symlink_to(target)


@pytest.mark.parametrize("locks", [(), ("lock",), ("study.lock",)])
def test_no_target_of_a_link_is_written_or_shown(locks, study_folder, tmp_path):
    """Neither by the study, also where it is refused, nor by answers."""
    secret = tmp_path / "secret"
    out = tmp_path / "out"
    secret.write_bytes(b"secret")
    shutil.copytree(study_folder / "out", out)
    names = {entry.name for entry in out.iterdir() if entry.is_file()} - {"lock", "study.lock"}
    assert {"holder", "study.json", "bands.nc", "quantiles.png"} <= names
    for name in names.union(locks, ["limits.png"]):
        linked(out / name, secret)
    outputs = [call("run", study_folder / "study.py", "--output", out, "--verify", 0, "--replace")]
    assert outputs[0][0] == bool(locks), outputs
    outputs += [call("report", out), call("status", out)]
    assert "secret" not in str(outputs)
    assert secret.read_bytes() == b"secret"
    page = out / "report.html"
    assert page.is_symlink() or "c2VjcmV0" not in page.read_text(encoding="utf-8")  # in base64


def test_a_store_with_a_link_is_refused(study_folder, tmp_path):
    out = tmp_path / "out"
    other = tmp_path / "other"
    for name in ("", "outputs", "zarr.json", "journal-000009"):
        shutil.copytree(study_folder / "out", out)
        link = out / "runs.zarr" / name
        if link.exists():
            shutil.move(link, other)
        else:
            other.write_bytes(b"secret")
        link.symlink_to(other)
        for words in (["run", study_folder / "study.py", "--output", out], ["status", out],
                      ["export", out, "--to", tmp_path / "runs.csv"]):  # fmt: skip
            status, output = call(*words)
            if words[0] != "run" or "no run was made" not in output:
                assert (status, "is a symbolic link" in output) == (1, True), (name, words, output)
        with pytest.raises(fb.errors.StoreError, match="symbolic link"):
            fb.execution.open_runs(out)
        shutil.rmtree(out)
        shutil.rmtree(other) if other.is_dir() else other.unlink()
