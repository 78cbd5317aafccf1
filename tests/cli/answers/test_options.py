"""Every option of every command that asks a surrogate changes what is told; wrong ones end it."""

import json
import shutil
import sys
from copy import deepcopy
from itertools import permutations

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import Collection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text
from typer.main import get_command
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app, folders
from flexband.cli.answers import check, frame
from flexband.cli.commands import commands, load
from flexband.study.folder import StudyFolder
from tests.rough import search_roughly

STUDY = """
import numpy as np
import xarray as xr
import flexband as fb

def response(e, x, z):
    t = np.linspace(0, 1, 7)
    size, angle = 10 + e[:, None] * (1 + 0.2 * x[:, None]), 2 * np.pi * t
    wide = ((2 + e) * x + 2 * z + 0.2 * z**3)[:, None] * (1 + t)
    values = np.stack([size * np.cos(angle), size * np.sin(angle), wide], axis=1)
    coords = {"output": ["X", "Y", "w"], "time": t}
    return xr.DataArray(values, coords, ("sample", "output", "time"))

inputs = {"e": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 1.0), "z": fb.Normal(0.0, 0.5)}
study = fb.Study(response, inputs, fb.PCCI(3, 1))
"""

LIMIT = ("--below", "w=9")
ROUGH = ("--accuracy", 0.03)
CHEAP = ("--below", "X=10.8", "--cost", "e=1")
CASES = {  # command -> what is always given, and each option
    "contributions": ((), {"sigmas": 3, "shapley": None}),
    "sobol": ((), {}),
    "narrow": (("e=0..0.5",), {"sigmas": 3}),
    "tolerance": (("x",), {"share": 0.9, "sigmas": 3}),
    "check": (
        (*LIMIT, *ROUGH),
        {"below": "X=3", "above": "X=3", "during": "0,0.5", "sigmas": 1, "accuracy": 0.3,
         "seed": 3, "runs": 16},
    ),
    "distribution": ((), {"probability": 0.3, "samples": 512, "seed": 3, "kind": "range"}),
    "allocate": (
        CHEAP,
        {"cost": ("e=1", "x=9"), "below": "X=10.5", "above": "Y=-8.8", "during": "0.2 0.5",
         "sigmas": 1, "probability": 0.01, "no-confirm": None},
    ),
    "derived": (
        ("spectrum", "w"),
        {"period": 0.5, "sigmas": 3, "probability": 0.5, "samples": 4096, "seed": 3},
    ),
    "yield": (
        (*LIMIT, *ROUGH, "--scatter", "e=uniform"),
        {"scatter": "e=1.33:1:upper", "below": "X=3", "above": "w=0", "during": "0,0.5",
         "accuracy": 0.3, "seed": 3, "runs": 16},
    ),
    "path": (("X", "Y"), {"sigmas": 3, "probability": 0.9, "directions": 16}),
}  # fmt: skip

OTHER_KINDS = {  # of a distribution
    "range": (("--kind", "range"), {"probability": 0.5}),
    "p-box": (
        ("w", "--kind", "p-box", "--time", 0.5), {"time": 1.0, "samples": 512, "seed": 3}
    ),
}  # fmt: skip
OF_STUDY_LIMITS = {  # the same of a study that has limits
    "narrow": (("e=0..0.5",), {"probability": None}),
    "check": (ROUGH, {"only": "w"}),
    "yield": ((*ROUGH, "--scatter", "e=triangular"), {"only": "w"}),
    "allocate": (("--cost", "e=1", "--cost", "x=1"), {"only": "X"}),
}
BOTH = [
    *CASES.items(), *(("distribution", case) for case in OTHER_KINDS.values()),
    *OF_STUDY_LIMITS.items(),
]  # fmt: skip

ANSWERS = [
    *((fb.analysis, name) for name in (
        "allocate", "check_requirements", "contributions", "derived", "failure_probability",
        "p_box", "path", "quantiles", "sobol_indices", "tolerance_for", "value_range",
    )),
    (fb, "production_yield"), (check, "check_requirements_in"),
]  # fmt: skip
"""Modules and names of the functions that commands ask."""

SAMPLING = {"samples", "seed", "accuracy", "runs", "no-confirm"}
"""Options that may move a picture by less than a pixel."""

LOADING = {"narrow", "check", "allocate", "yield"}
"""Commands that load the study's file, which lies elsewhere here."""

WITHOUT = {"narrow", "tolerance", "yield"}
"""Commands that draw nothing."""


def run(*arguments):
    return CliRunner().invoke(app, [*map(str, arguments)])


