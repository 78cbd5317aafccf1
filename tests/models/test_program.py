"""External programs: what they read, what is read of them, how they fail; real processes."""

import inspect
import json
import os
import pickle
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.execution.fingerprint import fingerprint

INPUTS = {"stiffness": fb.Interval(90.0, 110.0), "mass": fb.Normal(1.0, 0.02)}
SOLVER = """
import json, math, sys
data = json.load(open("model.json"))
omega = math.sqrt(data["spring"]["k"] / float(sys.argv[1]))
with open("out.csv", "w") as out:
    for k in range(11):
        print(k / 100, math.cos(omega * k / 100), sep=",", file=out)
print("omega =", omega)
"""
MODEL = '{"spring": {"k": ${stiffness}}, "empty": {}, "price": "$$${", "literal": "$${mass}"}'


def shell(text):
    return ["sh", "-c", text]


def series(folder):
    time, x = np.loadtxt(folder / "out.csv", delimiter=",").T
    return xr.DataArray(x, dims="time", coords={"time": time})


def read_number(folder):
    return float((folder / "stdout.txt").read_text())


@pytest.fixture
def oscillator(tmp_path):
    (tmp_path / "model.json").write_text(MODEL, encoding="utf-8")
    return fb.models.ExternalProgram(
        [sys.executable, "solver.py", "${mass:.12e}"],
        read=series,
        files={"solver.py": SOLVER.encode(), "model.json": tmp_path / "model.json"},
    )


def closed_form(stiffness, mass):
    t = np.linspace(0.0, 0.1, 11)
    return np.cos(np.sqrt(stiffness / mass)[:, None] * t)


def test_a_program_equals_its_closed_form(oscillator):
    with ProcessPoolExecutor(1) as pool:  # the response is sent to another process
        result = pool.submit(oscillator, stiffness=[95.0, 104.0], mass=[1.0, 1.1]).result()
    exact = closed_form(np.array([95.0, 104.0]), np.array([1.0, 1.1]))
    np.testing.assert_allclose(result, exact, rtol=1e-11)
    assert result.dims == ("sample", "time")
    bands = fb.propagate(oscillator, INPUTS, fb.PCCI(1, 1))
    expected = fb.propagate(closed_form, INPUTS, fb.PCCI(1, 1))
    np.testing.assert_allclose(bands["error_bar"], expected["error_bar"], rtol=1e-9)


def test_what_is_no_placeholder_survives():
    program = fb.models.ExternalProgram(
        ["cat", "in/model.json"],
        read=lambda folder: json.loads((folder / "stdout.txt").read_text())["spring"]["k"],
        files={"in/model.json": MODEL},
    )
    assert program(stiffness=[0.1 + 0.2, -1e-300]).tolist() == [0.1 + 0.2, -1e-300]
    outputs = []
    text = "{${x:.3e}} $HOME $(x) ${x:>8} `x` \\n é\r\n"
    program = fb.models.ExternalProgram(
        ["cat"], standard_input=text, read=lambda f: outputs.append((f / "stdout.txt").read_bytes())
    )
    with pytest.raises(fb.errors.InputError, match="got None"):
        program(x=[2.5])
    assert outputs[0].decode() == "{2.500e+00} $HOME $(x)      2.5 `x` \\n é\r\n"


def test_texts_and_numbers_are_arguments_without_a_shell():
    program = fb.models.ExternalProgram(
        [sys.executable, "-c", "import sys; print(len(sys.argv[1]) * int(sys.argv[2]))",
         "${material}; rm -rf '*' $HOME", "${turns:d}"],
        read=read_number,
    )  # fmt: skip
    result = program(material=np.array(["steel", "hard brass"]), turns=[1, 2])
    np.testing.assert_array_equal(result, [5 + 18, 2 * (10 + 18)])
    assert list(inspect.signature(program).parameters) == ["material", "turns"]


