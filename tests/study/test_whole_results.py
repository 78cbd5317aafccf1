"""From any study to its page: what is written is listed, checked, restored, and ends as it says."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app

STUDY = """
import numpy as np
import xarray as xr
import flexband as fb

TIMES = np.linspace(0.0, 1.0, 7)

def response(a, b, c={default}):
    c = np.where(np.asarray(c) == "long", 2.0, 1.0) + np.zeros(len(a))
    x = (c * (a + 0.1 * b))[:, None] + TIMES
    values = np.stack([x, 2 * x, 0.1 * x], axis=1)
    coords = {{"output": ["x", "y", "turn"], "time": TIMES, "unit": ("output", {units})}}
    return xr.DataArray(values, coords, ("sample", "output", "time"))

study = fb.Study(
    response,
    {{"a": fb.Interval(0.9, 1.1), "b": {b}{choice}}},
    fb.{method},
    requirements=[{requirements}],
    units={{{of_inputs}}},
    display_units={{{display}}},
    scatter={{{scatter}}},
)
"""

REQUIREMENTS = [
    'fb.Requirement("low", "x", below=9.0)',
    'fb.Requirement("other", "y", below=9000.0, unit="mm", during=(0.2, 0.5))',
    'fb.Requirement("near", "x", within=3.0)',
    'fb.Requirement("turned", "turn", above=-1.0, below=9.0, identifier="R-4")',
    'fb.Requirement("exceeded", "y", below=0.5)',
]


def text_of(rng):
    """Return a study of random parts, and how many requirements it has."""
    requirements = rng.permutation(REQUIREMENTS)[: rng.integers(5)]
    choice = rng.random() < 0.3
    display = [d for d in ('"x": "mm"', '"turn": "deg"', '"a": "mm"') if rng.random() < 0.5]
    parts = {
        "units": '["m", "m", "rad"]',
        "b": rng.choice(["fb.Normal(0.0, 0.1)", "fb.Interval(-0.1, 0.1)"]),
        "choice": ', "c": fb.Choice("short", "long")' if choice else "",
        "default": "1.0",
        "method": rng.choice(["PCCI(1, 2)", "AdaptivePCCI()", "LHSScanning(20, 3)"]),
        "requirements": ", ".join(requirements),
        "of_inputs": '"a": "m"' if '"a": "mm"' in display or rng.random() < 0.5 else "",
        "display": ", ".join(display),
        "scatter": '"a": fb.Uniform(0.9, 1.1)' if rng.random() < 0.3 else "",
    }
    if "Interval" in parts["b"]:
        parts["scatter"] = ""
    return STUDY.format(**parts), list(requirements)


def call(*arguments):
    return CliRunner().invoke(app, [*map(str, arguments)])


@pytest.mark.parametrize("seed", [0, 1, 2, 5, 6, 7])
def test_a_random_study_runs_reports_and_restores_what_is_deleted(tmp_path, seed):
    """Every requirement has a line; a file that is lost is refused until it is restored."""
    rng = np.random.default_rng(seed)
    text, requirements = text_of(rng)
    file = tmp_path / "study.py"
    out = tmp_path / "out"
    file.write_text(text, encoding="utf-8")
    run = call("run", file, "-o", out, "--verify", 2 if "LHS" not in text else 0)
    assert run.exit_code in (0, 3, 5), (text, run.output)
    lines = [line for line in run.stdout.splitlines() if line[:4] in ("PASS", "FAIL", "UNDE")]
    assert len(lines) == len(requirements), run.output
    assert run.stdout.splitlines()[: len(lines)] == lines  # first
    fails, undecided = (any(line.startswith(w) for line in lines) for w in ("FAIL", "UNDECIDED"))
    doubtful = undecided or "Not reliable" in run.stdout or "Missed" in run.stdout
    assert run.exit_code == (5 if fails else 3 if doubtful or run.exit_code == 3 else 0)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count('<li class="pass">') + page.count('<li class="fail">') + page.count(
        '<li class="undecided">'
    ) == len(requirements)
    assert call("report", out).exit_code == 0
    files = [p for p in out.iterdir() if p.suffix in (".nc", ".png") and p.stem != "contributions"]
    for path in rng.permutation(sorted(map(str, files)))[:2]:
        name = path.rpartition("/")[2]
        if name == "nominal.nc":
            continue
        shutil.move(path, tmp_path / "kept")
        result = call("report", out)
        assert result.exit_code == 1, (name, result.output)
        assert name in result.output
        assert "`flexband run`" in result.output
        second = call("run", file, "-o", out, "--verify", 2 if "LHS" not in text else 0)
        assert second.exit_code == run.exit_code, second.output
        assert call("report", out).exit_code == 0
        if name.rpartition(".")[0] in ("limits", "yield", "probability", "path"):
            assert (out / name).exists()


def test_an_altered_picture_is_refused(tmp_path):
    parts = dict.fromkeys(("choice", "of_inputs", "display", "scatter"), "")
    parts |= {"units": '["m", "m", "rad"]', "default": "1.0", "b": "fb.Normal(0.0, 0.1)"}
    file = tmp_path / "study.py"
    out = tmp_path / "out"
    text = STUDY.format(method="PCCI(1, 2)", requirements=REQUIREMENTS[0], **parts)
    file.write_text(text, encoding="utf-8")
    call("run", file, "-o", out)
    call("distribution", out)
    call("report", out)
    (out / "quantiles.png").write_bytes(b"another picture")
    output = " ".join(call("report", out).output.split())
    assert "quantiles.png, which the report shows, is not as written" in output
    assert "`flexband distribution` restores it, and `flexband run` leaves it out" in output
    call("distribution", out)
    assert call("report", out).exit_code == 0
    (out / "quantiles.nc").unlink()
    assert call("report", out).exit_code == 1
    assert call("run", file, "-o", out).exit_code == 0
    assert call("report", out).exit_code == 0


FAILING_ONCE = """
from pathlib import Path
import numpy as np
import flexband as fb