def study_in(place, text):
    (place / "study.py").write_text(text, encoding="utf-8")
    result = run("run", place / "study.py", "-o", place / "out", "--verify", 8)
    assert result.exit_code in (0, 5), result.output  # 5: a limit is not kept
    return place / "out"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return study_in(tmp_path_factory.mktemp("study"), STUDY)


@pytest.fixture(scope="module")
def limited(tmp_path_factory):
    requirements = '[fb.Requirement("w", below=12.0), fb.Requirement("X", below=13.0, above=-13.0)]'
    text = STUDY.replace("fb.PCCI(3, 1))", f"fb.PCCI(2, 1), requirements={requirements})")
    return study_in(tmp_path_factory.mktemp("limited"), text)


def outputs_of(folder, command, arguments):
    """Return what is printed, as text and as JSON, and the pictures; all is computed once."""
    for picture in folder.glob("*.png"):
        picture.unlink()
    load([command])
    with pytest.MonkeyPatch.context() as patch:
        results = []
        for module, name in ANSWERS:
            patch.setattr(module, name, recorder(getattr(module, name), results))
        search_roughly(patch)
        patch.setattr(Figure, "savefig", save_artists)
        trust = ["--trust"] * (command in LOADING)
        result = run(command, folder, *arguments, *trust)
    assert result.exit_code in (0, 3, 5), result.output  # limits are not kept, or undecided
    pictures = {file.name: file.read_bytes() for file in folder.glob("*.png")}
    with pytest.MonkeyPatch.context() as patch:
        for module, name in ANSWERS:
            patch.setattr(module, name, lambda *_, **__: results.pop(0))
        for module in (folders, frame):
            patch.setattr(module, "draw", lambda *_, drawable=True: drawable)
        answer = json.loads(run(command, folder, *arguments, *trust, "--json").stdout)
    assert not results
    return result.stdout, answer, pictures


def save_artists(figure, file, **_):
    """Write what a figure consists of: its lines, areas and words."""
    parts = []
    for artist in figure.findobj():
        if isinstance(artist, Line2D):
            parts.append((artist.get_color(), artist.get_xydata()))
        elif isinstance(artist, Collection):
            parts += [path.vertices for path in artist.get_paths()]
        elif isinstance(artist, Patch):
            parts.append(artist.get_patch_transform().transform_path(artist.get_path()).vertices)
        elif isinstance(artist, Text):
            parts.append(artist.get_text())
    with np.printoptions(threshold=sys.maxsize):
        file.write_text(repr(parts), encoding="utf-8")


def recorder(function, results):
    """Return a function that also appends what it returns to a list."""

    def call(*arguments, **options):
        result = function(*arguments, **options)
        results.append(deepcopy(result))
        return result

    return call


def with_option(arguments, option, value):
    """Return arguments with another value of an option."""
    remaining = [*map(str, arguments)]
    words = []
    while remaining:
        count = 2 if remaining[0].startswith("--") else 1
        if remaining[0] != f"--{option}":
            words += remaining[:count]
        remaining = remaining[count:]
    values = value if isinstance(value, tuple) else (value,)
    for entry in values:
        words += [f"--{option}", *([] if entry is None else str(entry).split(" "))]
    return words


@pytest.mark.parametrize(("command", "case"), BOTH)
def test_every_option_changes_what_is_printed_drawn_and_dumped(command, case, request, tmp_path):
    out = tmp_path / "out"
    always, options = case
    of = "limited" if case is OF_STUDY_LIMITS.get(command) else "folder"
    shutil.copytree(request.getfixturevalue(of), out)
    text, answer, pictures = outputs_of(out, command, always)
    assert bool(pictures) == (command not in WITHOUT)
    for option, value in options.items():
        other = outputs_of(out, command, with_option(always, option, value))
        assert other[0] != text, option
        assert other[1] != answer, option
        if option not in SAMPLING and pictures:
            assert other[2] != pictures, option


