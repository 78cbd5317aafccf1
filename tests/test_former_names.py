"""Former names, which work for one release, and say what to write instead."""

import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.cli.commands import commands

INPUTS = {"a": fb.Interval(9.0, 11.0), "b": fb.Normal(10.0, 0.1)}
REQUIREMENT = fb.Requirement("response", below=21.5)
STUDY = """
import flexband as fb

inputs = {"a": fb.Interval(9.0, 11.0), "b": fb.Normal(10.0, 0.1)}
study = fb.Study(lambda a, b: a + b, inputs, fb.PCCI(1, 1), KEYWORD=fb.KIND(below=21.5))
"""


@pytest.fixture(scope="module")
def surrogate():
    return fb.expand(lambda a, b: a + b, INPUTS, fb.PCCI(1, 1))


def warned(former, new):
    """Return the context in which a warning states a former name and its new one."""
    return pytest.warns(FutureWarning, match=f"^{former} is now called {new};")


def test_the_warning_points_to_the_line_of_the_user():
    with warned("flexband.Limit", "flexband.Requirement") as caught:
        fb.Limit(below=1.0)
    assert caught[0].filename == __file__
    assert caught[0].category is fb.errors.FormerNameWarning


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"below": 1.0}, "response below 1"),
        ({"output": "F", "above": -1.0, "during": (0.0, 0.5)}, "F above -1 from 0 to 0.5"),
    ],
)
def test_limit_is_a_requirement(arguments, words):
    with warned("flexband.Limit", "flexband.Requirement"):
        limit = fb.Limit(**arguments)
    assert isinstance(limit, fb.Requirement)
    assert str(limit) == words
    assert limit.output == arguments.get("output")


def test_limit_takes_its_output_and_bounds_by_position():
    with warned("flexband.Limit", "flexband.Requirement"):
        limit = fb.Limit("F", 2.0, -1.0, (0.0, 0.5))
    assert str(limit) == "F between -1 and 2 from 0 to 0.5"


def test_check_limits(surrogate):
    expected = fb.analysis.check_requirements(surrogate, REQUIREMENT, sigmas=2.0)
    former, new = "flexband.analysis.check_limits", "flexband.analysis.check_requirements"
    with warned(former, new):
        xr.testing.assert_identical(
            fb.analysis.check_limits(surrogate, limits=REQUIREMENT, sigmas=2.0), expected
        )


@pytest.mark.parametrize(
    ("function", "options"),
    [
        ("check_requirements", {}),
        ("failure_probability", {"accuracy": 0.1}),
        ("allocate", {"costs": {"a": 1.0}}),
    ],
)
def test_the_argument_limits(surrogate, function, options):
    public = getattr(fb.analysis, function)
    expected = public(surrogate, REQUIREMENT, **options)
    with warned(rf"{function}\(limits=…\)", rf"{function}\(requirements=…\)"):
        xr.testing.assert_identical(public(surrogate, limits=REQUIREMENT, **options), expected)
    with pytest.raises(fb.errors.InputError, match="limits is the former name of requirements"):
        public(surrogate, limits=REQUIREMENT, requirements=REQUIREMENT, **options)


def test_limits_of_a_study():
    arguments = lambda a, b: a + b, INPUTS, fb.PCCI(1, 1)
    with warned(r"Study\(limits=…\)", r"Study\(requirements=…\)"):
        study = fb.Study(*arguments, limits=REQUIREMENT)
    assert study.requirements == (REQUIREMENT,)
    with warned(r"Study\.limits", r"Study\.requirements"):
        assert study.limits == (REQUIREMENT,)
    by_position = fb.Study(*arguments, 1.0, REQUIREMENT, {"a": "mm"})
    assert by_position.requirements == (REQUIREMENT,)
    assert by_position.units == {"a": "mm"}


def test_commands_tell_the_new_names(tmp_path):
    """A study's file with former names runs, and `flexband limits` is `flexband check`."""
    file = tmp_path / "study.py"
    out = str(tmp_path / "out")
    file.write_text(STUDY.replace("KEYWORD", "limits").replace("KIND", "Limit"), encoding="utf-8")
    run = CliRunner().invoke(app, ["run", str(file), "--output", out, "--verify", "0"])
    for new in ("flexband.Requirement", "Study(requirements=…)"):
        assert f"is now called {new};" in " ".join(run.stderr.split())
    check, limits = (CliRunner().invoke(app, [name, out]) for name in ("check", "limits"))
    assert limits.stdout == check.stdout
    assert limits.exit_code == check.exit_code
    told = "`flexband limits` is now called `flexband check`"
    assert told in " ".join(limits.stderr.split())
    assert told not in check.stderr


def test_former_names_are_not_offered():
    assert "limits" not in commands()
    pages = [CliRunner().invoke(app, [name, "--help"]) for name in ("limits", "check")]
    assert pages[0].stdout == pages[1].stdout
    for place, name in ((fb, "Limit"), (fb.analysis, "check_limits")):
        assert name not in place.__all__
        assert name not in dir(place)