def response(a):
    if len(a) > 4 and Path(__file__).with_name("full").exists():
        raise OSError("no space left")
    return np.outer(a, np.linspace(0.5, 1.0, 5))

study = fb.Study(
    response, {"a": fb.Interval(0, 1)}, fb.PCCI(0, 2),
    requirements=fb.Requirement("response", below=3.0)
)
"""


@pytest.mark.usefixtures("no_drawing")
def test_a_verification_that_failed_once_is_made_by_the_next_run(tmp_path):
    file = tmp_path / "study.py"
    out = tmp_path / "out"
    file.write_text(FAILING_ONCE, encoding="utf-8")
    (tmp_path / "full").touch()
    first = call("run", file, "-o", out)
    assert first.exit_code == 3
    assert "not verified: the response raised OSError: no space left" in first.output
    assert "has this result already" not in call("run", file, "-o", out).output
    (tmp_path / "full").unlink()
    second = call("resume", out, "--trust")
    assert second.exit_code == 0, second.output
    assert (out / "verification.nc").exists()
    assert "has this result already" in call("run", file, "-o", out).output


CHARACTERS = "\x1b]0;owned\x07\u202eevil\x9b2J"


@pytest.mark.usefixtures("no_drawing")
def test_control_characters_of_a_file_do_not_reach_the_terminal(tmp_path):
    text = FAILING_ONCE.replace(
        'fb.Requirement("response", below=3.0)', f"fb.Requirement({CHARACTERS!r}, below=3.0)"
    )
    file = tmp_path / "study.py"
    out = tmp_path / "out"
    file.write_text(text, encoding="utf-8")
    outputs = [call("run", file, "-o", out).output]
    record = (out / "study.json").read_text("utf-8")
    reason = f'"state": "failed", "reason": "{"".join(map(ascii_of, CHARACTERS))}"'
    record = record.replace('"state": "finished"', reason)
    (out / "study.json").write_text(record, "utf-8")
    outputs += [call("status", out).output, call("resume", out, "--trust").output]
    outputs += [call(name, out).output for name in ("check", "contributions", "report")]
    assert "evil" in outputs[0]
    assert "evil" in outputs[1]
    for output in outputs:
        assert not set(output) & set("\x1b\x07\x9b\u202e"), output


def ascii_of(character):
    return f"\\u{ord(character):04x}"


@pytest.mark.usefixtures("no_drawing")
@pytest.mark.parametrize(
    ("requirements", "status"),
    [
        (("PASS",), 0), (("FAIL",), 5), (("UNDECIDED",), 3), (("PASS", "UNDECIDED"), 3),
        (("UNDECIDED", "FAIL"), 5), (("FAIL", "PASS"), 5), (("PASS", "UNDECIDED", "FAIL"), 5),
    ],
)  # fmt: skip
def test_every_command_with_a_verdict_ends_with_its_status(tmp_path, requirements, status):
    kinds = {
        "PASS": 'fb.Requirement("kept", below=3.0)',
        "FAIL": 'fb.Requirement("left", below=0.5)',
        "UNDECIDED": 'fb.Requirement("near", below=1.0)',
    }
    text = FAILING_ONCE.replace(
        'fb.Requirement("response", below=3.0)', f"[{', '.join(map(kinds.get, requirements))}]"
    )
    file = tmp_path / "study.py"
    out = tmp_path / "out"
    file.write_text(text, encoding="utf-8")
    commands = ["run", file, "-o", out], ["run", file, "-o", out], ["resume", out, "--trust"]
    for command in (*commands, ["check", out, "--trust"], ["check", out, "--trust", "--json"]):
        result = call(*command)
        assert result.exit_code == status, (command, result.output)
        if "--json" not in command:
            first = [line.split()[0] for line in result.stdout.splitlines()[: len(requirements)]]
            assert first == list(requirements), result.output


def test_a_study_is_data():
    study = fb.Study(
        lambda a: a, {"a": fb.Interval(0, 1)}, fb.PCCI(),
        requirements=fb.Requirement("response", below=2.0),
        units={"a": "m"}, scatter={"a": fb.Uniform(0, 1)},
    )  # fmt: skip
    other = fb.Requirement("other", below=9.0)
    replacement = replace(study, requirements=other)
    assert replacement.requirements == (other,)
    assert replace(study, sigmas=2.0).requirements == study.requirements
    for name in ("inputs", "units", "scatter", "display_units", "title_block"):
        with pytest.raises(TypeError):
            getattr(study, name)["a"] = None
    assert repr(study).startswith("Study(")


PLAY = """
import flexband as fb

def pendulum(pin):
    return fb.Mechanism(
        bodies={"arm": fb.RigidBody(mass=1.0, inertia=0.1, points={"tip": (1.0, 0.0)})},
        joints={"pin": fb.Revolute("arm", (0.0 + pin[0], 0.0 + pin[1]))},
        loads={"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("arm.tip")},
    )

study = fb.Study(
    fb.dynamic_response(pendulum, duration=0.3, output_step=0.01, step=0.01),
    {"pin": fb.Play(1e-4)},
    fb.PCCI(0, 2),
    requirements=[fb.Requirement("height", "tip_Y", above=-0.01)],
)
"""


def test_bounds_for_plays_that_vary_leave_requirements_undecided(tmp_path):
    """The tip falls far below what is required, but only plays that are constant are bounded."""
    file = tmp_path / "study.py"
    out = tmp_path / "out"
    file.write_text(PLAY, encoding="utf-8")
    for command in (["run", file, "-o", out], ["check", out, "--trust"]):
        result = call(*command)
        assert result.exit_code == 3, result.output
        assert result.stdout.startswith("UNDECIDED  height (above -0.01): not checked: ")
    assert "<b>UNDECIDED</b> height" in (out / "report.html").read_text("utf-8")