def test_all_options_are_judged():
    for name, (module, _) in commands().items():
        load([name])
        if ".answers." not in module:
            continue
        parameters = get_command(app).commands[name].params
        names = {
            parameter.opts[0].removeprefix("--")
            for parameter in parameters
            if parameter.opts[0].startswith("--")
        }
        options = {**CASES[name][1], **OF_STUDY_LIMITS.get(name, ((), {}))[1]}
        if name == "distribution":
            options |= OTHER_KINDS["p-box"][1]
        cases = {option.replace("no-confirm", "confirm") for option in options}
        assert names - {"json", "trust"} == cases


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("narrow", "e=1.2-1.5"), "a change must be"),
        (("yield", *LIMIT, "--scatter", "e=wide"), "--scatter must be NAME=uniform, NAME=tri"),
        (("yield", *LIMIT, "--scatter", "x=1"), "--scatter must be of e; got 'x=1'"),
        (("yield", *LIMIT, "--scatter", "e=1:2:upper"), "cpk must be from 0 to cp, 1; got 2"),
        (("narrow", "q=1"), "must be one of"),
        (("narrow", "e=0..0.5", "e=0"), "given once for e"),
        (("narrow", "e=0..0.5", "--probability"), "requires random inputs, no Compensator, and"),
        (("check", *LIMIT, "--only", "w"), "--only selects requirements of the study; omit"),
        (("tolerance", "q"), "name must be an input with a tolerance"),
        (("contributions", "--sigmas", -1), "sigmas"),
        (("distribution", "-p", 1), "above 0 and below 1; got"),
        (("check", *LIMIT, "--sigmas", -1), "sigmas must be positive; got -1"),
        (("check", "--below", "w=1", "--above", "w=2"), "above=2 and below=1"),
        (("allocate", *CHEAP, "--sigmas", -1), "sigmas must be positive; got -1"),
        (("allocate", *CHEAP, "--probability", 5), "from 1e-08 to 0.3; got 5"),
        (("distribution", "--kind", "range", "-p", 2), "probability"),
        (("distribution", "q", "--kind", "p-box"), "must be one of"),
        (("distribution", "--time", 1), "--time is one of --kind p-box; got --kind quantiles"),
        (
            ("distribution", "w", "--kind", "range"),
            "output is one of --kind p-box; got --kind range",
        ),
        (("distribution", "--kind", "range", "-p", 0.5, "-p", 0.9), "must be given once"),
        (("derived", "peak", "X", "Y", "w"), "one output, or two"),
        (("derived", "peak", "q"), "must be one of"),
        (("path", "X", "q"), "must be one of"),
        (("path", "X", "Y", "--sigmas", 2, "-p", 0.9), "exclude each other"),
        (("check",), "requires --below or --above"),
        (("check", "--below", "q=1"), "must be one of"),
        (("check", "--below", "w=1", "--during", "7,8"), "during"),
        (("check", "--below", "w=1", "--runs", 8), "--runs must be 0, or 16 or more; got 8"),
        (("check", "--below", "w=1", "--accuracy", 2), "accuracy"),
        (("check", "--below", "w=1", "--during", "x,8"), "parse string as a number"),
        (("allocate", *LIMIT, "--cost", "e"), "--cost must be NAME=NUMBER"),
        (("allocate", *LIMIT, "--cost", "e=1", "--cost", "e=2"), "given once for e"),
        (("allocate", *LIMIT, "--cost", "e=-0.1:2,0.2:1"), "must be positive"),
        (("allocate", *LIMIT, "--cost", "q=1"), "q"),
        (("allocate", *CHEAP, "--sigmas", 2, "--probability", 0.1), "exclude each other"),
    ],
)
def test_a_wrong_command_line_ends_with_status_2(folder, arguments, message):
    command, *rest = arguments
    result = run(command, folder, *rest)
    assert result.exit_code == 2, result.output
    assert message in " ".join(result.output.replace("│", " ").split())


@pytest.mark.parametrize("command", CASES)
@pytest.mark.parametrize("bad", ["-1", "nan"])
def test_no_numeric_option_takes_a_number_that_makes_no_sense(command, bad, folder):
    load([command])
    for parameter in get_command(app).commands[command].params:
        kind = str(parameter.type_descriptor.annotation)
        if parameter.opts[0].startswith("--") and ("float" in kind or "int" in kind):
            result = run(command, folder, *CASES[command][0], parameter.opts[0], bad, bad)
            assert result.exit_code == 2, (parameter.opts[0], result.output)


def test_only_takes_outputs_with_limits(limited):
    result = run("allocate", limited, "--only", "Y", "--cost", "e=1")
    assert result.exit_code == 2
    message = " ".join(result.output.split())
    assert "--only must be an output with a requirement in the study: w, X; got 'Y'" in message
    content = (limited / "limits.nc").read_bytes()
    answer = json.loads(run("check", limited, "--only", "X", "--json").stdout)
    assert answer["limits"]["limit"] == ["X between -13 and 13"]
    assert (limited / "limits.nc").read_bytes() == content  # the report has all of them