def run_one(command, **settings):
    arguments = {"read": read_number, **settings}
    return fb.models.ExternalProgram([*shell(command), "${x}"], **arguments)(x=[1.0])


@pytest.mark.parametrize(
    ("command", "text"),
    [
        ("echo one >&2; echo two >&2; exit 3", r"status 3. The last lines of stderr.txt:\n +one"),
        ("echo out; exit 1", r"status 1. The last lines of stdout.txt:\n    out$"),
        ("kill -SEGV $$", r"was ended by signal 11 \(Segmentation fault\)"),
        ("sleep 60", "was killed after its time limit of 0.2 s"),
        ("echo nothing", "cannot be read: ValueError: could not convert .*\n    nothing"),
        ("rm stdout.txt", "cannot be read: FileNotFoundError"),
    ],
)
def test_failures_tell_why(command, text):
    with pytest.raises(fb.errors.ModelError, match=text):
        run_one(command, time_limit=0.2 if "sleep" in command else None)


def test_only_the_last_lines_are_shown():
    with pytest.raises(fb.errors.ModelError) as error:
        run_one("seq 1 100000 >&2; exit 2")
    assert str(error.value).splitlines()[1:] == [f"    {k}" for k in range(99991, 100001)]


def alive(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


@pytest.mark.parametrize("ending", ["wait", "exit 0"], ids=["time limit", "left behind"])
def test_no_process_is_left(tmp_path, ending):
    command = f"sleep 60 & echo $! > {tmp_path}/pid; sh -c 'sleep 60 & wait' & echo 1; {ending}"
    start = time.monotonic()
    if ending == "wait":
        with pytest.raises(fb.errors.ModelError, match="time limit"):
            run_one(command, time_limit=0.3)
    else:
        assert run_one(command) == [1.0]
    assert time.monotonic() - start < 10.0
    pid = int((tmp_path / "pid").read_text())
    deadline = time.monotonic() + 5.0
    while alive(pid) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not alive(pid)


def test_an_interrupt_ends_the_program(tmp_path):
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), 2))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        run_one(f"echo $$ > {tmp_path}/pid; sleep 60")
    timer.join()
    assert not alive(int((tmp_path / "pid").read_text()))


def test_folders_are_deleted_or_kept(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "own"))
    (tmp_path / "own").mkdir()
    run_one("echo 1")
    with pytest.raises(fb.errors.ModelError):
        run_one("exit 1")
    assert not list((tmp_path / "own").iterdir())
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        fb.errors.ModelError, match=r"status 4[^$]*\nThe folder of the run is kept as "
    ) as error:
        run_one("echo partial; exit 4", files={"a/b.txt": "x = ${x}"}, keep="failed")
    folder = Path(str(error.value).rsplit(" ", 1)[1])
    assert folder.parent == tmp_path / "failed"
    assert (folder / "a/b.txt").read_text() == "x = 1.0"
    assert (folder / "stdout.txt").read_text() == "partial\n"


