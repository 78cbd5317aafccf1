"""Former commands and options are carried out, with one line that says what replaces them."""

import warnings

import numpy as np
import pytest
from typer.testing import CliRunner

import flexband as fb
from flexband import deprecation
from flexband.cli import app
from flexband.cli.commands import COMMANDS, commands, load, renamed

STUDY = """
import numpy as np
import flexband as fb

def response(a, x):
    return np.outer(a + 0.1 * x, np.linspace(0.5, 1.0, 5))

inputs = {"a": fb.Interval(0.9, 1.1), "x": fb.Normal(0, 1)}
stores = fb.Store("runs", insist=True), fb.Store("others")
study = fb.Study(response, inputs, fb.LHSScanning(6, 3))
"""


@pytest.fixture(autouse=True)
def _nothing_announced(monkeypatch):
    monkeypatch.setattr(deprecation, "_announced", set())


def call(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.mark.parametrize(
    ("former", "today"),
    [
        ("points f.py -o out", "export-points f.py -o out"),
        ("ingest out r.csv", "import-results out r.csv"),
        ("rerun out --failed --insist", "resume --retry-failed out --allow-mismatch"),
        ("run f.py --failed leave-out", "run f.py --failed skip"),
        ("run f.py --failed=leave-out", "run f.py --failed=skip"),
        ("range out -p 0.9", "distribution --kind range out -p 0.9"),
        ("p-box out u --time 1", "distribution --kind p-box out u --time 1"),
        ("quantiles out -p 0.1", "distribution --kind quantiles out -p 0.1"),
        ("run range -o points", "run range -o points"),
        ("derived leave-out peak", "derived leave-out peak"),
    ],
)
def test_former_words_are_replaced(former, today):
    words, names = renamed(former.split())
    assert words == today.split()
    assert bool(names) == (former != today)


def test_former_commands_are_replaced_by_commands():
    assert {words[0] for words in COMMANDS.values()} <= commands().keys()
    assert not COMMANDS.keys() & commands().keys()
    load(["range"])  # the module of the command that replaces it


def test_a_former_command_and_a_former_policy_say_what_replaces_them(tmp_path):
    file, out = tmp_path / "study.py", tmp_path / "out"
    file.write_text(STUDY, encoding="utf-8")
    done = call("run", file, "-o", out, "--failed", "leave-out", "--insist")
    assert done.exit_code == 0, done.output
    lines = [line for line in done.stderr.splitlines() if "is called" in line]
    ends = "now; the former name works for one more release"
    assert lines == [
        f"flexband: remark: leave-out is called skip {ends}",
        f"flexband: remark: --insist is called --allow-mismatch {ends}",
        f"flexband: remark: flexband.Store is called flexband.execution.Store {ends}",
        f"flexband: remark: Store(insist=) is called Store(allow_mismatch=) {ends}",
    ]
    fb.save_surrogate(
        fb.expand(lambda a: a, {"a": fb.Interval(0, 1)}, fb.PCCI(0, 1)), tmp_path / "surrogate.npz"
    )
    done = call("range", tmp_path)
    assert done.exit_code == 0, done.output
    assert f"`flexband range` is called `flexband distribution --kind range` {ends}" in done.stderr
    assert (tmp_path / "range.nc").is_file()


def test_the_former_policy_and_argument_work_with_one_warning(tmp_path):
    inputs = {"a": fb.Interval(1.0, 2.0)}
    with pytest.warns(FutureWarning, match='failed="leave out" is called failed="skip" now'):
        found = fb.propagate(lambda a: a, inputs, fb.PCCI(0, 1), failed="leave out")
    np.testing.assert_allclose(found["mean"], [1.0, 2.0])
    with pytest.warns(FutureWarning, match=r"Store\(insist=\) is called Store\(allow_mismatch=\)"):
        assert fb.execution.Store(tmp_path, insist=True) == fb.execution.Store(
            tmp_path, allow_mismatch=True
        )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert fb.execution.Store(tmp_path, insist=True).allow_mismatch