def test_narrowing_tells_the_margins_of_the_study_and_how_likely_limits_are_left(limited):
    """X = (10 + e (1 + 0.2 x)) cos t is up to 11.6, μ + 3σ, and up to 10.8 if e is below 0.5."""
    result = run("narrow", limited, "e=0..0.5", "--probability", "--json")
    assert result.exit_code == 0, (result.output, result.exception)
    output = result.stdout
    by_limit = json.loads(output)["limits"]
    limit = by_limit["X between -13 and 13"]
    assert limit["least_margin"] == pytest.approx([1.4, 2.2])
    assert limit["verdict"] == ["kept", "kept"]
    with xr.open_dataset(limited / "probability.nc") as of_study:
        likely = of_study["probability"].sel(bound="upper").values
    names = ["w below 12", "X between -13 and 13", "any limit"]
    assert list(by_limit) == names
    for k, name in enumerate(names):
        before, after = by_limit[name]["probability"]
        assert before == pytest.approx(likely[k], rel=0.1, abs=1e-9)
        assert after <= before
    printed = run("narrow", limited, "e=0..0.5").stdout
    assert "Requirements, margins of μ ± 3σ" in printed
    assert "probability" not in printed


def test_narrowing_does_without_the_limits_of_a_study_that_is_gone(limited, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(limited, out)
    record = json.loads((out / "study.json").read_text(encoding="utf-8"))
    text = json.dumps(record | {"file": str(tmp_path / "gone.py")})
    (out / "study.json").write_text(text, encoding="utf-8")
    result = run("narrow", out, "e=0..0.5")
    assert result.exit_code == 0
    assert "remark: requirements of the study are not shown: " in result.output
    assert "Requirements" not in result.stdout


def test_what_no_tolerance_reaches_is_told_once(folder):
    """X and Y do not depend on z, and w depends on x, too. Without e, X and Y are certain."""
    result = run("tolerance", folder, "z", "--share", 0.1)
    assert result.exit_code == 0, result.output
    text = " ".join(result.stdout.split())
    assert "none" not in text
    assert "tolerance for" not in text
    assert text.count("no error bar becomes as narrow as 10 % of the present width") == 1
    answer = json.loads(run("tolerance", folder, "z", "--json").stdout)["w"]
    assert (
        f"What can be reached is {100 * answer['least_width'] / answer['width']:.3g} %, of w"
        in text
    )
    text = " ".join(run("tolerance", folder, "e", "--share", 0.1).stdout.split())
    assert "the error bar of w does not become as narrow as 10 %" in text
    assert "71.3 % │ none │" in text


def test_answers_of_a_study_that_is_running_are_remarked(folder, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(folder, out)
    with StudyFolder(out).hold_lock():
        result = run("contributions", out)
        assert result.exit_code == 0
        assert "is running; this answer is from its surrogate.npz of 2" in result.output
        (out / "surrogate.npz").unlink()
        (out / "bands.nc").unlink()
        assert "which has none: its study is running" in " ".join(run("sobol", out).output.split())
    assert "is running" not in run("contributions", folder).output


def test_shapley_values_are_ranked_by_themselves(tmp_path):
    """Of a x + 2 z, whose error bar with |a| at most A is 2 √(A² + 1) wide, by enumeration."""
    inputs = {"a": fb.Interval(1, 2), "x": fb.Normal(0, 1), "z": fb.Normal(0, 0.5)}
    surrogate = fb.expand(lambda a, x, z: a * x + 2 * z, inputs, fb.PCCI(1, 1))
    fb.save_surrogate(surrogate, tmp_path / "surrogate.npz")

    def width(names):
        return 2 * np.hypot((2.0 if "a" in names else 1.5) * ("x" in names), "z" in names)

    exact = dict.fromkeys("axz", 0.0)
    for order in permutations("axz"):
        for k, name in enumerate(order):
            exact[name] += (width(order[: k + 1]) - width(order[:k])) / (6 * width("axz"))
    answer = json.loads(run("contributions", tmp_path, "--shapley", "--json").stdout)
    assert answer["inputs"] == sorted(exact, key=lambda name: -exact[name]) == ["x", "z", "a"]
    assert answer["shapley_mean_share"][""] == pytest.approx([exact[k] for k in answer["inputs"]])
    output = run("contributions", tmp_path, "--shapley").stdout
    assert output.index("x ") < output.index("61.7 %") < output.index("28.1 %")
    by_contribution = json.loads(run("contributions", tmp_path, "--json").stdout)
    assert by_contribution["inputs"] == ["x", "a", "z"]


def test_runs_that_would_correct_nothing_are_refused(tmp_path):
    text = STUDY.replace("fb.Normal(0.0, 1.0)", "0.0").replace("fb.Normal(0.0, 0.5)", "0.0")
    (tmp_path / "study.py").write_text(text, encoding="utf-8")
    assert run("run", tmp_path / "study.py", "-o", tmp_path / "o", "--verify", 0).exit_code == 0
    result = run("check", tmp_path / "o", "--below", "X=12", "--runs", 8)
    assert result.exit_code == 2
    assert "need random inputs" in " ".join(result.output.split())