def test_programs_are_found_from_the_current_folder(tmp_path, monkeypatch):
    (tmp_path / "tool").write_text("#!/bin/sh\necho $1\n")
    (tmp_path / "tool").chmod(0o755)
    monkeypatch.chdir(tmp_path)
    program = fb.models.ExternalProgram(["./tool", "${x}"], read=read_number)
    monkeypatch.chdir("/")
    assert pickle.loads(pickle.dumps(program))(x=[2.0]) == [2.0]


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"command": "solver in.txt"}, "command must be a list of the program .* got 'solver in"),
        ({"command": ["no such program", "${x}"]}, "must begin with a program that exists; got 'n"),
        ({"command": ["cat"]}, r"must have a placeholder, such as \$\{length\}"),
        ({"command": ["cat", "${}"]}, r"argument 1: the placeholder at '\$\{\}' must be the name"),
        ({"command": ["cat", "${a b}"]}, "must be the name of an input"),
        ({"files": {"m": "1\n${x"}}, r"file m: the placeholder at '\$\{x' must be the name"),
        ({"files": {"m": "${x:.3q}"}}, "must have a format of Python, such as .6e"),
        ({"files": {"../m": "${x}"}}, "paths inside the folder of a sample.*got '../m'"),
        ({"files": {"/m": "${x}"}}, "paths inside the folder of a sample"),
        ({"files": {"stdout.txt": "${x}"}}, "other than stdout.txt and stderr.txt"),
        ({"files": {"m": Path("/nowhere")}}, r"files\['m'\] must be a text in UTF-8"),
        ({"files": {"m": 3}}, r"files\['m'\] must be a text, a Path or bytes; got 3"),
        ({"time_limit": 0.0}, r"time_limit \[s\] must be positive"),
        ({"read": "out.csv"}, "read must be a function of the folder of a sample; got 'out.csv'"),
    ],
)
def test_bad_descriptions_are_refused(settings, text):
    with pytest.raises(fb.errors.InputError, match=text):
        fb.models.ExternalProgram(**{"command": ["cat", "${x}"], "read": read_number, **settings})


def test_names_and_values_are_checked():
    program = fb.models.ExternalProgram(["echo", "${stiffness:.0f}"], read=read_number)
    with pytest.raises(fb.errors.InputError, match="name mass, which the response does not take"):
        fb.propagate(program, INPUTS, fb.PCCI(1, 1))
    with pytest.raises(
        fb.errors.InputError, match="the response needs stiffness, which inputs do not"
    ):
        fb.propagate(fb.models.ExternalProgram(["echo", "${stiffness} ${mass}"], read=read_number),
                     {"mass": INPUTS["mass"]}, fb.PCCI(1, 1))  # fmt: skip
    with pytest.raises(fb.errors.InputError, match="placeholders are stiffness; got values of k"):
        program(k=[1.0])
    with pytest.raises(
        fb.errors.InputError, match=r"is a function of position.*fb\.models\.samplewise\("
    ):
        program(stiffness=lambda x: x)
    with pytest.raises(fb.errors.InputError, match=r"stiffness is a pair.*samplewise\("):
        program(stiffness=np.ones((2, 1)))
    with pytest.raises(fb.errors.InputError, match=r"stiffness = 'soft' cannot be written as"):
        program(stiffness=["soft"])
    with pytest.warns(
        fb.errors.FlexbandWarning, match=r"format '\.0f' of stiffness changes a value by"
    ):
        assert program(stiffness=[1.4]) == [1.0]
    assert program(stiffness=[3.0]) == [3.0]


def test_a_field_reaches_a_program_by_its_values():
    program = fb.models.ExternalProgram(["echo", "${a}"], read=read_number)
    field = fb.IntervalField(1.0, 2.0, length=1.0, domain=(0.0, 1.0))
    response = fb.models.samplewise(lambda E: program.sample(a=E(0.0)))
    bands = fb.propagate(response, {"E": field}, fb.PCCI(0, 1))
    np.testing.assert_allclose(bands["mean"], [1.0, 2.0], rtol=1e-12)


def test_a_store_knows_the_template_and_the_program(tmp_path):
    def fingerprint_of(text="k = ${x}", script="print(1)", **settings):
        (tmp_path / "script.py").write_text(script)
        command = [sys.executable, str(tmp_path / "script.py")]
        arguments = {"read": read_number, "files": {"m": text}, **settings}
        return fingerprint(fb.models.ExternalProgram(command, **arguments))

    first = fingerprint_of()
    assert fingerprint_of(time_limit=3.0, keep=tmp_path) == first
    others = [
        fingerprint_of("k = 2*${x}"),
        fingerprint_of(script="print(2)"),
        fingerprint_of(standard_input="go"),
    ]
    others.append(fingerprint_of(read=lambda folder: 1.0))
    assert len({first, *others}) == 5
